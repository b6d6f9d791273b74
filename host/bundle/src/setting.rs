//! Whether a setting can have a value, in words.

use cathforce_config::{Key, KeyError, keys};

use crate::nearest::nearest;

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

/// Advice for an unknown name: the nearest known one, or else `otherwise`.
pub fn misspelt(name: &str, known: &[&str], otherwise: &str) -> String {
    match nearest(name, known) {
        Some(nearest) => format!("write `{nearest}` if you meant that"),
        None => otherwise.to_owned(),
    }
}

/// A unit as it follows a number: with a space before it, or nothing for a pure number.
pub fn unit(key: Key) -> String {
    if key.unit() == "1" { String::new() } else { format!(" {}", key.unit()) }
}

/// Ratio at which a value looks like one in another unit.
const THOUSAND: f32 = 1000.0;

/// The value in range that one out of range was probably meant to be, as advice.
pub fn out_of_range(key: Key, value: f32) -> Option<String> {
    if key.unit() == "1" || value == 0.0 {
        return None;
    }
    let meant = [value / THOUSAND, value * THOUSAND].into_iter().find(|x| key.check(*x).is_ok())?;
    let of = if value.abs() > meant.abs() { "larger" } else { "smaller" };
    Some(format!(
        "it is a thousand times {of} than {meant}{}, which is in range; check its unit",
        unit(key)
    ))
}
