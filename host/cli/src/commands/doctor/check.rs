//! One check of the doctor, and its verdict.

use std::fmt::Display;

use cathforce_link::LinkError;
use serde::Serialize;

use crate::failure::Code;

/// One thing that was looked at.
#[derive(Debug, Serialize)]
pub struct Check {
    /// What was looked at.
    pub name: String,
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fix: Option<String>,
    /// Exit code if this is the first thing that is wrong.
    #[serde(skip)]
    pub code: Code,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Good,
    /// Works, but with less margin than it should have, or not for everything.
    Doubtful,
    Wrong,
}

impl Check {
    pub fn good(name: impl Into<String>, found: impl Display) -> Self {
        let (name, found) = (name.into(), found.to_string());
        Self { name, verdict: Verdict::Good, found, fix: None, code: Code::Failed }
    }

    pub fn doubtful(name: impl Into<String>, found: impl Display, fix: impl Into<String>) -> Self {
        Self { verdict: Verdict::Doubtful, fix: Some(fix.into()), ..Self::good(name, found) }
    }

    pub fn wrong(
        name: impl Into<String>,
        found: impl Display,
        fix: impl Into<String>,
        code: Code,
    ) -> Self {
        Self { verdict: Verdict::Wrong, code, ..Self::doubtful(name, found, fix) }
    }

    pub fn of(name: impl Into<String>, error: &LinkError) -> Self {
        let code = match error {
            LinkError::Address { .. } => Code::Usage,
            _ => Code::Link,
        };
        Self::wrong(name, error.problem(), error.fix(), code)
    }
}
