//! The noise floor: the error that a perfect model would leave.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::plant::{Plant, Point, Sample};

/// Runs count as repeats of each other when the model predicts the same for both, to this
/// share of what it predicts: the same commanded motion may still have been disturbed.
const SAME_PREDICTION: f64 = 0.05;
/// Noise that is stated nowhere, as a share of a channel's RMS: so small that it never
/// explains anything, and not zero.
const UNSTATED_SHARE: f64 = 1e-3;

/// Where the floor of a channel comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FloorSource {
    /// Half the mean squared difference between repeats.
    Repeats,
    /// What the rig states about the sensor.
    Stated,
    /// Neither: the floor is only a guess, and "no gap" cannot be concluded.
    Unknown,
}

/// The floor of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelFloor {
    pub source: FloorSource,
    /// Standard deviation, unit of the channel; `None` where the samples state their own.
    pub sd: Option<f64>,
}

/// The floor of every channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Floor {
    pub channels: Vec<ChannelFloor>,
}

/// That rig.toml does not state a channel's noise, and what its rows say instead, trial by trial.
pub fn unstated(channel: &str, found: &[f64]) -> String {
    let least = found.iter().copied().fold(f64::INFINITY, f64::min);
    let most = found.iter().copied().fold(0.0, f64::max);
    let to = if most > least { format!(" to {most:.2e}") } else { String::new() };
    format!(
        "the noise of {channel} is not stated in rig.toml; estimated from its rows as {least:.2e}{to}"
    )
}

/// That a channel scatters by more than rig.toml states.
pub fn understated(channel: &str, stated: f64, found: f64) -> String {
    format!(
        "rig.toml states a noise of {stated:.2e} for {channel}, but its rows scatter by {found:.2e}, which is \
         taken instead"
    )
}

impl Floor {
    /// σ² = ½⟨(y_a − y_b)²⟩ over repeats where there are any, of a catheter but for the mean
    /// difference of two runs; else the stated noise.
    pub fn of(plant: &dyn Plant) -> Self {
        let nominal = Point::nominal(plant);
        let predicted: Vec<_> =
            (0..plant.trials().len()).map(|trial| plant.simulate(trial, &nominal)).collect();
        let channels = (0..plant.channels().len()).map(|channel| {
            // Sum, sum of squares and number of differences, by the two trials.
            let mut differences: BTreeMap<_, (f64, f64, usize)> = BTreeMap::new();
            for repeat in plant.repeats() {
                let ((a, i), (b, j)) = (repeat.first, repeat.second);
                let (first, second) = (&plant.trials()[a].samples, &plant.trials()[b].samples);
                let (Some(f), Some(g)) = (&predicted[a], &predicted[b]) else { continue };
                if first[i].channel != channel {
                    continue;
                }
                let (f, g) = (&f[i..i + repeat.len], &g[j..j + repeat.len]);
                let power: f64 = f.iter().chain(g).map(|x| 0.5 * x * x).sum();
                let apart: f64 = f.iter().zip(g).map(|(x, y)| (x - y).powi(2)).sum();
                if apart > SAME_PREDICTION.powi(2) * power {
                    continue;
                }
                let (sum, squares, count) = differences.entry((a, b)).or_default();
                for (x, y) in first[i..i + repeat.len].iter().zip(&second[j..j + repeat.len]) {
                    *sum += x.value - y.value;
                    *squares += (x.value - y.value).powi(2);
                }
                *count += repeat.len;
            }
            let (mut squares, mut count) = (0.0, 0);
            for (sum, own, n) in differences.into_values() {
                // What two runs of a catheter differ by all along is a nuisance, not the floor.
                let (mean, lost) = if plant.cheap() { (0.0, 0) } else { (sum / n as f64, 1) };
                squares += 0.5 * (own - mean * sum);
                count += n - lost;
            }
            if count > 0 {
                let sd = Some((squares / count as f64).sqrt());
                return ChannelFloor { source: FloorSource::Repeats, sd };
            }
            let samples = || {
                let all = plant.trials().iter().flat_map(|trial| &trial.samples);
                all.filter(move |sample| sample.channel == channel)
            };
            if samples().all(|sample| sample.noise > 0.0) {
                return ChannelFloor { source: FloorSource::Stated, sd: None };
            }
            let power: f64 = samples().map(|sample| sample.value * sample.value).sum();
            let rms = (power / samples().count().max(1) as f64).sqrt();
            let sd = Some((UNSTATED_SHARE * rms).max(f64::MIN_POSITIVE));
            ChannelFloor { source: FloorSource::Unknown, sd }
        });
        Self { channels: channels.collect() }
    }

    /// Standard deviation by which runs under the same motion differ; `None` where none was repeated.
    pub fn of_repeats(&self, channel: usize) -> Option<f64> {
        let own = &self.channels[channel];
        own.sd.filter(|_| own.source == FloorSource::Repeats)
    }

    /// Standard deviation of one sample: noise, and what the model leaves open.
    ///
    /// See docs/explanation/diagnosis.md (D2).
    pub fn sd_of(&self, sample: &Sample) -> f64 {
        let noise = self.channels[sample.channel].sd.unwrap_or(sample.noise);
        noise.hypot(sample.model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unstated_noise_is_said_once_for_all_trials() {
        let said =
            "the noise of fx_N is not stated in rig.toml; estimated from its rows as 2.00e-3";
        assert_eq!(unstated("fx_N", &[0.002]), said);
        assert_eq!(unstated("fx_N", &[0.003, 0.002, 0.0025]), format!("{said} to 3.00e-3"));
    }
}
