//! Moving averages.

/// The mean over `window` rows around each row.
///
/// Near an end the window shrinks on both sides alike, so that a straight line stays what it is up to
/// its ends. An even window counts as the next larger odd one. `window` of 0 or 1 changes nothing.
pub fn moving_average(values: &[f64], window: usize) -> Vec<f64> {
    let half = window / 2;
    let mean = |i: usize| {
        let half = half.min(i).min(values.len() - 1 - i);
        mean(&values[i - half..=i + half])
    };
    (0..values.len()).map(mean).collect()
}

/// The mean over each row and the `window − 1` rows before it: (`window` − 1)/2 rows late. The first
/// rows are means over the rows that there are.
pub fn trailing_average(values: &[f64], window: usize) -> Vec<f64> {
    let window = window.max(1);
    (0..values.len()).map(|i| mean(&values[(i + 1).saturating_sub(window)..=i])).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stays_and_the_causal_mean_is_late_by_half_of_its_window() {
        let line: Vec<f64> = (0..50).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        for (mean, line) in moving_average(&line, 7).iter().zip(&line) {
            assert!((mean - line).abs() < 1e-12);
        }
        let late = trailing_average(&line, 7);
        for i in 6..50 {
            assert!((late[i] - line[i - 3]).abs() < 1e-12, "{i}");
        }
        assert_eq!(moving_average(&line, 1), line);
        assert_eq!(trailing_average(&line, 0), line);
        assert!(moving_average(&[], 5).is_empty());
    }

    #[test]
    fn means_are_those_of_a_calculation_by_hand() {
        assert_eq!(moving_average(&[1.0, 4.0, 1.0, 0.0, 5.0], 3), [1.0, 2.0, 5.0 / 3.0, 2.0, 5.0]);
        assert_eq!(trailing_average(&[1.0, 4.0, 1.0, 0.0], 3), [1.0, 2.5, 2.0, 5.0 / 3.0]);
    }
}
