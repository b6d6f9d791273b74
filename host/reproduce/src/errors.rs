//! Errors as the publications state them.

use cathforce_bundle::geometry::frechet;
use nalgebra::Vector3;

use crate::shape::at_equal_arc;

/// Absolute and relative error of one quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Error {
    /// Mean of the absolute error.
    pub mean: f64,
    /// The same over the mean magnitude of the measured quantity \[1\].
    pub relative: f64,
    /// Largest absolute error.
    pub peak: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Mean magnitude of the measured quantity.
    pub magnitude: f64,
}

/// Error of `ours` against `measured`, sample by sample.
///
/// The relative error is a ratio of means. A mean of ratios, which the publications may have used,
/// grows without bound where the force passes through zero.
pub fn error(measured: impl Iterator<Item = f64>, ours: impl Iterator<Item = f64>) -> Error {
    let (mut sum, mut squares, mut magnitude, mut peak, mut count) = (0.0, 0.0, 0.0, 0.0_f64, 0.0);
    for (m, o) in measured.zip(ours) {
        let e = (o - m).abs();
        sum += e;
        squares += e * e;
        magnitude += m.abs();
        peak = peak.max(e);
        count += 1.0;
    }
    Error {
        mean: sum / count,
        relative: sum / magnitude,
        peak,
        rms: (squares / count).sqrt(),
        magnitude: magnitude / count,
    }
}

/// Errors along the axes and of the norm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByAxis {
    pub axis: [Error; 3],
    pub total: Error,
}

/// Errors of a vector, sample by sample.
pub fn by_axis(measured: &[Vector3<f64>], ours: &[Vector3<f64>]) -> ByAxis {
    let along = |k: usize| error(measured.iter().map(|v| v[k]), ours.iter().map(|v| v[k]));
    let total = error(measured.iter().map(|v| v.norm()), ours.iter().map(|v| v.norm()));
    ByAxis { axis: std::array::from_fn(along), total }
}

/// Points of a shape that are compared, at equal arc.
const POINTS: usize = 100;

/// Discrete Fréchet distance \[m\] of two centre lines, both given from the tip, without their first
/// `skip_m`, seen along the unit vector `view`.
pub fn proximal_frechet_m(
    a: &[Vector3<f64>],
    b: &[Vector3<f64>],
    skip_m: f64,
    view: &Vector3<f64>,
) -> Option<f64> {
    let seen = |line: &[Vector3<f64>]| {
        let flat = at_equal_arc(line, skip_m, POINTS)?.into_iter().map(|p| p - view * view.dot(&p));
        Some(flat.collect::<Vec<_>>())
    };
    frechet(&seen(a)?, &seen(b)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_by_hand() {
        let e = error([1.0, -1.0, 2.0].into_iter(), [1.5, -1.0, 1.0].into_iter());
        assert_eq!((e.mean, e.relative, e.peak), (0.5, 0.375, 1.0));
        assert!((e.rms - (1.25f64 / 3.0).sqrt()).abs() < 1e-15);
        let v = by_axis(&[Vector3::new(3.0, 4.0, 0.0)], &[Vector3::new(3.0, 0.0, 0.0)]);
        assert_eq!((v.axis[1].mean, v.total.mean, v.total.relative), (4.0, 2.0, 0.4));
    }

    #[test]
    fn parallel_lines_are_as_far_apart_as_they_look() {
        let line = |y: f64, z: f64| {
            (0..30).map(|k| Vector3::new(0.1 - 3e-3 * f64::from(k), y, z)).collect::<Vec<_>>()
        };
        let (a, b) = (line(0.0, 0.0), line(2e-3, 5e-3));
        let seen = proximal_frechet_m(&a, &b, 0.02, &Vector3::z()).unwrap();
        assert!((seen - 2e-3).abs() < 1e-12, "{seen}");
        assert_eq!(proximal_frechet_m(&a, &b, 1.0, &Vector3::z()), None);
    }
}
