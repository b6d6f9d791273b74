//! The words of a parameter: how they are put together with its value.

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
    /// `{}` stands for the value with its interval, `{off}` for the value that is no effect. Of two words
    /// `[more|less]` the first is told of a positive value and the second of a negative one, which then loses its
    /// sign. `scale` makes the parameter one of `unit`; an empty unit is the parameter's own.
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

/// A clause of a parameter that is a size.
pub(super) const fn size(
    parameter: &'static str,
    text: &'static str,
    unit: (f64, &'static str),
) -> Clause {
    value(Is::Size, parameter, text, unit)
}

/// A clause of a parameter that is a shape.
pub(super) const fn shape(
    parameter: &'static str,
    text: &'static str,
    unit: (f64, &'static str),
) -> Clause {
    value(Is::Shape, parameter, text, unit)
}

/// A clause of a ratio.
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

/// Ratios within this are told as a difference in percent, others as a multiple.
const TOLD_AS_SHARE: std::ops::RangeInclusive<f64> = 0.4..=2.0;
/// Digits of a value without an interval.
pub(super) const DIGITS: u8 = 2;

/// A value with its unit, of a ratio without.
fn in_unit(value: &str, unit: &str) -> String {
    match unit {
        "" | "1" => value.to_owned(),
        "°" => format!("{value}°"),
        _ => format!("{value} {unit}"),
    }
}

/// A text with the one of two words `[positive|negative]` that the value's sign asks for, and the sign that the value
/// then loses.
fn by_sign(text: &str, value: f64) -> (String, f64) {
    let words = text.split_once('[').and_then(|(before, rest)| {
        let (words, after) = rest.split_once(']')?;
        Some((before, words.split_once('|')?, after))
    });
    match words {
        None => (text.to_owned(), 1.0),
        Some((before, (positive, _), after)) if value >= 0.0 => {
            (format!("{before}{positive}{after}"), 1.0)
        }
        Some((before, (_, negative), after)) => (format!("{before}{negative}{after}"), -1.0),
    }
}

impl Told {
    pub(super) fn with_interval(&self, own: &Estimate) -> String {
        match self {
            Self::Value { text, scale, unit } => {
                let unit = if unit.is_empty() { own.unit } else { *unit };
                let (text, sign) = by_sign(text, scale * own.value);
                let mut told = own.times(sign * *scale);
                if sign < 0.0 {
                    (told.low, told.high) = (told.high, told.low);
                }
                let [value, low, high] = told.digits();
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

    pub(super) fn alone(&self, value: f64, unit: &str) -> String {
        match self {
            Self::Value { text, scale, unit: own } => {
                let unit = if own.is_empty() { unit } else { own };
                let (text, sign) = by_sign(text, scale * value);
                let value = in_unit(&shortest(sign * scale * value, DIGITS), unit);
                let text = text.split(", not {off}").next().unwrap_or(&text);
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
