//! How figures are rounded and written, in sentences, tables and pages alike.

/// A figure in the unit that suits it: N or mN, m or mm.
pub fn quantity(value: f64, unit: &str) -> String {
    if value.abs() < 1.0 || unit == "m" {
        format!("{:.2} m{unit}", 1e3 * value)
    } else {
        format!("{value:.2} {unit}")
    }
}
