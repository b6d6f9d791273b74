//! Every example output of the book is what its command prints.
//!
//! A page shows commands with their output in a fenced block of the language `console`:
//!
//! ````text
//! ```console
//! $ cathforce config get force_gain examples/tapered-none
//! 1
//! ```
//! ````
//!
//! The commands of a page run in order in one temporary folder with a copy of `examples/`, so each
//! finds what the ones before it have made. `cat FILE` and `head -n N FILE` are understood too.
//! `…` on a line of its own stands for any lines, within a line for any characters: it hides
//! wall times and what is too long to show. `# exit code N` after a command expects that code and
//! shows the error, too.
//!
//! After a change, `CATHFORCE_WRITE_PAGES=1 cargo test -p cathforce --test book_examples` writes
//! the new output into the pages.

#[path = "support/documented.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod documented;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use cathforce_blind_test::{Change, Stand, play, rigs};
use cathforce_control::Fault;

/// Stands for whatever is there.
const ANY: &str = "…";

macro_rules! pages {
    ($( $name:ident: $page:literal, )+) => {
        const PAGES: &[&str] = &[ $( $page, )+ ];
        $(
            #[test]
            fn $name() {
                compare($page);
            }
        )+
    };
}

// A test each, so that they run side by side.
pages! {
    the_first_ten_minutes: "docs/tutorial/first-ten-minutes.md",
    the_first_diagnosis: "docs/tutorial/first-diagnosis.md",
    describing_a_rig: "docs/how-to/describe-your-rig.md",
    identifying_a_drive: "docs/how-to/identify-a-drive.md",
    identifying_a_transmission: "docs/how-to/identify-a-transmission.md",
    importing_measurements: "docs/how-to/import-measurements.md",
    reading_a_fault: "docs/how-to/read-a-fault.md",
    what_the_operator_feels: "docs/explanation/haptics.md",
}

#[test]
fn every_page_with_examples_is_compared() {
    let with_examples = documented::pages().into_iter().filter(|page| {
        fs::read_to_string(page).unwrap().lines().any(|line| line.trim_start() == "```console")
    });
    let with_examples = with_examples
        .map(|page| page.strip_prefix(documented::root()).unwrap().display().to_string());
    for page in with_examples {
        assert!(PAGES.contains(&&page[..]), "{page} has examples: give it a line in `pages!`");
    }
}

#[track_caller]
fn compare(page: &str) {
    let path = documented::root().join(page);
    let text = fs::read_to_string(&path).unwrap();
    let folder = tempfile::tempdir().unwrap();
    copy(&documented::root().join("examples"), &folder.path().join("examples"));
    let mut differences = String::new();
    let mut renewed = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        renewed.push(line.to_owned());
        if line != "```console" {
            continue;
        }
        while let Some(line) = lines.next_if(|line| *line != "```") {
            let command = line.strip_prefix("$ ").unwrap_or_else(|| {
                panic!("{page}: `{line}` comes before any command: begin the block with `$ `")
            });
            renewed.push(line.to_owned());
            let mut whole = command.to_owned();
            while let Some(begun) = whole.strip_suffix('\\') {
                let rest = lines.next().unwrap();
                renewed.push(rest.to_owned());
                whole = begun.to_owned() + rest;
            }
            let mut shown = Vec::new();
            while let Some(line) = lines.next_if(|l| *l != "```" && !l.starts_with("$ ")) {
                shown.push(line);
            }
            let said = output(folder.path(), &whole);
            let said: Vec<&str> = said.lines().map(str::trim_end).collect();
            if !are_alike(&shown, &said) {
                let (shown, said) = (shown.join("\n"), said.join("\n"));
                writeln!(differences, "$ {whole}\n--- page\n{shown}\n--- prints\n{said}\n")
                    .unwrap();
            }
            renewed.extend(renew(&shown, &said));
        }
    }
    if is_to_be_written() {
        fs::write(&path, renewed.join("\n") + "\n").unwrap();
    } else {
        assert!(
            differences.is_empty(),
            "{page} shows what its commands do not print; `CATHFORCE_WRITE_PAGES=1 cargo test -p \
             cathforce --test book_examples` writes it anew:\n{differences}"
        );
    }
}

fn is_to_be_written() -> bool {
    std::env::var_os("CATHFORCE_WRITE_PAGES").is_some()
}

#[test]
fn the_page_of_faults_explains_each_of_them() {
    for fault in Fault::ALL {
        let name = fault.name();
        let page = documented::root().join(format!("docs/faults/{name}.md"));
        let page = fs::read_to_string(page).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(page.starts_with(&format!("# {name}\n")), "docs/faults/{name}.md");
        let explained = Command::new(env!("CARGO_BIN_EXE_cathforce"))
            .args(["fault", "explain", name])
            .output()
            .unwrap();
        assert_eq!(String::from_utf8(explained.stdout).unwrap().trim(), page.trim(), "{name}");
    }
}

/// The tutorial's rig: its wall has twice the friction that its rig.toml states, in three trials of
/// 2.6 s on the solver that shares nothing with the device's model.
#[test]
fn the_example_with_a_sticky_wall_is_what_the_reference_solver_makes() {
    const FACTOR: f64 = 2.0;
    const ROWS: usize = 650;
    const NOISE_SEED: u64 = 1;
    let rig = &rigs()[0];
    let trial = |motion| {
        let mut rows = play(rig, &[Change::Friction { factor: FACTOR }], motion).unwrap();
        rows.truncate(ROWS);
        rows
    };
    let folder = tempfile::tempdir().unwrap();
    let trials = [trial(0), trial(2), trial(0)];
    Stand::own(rig).write(folder.path(), "sticky-bend", &trials, NOISE_SEED).unwrap();
    let example = documented::root().join("examples/sticky-bend");
    if is_to_be_written() {
        copy(folder.path(), &example);
    }
    let files =
        ["rig.toml", "centreline.csv", "trials/000.csv", "trials/001.csv", "trials/002.csv"];
    for file in files {
        let [made, kept] = [folder.path(), &example].map(|at| fs::read_to_string(at.join(file)));
        assert!(made.unwrap() == kept.unwrap_or_default(), "examples/sticky-bend/{file}");
    }
}

/// What a command prints, once it has ended as expected.
fn output(folder: &Path, line: &str) -> String {
    let (line, wanted) = match line.split_once(" # exit code ") {
        Some((line, code)) => (line, code.trim().parse().unwrap()),
        None => (line, 0),
    };
    let words = shlex::split(line).unwrap();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["cathforce", arguments @ ..] => {
            let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
            command.args(arguments).current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
            let output = command.output().unwrap();
            let [out, err] = [output.stdout, output.stderr].map(|s| String::from_utf8(s).unwrap());
            let code = output.status.code();
            assert_eq!(code, Some(wanted), "`{line}` ends with another exit code:\n{out}{err}");
            // Progress goes to stderr and is not shown, but what a command fails with is.
            if wanted == 0 { out } else { out + &err }
        }
        ["cat", file] => fs::read_to_string(folder.join(file)).unwrap(),
        ["head", "-n", number, file] => {
            let text = fs::read_to_string(folder.join(file)).unwrap();
            text.lines().take(number.parse().unwrap()).collect::<Vec<_>>().join("\n")
        }
        _ => panic!(
            "`{line}`: a console block holds `cathforce`, `cat` and `head -n`; show others as `sh`"
        ),
    }
}

/// Whether lines are as shown, where `…` stands for any lines or characters.
fn are_alike(shown: &[&str], said: &[&str]) -> bool {
    match shown.split_first() {
        None => said.is_empty(),
        Some((&ANY, rest)) => (0..=said.len()).any(|from| are_alike(rest, &said[from..])),
        Some((line, rest)) => match said.split_first() {
            Some((first, others)) => is_alike(line, first) && are_alike(rest, others),
            None => false,
        },
    }
}

fn is_alike(shown: &str, said: &str) -> bool {
    let mut parts = shown.split(ANY);
    let Some(mut left) = said.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(end) = parts.pop() else { return left.is_empty() };
    for part in parts {
        let Some(at) = left.find(part) else { return false };
        left = &left[at + part.len()..];
    }
    left.ends_with(end)
}

/// The output as the page is to show it: what the page leaves out stays left out.
fn renew(shown: &[&str], said: &[&str]) -> Vec<String> {
    let owned = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
    if are_alike(shown, said) {
        return owned(shown);
    }
    let (mut head, mut tail) = (said, &said[said.len()..]);
    if let Some(first) = shown.iter().position(|line| *line == ANY) {
        // As many lines as before at either end.
        let after = shown.len() - shown.iter().rposition(|line| *line == ANY).unwrap() - 1;
        if first + after < said.len() {
            (head, tail) = (&said[..first], &said[said.len() - after..]);
        }
    }
    let masks: Vec<&&str> = shown.iter().filter(|l| **l != ANY && l.contains(ANY)).collect();
    let masked = |line: &&str| {
        let mask = masks.iter().find(|mask| is_alike(mask, line));
        mask.map_or(*line, |mask| **mask).to_owned()
    };
    let mut lines: Vec<String> = head.iter().map(masked).collect();
    if head.len() + tail.len() < said.len() {
        lines.push(ANY.to_owned());
    }
    lines.extend(tail.iter().map(masked));
    lines
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to),
            false => drop(fs::copy(entry.path(), to).unwrap()),
        }
    }
}

#[test]
fn an_ellipsis_stands_for_lines_and_for_characters_and_stays_when_a_page_is_renewed() {
    assert!(are_alike(&["a", ANY, "d"], &["a", "b", "c", "d"]));
    assert!(are_alike(&["a", ANY], &["a"]) && !are_alike(&["a"], &["a", "b"]));
    assert!(is_alike("took … s of … ms", "took 1.5 s of 20 ms") && !is_alike("took … s", "took"));
    let renewed = renew(&["n 1", ANY, "took … s"], &["n 2", "b", "c", "took 3 s"]);
    assert_eq!(renewed, ["n 2", ANY, "took … s"]);
}
