//! What several trials make of one parameter.

/// Mean, least, largest and standard deviation over trials, in the unit of the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub nominal: f64,
    pub lower: f64,
    pub upper: f64,
    /// 0 of one trial.
    pub sd: f64,
}

impl Spread {
    /// Of the values that the trials gave; `None` without any.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let count = values.len() as f64;
        let nominal = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|own| (own - nominal).powi(2)).sum::<f64>();
        Some(Self {
            nominal,
            lower: values.iter().copied().fold(f64::INFINITY, f64::min),
            upper: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            sd: if count > 1.0 { (squares / (count - 1.0)).sqrt() } else { 0.0 },
        })
    }

    /// The largest standard deviation that `trials` values between two bounds can have: half of them at
    /// either bound.
    pub fn largest_sd(lower: f64, upper: f64, trials: usize) -> f64 {
        let n = trials as f64;
        // An odd one lies at a bound too: n/2 ± 1/2 of them.
        let squares = if trials.is_multiple_of(2) { n / 4.0 } else { (n * n - 1.0) / (4.0 * n) };
        (upper - lower) * (squares / (n - 1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_the_textbook() {
        let found = Spread::of(&[1.0, 2.0, 3.0, 6.0]).unwrap();
        assert_eq!((found.nominal, found.lower, found.upper), (3.0, 1.0, 6.0));
        assert!((found.sd - (14.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of(&[]), None);
        for trials in [2, 3, 5, 8] {
            let ends: Vec<f64> = (0..trials).map(|k| f64::from(k % 2)).collect();
            let most = Spread::largest_sd(0.0, 1.0, trials as usize);
            assert!((Spread::of(&ends).unwrap().sd - most).abs() < 1e-12, "{trials}");
        }
    }
}
