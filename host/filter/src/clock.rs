//! Whether rows are equally far apart in time, as every filter by rows takes for granted.

use std::ops::Range;

use thiserror::Error;

/// A step may differ from the usual one by this share. A row that stands by a tenth of a step beside
/// its place moves a value on a slope by a tenth of what it changes from row to row, which is less than
/// any noise that is worth filtering; two such rows make a step a fifth too long.
const JITTER: f64 = 0.2;
/// A step that is longer than this many usual ones lacks a row.
const GAP: f64 = 1.5;
/// Fewer rows have no usual step.
const FEWEST: usize = 4;

/// Why rows cannot be filtered. `row`: index of the later one of two rows.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ClockError {
    #[error("there are {count} values, too few to filter")]
    TooFew { count: usize },
    #[error("the time goes from {before_s} s to {now_s} s, so it does not rise")]
    NotRising { row: usize, before_s: f64, now_s: f64 },
    #[error("no value for {gap_s:.4} s before this row, where one follows every {step_s:.4} s")]
    Gap { row: usize, gap_s: f64, step_s: f64 },
    #[error(
        "the rows are not equally far apart in time: {own_s:.6} s before this row, {step_s:.6} s usually"
    )]
    Uneven { row: usize, own_s: f64, step_s: f64 },
}

impl ClockError {
    /// What to do about it.
    pub fn fix(&self) -> &'static str {
        match self {
            Self::TooFew { .. } => "leave the column out with --column, or record longer",
            Self::NotRising { .. } => {
                "sort the rows by time; where the clock was set back, cut the file in two there"
            }
            Self::Gap { .. } => {
                "fill the gap, or give --split-at-gaps, which filters the rows before and after it \
                 apart"
            }
            Self::Uneven { .. } => {
                "resample the table to a uniform clock first, by the times at which the sensor \
                 measured"
            }
        }
    }

    /// The row that it is about.
    pub fn row(&self) -> Option<usize> {
        match *self {
            Self::TooFew { .. } => None,
            Self::NotRising { row, .. } | Self::Gap { row, .. } | Self::Uneven { row, .. } => {
                Some(row)
            }
        }
    }
}

/// The usual step, and the stretches of rows without a gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    pub step_s: f64,
    pub stretches: Vec<Range<usize>>,
}

impl Clock {
    /// Checks the times of rows \[s\]. With `split_at_gaps` a gap begins a new stretch; otherwise it is
    /// refused.
    pub fn of(t_s: &[f64], split_at_gaps: bool) -> Result<Self, ClockError> {
        if t_s.len() < FEWEST {
            return Err(ClockError::TooFew { count: t_s.len() });
        }
        let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(i) = steps.iter().position(|step| *step <= 0.0) {
            let (before_s, now_s) = (t_s[i], t_s[i + 1]);
            return Err(ClockError::NotRising { row: i + 1, before_s, now_s });
        }
        let all = steps.clone();
        let step_s = crate::hampel::median(&mut steps);
        let (mut stretches, mut from) = (Vec::new(), 0);
        for (i, own_s) in all.into_iter().enumerate() {
            let row = i + 1;
            if own_s > GAP * step_s {
                if !split_at_gaps {
                    return Err(ClockError::Gap { row, gap_s: own_s, step_s });
                }
                stretches.push(from..row);
                from = row;
            } else if (own_s - step_s).abs() > JITTER * step_s {
                return Err(ClockError::Uneven { row, own_s, step_s });
            }
        }
        stretches.push(from..t_s.len());
        Ok(Self { step_s, stretches })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_jitters_a_little_is_uniform() {
        let t_s: Vec<f64> =
            (0..50).map(|i| 0.004 * f64::from(i) + 1e-4 * f64::from(i % 3)).collect();
        let clock = Clock::of(&t_s, false).unwrap();
        assert!((clock.step_s - 0.004).abs() < 2e-4, "{clock:?}");
        assert_eq!(clock.stretches.as_slice(), std::slice::from_ref(&(0..50)));
    }

    #[test]
    fn every_other_clock_is_refused_with_its_row() {
        let even = |i: u32| 0.1 * f64::from(i);
        let gap: Vec<f64> = (0..20).map(|i| even(if i < 7 { i } else { i + 3 })).collect();
        let refused = Clock::of(&gap, false).unwrap_err();
        assert!(matches!(refused, ClockError::Gap { row: 7, .. }), "{refused:?}");
        assert!(refused.fix().contains("--split-at-gaps"));
        assert_eq!(Clock::of(&gap, true).unwrap().stretches, [0..7, 7..20]);
        let back = [0.0, 0.1, 0.2, 0.15, 0.3];
        assert_eq!(Clock::of(&back, true).unwrap_err().row(), Some(3));
        let uneven = [0.0, 0.1, 0.2, 0.26, 0.36, 0.46];
        assert!(matches!(Clock::of(&uneven, true), Err(ClockError::Uneven { row: 3, .. })));
        assert_eq!(Clock::of(&[0.0, 1.0], false), Err(ClockError::TooFew { count: 2 }));
    }
}
