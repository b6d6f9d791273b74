//! From win frequencies to probabilities.

/// A monotone table, linear in between: how often an effect that won so often was there.
///
/// Made from tune cases only (`cathforce gap challenge make --seed 1000 --cases 210`, after their
/// labels were opened): of 144 effects that won as often as the blocks allow, 136 were there; of 18
/// that won less often, 16. Below, an effect is taken to be there as often as it won: what wins half
/// the time shares the wins with one that it cannot be told from.
const TABLE: [(f64, f64); 5] = [(0.0, 0.0), (0.6, 0.6), (0.9, 0.85), (0.94, 0.93), (1.0, 0.95)];

/// Effects and cases that [`TABLE`] was made from.
pub const NAMED: usize = 162;
pub const CASES: usize = 121;

/// The probability that an effect is there which won with this frequency.
pub fn probability(frequency: f64) -> f64 {
    let frequency = frequency.clamp(0.0, 1.0);
    for pair in TABLE.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        if frequency <= x1 {
            return y0 + (y1 - y0) * (frequency - x0) / (x1 - x0);
        }
    }
    TABLE[TABLE.len() - 1].1
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
