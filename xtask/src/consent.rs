//! Whether things may be installed.

use std::io::{BufRead, IsTerminal, Write};

use anyhow::bail;

use crate::arguments::{Choice, Given};
use crate::shell::{command, output};

/// Of every task that may install something.
pub const YES: Choice =
    Choice { name: "yes", value: None, about: "Install what is missing without asking." };

/// Whether things may be installed without asking.
#[derive(Clone, Copy, Debug)]
pub struct Consent {
    is_given: bool,
}

impl Consent {
    /// Given in advance by `--yes`, by root, or where `CI` is set.
    pub fn of(given: &Given) -> Self {
        Self { is_given: given.has(YES.name) || is_root() || std::env::var_os("CI").is_some() }
    }

    /// Asks for `what`, unless the answer is known.
    pub fn to(self, what: &str) -> anyhow::Result<()> {
        println!("Missing; I will run: {what}");
        if self.is_given {
            return Ok(());
        }
        if std::io::stdin().is_terminal() {
            print!("Go ahead? [y/N] ");
            std::io::stdout().flush()?;
            let mut answer = String::new();
            std::io::stdin().lock().read_line(&mut answer)?;
            if answer.trim().eq_ignore_ascii_case("y") {
                return Ok(());
            }
        }
        bail!("not installed. Run it yourself, or allow it with --yes:\n  {what}");
    }
}

pub fn is_root() -> bool {
    output(command("id").arg("-u")).is_some_and(|id| id.trim() == "0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_installed_unasked() {
        // A test has no terminal to ask on.
        let refused = Consent { is_given: false }.to("apt-get install qemu").unwrap_err();
        let text = refused.to_string();
        assert!(text.contains("--yes") && text.ends_with("apt-get install qemu"), "{text}");
        assert!(Consent { is_given: true }.to("true").is_ok());
    }
}
