//! How well the masks tell a stiffness.
//!
//! The outline of every mask is compared with its section in [`SECTORS`] sectors round the centroid:
//! the residual r of a sector is its area of mask less its area of section, over the length of its arc,
//! which is the mean distance of the outlines in mm. With the derivatives J of the residuals by E and ν
//! (the registration follows, so that it takes its share of what they tell) the covariance of least
//! squares with errors that go together within an image is that of `cathforce_calibration::Certainty`.
//!
//! A free block under a given force tells little of ν. In linear elasticity, a vessel of 8 mm at 12 mm
//! under 10 N on 40 × 8 mm of 592.5 kPa becomes lower by 0.4674 mm at ν = 0.47 and by 0.4620 mm at 0.49,
//! wider by 0.0338 and 0.0277 mm, and sinks by 0.3532 and 0.3476 mm: but for 1 to 5 µm that is what a
//! change of E by 1.4 % does. [`Known`] says so where it is so.
//!
//! The fit maximises the overlap, which is to minimise the sum of |r| rather than of r²: for errors of
//! a normal distribution its variance is π/2 times that of least squares (Huber and Ronchetti, "Robust
//! statistics", 2nd ed. 2009, section 1.2).

use std::f64::consts::{FRAC_PI_2, TAU};

use cathforce_calibration::Certainty;
use nalgebra::DMatrix;
use serde::Serialize;

use crate::response::Tissue;
use crate::study::{Explained, Prepared};

/// Of 1 mm on a vessel of 8 mm: a speckle or two.
const SECTORS: usize = 24;
/// Standard deviations of a normal distribution on either side within which 95 % lie.
const NINETY_FIVE: f64 = 1.96;
/// Steps of the differences, in shares of the modulus and in the ratio.
const STEP_SHARE: f64 = 0.02;
const STEP_RATIO: f64 = 0.001;

/// A value with its standard deviation and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    pub value: f64,
    pub sd: f64,
    pub interval_95: [f64; 2],
}

/// Whether data tell a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    FromTheData,
    /// Every value within the bounds explains the images about as well.
    CannotBeToldFromThisData,
}

impl Known {
    /// The bounds alone, with nothing more known, leave a standard deviation of (high − low)/√12. Data
    /// tell a parameter if they leave less than half of that, which is to say that three quarters of
    /// the variance are gone.
    pub(crate) fn of(found: &Interval, [low, high]: [f64; 2]) -> Self {
        let of_bounds = (high - low) / 12f64.sqrt();
        if found.sd < 0.5 * of_bounds { Self::FromTheData } else { Self::CannotBeToldFromThisData }
    }
}

/// Intervals of Young's modulus \[kPa\] and Poisson's ratio.
pub(crate) fn intervals(prepared: &Prepared<'_>, best: Tissue) -> [Interval; 2] {
    let bounds = &prepared.study.bounds;
    let values = [best.youngs_modulus_kpa, best.poissons_ratio];
    let scales = [bounds.youngs_modulus_kpa, bounds.poissons_ratio]
        .map(|[low, high]| (high - low) / 12f64.sqrt());
    let sd = standard_deviations(prepared, best, scales).unwrap_or(scales);
    [0, 1].map(|k| {
        let (value, sd) = (values[k], sd[k]);
        Interval { value, sd, interval_95: [value - NINETY_FIVE * sd, value + NINETY_FIVE * sd] }
    })
}

/// `scales`: standard deviations without the images. `None` where a neighbour has no section.
fn standard_deviations(
    prepared: &Prepared<'_>,
    best: Tissue,
    scales: [f64; 2],
) -> Option<[f64; 2]> {
    let steps = [STEP_SHARE * best.youngs_modulus_kpa, STEP_RATIO];
    let at = |k: usize, by: f64| {
        let Tissue { mut youngs_modulus_kpa, mut poissons_ratio } = best;
        *(if k == 0 { &mut youngs_modulus_kpa } else { &mut poissons_ratio }) += by;
        prepared.explained(Tissue { youngs_modulus_kpa, poissons_ratio })
    };
    let explained = prepared.explained(best)?;
    let base = residuals_mm(prepared, &explained, &explained);
    let mut columns = Vec::new();
    for (k, step) in steps.into_iter().enumerate() {
        let [up, down] = [step, -step].map(|by| at(k, by));
        let up = residuals_mm(prepared, &up?, &explained);
        let down = residuals_mm(prepared, &down?, &explained);
        columns.push(up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * step)).collect::<Vec<_>>());
    }
    let sd_mm = (base.iter().map(|r| r * r).sum::<f64>() / base.len() as f64).sqrt();
    let jacobian = DMatrix::from_fn(base.len(), 2, |i, k| columns[k][i] / sd_mm);
    let residuals: Vec<f64> = base.iter().map(|r| r / sd_mm).collect();
    let image: Vec<usize> = (0..base.len()).map(|i| i / SECTORS).collect();
    let found = Certainty::of(&jacobian, &residuals, &image, &scales, true);
    let widened = |k: usize| (found.sd[k] * FRAC_PI_2.sqrt()).min(scales[k]);
    Some([widened(0), widened(1)])
}

/// Residuals of every sector of every image \[mm\]. `sectors`: the sections round whose centroids the
/// sectors lie, so that a change of the stiffness leaves them in their place.
fn residuals_mm(prepared: &Prepared<'_>, own: &Explained, sectors: &Explained) -> Vec<f64> {
    let images = prepared.study.images.iter().zip(&own.sections).zip(&sectors.sections);
    let residuals = images.flat_map(|((image, section), of_sectors)| {
        let grid = image.mask.grid;
        let covered = grid.coverage(section);
        let (area, centre) = of_sectors.area_and_centroid_mm();
        let arc_mm = TAU * (2.0 * area / TAU).sqrt() / SECTORS as f64;
        let mut sums = [0.0; SECTORS];
        for (k, (is_vessel, covered)) in image.mask.is_vessel.iter().zip(&covered).enumerate() {
            let missing = f64::from(u8::from(*is_vessel)) - f64::from(*covered);
            if missing != 0.0 {
                let from = grid.middle_mm(k % grid.size_px[0], k / grid.size_px[0]) - centre;
                let turn = (from.y.atan2(from.x) / TAU).rem_euclid(1.0);
                sums[((turn * SECTORS as f64) as usize).min(SECTORS - 1)] += missing;
            }
        }
        sums.map(|sum| sum * grid.pixel_mm.powi(2) / arc_mm)
    });
    residuals.collect()
}
