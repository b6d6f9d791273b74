//! Where the gap lies: its energy by channel, phase, regime and place, with intervals.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::plant::{Plant, Sample};
use crate::problem::Problem;
use crate::score::Score;

/// Equal parts of the arc length, or of a drive's travel.
pub const ARC_BINS: usize = 4;
/// Resamples of the blocks for the intervals.
const RESAMPLES: usize = 400;
const SEED: u64 = 0x7768_6572;
/// Cells with a smaller share of the gap are not told.
const SMALLEST_SHARE: f64 = 0.01;

/// One cell of the gap.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    pub channel: String,
    pub phase: String,
    pub regime: String,
    pub arc_m: [f64; 2],
    /// Of all samples of the channel.
    pub time_share: f64,
    /// Of the whole gap above the floor, over all channels.
    pub gap_share: f64,
    pub gap_share_low: f64,
    pub gap_share_high: f64,
    pub note: String,
}

/// Sums over samples of one cell, by block.
#[derive(Clone, Debug, Default)]
struct Sums {
    blocks: BTreeMap<usize, f64>,
    samples: usize,
}

/// A table of the gap's energy, largest first. `score`: the nominal model's.
pub fn locate(problem: &Problem<'_>, score: &Score) -> Vec<Cell> {
    let plant = problem.plant;
    let range = arc_range(plant);
    let mut cells: BTreeMap<[usize; 4], Sums> = BTreeMap::new();
    let mut in_channel = vec![0_usize; plant.channels().len()];
    let mut first_block = 0;
    for (trial, residuals) in plant.trials().iter().zip(&score.residuals) {
        for (sample, residual) in trial.samples.iter().zip(residuals) {
            let Some(r) = residual else { continue };
            let key = [sample.channel, sample.phase, sample.regime, arc_bin(range, sample.arc_m)];
            let sums = cells.entry(key).or_default();
            *sums.blocks.entry(first_block + sample.block).or_default() += r * r - 1.0;
            sums.samples += 1;
            in_channel[sample.channel] += 1;
        }
        first_block += trial.blocks;
    }
    let intervals = intervals(&cells, first_block);
    let whole: f64 = cells.values().map(energy).sum();
    let notes = notes(problem, score);
    let width = (range[1] - range[0]) / ARC_BINS as f64;
    let mut table: Vec<Cell> = cells
        .iter()
        .zip(intervals)
        .map(|(([channel, phase, regime, bin], sums), [low, high])| {
            let share = energy(sums) / whole.max(f64::MIN_POSITIVE);
            let start = range[0] + *bin as f64 * width;
            Cell {
                channel: plant.channels()[*channel].name.clone(),
                phase: plant.phases()[*phase].to_owned(),
                regime: plant.regimes()[*regime].clone(),
                arc_m: [start, start + width],
                time_share: sums.samples as f64 / in_channel[*channel].max(1) as f64,
                gap_share: share,
                gap_share_low: low.min(share),
                gap_share_high: high.max(share),
                note: notes.get(&(*channel, *phase)).cloned().unwrap_or_default(),
            }
        })
        .filter(|cell| cell.gap_share >= SMALLEST_SHARE)
        .collect();
    table.sort_by(|a, b| b.gap_share.total_cmp(&a.gap_share));
    table
}

/// Energy of a cell above its floor.
fn energy(sums: &Sums) -> f64 {
    sums.blocks.values().sum::<f64>().max(0.0)
}

/// 90 % of what the shares are when the blocks are drawn again.
fn intervals(cells: &BTreeMap<[usize; 4], Sums>, blocks: usize) -> Vec<[f64; 2]> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut shares = vec![Vec::with_capacity(RESAMPLES); cells.len()];
    for _ in 0..RESAMPLES {
        let mut drawn = vec![0.0; blocks];
        for _ in 0..blocks {
            drawn[rng.random_range(0..blocks)] += 1.0;
        }
        let energy = |sums: &Sums| -> f64 {
            sums.blocks.iter().map(|(&block, e)| drawn[block] * e).sum::<f64>().max(0.0)
        };
        let whole: f64 = cells.values().map(energy).sum();
        for (sums, shares) in cells.values().zip(&mut shares) {
            shares.push(energy(sums) / whole.max(f64::MIN_POSITIVE));
        }
    }
    let bounds = |mut shares: Vec<f64>| {
        shares.sort_by(f64::total_cmp);
        let at = |share: f64| shares[((shares.len() - 1) as f64 * share).round() as usize];
        [at(0.05), at(0.95)]
    };
    shares.into_iter().map(bounds).collect()
}

/// Smallest and largest arc length of any sample.
pub fn arc_range(plant: &dyn Plant) -> [f64; 2] {
    let arcs = || plant.trials().iter().flat_map(|trial| &trial.samples).map(|s| s.arc_m);
    [arcs().fold(f64::INFINITY, f64::min), arcs().fold(f64::NEG_INFINITY, f64::max)]
}

/// Part of the arc that a sample lies in.
pub fn arc_bin(range: [f64; 2], arc_m: f64) -> usize {
    let share = (arc_m - range[0]) / (range[1] - range[0]).max(f64::MIN_POSITIVE);
    ((share * ARC_BINS as f64) as usize).min(ARC_BINS - 1)
}

/// What the residual looks like, by channel and phase.
fn notes(problem: &Problem<'_>, score: &Score) -> BTreeMap<(usize, usize), String> {
    let mut groups: BTreeMap<(usize, usize), Vec<(Sample, f64)>> = BTreeMap::new();
    for (t, trial) in problem.plant.trials().iter().enumerate() {
        for (i, sample) in trial.samples.iter().enumerate() {
            if let Some(r) = score.residuals[t][i] {
                let group = groups.entry((sample.channel, sample.phase)).or_default();
                group.push((*sample, r));
            }
        }
    }
    groups.into_iter().map(|(key, samples)| (key, describe(&samples))).collect()
}

/// Correlations below this are not told.
const TOLD: f64 = 0.5;

/// The strongest of a few simple shapes, in words.
fn describe(samples: &[(Sample, f64)]) -> String {
    let against = |of: &dyn Fn(&Sample) -> f64, centred: bool| {
        let n = samples.len() as f64;
        let (mut x, mut r) = (0.0, 0.0);
        if centred {
            x = samples.iter().map(|(s, _)| of(s)).sum::<f64>() / n;
            r = samples.iter().map(|(_, r)| r).sum::<f64>() / n;
        }
        let (mut xx, mut rr, mut xr) = (0.0, 0.0, 0.0);
        for (sample, residual) in samples {
            let (a, b) = (of(sample) - x, residual - r);
            xx += a * a;
            rr += b * b;
            xr += a * b;
        }
        if xx * rr > 0.0 { xr / (xx * rr).sqrt() } else { 0.0 }
    };
    let mean = against(&|_| 1.0, false);
    let moving = |s: &Sample| s.speed_m_per_s;
    let shapes = [
        (mean, "an offset: the sign does not change"),
        (against(&|s| moving(s).signum(), false), "the sign follows the direction of motion"),
        (against(&moving, true), "grows with the speed"),
        (against(&|s| s.arc_m, true), "grows with the length inside"),
        (against(&|s| s.arc_m * s.arc_m, true), "grows with the square of the length inside"),
        (against(&|s| s.t_s, true), "drifts with time"),
    ];
    let strongest = shapes.into_iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    strongest.filter(|(correlation, _)| correlation.abs() >= TOLD).map_or_else(
        String::new,
        |(correlation, what)| {
            let opposed = if correlation < 0.0 { ", negative" } else { "" };
            format!("{what}{opposed} (correlation {:.2})", correlation.abs())
        },
    )
}
