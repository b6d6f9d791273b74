//! From win frequencies to probabilities.

/// A monotone table, linear in between: how often an effect that won so often was there.
///
/// Made from training cases only. The table that is built in is the identity: no sealed cases
/// have been scored with it yet, and the diagnosis says so.
const TABLE: [(f64, f64); 2] = [(0.0, 0.0), (1.0, 1.0)];

/// Whether [`TABLE`] was made from cases.
pub const FROM_CASES: bool = false;

/// The probability that an effect is there which won with this frequency.
pub fn probability(frequency: f64) -> f64 {
    let frequency = frequency.clamp(0.0, 1.0);
    for pair in TABLE.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        if frequency <= x1 {
            return y0 + (y1 - y0) * (frequency - x0) / (x1 - x0);
        }
    }
    frequency
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_monotone_and_covers_everything() {
        assert_eq!((TABLE[0].0, TABLE[TABLE.len() - 1].0), (0.0, 1.0));
        for pair in TABLE.windows(2) {
            assert!(pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1);
        }
        assert_eq!(probability(2.0), TABLE[TABLE.len() - 1].1);
    }
}
