//! How often named effects are there, by the confidence with which they were named.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

/// Upper bounds of the confidences of each row.
const UP_TO: [f64; 5] = [0.5, 0.7, 0.9, 0.98, 1.0];

/// The effects that were named with about the same confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// The largest confidence of this row; the smallest is that of the row before.
    pub up_to: f64,
    pub named: usize,
    pub there: usize,
    /// Sum of the confidences: how many should be there.
    pub expected: f64,
}

/// The rows that have effects. `named`: confidence of every named effect, and whether it is there.
pub(crate) fn reliability(named: &[(f64, bool)]) -> Vec<Reliability> {
    let mut rows: Vec<Reliability> = UP_TO
        .iter()
        .map(|up_to| Reliability { up_to: *up_to, named: 0, there: 0, expected: 0.0 })
        .collect();
    for (confidence, is_there) in named {
        let row = rows.iter_mut().find(|row| *confidence <= row.up_to);
        // A confidence is a probability.
        let Some(row) = row else { continue };
        row.named += 1;
        row.there += usize::from(*is_there);
        row.expected += confidence;
    }
    rows.retain(|row| row.named > 0);
    rows
}

/// Mean distance of the shares from their confidences, in percent, each row by its number of effects.
pub(crate) fn distance(rows: &[Reliability]) -> Option<f64> {
    let named: usize = rows.iter().map(|row| row.named).sum();
    let off: f64 = rows.iter().map(|row| (row.there as f64 - row.expected).abs()).sum();
    (named > 0).then(|| 100.0 * off / named as f64)
}

/// The rows as a table of Markdown.
pub(crate) fn reliability_table(rows: &[Reliability]) -> String {
    let mut text = String::from(
        "| confidence up to | effects named | should be there | are there |\n| ---: | ---: | ---: | ---: |\n",
    );
    for row in rows {
        let (up_to, expected) = (100.0 * row.up_to, row.expected);
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {up_to:.0} % | {} | {expected:.1} | {} |", row.named, row.there);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_compared_with_what_was_said() {
        let named = [(0.4, false), (0.6, true), (0.6, false), (1.0, true)];
        let rows = reliability(&named);
        let counts: Vec<_> = rows.iter().map(|row| (row.up_to, row.named, row.there)).collect();
        assert_eq!(counts, [(0.5, 1, 0), (0.7, 2, 1), (1.0, 1, 1)]);
        // 0.4 too many, 0.2 too many, and none.
        assert!((distance(&rows).unwrap() - 15.0).abs() < 1e-9);
        assert_eq!(distance(&[]), None);
    }
}
