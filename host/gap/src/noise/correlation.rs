//! How many consecutive residuals one independent observation is worth.

/// 1 + 2 Σ ρ_k up to the first autocorrelation that is not positive, at most a tenth of the
/// series: how many samples one independent one is worth.
///
/// Of the raw second moment, not of the variance: a constant residual is one observation.
pub fn correlation_length(series: &[f64]) -> f64 {
    let n = series.len();
    let power: f64 = series.iter().map(|x| x * x).sum::<f64>() / n.max(1) as f64;
    if n < 2 || power <= 0.0 {
        return 1.0;
    }
    let mut length = 1.0;
    for lag in 1..=(n / 10).max(1) {
        let products: f64 = series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum();
        let correlation = products / ((n - lag) as f64 * power);
        if correlation <= 0.0 {
            break;
        }
        length += 2.0 * correlation;
    }
    length.min(n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_samples_count_once_and_held_ones_as_one() {
        // Alternating signs: the first correlation is negative.
        let alternating: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(correlation_length(&alternating), 1.0);
        let held: Vec<f64> = (0..400).map(|i| if (i / 20) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let length = correlation_length(&held);
        // Its correlation falls linearly to 0 at a lag of 10: 2 · ½ · 10.
        assert!((9.0..12.0).contains(&length), "{length}");
        assert_eq!(correlation_length(&[]), 1.0);
    }
}
