//! What people see: data on stdout, progress and remarks on stderr.

use std::fmt::Display;
use std::io::{IsTerminal, Write, stderr, stdout};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::failure::{Code, Failure};

/// How to talk, from the arguments and the environment.
#[derive(Clone, Copy, Debug)]
pub struct Ui {
    /// Data as JSON.
    pub json: bool,
    /// Errors only on stderr.
    pub quiet: bool,
    /// Colours, where there is a terminal.
    pub colour: bool,
}

impl Ui {
    pub fn new(json: bool, quiet: bool) -> Self {
        let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        Self { json, quiet, colour: !plain }
    }

    /// A remark that is not data.
    pub fn say(&self, message: impl Display) {
        if !self.quiet {
            // A closed stderr cannot be reported anywhere.
            let _ = writeln!(stderr(), "{message}");
        }
    }

    /// A warning, which `--quiet` does not suppress.
    pub fn warn(&self, message: impl Display) {
        let label = self.paint("warning:", "33;1", stderr().is_terminal());
        let _ = writeln!(stderr(), "{label} {message}");
    }

    /// The error that ended the command.
    pub fn error(&self, message: impl Display) {
        let label = self.paint("error:", "31;1", stderr().is_terminal());
        let _ = writeln!(stderr(), "{label} {message}");
    }

    /// Prints the result of the command on stdout: as JSON with `--json`, else as text.
    pub fn data(&self, value: &impl Serialize, text: impl Display) -> Result<(), Failure> {
        let written = if self.json {
            writeln!(stdout(), "{}", to_json(value)?)
        } else {
            write!(stdout(), "{text}")
        };
        match written {
            // The reader of the pipe has seen enough.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            Err(error) => {
                Err(Failure::new(Code::Failed, format!("cannot write to stdout: {error}")))
            }
            Ok(()) => Ok(()),
        }
    }

    /// The text in bold on a terminal.
    pub fn bold(&self, text: &str) -> String {
        self.paint(text, "1", stdout().is_terminal())
    }

    fn paint(&self, text: &str, style: &str, terminal: bool) -> String {
        if self.colour && terminal {
            format!("\x1b[{style}m{text}\x1b[0m")
        } else {
            text.to_owned()
        }
    }

    /// Shows progress: as a bar on a terminal, else as a line at every quarter.
    pub fn progress(&self, what: &'static str, total: u64, unit: &'static str) -> Progress {
        let terminal = stderr().is_terminal();
        let bar = (terminal && !self.quiet).then(|| {
            let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
            let template = format!(
                "{what:<9} {{bar:32}} {{percent:>3}} %  {{pos}}/{{len}} {unit}  {{eta}} left"
            );
            if let Ok(style) = ProgressStyle::with_template(&template) {
                bar.set_style(style.progress_chars("━╸─"));
            }
            bar
        });
        Progress { what, total, bar, lines: !terminal && !self.quiet, quarter: 0 }
    }
}

/// A result as JSON, indented.
pub fn to_json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))
}

/// The progress of some work.
pub struct Progress {
    what: &'static str,
    total: u64,
    bar: Option<ProgressBar>,
    lines: bool,
    quarter: u64,
}

impl Progress {
    pub fn set(&mut self, done: u64) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
        }
        let quarter = 4 * done.min(self.total) / self.total.max(1);
        if self.lines && quarter > self.quarter {
            self.quarter = quarter;
            let _ = writeln!(stderr(), "{}: {} %", self.what, 25 * quarter);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Rows of two columns; the first is as wide as its longest label.
pub fn two_columns(rows: &[(String, String)]) -> String {
    let width = rows.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(0);
    rows.iter()
        .map(|(label, value)| {
            let gap = " ".repeat(width - label.chars().count() + 2);
            format!(
                "{label}{gap}{}\n",
                value.replace('\n', &format!("\n{}", " ".repeat(width + 2)))
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_whatever_the_letters() {
        let rows = [("µ".into(), "1".into()), ("force".into(), "2\n3".into())];
        assert_eq!(two_columns(&rows), "µ      1\nforce  2\n       3\n");
    }
}
