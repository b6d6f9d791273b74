//! Units of force in a sensor's log.

/// Names of a unit, lower case, and its size \[N\]. The pound and the kilogram are those of force: by
/// definition 0.45359237 kg and 1 kg at 9.80665 m/s².
const UNITS: [(&[&str], f64); 7] = [
    (&["n", "newton", "newtons"], 1.0),
    (&["mn", "millinewton", "millinewtons"], 1e-3),
    (&["kn", "kilonewton", "kilonewtons"], 1e3),
    (&["lbf", "lb", "lbs", "pound", "pounds", "pound-force"], POUND_N),
    (&["klbf", "klb", "kip", "kips"], 1e3 * POUND_N),
    (&["kgf", "kg", "kilogram", "kilograms", "kp"], KILOGRAM_N),
    (&["gf", "g", "gram", "grams"], 1e-3 * KILOGRAM_N),
];
const KILOGRAM_N: f64 = 9.80665;
const POUND_N: f64 = 0.453_592_37 * KILOGRAM_N;

/// Names of values that are no force yet.
const COUNTS: [&str; 4] = ["counts", "count", "cts", "force counts"];

/// The size of a unit of force \[N\]; `None` for a name that is none.
pub(crate) fn newtons(unit: &str) -> Option<f64> {
    let unit = unit.trim().to_lowercase();
    UNITS.iter().find(|(names, _)| names.contains(&unit.as_str())).map(|(_, newtons)| *newtons)
}

pub(super) fn is_counts(unit: &str) -> bool {
    COUNTS.contains(&unit.trim().to_lowercase().as_str())
}

/// The names that are understood, for the advice in an error.
pub(crate) fn known() -> String {
    UNITS
        .iter()
        .filter_map(|(names, _)| names.first())
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pound_is_four_and_a_half_newtons_in_every_spelling() {
        for unit in ["lbf", "LB", " Pounds "] {
            assert!((newtons(unit).unwrap() - 4.448_221_615_260_5).abs() < 1e-12, "{unit}");
        }
        assert_eq!((newtons("mN"), newtons("N"), newtons("counts")), (Some(1e-3), Some(1.0), None));
    }
}
