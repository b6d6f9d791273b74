//! Error and noise of a force against the reference.

use nalgebra::Vector3;
use serde::Serialize;

/// Force on the vessel over insertion, in equal steps of time.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Insertion \[m\], growing.
    pub insertion_m: Vec<f64>,
    /// Force on the vessel \[N\].
    pub force_n: Vec<Vector3<f64>>,
}

impl FromIterator<(f64, [f64; 3])> for Series {
    fn from_iter<I: IntoIterator<Item = (f64, [f64; 3])>>(rows: I) -> Self {
        let rows = rows.into_iter().map(|(insertion_m, force)| (insertion_m, Vector3::from(force)));
        let (insertion_m, force_n) = rows.unzip();
        Self { insertion_m, force_n }
    }
}

/// Accuracy of a force over an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// RMS of the difference to the reference, over the reference's peak as far as the series goes \[1\].
    pub force_error: f64,
    /// RMS of the difference to its own mean over [`Score::WINDOW`] samples, over the mean force
    /// \[1\].
    pub force_noise: f64,
}

impl Score {
    /// Samples of the moving mean: 0.1 s, in which the instrument moves by 1.3 mm.
    pub const WINDOW: usize = 100;
    /// Scoring begins when the reference reaches this share of its peak.
    const TOUCHED: f64 = 0.05;

    /// Scores a series; `None` if less than a window of it is in the scored range.
    pub fn of(series: &Series, reference: &Series) -> Option<Self> {
        let end_m = series.insertion_m.last().copied()?;
        let end = reference.insertion_m.partition_point(|&x| x <= end_m);
        let peak_n = reference.force_n[..end].iter().map(Vector3::norm).fold(0.0, f64::max);
        let touched = |force: &Vector3<f64>| force.norm() > Self::TOUCHED * peak_n;
        let from_m = reference.insertion_m[reference.force_n.iter().position(touched)?];
        let first = series.insertion_m.partition_point(|&x| x < from_m);
        let (insertion_m, force_n) = (&series.insertion_m[first..], &series.force_n[first..]);
        if force_n.len() < Self::WINDOW {
            return None;
        }
        let differences =
            insertion_m.iter().zip(force_n).map(|(&x, force)| force - reference.at(x));
        let smooth: Vec<Vector3<f64>> = force_n
            .windows(Self::WINDOW)
            .map(|window| window.iter().sum::<Vector3<f64>>() / Self::WINDOW as f64)
            .collect();
        let rattle = smooth.iter().zip(&force_n[Self::WINDOW / 2..]).map(|(mean, f)| f - mean);
        let mean_n = smooth.iter().map(Vector3::norm).sum::<f64>() / smooth.len() as f64;
        Some(Self { force_error: rms(differences) / peak_n, force_noise: rms(rattle) / mean_n })
    }
}

impl Series {
    /// Force at an insertion, linear between samples and constant outside \[N\].
    fn at(&self, insertion_m: f64) -> Vector3<f64> {
        let after = self.insertion_m.partition_point(|&x| x < insertion_m);
        let (Some(&b), true) = (self.force_n.get(after), after > 0) else {
            return self.force_n[after.min(self.force_n.len() - 1)];
        };
        let (x, y) = (self.insertion_m[after - 1], self.insertion_m[after]);
        self.force_n[after - 1].lerp(&b, (insertion_m - x) / (y - x))
    }
}

fn rms(vectors: impl Iterator<Item = Vector3<f64>>) -> f64 {
    let (count, sum) = vectors.fold((0, 0.0), |(n, sum), v| (n + 1, sum + v.norm_squared()));
    (sum / f64::from(count)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(force_n: impl Fn(f64) -> f64) -> Series {
        (0..2000).map(|k| (f64::from(k), [force_n(f64::from(k)), 0.0, 0.0])).collect()
    }

    #[test]
    fn a_series_is_its_own_reference() {
        let ramp = series(|x| x);
        let score = Score::of(&ramp, &ramp).unwrap();
        assert!(score.force_error < 1e-12, "{score:?}");
        // Half a sample between the middle of a window and the sample beside it.
        assert!(score.force_noise < 1e-3, "{score:?}");
    }

    #[test]
    fn an_offset_is_an_error_and_a_rattle_is_noise() {
        let step = |x: f64| if x < 500.0 { 0.0 } else { 2.0 };
        let reference = series(step);
        let offset = Score::of(&series(|x| step(x) + 0.2), &reference).unwrap();
        assert!((offset.force_error - 0.1).abs() < 1e-12, "{offset:?}");
        assert!(offset.force_noise < 1e-12, "{offset:?}");
        let sign = |x: f64| if x % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let rattle = Score::of(&series(|x| step(x) + 0.5 * sign(x)), &reference).unwrap();
        assert!((rattle.force_error - 0.25).abs() < 1e-12, "{rattle:?}");
        assert!((rattle.force_noise - 0.25).abs() < 1e-3, "{rattle:?}");
    }

    #[test]
    fn insertions_need_not_agree() {
        let reference = series(|x| x);
        let half_a_sample_late: Series =
            (0..1999).map(|k| (f64::from(k) + 0.5, [f64::from(k) + 0.5, 0.0, 0.0])).collect();
        assert!(Score::of(&half_a_sample_late, &reference).unwrap().force_error < 1e-12);
        let short: Series = (0..50).map(|k| (f64::from(k), [1.0, 0.0, 0.0])).collect();
        assert_eq!(Score::of(&short, &reference), None);
    }
}
