//! How figures are rounded and written, in sentences, tables and pages alike.
//!
//! A figure has three significant digits, a share two or three. What is closed and what is left of a
//! gap come from one rounding, so that they add up to 100 %.

/// Significant digits of a figure.
const DIGITS: u8 = 3;
/// Decimals of a figure at most.
const MOST_DECIMALS: f64 = 3.0;

/// A figure with three significant digits in the unit that suits it: N or mN, m or mm.
///
/// `value`: in `unit`, which is `N` or `m`.
pub fn quantity(value: f64, unit: &str) -> String {
    let milli = value.abs() < 1.0 || unit == "m";
    let (value, prefix) = if milli { (1e3 * value, "m") } else { (value, "") };
    format!("{} {prefix}{unit}", rounded(value, DIGITS, MOST_DECIMALS))
}

/// Two figures with three significant digits each, in one unit: `38.1 to 10.4 mN`.
pub fn from_to(before: f64, after: f64, unit: &str) -> String {
    let (scale, prefix) = if before.abs() < 1.0 { (1e3, "m") } else { (1.0, "") };
    let [before, after] = [before, after].map(|x| rounded(scale * x, DIGITS, MOST_DECIMALS));
    format!("{before} to {after} {prefix}{unit}")
}

/// A number with so many significant digits, without powers of ten.
pub fn significant(value: f64, digits: u8) -> String {
    /// More decimals say nothing in any unit.
    const MOST: f64 = 12.0;
    rounded(value, digits, MOST)
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

fn rounded(value: f64, digits: u8, most_decimals: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = f64::from(digits) - 1.0 - value.abs().log10().floor();
    if decimals < 0.0 {
        let size = 10_f64.powf(-decimals);
        return format!("{:.0}", (value / size).round() * size);
    }
    format!("{value:.*}", decimals.min(most_decimals) as usize)
}

/// A share as a percentage: whole points, and tenths within one point of 0 % and of 100 %.
pub fn percent(share: f64) -> String {
    written(points(share))
}

/// What is closed of a gap and what is left of it, as percentages that add up to 100 %.
///
/// `closed`: share of the gap above the floor.
pub fn closed_and_left(closed: f64) -> [String; 2] {
    let closed = points(closed);
    [closed, 100.0 - closed].map(written)
}

/// A share in points, rounded: 99.6 %, 95 %, 0.4 %.
fn points(share: f64) -> f64 {
    let points = 100.0 * share;
    let tenths = (points > 99.0 && points < 101.0) || points.abs() < 1.0;
    if tenths { (10.0 * points).round() / 10.0 } else { points.round() }
}

fn written(points: f64) -> String {
    // No minus before a zero.
    let points = if points.abs() < 0.05 { 0.0 } else { points };
    let is_whole = (points - points.round()).abs() < 0.05;
    if is_whole { format!("{points:.0} %") } else { format!("{points:.1} %") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_has_three_digits_in_the_unit_that_suits_it() {
        for (value, unit, text) in [
            (0.038_123, "N", "38.1 mN"),
            (0.004, "N", "4.00 mN"),
            (0.000_4, "N", "0.400 mN"),
            (0.2, "N", "200 mN"),
            (2.0, "N", "2.00 N"),
            (1234.5, "N", "1230 N"),
            (12.345_6, "m", "12300 mm"),
            (4e-8, "m", "0.000 mm"),
            (0.0, "N", "0 mN"),
        ] {
            assert_eq!(quantity(value, unit), text);
        }
        assert_eq!(from_to(0.038_123_4, 0.010_441, "N"), "38.1 to 10.4 mN");
        assert_eq!(from_to(45.678, 0.912_3, "N"), "45.7 to 0.912 N");
    }

    #[test]
    fn what_is_closed_and_what_is_left_add_up() {
        let both = |closed: f64| closed_and_left(closed).join(" closed, ") + " left";
        assert_eq!(both(0.996), "99.6 % closed, 0.4 % left");
        assert_eq!(both(0.999_8), "100 % closed, 0 % left");
        assert_eq!(both(0.945), "95 % closed, 5 % left");
        assert_eq!(both(0.004), "0.4 % closed, 99.6 % left");
        assert_eq!(both(-0.2), "-20 % closed, 120 % left");
        assert_eq!(
            (percent(0.996), percent(0.5), percent(-1e-5)),
            ("99.6 %".to_owned(), "50 %".to_owned(), "0 %".to_owned())
        );
    }

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
