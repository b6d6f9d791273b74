//! What a log says of itself above the names of its columns.

use super::fields::split;
use super::units;

type Wrong = (String, String);

/// The lines `Key: value` that are understood.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Preamble {
    /// `Force Units`, as written.
    pub(super) force_unit: Option<String>,
    /// `Counts per Unit Force`.
    pub(super) counts_per_unit: Option<f64>,
    /// `RDT Sample Rate` \[Hz\].
    pub(super) rate_hz: Option<f64>,
}

impl Preamble {
    /// Reads a line; one that is no such key is passed over. Errors: the value of a key cannot be read,
    /// or the key stands there twice with two values.
    pub(super) fn take(&mut self, line: &str) -> Result<(), Wrong> {
        for field in split(line) {
            let Some((key, value)) = field.split_once([':', '=']) else { continue };
            let key = key.trim().to_lowercase();
            let value = value.trim();
            match key.as_str() {
                "force units" | "force unit" => {
                    if units::newtons(value).is_none() && !units::is_counts(value) {
                        let fix = format!("write one of {} there", units::known());
                        return Err((format!("`{value}` is no unit of force that is known"), fix));
                    }
                    once(&mut self.force_unit, value.to_owned(), &key)?;
                }
                "counts per unit force" | "counts per force" | "counts per unit" => {
                    once(&mut self.counts_per_unit, positive(&key, value)?, &key)?;
                }
                "rdt sample rate" | "rdt output rate" | "sample rate" => {
                    once(&mut self.rate_hz, positive(&key, value)?, &key)?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn once<T: PartialEq>(place: &mut Option<T>, value: T, key: &str) -> Result<(), Wrong> {
    match place.as_ref().is_some_and(|before| *before != value) {
        true => Err((
            format!("`{key}` stands here a second time with another value"),
            "keep one".into(),
        )),
        false => {
            *place = Some(value);
            Ok(())
        }
    }
}

fn positive(key: &str, value: &str) -> Result<f64, Wrong> {
    // The rate may have its unit behind it.
    let number = value.split_whitespace().next().unwrap_or_default();
    let number = number.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let found = number.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    found.ok_or_else(|| {
        (
            format!("`{value}` is no positive number, as `{key}`"),
            "write a number with a point".into(),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_the_sensors_program_are_understood_and_others_passed_over() {
        let mut said = Preamble::default();
        for line in [
            "Start Time: 1/1/24 1:00 PM",
            "RDT Sample Rate: 100",
            "\"PLEASE NOTE: The sample rate is read when the program starts.\"",
            "Force Units: lbf, Torque Units: lbf-in, Counts per Unit Force: 1000000.0",
        ] {
            said.take(line).unwrap();
        }
        let unit = Some("lbf".to_owned());
        let expected =
            Preamble { force_unit: unit, counts_per_unit: Some(1e6), rate_hz: Some(100.0) };
        assert_eq!(said, expected);
        assert!(said.take("Force Units: N").unwrap_err().0.contains("second time"));
        assert!(said.take("Force Units: stone").unwrap_err().1.contains("`lbf`"));
        assert!(said.take("RDT Sample Rate: fast").is_err());
    }
}
