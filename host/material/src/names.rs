//! What the heading of a tensile test may name.

use crate::curve::StressMeasure;

/// A quantity of a tensile test, with the factor from the column's unit to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    /// Length over unloaded length, less the offset: 0 for a stretch, −1 for a strain.
    Stretch { factor: f64, offset: f64 },
    /// \[m\] per unit.
    Extension(f64),
    /// \[N\] per unit.
    Force(f64),
    /// \[Pa\] per unit, and whether the name says which stress it is.
    Stress(f64, Option<StressMeasure>),
    /// Belongs to a test, but not to a fit.
    Ignored,
}

/// The units of each quantity that a heading may name.
const LENGTHS: [(&str, f64); 3] = [("mm", 1e-3), ("m", 1.0), ("um", 1e-6)];
const FORCES: [(&str, f64); 3] = [("n", 1.0), ("kn", 1e3), ("mn", 1e-3)];
const STRESSES: [(&str, f64); 4] = [("pa", 1.0), ("kpa", 1e3), ("mpa", 1e6), ("n/mm2", 1e6)];

/// Columns that are offered in messages.
pub(crate) const OFFERED: [&str; 10] = [
    "stretch",
    "strain",
    "strain_percent",
    "extension_mm",
    "force_N",
    "nominal_stress_MPa",
    "true_stress_MPa",
    "stress_MPa",
    "stress_kPa",
    "extension_m",
];

/// What a column holds. `Err`: the words of a quantity whose unit is missing or not known.
pub(crate) fn quantity(name: &str) -> Option<Result<Quantity, &'static str>> {
    use StressMeasure::{Nominal, True};
    let words = words(name);
    let first = words.first()?.as_str();
    let unit = words[1..].join("");
    let unit_of = |units: &[(&str, f64)]| {
        units.iter().find(|(known, _)| *known == unit).map(|(_, factor)| *factor)
    };
    Some(match first {
        "stretch" if unit.is_empty() => Ok(Quantity::Stretch { factor: 1.0, offset: 0.0 }),
        "strain" if unit.is_empty() => Ok(Quantity::Stretch { factor: 1.0, offset: 1.0 }),
        "strain" if unit == "percent" || unit == "%" => {
            Ok(Quantity::Stretch { factor: 0.01, offset: 1.0 })
        }
        "stretch" | "strain" => Err("a ratio (`stretch`, `strain`) or `strain_percent`"),
        "extension" | "displacement" => {
            unit_of(&LENGTHS).map(Quantity::Extension).ok_or("mm, m or um")
        }
        "force" | "load" => unit_of(&FORCES).map(Quantity::Force).ok_or("N, kN or mN"),
        "stress" | "nominal" | "engineering" | "true" | "cauchy" => {
            let measure = match first {
                "stress" => None,
                "true" | "cauchy" => Some(True),
                _ => Some(Nominal),
            };
            let unit = unit.strip_prefix("stress").unwrap_or(&unit);
            let factor = STRESSES.iter().find(|(known, _)| *known == unit).map(|(_, f)| *f);
            factor.map(|f| Quantity::Stress(f, measure)).ok_or("Pa, kPa, MPa or N/mm2")
        }
        "time" | "temperature" | "width" | "thickness" | "remark" => Ok(Quantity::Ignored),
        _ => return None,
    })
}

/// The words of a name in small letters, between underscores, spaces and brackets.
fn words(name: &str) -> Vec<String> {
    // Small letters make mN and MN alike, so that a force in meganewtons is no unit here: no tensile
    // machine has it.
    let name = name.to_lowercase();
    let words = name.split(|c: char| !(c.is_alphanumeric() || c == '%' || c == '/'));
    words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// The nearest known column.
pub(crate) fn nearest(name: &str) -> Option<&'static str> {
    let likeness = |known: &str| {
        strsim::normalized_damerau_levenshtein(&name.to_lowercase(), &known.to_lowercase())
    };
    let best = OFFERED.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(best) >= 0.6).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use StressMeasure::{Nominal, True};

    #[test]
    fn headings_name_quantity_and_unit() {
        for (name, expected) in [
            ("stretch", Quantity::Stretch { factor: 1.0, offset: 0.0 }),
            ("Strain [%]", Quantity::Stretch { factor: 0.01, offset: 1.0 }),
            ("extension_mm", Quantity::Extension(1e-3)),
            ("Force (N)", Quantity::Force(1.0)),
            ("stress_kPa", Quantity::Stress(1e3, None)),
            ("true_stress_MPa", Quantity::Stress(1e6, Some(True))),
            ("Engineering stress [MPa]", Quantity::Stress(1e6, Some(Nominal))),
        ] {
            assert_eq!(quantity(name), Some(Ok(expected)), "{name}");
        }
        assert!(matches!(quantity("force_counts"), Some(Err(_))));
        assert!(matches!(quantity("strain_mm"), Some(Err(_))));
        assert_eq!(quantity("colour"), None);
        assert_eq!(nearest("forse_N"), Some("force_N"));
    }
}
