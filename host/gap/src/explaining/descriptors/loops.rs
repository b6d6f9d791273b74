//! Hysteresis loops of a residual at reversals: forward and backward at the same places.

use super::residual::Residual;

/// To either side of a reversal, the way that belongs to its loop \[m\].
pub const LOOP_M: f64 = 20e-3;
const LOOP_BINS: usize = 10;
/// Shorter ways there and back are no loop \[m\].
const SHORTEST_LOOP_M: f64 = 5e-4;

/// What reversals open, over the way.
#[derive(Clone, Copy, Debug)]
pub struct Loops {
    pub area: f64,
    pub width: f64,
    pub share: f64,
}

impl Loops {
    /// `None` without a reversal.
    pub fn of(channel: &[Residual]) -> Option<Self> {
        let (mut area, mut span, mut count, mut energy, mut samples) = (0.0, 0.0, 0, 0.0, 0);
        for trial in channel.chunk_by(|a, b| a.trial == b.trial) {
            let moving = trial.iter().filter(|residual| residual.direction() != 0.0);
            let moving: Vec<Residual> = moving.copied().collect();
            let ways: Vec<&[Residual]> =
                moving.chunk_by(|a, b| a.direction() == b.direction()).collect();
            for pair in ways.windows(2) {
                let Some(own) = Branches::of(pair[0], pair[1]) else { continue };
                area += own.area;
                span += own.span_m;
                energy += own.energy;
                samples += own.samples;
                count += 1;
            }
        }
        if count == 0 || span <= 0.0 || energy <= 0.0 {
            return None;
        }
        let width = area / span;
        let rms = (energy / samples as f64).sqrt();
        Some(Self { area: area / f64::from(count), width, share: 0.5 * width / rms })
    }
}

/// The ways to and from a reversal.
struct Branches {
    /// Forward less backward.
    area: f64,
    span_m: f64,
    energy: f64,
    samples: usize,
}

impl Branches {
    /// `None` where they have hardly a place in common.
    fn of(to: &[Residual], from: &[Residual]) -> Option<Self> {
        let turn_m = from.first()?.arc_m;
        let away = |way: &[Residual]| {
            way.iter().map(|residual| (residual.arc_m - turn_m).abs()).fold(0.0, f64::max)
        };
        let span_m = away(to).min(away(from)).min(LOOP_M);
        if span_m < SHORTEST_LOOP_M {
            return None;
        }
        let binned = |way: &[Residual]| {
            let mut bins = [(0.0, 0_usize); LOOP_BINS];
            for residual in way {
                let share = (residual.arc_m - turn_m).abs() / span_m;
                if share <= 1.0 {
                    let bin = &mut bins[((share * LOOP_BINS as f64) as usize).min(LOOP_BINS - 1)];
                    *bin = (bin.0 + residual.error, bin.1 + 1);
                }
            }
            bins
        };
        let forward = to.first()?.direction();
        let (mut difference, mut compared) = (0.0, 0);
        for ((a, n), (b, m)) in binned(to).into_iter().zip(binned(from)) {
            if n > 0 && m > 0 {
                difference += forward * (a / n as f64 - b / m as f64);
                compared += 1;
            }
        }
        let span_m = span_m * compared as f64 / LOOP_BINS as f64;
        let near = |residual: &&Residual| (residual.arc_m - turn_m).abs() <= LOOP_M;
        let errors: Vec<f64> = to.iter().chain(from).filter(near).map(|r| r.error).collect();
        (compared > 0).then(|| Self {
            area: difference / compared as f64 * span_m,
            span_m,
            energy: errors.iter().map(|e| e * e).sum(),
            samples: errors.len(),
        })
    }
}
