//! From win frequencies to probabilities.

/// A monotone table, linear in between: how often an effect that won so often was there.
///
/// Made from tune cases only, after their labels were opened (`cathforce gap challenge make` with
/// seed 1000, and with seeds 15000 to 17000): of 209 effects that won as often as the blocks allow,
/// 200 were there; of 24 that won less often, 22. Below, an effect is taken to be there as often as
/// it won: what wins half the time shares the wins with one that it cannot be told from.
const TABLE: [(f64, f64); 5] = [(0.0, 0.0), (0.6, 0.6), (0.9, 0.85), (0.94, 0.95), (1.0, 0.97)];

/// Effects and cases that [`TABLE`] was made from.
pub const NAMED: usize = 233;
pub const CASES: usize = 176;

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
