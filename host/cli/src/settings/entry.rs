//! One setting of a file, and whether it can be used.

use cathforce_config::{Key, KeyError, keys};
use cathforce_effect_catalogue::Effect;

use super::problem::Problem;
use super::units::{out_of_range, unit};

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

/// Checks the name and the value of a setting. `Err` holds the problem and its fix.
pub fn check(name: &str, value: f32) -> Result<(), (String, String)> {
    let Some(key) = Key::find(name) else {
        let names = keys().map(Key::name).collect::<Vec<_>>();
        let fix = misspelt(name, &names, "`cathforce config list` lists the names");
        return Err((format!("there is no setting `{name}`"), fix));
    };
    let [min, max] = key.range();
    let unit = unit(key);
    let range = format!("write a number from {min} to {max}{unit}");
    key.check(value).map_err(|error| match error {
        KeyError::NotFinite => (format!("{name} is not a finite number"), range),
        KeyError::NotWhole => {
            (format!("{name} = {value} must be a whole number"), "write a whole number".into())
        }
        KeyError::Range => {
            let message = format!("{name} must be between {min} and {max}{unit}, not {value}");
            (message, out_of_range(key, value).unwrap_or(range))
        }
    })
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

/// Advice for an unknown name: the nearest known one, or else `otherwise`.
pub fn misspelt(name: &str, known: &[&str], otherwise: &str) -> String {
    match cathforce_bundle::nearest(name, known) {
        Some(nearest) => format!("write `{nearest}` if you meant that"),
        None => otherwise.to_owned(),
    }
}
