//! Where the gap lies: its energy by channel, phase, regime and place, with intervals.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::explaining::descriptors::{Descriptors, Residual};
use crate::fitting::problem::Problem;
use crate::plant::{Plant, Sample, Units};
use crate::scoring::score::Score;

/// Equal parts of the arc length, or of a drive's travel.
pub const ARC_BINS: usize = 4;
/// Resamples of the blocks for the intervals.
const RESAMPLES: usize = 400;
const SEED: u64 = 0x7768_6572;
/// Cells with a smaller share of the gap are not told.
const SMALLEST_SHARE: f64 = 0.01;

/// One cell of the gap.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    /// What the channel's residual looks like in this phase, in words.
    pub note: String,
    /// The same in numbers.
    pub descriptors: Descriptors,
    #[serde(skip)]
    pub units: Units,
}

impl Cell {
    /// From where to where; a drive's positions may be negative, and a little less than 0 is no -0.
    pub fn stretch(&self) -> String {
        self.units.stretch(self.arc_m)
    }
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
    for (t, trial) in plant.trials().iter().enumerate() {
        for (i, sample) in trial.samples.iter().enumerate() {
            let Some(counts) = score.counts(problem, t, i) else { continue };
            let key = [sample.channel, sample.phase, sample.regime, arc_bin(range, sample.arc_m)];
            let sums = cells.entry(key).or_default();
            *sums.blocks.entry(first_block + sample.block).or_default() += counts - 1.0;
            sums.samples += 1;
            in_channel[sample.channel] += 1;
        }
        first_block += trial.blocks;
    }
    let intervals = intervals(&cells, first_block);
    let whole: f64 = cells.values().map(energy).sum();
    let looks = looks(problem, score);
    let width = (range[1] - range[0]) / ARC_BINS as f64;
    let mut table: Vec<Cell> = cells
        .iter()
        .zip(intervals)
        .map(|(([channel, phase, regime, bin], sums), [low, high])| {
            let share = energy(sums) / whole.max(f64::MIN_POSITIVE);
            let start = range[0] + *bin as f64 * width;
            let time_share = sums.samples as f64 / in_channel[*channel].max(1) as f64;
            let descriptors = looks.get(&(*channel, *phase)).copied().unwrap_or_default();
            let channel = &plant.channels()[*channel];
            Cell {
                channel: channel.name.clone(),
                phase: plant.phases()[*phase].to_owned(),
                regime: plant.regimes()[*regime].clone(),
                arc_m: [start, start + width],
                time_share,
                gap_share: share,
                gap_share_low: low.min(share),
                gap_share_high: high.max(share),
                note: note(plant, &descriptors.words(plant.units().of(channel.quantity))),
                descriptors,
                units: plant.units(),
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
fn looks(problem: &Problem<'_>, score: &Score) -> BTreeMap<(usize, usize), Descriptors> {
    let plant = problem.plant;
    let mut channels: Vec<Vec<(usize, Residual)>> = vec![Vec::new(); plant.channels().len()];
    for (t, trial) in plant.trials().iter().enumerate() {
        for (i, sample) in trial.samples.iter().enumerate() {
            if let Some(error) = score.error(problem, t, i) {
                let Sample { t_s, arc_m, speed_m_per_s, value, .. } = *sample;
                let predicted = value - error;
                let residual = Residual { trial: t, t_s, arc_m, speed_m_per_s, predicted, error };
                channels[sample.channel].push((sample.phase, residual));
            }
        }
    }
    let mut looks = BTreeMap::new();
    for (channel, own) in channels.iter().enumerate() {
        let of = |wanted: Option<usize>| -> Vec<Residual> {
            let own = own.iter().filter(|(phase, _)| wanted.is_none_or(|wanted| wanted == *phase));
            own.map(|(_, residual)| *residual).collect()
        };
        let all = of(None);
        let whole = Descriptors::of(&all);
        for phase in 0..plant.phases().len() {
            looks.insert((channel, phase), whole.of_phase(&of(Some(phase)), &all));
        }
    }
    looks
}

/// What is said of a channel; what is a length inside a vessel is the input of a transmission.
fn note(plant: &dyn Plant, words: &str) -> String {
    match plant.units().of_force() {
        "output" => words.replace("the length inside", "the input"),
        _ => words.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, explained_by};

    #[test]
    fn one_sample_that_is_far_off_is_not_where_a_catheters_gap_is() {
        const SD: f64 = 0.01;
        // Over the first half of the way three standard deviations, in a sample of the second a hundred.
        let off = |i: usize| match i {
            0..100 => 3.0 * SD,
            150 => 100.0 * SD,
            _ => 0.0,
        };
        let first_half = |is_drive: bool| {
            let mut toy = Toy::new(0.01, SD, (0..200).map(off), |_, _| 0.0).fed(|i| i as f64);
            toy.cheap = is_drive;
            explained_by(&toy, &[], |selector, selection| {
                let cells = locate(selector.problem, &selection.nominal.score);
                let own = cells.iter().filter(|cell| cell.arc_m[1] < 101.0);
                own.map(|cell| cell.gap_share).sum::<f64>()
            })
        };
        // By Charbonnier's loss with c = 3: 100 (7.46 − 1) beside 582.
        assert!((first_half(false) - 646.0 / 1228.0).abs() < 0.03, "{}", first_half(false));
        // By squares: 100 (9 − 1) beside 10000.
        assert!((first_half(true) - 800.0 / 10800.0).abs() < 0.01, "{}", first_half(true));
    }

    #[test]
    fn a_stretch_is_in_millimetres_and_never_from_minus_zero() {
        let cell = |arc_m| Cell { arc_m, ..Cell::default() };
        assert_eq!(cell([-3e-4, 0.0617]).stretch(), "0 to 62 mm");
        assert_eq!(cell([-0.05, -0.0124]).stretch(), "-50 to -12 mm");
    }
}
