//! Relative errors, many at once.

/// Root of the mean square and largest of relative errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    pub rms: f64,
    pub largest: f64,
    pub count: usize,
}

impl Errors {
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Self {
        let (mut squares, mut largest, mut count) = (0.0, 0.0_f64, 0);
        for error in errors {
            squares += error * error;
            largest = largest.max(error.abs());
            count += 1;
        }
        let rms = if count > 0 { f64::sqrt(squares / count as f64) } else { 0.0 };
        Self { rms, largest, count }
    }
}
