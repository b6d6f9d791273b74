//! The console output of a guest's script.

use std::collections::BTreeMap;

/// One command of the script.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    pub status: i32,
    /// Time at its end since the guest was switched on \[s\].
    pub ended_s: f64,
    pub stdout: String,
    pub stderr: String,
}

/// The finished steps of a script.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transcript {
    steps: BTreeMap<String, Step>,
}

impl Transcript {
    /// `None` if the end is missing.
    pub(super) fn parse(console: &str) -> Option<Self> {
        let mut transcript = Self::default();
        let mut current: Option<&mut Step> = None;
        for line in console.lines().map(|line| line.trim_end_matches('\r')) {
            if line == "@@ end" {
                return Some(transcript);
            } else if let Some(head) = line.strip_prefix("@@ step ") {
                let mut words = head.split(' ');
                let name = words.next()?.to_owned();
                let status = words.next()?.parse().ok()?;
                let ended_s = words.next()?.parse().ok()?;
                let step = transcript.steps.entry(name).or_default();
                *step = Step { status, ended_s, ..Step::default() };
                current = Some(step);
            } else if let (Some(text), Some(step)) = (line.strip_prefix("@1 "), &mut current) {
                step.stdout += text;
                step.stdout.push('\n');
            } else if let (Some(text), Some(step)) = (line.strip_prefix("@2 "), &mut current) {
                step.stderr += text;
                step.stderr.push('\n');
            }
        }
        None
    }

    /// When each step ended, since power-on.
    pub fn timeline(&self) -> String {
        let mut steps = self.steps.iter().collect::<Vec<_>>();
        steps.sort_by(|(_, a), (_, b)| a.ended_s.total_cmp(&b.ended_s));
        steps.iter().map(|(name, step)| format!(" {name} {:.1} s", step.ended_s)).collect()
    }

    /// A step by its name; fails the test if there is none.
    pub fn step(&self, name: &str) -> &Step {
        self.steps.get(name).unwrap_or_else(|| panic!("no step {name}: {:#?}", self.steps))
    }

    /// Output of a step; fails the test if the step failed.
    pub fn ok(&self, name: &str) -> &str {
        let step = self.step(name);
        assert_eq!(step.status, 0, "{name}: {step:#?}");
        &step.stdout
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_come_back_with_status_and_output_and_noise_is_passed_over() {
        let console = "[  0.1] noise\r\n@@ step a 0 3.25\r\n@1 x y\r\n@1 \r\n[  4.0] noise\r\n\
                       @@ step b 5 4.00\r\n@2 error: no\r\n@@ end\r\n";
        let transcript = Transcript::parse(console).unwrap();
        assert_eq!(transcript.ok("a"), "x y\n\n");
        let b = transcript.step("b");
        assert_eq!((b.status, b.ended_s, b.stderr.as_str()), (5, 4.0, "error: no\n"));
        assert_eq!(Transcript::parse(console.strip_suffix("@@ end\r\n").unwrap()), None);
    }
}
