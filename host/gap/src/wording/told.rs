//! What is told of an effect: its name, and a clause for each of its parameters that matters.

use std::collections::BTreeMap;

use super::{catheter, drive};
use crate::deciding::interval::Estimate;
use crate::rounding::{shortest, significant};

/// An effect in words.
pub(super) struct Words {
    pub id: &'static str,
    /// A noun, as in "cannot be told from …".
    pub name: &'static str,
    /// In the order in which they are told. Phases and places have none.
    pub clauses: &'static [Clause],
}

/// What is told of a parameter.
pub(super) struct Clause {
    pub parameter: &'static str,
    pub is: Is,
    pub told: Told,
}

/// What a parameter is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Is {
    /// How large the effect is: not told where its interval holds "off", unless all of them do.
    Size,
    /// How the effect acts, which has no value that is off.
    Shape,
}

/// The words of a parameter.
pub(super) enum Told {
    /// `{}` stands for the value with its interval, `{off}` for the value that is no effect. `scale` makes the
    /// parameter one of `unit`; an empty unit is the parameter's own.
    Value { text: &'static str, scale: f64, unit: &'static str },
    /// A ratio: "SUBJECT 42 % MORE than THAN", or "SUBJECT 3.2 times as MUCH as THAN".
    Ratio {
        subject: &'static str,
        more: &'static str,
        less: &'static str,
        much: &'static str,
        than: &'static str,
    },
}

/// Millimetres, millinewtons or milliseconds for one metre, newton or second.
pub(super) const MILLI: f64 = 1e3;
const PERCENT: f64 = 100.0;
const DEGREES: f64 = 180.0 / std::f64::consts::PI;
/// What a nominal value comes from.
pub(super) const RIG: &str = "rig.toml says";

const fn value(
    is: Is,
    parameter: &'static str,
    text: &'static str,
    (scale, unit): (f64, &'static str),
) -> Clause {
    Clause { parameter, is, told: Told::Value { text, scale, unit } }
}

/// A parameter that is a size.
pub(super) const fn size_clause(
    parameter: &'static str,
    text: &'static str,
    unit: (f64, &'static str),
) -> Clause {
    value(Is::Size, parameter, text, unit)
}

pub(super) const fn shape(
    parameter: &'static str,
    text: &'static str,
    unit: (f64, &'static str),
) -> Clause {
    value(Is::Shape, parameter, text, unit)
}

pub(super) const fn ratio(
    parameter: &'static str,
    subject: &'static str,
    [more, less, much]: [&'static str; 3],
    than: &'static str,
) -> Clause {
    Clause { parameter, is: Is::Size, told: Told::Ratio { subject, more, less, much, than } }
}

pub(super) const STIFF: [&str; 3] = ["stiffer", "softer", "stiff"];
pub(super) const MUCH: [&str; 3] = ["more", "less", "much"];
pub(super) const LONG: [&str; 3] = ["longer", "shorter", "long"];
pub(super) const MM: (f64, &str) = (MILLI, "mm");
pub(super) const MN: (f64, &str) = (MILLI, "mN");
pub(super) const MS: (f64, &str) = (MILLI, "ms");
pub(super) const SHARE: (f64, &str) = (PERCENT, "%");
pub(super) const ANGLE: (f64, &str) = (DEGREES, "°");
/// In its own unit.
pub(super) const OWN: (f64, &str) = (1.0, "");

/// A ratio further from 1 than this is told as a multiple.
const TOLD_AS_SHARE: std::ops::RangeInclusive<f64> = 0.4..=2.0;
/// Digits of a value without an interval.
const DIGITS: u8 = 2;

/// What is known of an effect; a drive's may have the name of a catheter's, with other parameters.
fn words(id: &str) -> impl Iterator<Item = &'static Words> {
    catheter::WORDS.iter().chain(drive::WORDS).filter(move |own| own.id == id)
}

fn clauses(id: &str) -> impl Iterator<Item = &'static Clause> {
    words(id).flat_map(|own| own.clauses)
}

/// An effect as a noun; its identifier where it has no words.
pub fn name(id: &str) -> &str {
    words(id).next().map_or(id, |own| own.name)
}

/// An effect with its values, as one sentence. `what`: its description, in case it has no words.
pub fn values(id: &str, what: &str, parameters: &BTreeMap<String, Estimate>) -> String {
    let with = clauses(id).filter_map(|clause| Some((clause, parameters.get(clause.parameter)?)));
    let with: Vec<(&Clause, &Estimate)> = with.collect();
    let is_there = |own: &Estimate| own.low > own.off || own.high < own.off;
    let any = with.iter().any(|(clause, own)| clause.is == Is::Size && is_there(own));
    let told = with.iter().filter(|(clause, own)| clause.is == Is::Shape || !any || is_there(own));
    let clauses: Vec<String> = told.map(|(clause, own)| clause.told.with_interval(own)).collect();
    if clauses.is_empty() {
        return sentence(&format!("{id} – {}", what.trim_end_matches('.')));
    }
    sentence(&clauses.join("; "))
}

/// A size of an effect, as a clause. `unit`: of the parameter.
pub fn size(id: &str, parameter: &str, value: f64, unit: &str) -> String {
    match clauses(id).find(|own| own.parameter == parameter) {
        Some(clause) => clause.told.alone(value, unit),
        None => format!("{} {} of {} {unit}", name(id), parameter, shortest(value, DIGITS)),
    }
}

fn sentence(text: &str) -> String {
    capitalised(text) + "."
}

/// With a capital letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map_or(String::new(), |own| own.to_uppercase().collect());
    first + letters.as_str()
}

/// A value with its unit, of a ratio without.
fn in_unit(value: &str, unit: &str) -> String {
    match unit {
        "" | "1" => value.to_owned(),
        "%" | "°" => format!("{value} {unit}").replace(" °", "°"),
        _ => format!("{value} {unit}"),
    }
}

impl Told {
    fn with_interval(&self, own: &Estimate) -> String {
        match self {
            Self::Value { text, scale, unit } => {
                let unit = if unit.is_empty() { own.unit } else { *unit };
                let [value, low, high] = own.times(*scale).digits();
                let off = significant(scale * own.off, DIGITS);
                let value = format!("{} ({low} to {high})", in_unit(&value, unit));
                text.replace("{}", &value).replace("{off}", &in_unit(&off, unit))
            }
            Self::Ratio { subject, more, less, much, than } => {
                if !TOLD_AS_SHARE.contains(&own.value) {
                    let [value, low, high] = own.digits();
                    return format!(
                        "{subject} {value} times as {much} as {than} ({low} to {high})"
                    );
                }
                let sign = if own.value < 1.0 { -100.0 } else { 100.0 };
                let share = |of: f64| sign * (of - 1.0);
                let (low, high) = (share(own.low), share(own.high));
                let percent = Estimate {
                    value: share(own.value),
                    low: low.min(high),
                    high: low.max(high),
                    ..own.clone()
                };
                let [value, low, high] = percent.digits();
                let sense = if own.value < 1.0 { less } else { more };
                format!("{subject} {value} % {sense} than {than} ({low} to {high} %)")
            }
        }
    }

    fn alone(&self, value: f64, unit: &str) -> String {
        match self {
            Self::Value { text, scale, unit: own } => {
                let unit = if own.is_empty() { unit } else { own };
                let value = in_unit(&shortest(scale * value, DIGITS), unit);
                let text = text.split(", not {off}").next().unwrap_or(text);
                text.replace("{}", &value)
            }
            Self::Ratio { subject, more, less, much, than } => {
                if !TOLD_AS_SHARE.contains(&value) {
                    let value = shortest(value, DIGITS);
                    return format!("{subject} {value} times as {much} as {than}");
                }
                let sense = if value < 1.0 { less } else { more };
                let percent = shortest(100.0 * (value - 1.0).abs(), DIGITS);
                format!("{subject} {percent} % {sense} than {than}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Parameter;

    fn told(id: &str, parameters: &[(&str, [f64; 4], &'static str)]) -> String {
        let own = |(name, [value, low, high, off], unit): &(&str, [f64; 4], &'static str)| {
            let own = Estimate { value: *value, low: *low, high: *high, unit, off: *off };
            ((*name).to_owned(), own)
        };
        values(id, "what it is.", &parameters.iter().map(own).collect())
    }

    #[test]
    fn an_effect_is_told_as_a_person_would() {
        let friction = [("friction_coefficient", [0.46, 0.42, 0.5, 0.3], "1")];
        assert_eq!(
            told("contact.friction", &friction),
            "The wall's friction coefficient is 0.460 (0.420 to 0.500), not 0.30."
        );
        let stiffness = [
            ("shaft_factor", [1.42, 1.34, 1.5, 1.0], "1"),
            ("tip_factor", [6.5, 4.6, 8.4, 1.0], "1"),
        ];
        assert_eq!(
            told("instrument.stiffness", &stiffness),
            "The instrument's shaft is 42.0 % stiffer than rig.toml says (34.0 to 50.0 %); its tip is \
             6.5 times as stiff as rig.toml says (4.6 to 8.4)."
        );
        // What may as well be off is left out, unless nothing would be left.
        let backlash = [
            ("insertion_m", [8.2e-4, 7.5e-4, 8.9e-4, 0.0], "m"),
            ("rotation_rad", [0.0, 0.0, 0.01, 0.0], "rad"),
        ];
        assert_eq!(
            told("drive.backlash", &backlash),
            "The feed has a backlash of 0.820 mm (0.750 to 0.890)."
        );
        let nothing = [("insertion_m", [0.0, 0.0, 2e-4, 0.0], "m")];
        assert!(told("drive.backlash", &nothing).contains("backlash of 0.0"));
        assert_eq!(told("not.known", &[]), "Not.known – what it is.");
    }

    #[test]
    fn a_size_stands_without_an_interval() {
        assert_eq!(
            size("instrument.stiffness", "shaft_factor", 0.88, "1"),
            "the instrument's shaft is 12 % softer than rig.toml says"
        );
        assert_eq!(
            size("contact.friction", "friction_coefficient", 0.36, "1"),
            "the wall's friction coefficient is 0.36"
        );
        assert_eq!(size("not.known", "x", 2.0, "m"), "not.known x of 2 m");
    }

    #[test]
    fn every_effect_and_every_parameter_that_is_told_exists() {
        for effect in cathforce_effect_catalogue::all() {
            assert!(clauses(effect.id).count() > 0, "{} has no words", effect.id);
        }
        for own in catheter::WORDS {
            let known = cathforce_effect_catalogue::Effect::find(own.id).expect(own.id);
            for clause in own.clauses {
                let names = known.parameters.iter().any(|p| p.name == clause.parameter);
                assert!(names, "{}: {}", own.id, clause.parameter);
            }
        }
        for own in crate::drive::listed() {
            let is_told = |p: &&Parameter| clauses(own.id).any(|c| c.parameter == p.name);
            assert!(own.parameters.iter().any(|p| is_told(&p)), "{}: nothing is told", own.id);
        }
    }
}
