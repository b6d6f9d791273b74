//! docs/reference/command-line.md.

use std::fmt::Write as _;

use clap::{Arg, ArgAction, Command, CommandFactory as _};

use super::{cell, check, notice};
use crate::args::Arguments;

#[test]
fn the_page_of_commands_is_up_to_date() {
    let mut root = Arguments::command();
    root.build();
    let mut page = format!(
        "# Command line\n\n{}\n{}.\n\n{INTRODUCTION}",
        notice("the arguments of the program"),
        about(&root)
    );
    for command in commands(&root) {
        let _ = writeln!(
            page,
            "| [`{0}`](#cathforce-{0}) | {1}. |",
            command.get_name(),
            about(command)
        );
    }
    page += "\n## Options of every command\n";
    page += &table("option", root.get_arguments().filter(|arg| arg.is_global_set()));
    page += "\n## Exit codes\n\n| code | meaning |\n| --- | --- |\n";
    let codes = root.get_after_help().map(ToString::to_string).unwrap_or_default();
    for line in codes.lines().skip(1) {
        let (code, meaning) = line.trim().split_once(' ').expect("a code and its meaning");
        let _ = writeln!(page, "| {code} | {} |", meaning.trim());
    }
    for command in commands(&root) {
        section(&mut page, "cathforce", command, 2);
    }
    check("command-line.md", &page);
}

const INTRODUCTION: &str = "\
The thing that a command is about comes first: a bundle, a recording or a settings file. A file that
the command takes or writes comes second. `--link` names the device, `--json` prints the result as
JSON, and `--out` names the file that is written. Results go to stdout; progress, remarks and errors
go to stderr.

| command | what it does |
| --- | --- |
";

/// One command, and the commands below it.
fn section(page: &mut String, parent: &str, command: &Command, level: usize) {
    let name = format!("{parent} {}", command.get_name());
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage:").trim();
    let _ = write!(
        page,
        "\n{} {name}\n\n{}.\n\n```text\n{usage}\n```\n",
        "#".repeat(level),
        about(command)
    );
    let positional = command.get_positionals().filter(|arg| is_shown(arg)).collect::<Vec<_>>();
    if !positional.is_empty() {
        *page += &table("argument", positional);
    }
    let is_option = |arg: &&Arg| !arg.is_positional() && is_shown(arg);
    let options = command.get_arguments().filter(is_option).collect::<Vec<_>>();
    if !options.is_empty() {
        *page += &table("option", options);
    }
    for inner in commands(command) {
        section(page, &name, inner, level + 1);
    }
}

fn commands(command: &Command) -> impl Iterator<Item = &Command> {
    command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help")
}

fn about(command: &Command) -> String {
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    about.trim_end_matches('.').to_owned()
}

/// Global options have a section of their own.
fn is_shown(arg: &Arg) -> bool {
    !arg.is_hide_set()
        && !arg.is_global_set()
        && !matches!(arg.get_action(), ArgAction::Help | ArgAction::Version)
}

fn table<'a>(kind: &str, args: impl IntoIterator<Item = &'a Arg>) -> String {
    let mut text = format!("\n| {kind} | meaning | default |\n| --- | --- | --- |\n");
    for arg in args {
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        // A default that depends on other arguments stands in the help text.
        let (help, given) = match help.split_once(" [default: ") {
            Some((help, rest)) => {
                let (default, more) = rest.split_once(']').expect("an end");
                (format!("{help}{more}"), Some(default.to_owned()))
            }
            None => (help, None),
        };
        let values = arg.get_default_values().iter().map(|value| value.to_string_lossy());
        let value = values.collect::<Vec<_>>().join(" ");
        let takes_value = !matches!(arg.get_action(), ArgAction::SetTrue);
        let default = given.or((takes_value && !value.is_empty()).then(|| format!("`{value}`")));
        let _ = writeln!(
            text,
            "| `{}` | {}{} | {} |",
            cell(&spelling(arg)),
            cell(help.trim_end_matches('.')),
            choices(arg),
            cell(&default.unwrap_or_default())
        );
    }
    text
}

/// `--out FILE.json`, or `BUNDLE`.
fn spelling(arg: &Arg) -> String {
    let names = arg.get_value_names().unwrap_or_default();
    let names = names.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let more = if arg.is_positional() && arg.get_num_args().is_some_and(|n| n.max_values() > 1) {
        "..."
    } else {
        ""
    };
    match arg.get_long() {
        Some(long) if arg.get_action().takes_values() => format!("--{long} {names}"),
        Some(long) => format!("--{long}"),
        None => format!("{names}{more}"),
    }
}

/// The words that an argument takes, if they are few.
fn choices(arg: &Arg) -> String {
    let values = arg.get_possible_values();
    if values.is_empty() || !arg.get_action().takes_values() {
        return String::new();
    }
    let values = values.iter().map(|value| format!("`{}`", value.get_name())).collect::<Vec<_>>();
    format!(": {}", values.join(", "))
}

/// Every command and every argument explains itself.
#[test]
fn no_help_text_is_blank() {
    fn walk(path: &str, command: &Command, wrong: &mut Vec<String>) {
        let path = format!("{path} {}", command.get_name());
        if about(command).is_empty() {
            wrong.push(path.clone());
        }
        for arg in command.get_arguments() {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            if help.trim().is_empty() {
                wrong.push(format!("{path}: {}", arg.get_id()));
            }
        }
        command.get_subcommands().for_each(|inner| walk(&path, inner, wrong));
    }
    let mut wrong = Vec::new();
    let mut root = Arguments::command();
    root.build();
    walk("", &root, &mut wrong);
    assert_eq!(wrong, Vec::<String>::new());
}

/// The thing comes first and the file second; JSON is a switch; devices are named by `--link`.
#[test]
fn every_command_follows_the_conventions() {
    fn walk(path: &str, command: &Command) {
        let path = format!("{path} {}", command.get_name());
        let positional = command.get_positionals().map(|arg| arg.get_id().as_str());
        let positional = positional.collect::<Vec<_>>();
        let things = ["bundle", "recording", "log", "table", "folder", "dbc", "path", "source"];
        for (at, name) in positional.iter().enumerate() {
            assert!(at == 0 || !things.contains(name), "{path}: {name} does not come first");
        }
        for arg in command.get_arguments() {
            match arg.get_long() {
                Some("json") => assert!(matches!(arg.get_action(), ArgAction::SetTrue), "{path}"),
                Some("out" | "link") => assert!(arg.get_action().takes_values(), "{path}"),
                _ => {}
            }
        }
        command.get_subcommands().for_each(|inner| walk(&path, inner));
    }
    walk("", &Arguments::command());
}
