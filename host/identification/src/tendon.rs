//! Static and sliding friction and dead zone of a tendon from loops of its drive.

use cathforce_calibration::Parameter;
use cathforce_mechanics::{Description, DescriptionError, FREE, Lumen, LumenHeader};
use rayon::prelude::*;

use crate::hysteresis::{LoopError, LoopFeatures, PulledTip, loop_features};
use crate::noise::feature_sd;
use crate::search::{Experiment, Measured};

/// Samples on either side over which a record of the tip is averaged before its features are taken. The
/// dead zone ends when the tip has moved by a fiftieth of its way: without averaging, noise would end it.
const AVERAGED: usize = 2;

/// The friction of a tendon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TendonValues {
    /// Coefficient in its lumen while the drive holds still \[1\].
    pub static_friction: f64,
    /// Coefficient while the drive moves, over that one \[1\]. A ratio, since it is not larger than 1:
    /// within bounds of both coefficients half of the places would be no tendon.
    pub sliding_ratio: f64,
    /// Dead zone: displacement that takes up slack \[m\].
    pub slack_m: f64,
}

impl TendonValues {
    /// Names in the order of [`TendonValues::to_array`], with their units.
    pub const NAMES: [&'static str; 3] = ["static_friction", "sliding_ratio", "slack_m"];

    /// In the order of their declaration.
    pub fn to_array(self) -> [f64; 3] {
        [self.static_friction, self.sliding_ratio, self.slack_m]
    }

    /// From the same order.
    pub fn of_array([static_friction, sliding_ratio, slack_m]: [f64; 3]) -> Self {
        Self { static_friction, sliding_ratio, slack_m }
    }

    /// Parameters to search for between two sets of values, from their middle.
    pub fn parameters(low: Self, high: Self) -> Vec<Parameter> {
        let bounds = low.to_array().into_iter().zip(high.to_array());
        let named = Self::NAMES.into_iter().zip(bounds);
        named.map(|(name, (low, high))| Parameter::new(name, low, high)).collect()
    }

    /// The description with these values for its first tendon.
    pub fn description(&self, description: &Description<f64>) -> Description<f64> {
        let mut own = description.clone();
        if let Some(tendon) = own.tendons.first_mut() {
            tendon.static_friction = self.static_friction;
            tendon.sliding_friction = self.sliding_ratio * self.static_friction;
            tendon.slack_m = self.slack_m;
        }
        own
    }
}

/// A vessel without a wall, for a catheter in free space around the origin.
pub struct OpenVessel(Vec<u8>);

impl OpenVessel {
    /// Spacing and bricks along an axis of the coarsest grid: a cube of 0.8 m.
    const CELL_M: f32 = 1e-2;
    const BRICKS: u16 = 20;

    pub fn new() -> Self {
        let bricks = usize::from(Self::BRICKS).pow(3);
        Self(FREE.to_le_bytes().repeat(bricks))
    }

    /// `None` never: the header states the length of the bytes.
    pub fn lumen(&self) -> Option<Lumen<'_>> {
        let header = LumenHeader {
            origin_m: [-0.4; 3],
            cell_m: Self::CELL_M,
            distance_unit_m: 1e-6,
            bricks: [Self::BRICKS; 3],
            stored: 0,
        };
        Lumen::new(header, &self.0).ok()
    }
}

impl Default for OpenVessel {
    fn default() -> Self {
        Self::new()
    }
}

/// How a tendon is pulled: to each amplitude, back, and to it again.
#[derive(Clone, Debug, PartialEq)]
pub struct PullSetup {
    /// Free length \[m\].
    pub length_m: f64,
    /// Largest displacements of the drive, one loop each \[m\].
    pub amplitudes_m: Vec<f64>,
    /// Time of a way from one end to the other, and of a stay there \[s\].
    pub way_s: f64,
    pub stay_s: f64,
    /// Between samples of the sensor \[s\].
    pub sample_s: f64,
}

/// One loop: displacement of the drive, and of the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopRecord {
    pub tendon_m: Vec<f64>,
    pub tip_m: Vec<f64>,
}

impl LoopRecord {
    /// Features of the averaged record.
    pub fn features(&self) -> Result<LoopFeatures, LoopError> {
        loop_features(&self.tendon_m, &averaged(&self.tip_m))
    }

    /// Features of the same drive with another record of the tip.
    pub(crate) fn features_of(&self, tip_m: &[f64]) -> Option<[f64; 5]> {
        loop_features(&self.tendon_m, &averaged(tip_m)).ok().map(to_array)
    }
}

impl PullSetup {
    /// The drive over time: trapezoids whose flanks have two continuous derivatives, up, down, and up,
    /// one value each `step_s` \[m\].
    pub fn drive_m(&self, amplitude_m: f64, step_s: f64) -> Vec<f64> {
        let count = |time_s: f64| ((time_s / step_s).round() as usize).max(1);
        let (way, stay) = (count(self.way_s), count(self.stay_s));
        // 10 x³ − 15 x⁴ + 6 x⁵
        let rises = |x: f64| x * x * x * (10.0 + x * (6.0 * x - 15.0));
        let flank = (1..=way).map(|k| rises(k as f64 / way as f64));
        let up: Vec<f64> = flank.chain((0..stay).map(|_| 1.0)).collect();
        let down = up.iter().map(|x| 1.0 - x);
        let all = up.iter().copied().chain(down).chain(up.iter().copied());
        all.map(|share| amplitude_m * share).collect()
    }

    /// Loops of a tendon with these values, as a sensor without noise takes them.
    ///
    /// `rest`: of any tendon on the same mesh, whose ticks fit a whole number of times into `sample_s`.
    pub fn loops(
        &self,
        values: &TendonValues,
        rest: &PulledTip,
        lumen: &Lumen<'_>,
    ) -> Result<Vec<LoopRecord>, DescriptionError> {
        let description = values.description(rest.description());
        let tick_s = description.solver.tick_s;
        let every = ((self.sample_s / tick_s).round() as usize).max(1);
        let record = |&amplitude_m: &f64| {
            let mut tip = rest.with(description.clone())?;
            let drive_m = self.drive_m(amplitude_m, tick_s);
            let tip_m = tip.pull(lumen, &drive_m);
            let sampled = |all: Vec<f64>| all.into_iter().step_by(every).collect();
            Ok(LoopRecord { tendon_m: sampled(drive_m), tip_m: sampled(tip_m) })
        };
        self.amplitudes_m.par_iter().map(record).collect()
    }
}

/// Centred moving average, of fewer samples at the ends.
fn averaged(tip_m: &[f64]) -> Vec<f64> {
    let mean = |k: usize| {
        let own = &tip_m[k.saturating_sub(AVERAGED)..(k + AVERAGED + 1).min(tip_m.len())];
        own.iter().sum::<f64>() / own.len() as f64
    };
    (0..tip_m.len()).map(mean).collect()
}

fn to_array(own: LoopFeatures) -> [f64; 5] {
    let LoopFeatures { lowest_m, highest_m, dead_at_highest_m, dead_at_lowest_m, thickness_m } =
        own;
    [lowest_m, highest_m, dead_at_highest_m, dead_at_lowest_m, thickness_m]
}

/// Loops of a tendon, simulated on a coarse and on a fine chain of links.
pub struct Pulls<'a> {
    pub setup: &'a PullSetup,
    pub coarse: &'a PulledTip,
    pub fine: &'a PulledTip,
    pub lumen: &'a Lumen<'a>,
}

impl Experiment for Pulls<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let values = TendonValues::of_array(values.try_into().ok()?);
        let rest = if fine { self.fine } else { self.coarse };
        let records = self.setup.loops(&values, rest, self.lumen).ok()?;
        let features: Result<Vec<_>, _> = records.iter().map(LoopRecord::features).collect();
        Some(features.ok()?.into_iter().flat_map(to_array).collect())
    }
}

/// Features of measured loops, and what white noise of standard deviation `noise_m` on the tip makes of
/// them. A dead zone is known to the way of the drive in one sample at best.
///
/// Errors: the record that is no loop, by its place among `records`.
pub fn measured_loops(
    records: &[LoopRecord],
    noise_m: f64,
    seed: u64,
) -> Result<Measured, (usize, LoopError)> {
    let mut measured = Measured::default();
    for (k, own) in records.iter().enumerate() {
        let found = own.features().map_err(|error| (k, error))?;
        let noisy = |tip_m: &[f64]| {
            let record = LoopRecord { tip_m: tip_m.to_vec(), ..own.clone() };
            record.features().ok().map(to_array)
        };
        let sd = feature_sd(&own.tip_m, noise_m, seed, noisy).ok_or((k, LoopError::NoLoop))?;
        let ways = own.tendon_m.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let sample_m = ways.fold(0.0, f64::max);
        // A place within one sample is spread evenly over it: its standard deviation is 1/√12 of it.
        let least = [0.0, 0.0, sample_m, sample_m, 0.0].map(|way| way / 12f64.sqrt());
        measured.features.extend(to_array(found));
        measured.sd.extend(sd.iter().zip(least).map(|(sd, least)| sd.hypot(least)));
    }
    Ok(measured)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_goes_up_down_and_up_smoothly() {
        let setup = PullSetup {
            length_m: 0.1,
            amplitudes_m: vec![2e-3],
            way_s: 1.0,
            stay_s: 0.2,
            sample_s: 0.01,
        };
        let drive_m = setup.drive_m(2e-3, 0.01);
        assert_eq!(drive_m.len(), 3 * 120);
        assert!((drive_m[110] - 2e-3).abs() < 1e-15 && drive_m[230].abs() < 1e-15);
        assert!((drive_m[49] - 1e-3).abs() < 1e-12, "{}", drive_m[49]);
        // 15/8 of the mean speed in the middle of a flank.
        let fastest = drive_m.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!((fastest / (2e-3 * 0.01) / 1.875 - 1.0).abs() < 1e-3, "{fastest}");
        assert_eq!(averaged(&[0.0, 3.0, 0.0]), [1.0, 1.0, 1.0]);
        assert!(OpenVessel::new().lumen().is_some());
    }
}
