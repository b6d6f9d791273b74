//! Where a sampled signal crosses a level.

/// Index, with its fraction, at which `signal` first reaches `level` at or after sample `from`, between two
/// samples by a straight line; `None` if it never does.
pub(crate) fn first_crossing(signal: &[f64], from: usize, level: f64) -> Option<f64> {
    let side = |x: f64| x - level;
    let pairs = signal.windows(2).enumerate().skip(from);
    pairs.filter(|(_, w)| side(w[0]) != side(w[1])).find_map(|(i, w)| {
        let share = (level - w[0]) / (w[1] - w[0]);
        (0.0..=1.0).contains(&share).then_some(i as f64 + share)
    })
}

/// The same backwards from sample `from`.
pub(crate) fn last_crossing(signal: &[f64], from: usize, level: f64) -> Option<f64> {
    (1..=from.min(signal.len().saturating_sub(1))).rev().find_map(|i| {
        let (a, b) = (signal[i - 1], signal[i]);
        let share = if a == b { f64::NAN } else { (level - a) / (b - a) };
        (0.0..=1.0).contains(&share).then_some((i - 1) as f64 + share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_found_between_samples_both_ways() {
        let signal = [0.0, 1.0, 3.0, 2.0, -1.0];
        assert_eq!(first_crossing(&signal, 0, 2.0), Some(1.5));
        assert_eq!(first_crossing(&signal, 2, 0.5), Some(3.5));
        assert_eq!(last_crossing(&signal, 2, 0.5), Some(0.5));
        assert_eq!(first_crossing(&signal, 0, 9.0), None);
        assert_eq!(last_crossing(&[1.0, 1.0], 1, 1.0), None);
    }
}
