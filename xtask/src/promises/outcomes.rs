//! What became of tests, read off the output of `cargo test -- --show-output`.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use anyhow::Context as _;

/// Outcomes by the functions' names, and the figures that were printed.
#[derive(Debug, Default)]
pub struct Outcomes {
    /// Of all tests with this name.
    passed: BTreeMap<String, bool>,
    /// Lines `figure P11: TEXT`.
    figures: Vec<(String, String)>,
}

impl Outcomes {
    /// Runs a command that tests, and shows its lines as they come. That tests fail is no error.
    pub fn of(command: &mut Command) -> anyhow::Result<Self> {
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let stdout = child.stdout.take().context("its output is piped")?;
        let mut outcomes = Self::default();
        for line in BufReader::new(stdout).lines() {
            let line = line?;
            outcomes.take(&line);
            if line.starts_with("test ") || line.starts_with("figure ") {
                eprintln!("{line}");
            }
        }
        child.wait()?;
        Ok(outcomes)
    }

    #[cfg(test)]
    pub fn read(text: &str) -> Self {
        let mut outcomes = Self::default();
        text.lines().for_each(|line| outcomes.take(line));
        outcomes
    }

    fn take(&mut self, line: &str) {
        if let Some((path, outcome)) =
            line.strip_prefix("test ").and_then(|l| l.split_once(" ... "))
        {
            let name = path.rsplit("::").next().unwrap_or(path).to_owned();
            let passed = outcome.trim() == "ok";
            let all = self.passed.entry(name).or_insert(true);
            *all &= passed;
        } else if let Some((id, figure)) =
            line.strip_prefix("figure ").and_then(|l| l.split_once(": "))
        {
            self.figures.push((id.to_owned(), figure.to_owned()));
        }
    }

    /// Whether every test with this name passed; `None` if none ran.
    pub fn passed(&self, name: &str) -> Option<bool> {
        self.passed.get(name).copied()
    }

    /// What was measured for a promise.
    pub fn figures(&self, id: &str) -> Vec<&str> {
        let of_it = self.figures.iter().filter(|(of, _)| of == id);
        of_it.map(|(_, figure)| figure.as_str()).collect()
    }
}
