//! Outlier replacement by Hampel's identifier (Davies and Gather 1993; Pearson et al. 2016).

/// Standard deviations of a normal distribution for one median of |x|.
const PER_MEDIAN_DEVIATION: f64 = 1.4826;
/// Fewer rows say nothing about what is usual.
const FEWEST: usize = 3;

/// Values without their outliers.
#[derive(Clone, Debug, PartialEq)]
pub struct Replaced {
    pub values: Vec<f64>,
    /// Indices of the rows that were replaced.
    pub rows: Vec<usize>,
}

/// Replaces each value that is farther than `sd` standard deviations from the median of the `window`
/// rows around it by that median.
///
/// The standard deviation is 1.4826 times the median distance from the median, which outliers do not
/// move while they are fewer than half of the window. Where more than half of the window are equal it
/// is 0, and every other value is an outlier.
pub fn hampel(values: &[f64], window: usize, sd: f64) -> Replaced {
    let half = window / 2;
    replace(values, sd, |i| (i.saturating_sub(half), (i + half + 1).min(values.len())))
}

/// The same by the `window` rows that end at each row: causal, and nothing is late. A jump counts as
/// an outlier until it fills half of the window, so that it comes that late.
pub fn trailing_hampel(values: &[f64], window: usize, sd: f64) -> Replaced {
    replace(values, sd, |i| ((i + 1).saturating_sub(window.max(1)), i + 1))
}

fn replace(values: &[f64], sd: f64, window: impl Fn(usize) -> (usize, usize)) -> Replaced {
    let mut replaced = Replaced { values: values.to_vec(), rows: Vec::new() };
    let mut around = Vec::new();
    for (i, value) in values.iter().enumerate() {
        let (from, to) = window(i);
        if to - from < FEWEST {
            continue;
        }
        around.clear();
        around.extend_from_slice(&values[from..to]);
        let middle = median(&mut around);
        around.iter_mut().for_each(|x| *x = (*x - middle).abs());
        let deviation = PER_MEDIAN_DEVIATION * median(&mut around);
        if (value - middle).abs() > sd * deviation {
            replaced.values[i] = middle;
            replaced.rows.push(i);
        }
    }
    replaced
}

/// Of at least one value; their order changes.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    let (count, upper) = (values.len(), values.len() / 2);
    let (below, middle, _) = values.select_nth_unstable_by(upper, f64::total_cmp);
    let middle = *middle;
    // An even number has two in the middle; the lower one is the largest of those below.
    if count.is_multiple_of(2)
        && let Some(lower) = below.iter().copied().max_by(f64::total_cmp)
    {
        return 0.5 * (lower + middle);
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_one_or_the_mean_of_two() {
        assert_eq!(median(&mut [3.0]), 3.0);
        assert_eq!(median(&mut [5.0, 1.0, 3.0]), 3.0);
        assert_eq!(median(&mut [5.0, 1.0, 3.0, 4.0]), 3.5);
        assert_eq!(median(&mut [2.0, 1.0]), 1.5);
    }

    #[test]
    fn a_spike_is_replaced_by_the_median_and_nothing_else_changes() {
        let wave: Vec<f64> = (0..200).map(|i| (0.05 * f64::from(i)).sin()).collect();
        let mut measured = wave.clone();
        for row in [0, 57, 58, 199] {
            measured[row] += 8.0;
        }
        let found = hampel(&measured, 11, 3.0);
        assert_eq!(found.rows, [0, 57, 58, 199]);
        for (i, (found, wave)) in found.values.iter().zip(&wave).enumerate() {
            assert!((found - wave).abs() < 0.2, "{i}");
        }
        assert_eq!(hampel(&wave, 11, 3.0).values, wave);
    }

    #[test]
    fn a_jump_is_no_outlier_but_looking_back_only_it_comes_late() {
        let jump: Vec<f64> = (0..60).map(|i| f64::from(i / 30) + 0.01 * f64::from(i % 3)).collect();
        assert!(hampel(&jump, 11, 3.0).rows.is_empty());
        assert_eq!(trailing_hampel(&jump, 11, 3.0).rows, [30, 31, 32, 33, 34]);
    }

    #[test]
    fn what_comes_later_changes_nothing_of_the_causal_one() {
        let values: Vec<f64> = (0..100).map(|i| f64::from((i * 37) % 11)).collect();
        let whole = trailing_hampel(&values, 9, 1.0);
        let part = trailing_hampel(&values[..60], 9, 1.0);
        assert!(!whole.rows.is_empty());
        assert_eq!(whole.values[..60], part.values);
    }
}
