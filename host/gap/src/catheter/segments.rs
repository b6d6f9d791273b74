//! Candidates for the next recording: the parts of the protocol, one by one.

use super::prepare::Prepared;
use super::simulate::{Inputs, Trajectory};
use crate::planning::protocol::{Piece, Protocol};
use crate::plant::{Channel, Quantity, Segment, Trial};

/// The drive reaches the beginning of a part at this speed \[m/s\].
const LEAD_IN_M_PER_S: f64 = 0.04;
/// Ticks from one reading to the next.
const FORCE_EVERY: usize = 10;
const TIP_EVERY: usize = 20;

/// The parts, and how well each channel is measured.
#[derive(Default)]
pub struct Segments {
    pub list: Vec<Segment>,
    motions: Vec<Played>,
    /// Standard deviation of a reading, what the model leaves open included, by quantity.
    noise: Vec<(Quantity, f64)>,
}

/// One part, and what comes before it.
struct Played {
    inputs: Inputs,
    /// Its first tick.
    first: usize,
}

impl Segments {
    /// There are never more.
    pub const MOST: usize = 16;

    /// Between the shallowest and the deepest insertion that the trials had; without any when
    /// that is no way.
    pub fn of(prepared: &[Prepared], channels: &[Channel], trials: &[Trial], tick_s: f64) -> Self {
        let insertions = || prepared.iter().flat_map(|own| own.inputs.insertion_m.iter().copied());
        let (from_m, to_m) = (
            insertions().fold(f64::INFINITY, f64::min),
            insertions().fold(f64::NEG_INFINITY, f64::max),
        );
        let mut segments = Self::default();
        let Ok(protocol) = Protocol::new(from_m, to_m) else { return segments };
        for piece in protocol.pieces() {
            if segments.list.iter().all(|known| known.name != piece.name) {
                segments.list.push(Segment { name: piece.name, what: piece.what });
                segments.motions.push(Played::of(&protocol, piece, from_m, tick_s));
            }
        }
        segments.noise = [Quantity::Force, Quantity::DriveForce, Quantity::Tip]
            .into_iter()
            .filter_map(|quantity| Some((quantity, noise(quantity, channels, trials)?)))
            .collect();
        segments
    }

    pub fn inputs(&self, segment: usize) -> Option<&Inputs> {
        self.motions.get(segment).map(|motion| &motion.inputs)
    }

    /// Readings over their noise. `force_n`: of the sensor, one a tick.
    pub fn read(
        &self,
        segment: usize,
        of: &Trajectory,
        force_n: &[[f64; 3]],
        shift_s: f64,
    ) -> Option<Vec<f64>> {
        let Played { inputs, first } = self.motions.get(segment)?;
        let ticks = inputs.insertion_m.len();
        let shift = shift_s / inputs.tick_s;
        let at = |column: &dyn Fn(usize) -> f64, tick: usize| {
            crate::signal::interpolate_by(column, ticks, tick as f64 + shift)
        };
        let mut readings = Vec::new();
        for (quantity, sd) in &self.noise {
            let (every, axes): (usize, &[usize]) = match quantity {
                Quantity::DriveForce => (FORCE_EVERY, &[0]),
                Quantity::Tip => (TIP_EVERY, &[0, 1, 2]),
                _ => (FORCE_EVERY, &[0, 1, 2]),
            };
            for &axis in axes {
                let column: &dyn Fn(usize) -> f64 = match quantity {
                    Quantity::DriveForce => &|tick| of.drive_force_n[tick],
                    Quantity::Tip => &|tick| of.tip_m[tick][axis],
                    _ => &|tick| force_n[tick][axis],
                };
                readings.extend((*first..ticks).step_by(every).map(|tick| at(column, tick) / sd));
            }
        }
        Some(readings)
    }
}

impl Played {
    fn of(protocol: &Protocol, piece: &Piece, from_m: f64, tick_s: f64) -> Self {
        let start = protocol.at(piece.start_s);
        let lead_in_s = (start.insertion_m - from_m).abs() / LEAD_IN_M_PER_S;
        let first = (lead_in_s / tick_s).ceil() as usize;
        let ticks = first + ((piece.end_s - piece.start_s) / tick_s) as usize;
        let at = |tick: usize| {
            let share = tick as f64 / first.max(1) as f64;
            match tick.checked_sub(first) {
                Some(since) => protocol.at(piece.start_s + since as f64 * tick_s),
                None => crate::planning::protocol::Position {
                    insertion_m: from_m + share * (start.insertion_m - from_m),
                    ..start
                },
            }
        };
        let inputs = Inputs {
            tick_s,
            insertion_m: (0..ticks).map(|tick| at(tick).insertion_m).collect(),
            rotation_rad: (0..ticks).map(|tick| at(tick).rotation_rad).collect(),
            guidewire: None,
            tendons_m: Vec::new(),
            shape_ticks: Vec::new(),
            shape_points: 0,
        };
        Self { inputs, first }
    }
}

/// Root mean square over the samples of a quantity of what scatters in them.
fn noise(quantity: Quantity, channels: &[Channel], trials: &[Trial]) -> Option<f64> {
    let samples = trials.iter().flat_map(|trial| &trial.samples);
    let own = samples.filter(|sample| channels[sample.channel].quantity == quantity);
    let (sum, count) = own.fold((0.0, 0_usize), |(sum, count), sample| {
        (sum + sample.noise.powi(2) + sample.model.powi(2), count + 1)
    });
    (count > 0 && sum > 0.0).then(|| (sum / count as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Sample;
    use crate::toy::trial;

    const TICK_S: f64 = 2e-3;

    fn segments() -> Segments {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(path).unwrap();
        let prepared = Prepared::of(&bundle.trials[0], &bundle.rig.sensor, TICK_S).unwrap();
        let channel = |name: &str, quantity| Channel { name: name.into(), quantity };
        let channels = [channel("fx_N", Quantity::Force), channel("tip_x_m", Quantity::Tip)];
        let sample = |channel: usize, noise: f64, model: f64| Sample {
            t_s: 0.0,
            channel,
            value: 0.0,
            noise,
            model,
            phase: 0,
            regime: 0,
            arc_m: 0.0,
            speed_m_per_s: 0.0,
            block: 0,
        };
        let samples = vec![sample(0, 3e-3, 4e-3), sample(1, 1e-4, 0.0)];
        let trials = [trial(samples)];
        Segments::of(&[prepared], &channels, &trials, TICK_S)
    }

    #[test]
    fn every_part_is_there_once_and_begins_where_the_protocol_has_it() {
        let segments = segments();
        assert!((13..=Segments::MOST).contains(&segments.list.len()), "{:?}", segments.list);
        for (i, segment) in segments.list.iter().enumerate() {
            assert!(segments.list[..i].iter().all(|other| other.name != segment.name));
            let Played { inputs, first } = &segments.motions[i];
            // The lead-in ends where the part begins: no step is larger than the fastest feed.
            let fastest = inputs.insertion_m.windows(2).map(|w| (w[1] - w[0]).abs() / TICK_S);
            assert!(fastest.fold(0.0, f64::max) < LEAD_IN_M_PER_S + 1e-9, "{}", segment.name);
            assert!(*first < inputs.insertion_m.len(), "{}", segment.name);
        }
    }

    #[test]
    fn readings_are_over_the_noise_of_their_channel_and_shifted() {
        let segments = segments();
        let Played { inputs, first } = &segments.motions[0];
        let ticks = inputs.insertion_m.len();
        let ramp = |tick: usize| tick as f64 * TICK_S;
        let of = Trajectory {
            tip_m: (0..ticks).map(|tick| [ramp(tick), 0.0, 0.0]).collect(),
            ..Trajectory::default()
        };
        let force_n = vec![[1.0, 2.0, 3.0]; ticks];
        let read = |shift_s| segments.read(0, &of, &force_n, shift_s).unwrap();
        let forces = (ticks - first).div_ceil(FORCE_EVERY);
        let tips = (ticks - first).div_ceil(TIP_EVERY);
        assert_eq!(read(0.0).len(), 3 * (forces + tips));
        // 3 and 4 mN.
        assert!((read(0.0)[forces] - 2.0 / 5e-3).abs() < 1e-9);
        let late = read(5e-3)[3 * forces + 1] - read(0.0)[3 * forces + 1];
        assert!((late - 5e-3 / 1e-4).abs() < 1e-6, "{late}");
    }
}
