//! Numbers of any size for people.

/// A number to so many significant digits, without powers of ten.
pub fn significant(value: f64, digits: u8) -> String {
    /// More say nothing in any unit.
    const MOST: f64 = 12.0;
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = f64::from(digits) - 1.0 - value.abs().log10().floor();
    format!("{value:.*}", decimals.clamp(0.0, MOST) as usize)
}

/// The same without zeros at the end.
pub fn shortest(value: f64, digits: u8) -> String {
    let text = significant(value, digits);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_keep_their_digits_and_large_ones_their_size() {
        let both = |value| [significant(value, 3), shortest(value, 3)];
        assert_eq!(both(1.2345e-5), ["0.0000123", "0.0000123"]);
        assert_eq!(both(-0.38), ["-0.380", "-0.38"]);
        assert_eq!(both(32.0), ["32.0", "32"]);
        assert_eq!(both(4000.0), ["4000", "4000"]);
        assert_eq!(both(0.0), ["0", "0"]);
    }
}
