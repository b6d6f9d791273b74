//! One setting of a file, and whether it can be used.

pub use cathforce_bundle::setting::{check, misspelt};
use cathforce_effect_catalogue::Effect;

use super::problem::Problem;

/// A number, or a number with the effect that a diagnosis found.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    ByHand(f32),
    Diagnosed {
        value: f32,
        /// Identifier of the effect.
        effect: String,
    },
}

impl Setting {
    pub fn value(&self) -> f32 {
        match self {
            Self::ByHand(value) | Self::Diagnosed { value, .. } => *value,
        }
    }
}

/// A setting with its name and its line. Name and value are not checked yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub name: String,
    pub line: usize,
    pub setting: Setting,
}

/// Why an entry cannot be used; `None` where it can.
pub fn problem(entry: &Entry) -> Option<Problem> {
    match check(&entry.name, entry.setting.value()) {
        Ok(()) => unknown_effect(entry),
        Err((message, fix)) => Some(Problem { line: entry.line, message, fix }),
    }
}

/// The effect that a value comes from must exist: `gap apply` and `config show` look it up.
fn unknown_effect(entry: &Entry) -> Option<Problem> {
    let Setting::Diagnosed { effect, .. } = &entry.setting else { return None };
    if Effect::find(effect).is_some() {
        return None;
    }
    let ids = cathforce_effect_catalogue::all().map(|effect| effect.id).collect::<Vec<_>>();
    Some(Problem {
        line: entry.line,
        message: format!("{}: there is no effect `{effect}`", entry.name),
        fix: misspelt(effect, &ids, "`cathforce gap effects` lists them"),
    })
}
