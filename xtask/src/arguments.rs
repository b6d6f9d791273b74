//! The command line: a table of tasks, read and explained.
//!
//! A parser with derived code takes longer to build than everything else in this program.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use anyhow::{Context, anyhow, bail};

/// What `cargo xtask NAME` does.
pub struct Task {
    pub name: &'static str,
    /// A name that it had before; it still works.
    pub former: Option<&'static str>,
    pub about: &'static str,
    pub options: &'static [Choice],
    pub run: fn(&Given) -> anyhow::Result<()>,
}

/// An option of a task: `--name`, or `--name VALUE`.
#[derive(Debug)]
pub struct Choice {
    pub name: &'static str,
    /// What stands for its value in the help; `None` for a switch.
    pub value: Option<&'static str>,
    pub about: &'static str,
}

/// The options that were given.
#[derive(Debug, Default)]
pub struct Given(BTreeMap<&'static str, OsString>);

impl Given {
    /// Whether the option was given.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// The value of an option that takes one.
    pub fn value(&self, name: &str) -> Option<&OsStr> {
        self.0.get(name).map(OsString::as_os_str)
    }

    /// A path, from the folder in which the user is.
    pub fn path(&self, name: &str) -> anyhow::Result<Option<PathBuf>> {
        let path = self.value(name).map(std::path::absolute).transpose();
        path.with_context(|| format!("--{name}"))
    }

    /// Refuses two options together if each is a task of its own.
    pub fn at_most_one(&self, names: &[&str]) -> anyhow::Result<()> {
        let given: Vec<_> = names.iter().filter(|name| self.has(name)).collect();
        match given[..] {
            [first, second, ..] => bail!("--{first} and --{second} exclude each other"),
            _ => Ok(()),
        }
    }
}

/// What the command line asks for.
pub enum Asked {
    Help(String),
    Run(&'static Task, Given),
}

/// Reads the words after `cargo xtask`.
pub fn parse(
    tasks: &'static [Task],
    words: impl IntoIterator<Item = impl Into<OsString>>,
) -> anyhow::Result<Asked> {
    let mut parser = lexopt::Parser::from_args(words);
    let task = match parser.next()? {
        None => return Ok(Asked::Help(overview(tasks))),
        Some(lexopt::Arg::Short('h') | lexopt::Arg::Long("help")) => {
            return Ok(Asked::Help(overview(tasks)));
        }
        Some(lexopt::Arg::Value(name)) => task(tasks, &name.to_string_lossy())?,
        Some(option) => {
            bail!("{}: the name of a task comes first\n\n{}", shown(&option), overview(tasks))
        }
    };
    let mut given = Given::default();
    while let Some(word) = parser.next()? {
        let name = match word {
            lexopt::Arg::Short('h') | lexopt::Arg::Long("help") => {
                return Ok(Asked::Help(details(task)));
            }
            lexopt::Arg::Long(name) => name,
            other => return Err(unknown(task, &shown(&other))),
        };
        let known = task.options.iter().find(|option| option.name == name);
        let option = known.ok_or_else(|| unknown(task, &format!("--{name}")))?;
        let value = match option.value {
            Some(_) => parser.value()?,
            None => OsString::new(),
        };
        if given.0.insert(option.name, value).is_some() {
            bail!("--{} is given twice", option.name);
        }
    }
    Ok(Asked::Run(task, given))
}

fn task(tasks: &'static [Task], name: &str) -> anyhow::Result<&'static Task> {
    let is_named = |task: &&Task| task.name == name || task.former == Some(name);
    tasks.iter().find(is_named).ok_or_else(|| {
        let near = nearest(name, tasks.iter().map(|task| task.name));
        let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        anyhow!("there is no task `{name}`{near}\n\n{}", overview(tasks))
    })
}

fn unknown(task: &Task, word: &str) -> anyhow::Error {
    let near = nearest(word.trim_start_matches('-'), task.options.iter().map(|option| option.name));
    let near = near.map_or(String::new(), |near| format!("; did you mean `--{near}`?"));
    anyhow!("`cargo xtask {}` takes no `{word}`{near}\n\n{}", task.name, details(task))
}

/// The name that `word` was probably meant to be.
fn nearest<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let scored = names.map(|name| (strsim::jaro_winkler(word, name), name));
    // As far as a letter too much, or two that changed places.
    let near = scored.filter(|(likeness, _)| *likeness > 0.8);
    near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

fn shown(word: &lexopt::Arg<'_>) -> String {
    match word {
        lexopt::Arg::Short(letter) => format!("-{letter}"),
        lexopt::Arg::Long(name) => format!("--{name}"),
        lexopt::Arg::Value(value) => value.to_string_lossy().into_owned(),
    }
}

/// All tasks, a line each.
fn overview(tasks: &[Task]) -> String {
    let rows: Vec<_> = tasks.iter().map(|t| (t.name.to_owned(), t.about)).collect();
    format!(
        "Builds, tests and shows Cathforce.\n\nUsage: cargo xtask TASK [OPTIONS]\n\nTasks:\n{}\n\
         `cargo xtask TASK --help` lists the options of a task.\n",
        columns(&rows)
    )
}

/// A task and its options.
fn details(task: &Task) -> String {
    let rows: Vec<_> = task.options.iter().map(|o| (usage(o), o.about)).collect();
    let options = match rows[..] {
        [] => "It has no options.\n".to_owned(),
        _ => format!("Options:\n{}", columns(&rows)),
    };
    format!("{}\n\nUsage: cargo xtask {} [OPTIONS]\n\n{options}", task.about, task.name)
}

fn usage(option: &Choice) -> String {
    let value = option.value.map_or(String::new(), |value| format!(" {value}"));
    format!("--{}{value}", option.name)
}

fn columns(rows: &[(String, &str)]) -> String {
    let width = rows.iter().map(|(left, _)| left.len()).max().unwrap_or(0);
    rows.iter().map(|(left, right)| format!("  {left:width$}  {right}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    static TASKS: [Task; 2] = [
        Task {
            name: "demo",
            former: None,
            about: "Show it.",
            options: &[
                Choice { name: "json", value: Some("FILE"), about: "Write it." },
                Choice { name: "yes", value: None, about: "Do not ask." },
            ],
            run: |_| Ok(()),
        },
        Task {
            name: "validation",
            former: Some("accuracy"),
            about: "Measure it.",
            options: &[],
            run: |_| Ok(()),
        },
    ];

    fn read(line: &str) -> anyhow::Result<Asked> {
        parse(&TASKS, line.split_whitespace())
    }

    fn refused(line: &str) -> String {
        match read(line) {
            Ok(_) => panic!("{line} is taken"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn options_are_read_and_former_names_work() {
        let Ok(Asked::Run(task, given)) = read("demo --json=a.json --yes") else { panic!() };
        assert_eq!((task.name, given.has("yes")), ("demo", true));
        assert_eq!(given.value("json"), Some(OsStr::new("a.json")));
        assert!(given.path("json").unwrap().unwrap().is_absolute());
        let Ok(Asked::Run(task, _)) = read("accuracy") else { panic!() };
        assert_eq!(task.name, "validation");
    }

    #[test]
    fn a_near_miss_is_told_and_the_choices_are_listed() {
        assert!(refused("dmeo").contains("did you mean `demo`?"), "{}", refused("dmeo"));
        assert!(refused("x").contains("Tasks:"), "{}", refused("x"));
        let option = refused("demo --jsn f");
        assert!(option.contains("did you mean `--json`?") && option.contains("FILE"), "{option}");
        assert!(refused("demo extra").contains("takes no `extra`"));
        assert!(refused("demo --json").contains("--json"));
        assert!(refused("demo --yes --yes").contains("twice"));
        assert!(refused("--yes demo").contains("comes first"));
    }

    #[test]
    fn help_is_given_where_it_is_asked_for() {
        for line in ["", "--help", "-h"] {
            assert!(matches!(read(line), Ok(Asked::Help(text)) if text.contains("validation")));
        }
        let asked = read("demo --yes --help");
        assert!(matches!(asked, Ok(Asked::Help(text)) if text.contains("--json FILE")));
    }

    #[test]
    fn two_tasks_in_one_are_refused() {
        let Ok(Asked::Run(_, given)) = read("demo --json f --yes") else { panic!() };
        let error = given.at_most_one(&["yes", "json"]).unwrap_err().to_string();
        assert_eq!(error, "--yes and --json exclude each other");
        assert!(given.at_most_one(&["yes", "other"]).is_ok());
    }
}
