//! What trials of a rig can tell, before anything is measured on it.
//!
//! Every effect is switched on in the model, one at a time, on the motion of the trials. With s_i
//! what effect i does to the predictions at a typical size (one standard deviation of its prior
//! away from off), over the noise,
//!
//! > d_i = ‖(I − P_ν) s_i‖,   D_ij = ‖(I − P_[s_j, ν]) s_i‖
//!
//! say how far effect i stands out from what the nuisances ν can do, and from what they and
//! effect j can. The size from which on an effect is seen is looked for by simulation, starting
//! from [`SEEN`]/d_i of the typical one: where contact takes another path, sizes do not scale.
//! Samples that a slight change of a nuisance moves out of proportion count less for it.
//! Distances are upper bounds: beside other effects, whose parameters are fitted too, s_i stands out
//! less ([`RESERVE`]).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fitting::nuisance::Nuisances;
use crate::fitting::progress::Progress;
use crate::noise::floor::Floor;
use crate::parallel::{each_or_none, each_some};
use crate::plant::{Parameter, Plant, Point, Sample};
use crate::scoring::metric::Metric;

/// Distance from which on an effect is seen, or told from another.
pub const SEEN: f64 = 5.0;
/// What distances do not say, for people.
pub const RESERVE: &str = "distances are linearised, each effect at its typical size and with no other \
                           effect in the data: they are upper bounds, and a diagnosis that must \
                           leave room for others tells less apart";
/// What the model leaves open stays the same for about so long \[s\].
const MODEL_CORRELATION_S: f64 = 0.5;

/// Share of its prior by which a nuisance moves to see where contact takes another path.
const SLIGHT: f64 = 0.02;
/// Simulations in which the size that is just seen is looked for, and how near to [`SEEN`] ends it.
const LOOKS: usize = 4;
const NEAR: f64 = 0.8;

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Size {
    pub name: &'static str,
    /// Where the effect is not there.
    pub off: f64,
    pub value: f64,
    pub unit: &'static str,
}

/// How visible one effect is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Visibility {
    pub id: &'static str,
    /// Of its typical size.
    pub distance: f64,
    /// Its parameters where it is just seen; `None` where these trials do not show it at all, or
    /// only beyond its bounds.
    pub smallest: Option<Vec<Size>>,
}

/// Two effects, the first at its typical size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    pub effect: &'static str,
    pub rival: &'static str,
    pub distance: f64,
}

/// What trials can tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Isolability {
    pub effects: Vec<Visibility>,
    /// Every ordered pair, in the order of the effects.
    pub pairs: Vec<Pair>,
    /// Share of the ordered pairs at or above [`SEEN`].
    pub told_apart: f64,
    /// Effects whose simulation broke down.
    pub failed: Vec<&'static str>,
}

/// About how many trials [`isolability`] simulates.
pub fn expected_simulations(plant: &dyn Plant) -> u64 {
    let starts: usize = plant.effects().iter().map(|effect| effect.starts.len()).sum();
    let looks = 2 * plant.effects().len();
    (plant.trials().len() * (1 + 2 * plant.nuisances().len() + starts + looks)) as u64
}

/// What the trials of a plant can tell; what was measured in them plays no part.
///
/// `None` when the nominal model breaks down on them.
pub fn isolability(plant: &dyn Plant, progress: Progress<'_>) -> Option<Isolability> {
    let mut played = Played::new(plant, progress);
    let nominal = Point::nominal(plant);
    let mut base = played.all(&nominal)?;
    let moved = |share: f64, k: usize| {
        let mut point = nominal.clone();
        point.nuisances[k] = share * plant.nuisances()[k].sd;
        Some(difference(&played.all(&point)?, &base))
    };
    let all = |share: f64| -> Option<Vec<Vec<DVector<f64>>>> {
        (0..plant.nuisances().len()).map(|k| moved(share, k)).collect()
    };
    let (mut columns, slight) = (all(1.0)?, all(SLIGHT)?);
    for trial in 0..base.len() {
        let factors = played.doubt(trial, &columns, &slight);
        for whitened in columns.iter_mut().map(|c| &mut c[trial]).chain([&mut base[trial]]) {
            whitened.component_mul_assign(&factors);
        }
    }
    let of_trial = |trial: usize| {
        let own: Vec<DVector<f64>> = columns.iter().map(|c: &Vec<_>| c[trial].clone()).collect();
        matrix(&own, base[trial].len())
    };
    let nuisances = Nuisances::of((0..base.len()).map(of_trial).collect());
    let metric = Metric::with(&nuisances, 1.0);
    let signatures: Vec<Option<Signature>> =
        (0..plant.effects().len()).map(|e| Signature::of(&played, &nominal, &base, e)).collect();
    let none = nothing(&base);
    let mut found =
        Isolability { effects: Vec::new(), pairs: Vec::new(), told_apart: 0.0, failed: Vec::new() };
    let mut own = Vec::new();
    for (index, (effect, signature)) in plant.effects().iter().zip(&signatures).enumerate() {
        let Some(signature) = signature else {
            found.failed.push(effect.id);
            own.push(None);
            continue;
        };
        let (start, typical, distance) = signature.most_visible(&metric, &none);
        let near = Near { played: &played, nominal: &nominal, base: &base, metric: &metric };
        let share = SEEN / distance / signature.sizes[start];
        let smallest = near.just_seen(index, &effect.starts[start], share);
        found.effects.push(Visibility { id: effect.id, distance, smallest });
        own.push(Some(typical));
    }
    let ordered: Vec<(usize, usize)> = (0..own.len())
        .flat_map(|i| (0..own.len()).map(move |j| (i, j)))
        .filter(|&(i, j)| i != j && own[i].is_some() && own[j].is_some())
        .collect();
    let pair = |&(i, j): &(usize, usize)| {
        let (effect, rival) = (plant.effects()[i].id, plant.effects()[j].id);
        let distance = metric.distance(own[i].as_ref()?, &signatures[j].as_ref()?.span());
        Some(Pair { effect, rival, distance })
    };
    found.pairs = each_some(&ordered, pair);
    let apart = found.pairs.iter().filter(|pair| pair.distance >= SEEN).count();
    found.told_apart = apart as f64 / found.pairs.len().max(1) as f64;
    Some(found)
}

/// Trials of a plant, whitened.
struct Played<'a> {
    plant: &'a dyn Plant,
    /// One over the standard deviation of every sample.
    weights: Vec<Vec<f64>>,
    /// Samples over which what the model leaves open stays the same.
    repeated: Vec<Vec<f64>>,
    done: std::sync::atomic::AtomicUsize,
    progress: Progress<'a>,
}

impl<'a> Played<'a> {
    fn new(plant: &'a dyn Plant, progress: Progress<'a>) -> Self {
        let floor = Floor::of(plant);
        let (mut weights, mut repeated) = (Vec::new(), Vec::new());
        for trial in plant.trials() {
            let mut own = vec![1.0; trial.samples.len()];
            for range in trial.channel_ranges() {
                let samples = &trial.samples[range.clone()];
                own[range].fill((MODEL_CORRELATION_S / interval_s(samples)).max(1.0));
            }
            let weight = |(sample, repeated): (&Sample, &f64)| {
                let noise = floor.sd_of(&Sample { model: 0.0, ..*sample });
                1.0 / noise.hypot(repeated.sqrt() * sample.model)
            };
            weights.push(trial.samples.iter().zip(&own).map(weight).collect());
            repeated.push(own);
        }
        Self { plant, weights, repeated, done: Default::default(), progress }
    }

    /// Doubts the samples of a trial that a slight change of a nuisance moves out of proportion:
    /// contact takes another path there, which says nothing about an effect. Gives the factors by
    /// which their weights fall.
    fn doubt(
        &mut self,
        trial: usize,
        columns: &[Vec<DVector<f64>>],
        slight: &[Vec<DVector<f64>>],
    ) -> DVector<f64> {
        let factor = |i: usize| {
            let pairs = columns.iter().zip(slight);
            let beyond =
                pairs.map(|(whole, part)| (part[trial][i] - SLIGHT * whole[trial][i]).abs());
            let doubt = beyond.fold(0.0, f64::max);
            1.0 / (1.0 + self.repeated[trial][i] * doubt * doubt).sqrt()
        };
        let samples = self.weights[trial].len();
        let factors = DVector::from_iterator(samples, (0..samples).map(factor));
        for (weight, factor) in self.weights[trial].iter_mut().zip(factors.iter()) {
            *weight *= factor;
        }
        factors
    }

    /// Predictions over their noise, by trial.
    fn all(&self, point: &Point) -> Option<Vec<DVector<f64>>> {
        let one = |trial: usize| {
            let predicted = self.plant.simulate(trial, point)?;
            let done = 1 + self.done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            // A look at what a recording can tell takes seconds, and is not ended before.
            let _ = self.progress.simulated(done);
            let whitened = predicted.iter().zip(&self.weights[trial]).map(|(f, w)| f * w);
            let whitened = DVector::from_iterator(predicted.len(), whitened);
            whitened.iter().all(|x| x.is_finite()).then_some(whitened)
        };
        each_or_none(0..self.plant.trials().len(), one)
    }
}

/// Mean time between samples of a channel \[s\].
fn interval_s(samples: &[Sample]) -> f64 {
    match samples {
        [first, .., last] => (last.t_s - first.t_s) / (samples.len() - 1) as f64,
        _ => f64::INFINITY,
    }
}

/// What an effect does at each of its switch-on values, by trial.
struct Signature {
    starts: Vec<Vec<DVector<f64>>>,
    /// Size of each, in standard deviations of the prior.
    sizes: Vec<f64>,
}

impl Signature {
    fn of(
        played: &Played<'_>,
        nominal: &Point,
        base: &[DVector<f64>],
        effect: usize,
    ) -> Option<Self> {
        let own = &played.plant.effects()[effect];
        let mut starts = Vec::new();
        for values in &own.starts {
            let mut point = nominal.clone();
            point.effects[effect].clone_from(values);
            starts.push(difference(&played.all(&point)?, base));
        }
        let size = |values: &Vec<f64>| {
            let deviations = own.parameters.iter().zip(values);
            deviations.map(|(p, v)| ((v - p.off) / p.scale).powi(2)).sum::<f64>().sqrt()
        };
        let sizes = own.starts.iter().map(size).collect();
        (!starts.is_empty()).then_some(Self { starts, sizes })
    }

    /// Of the switch-on values near the typical size, the one that stands out most for its size;
    /// what it does at the typical size, and how far that stands out from `span`. Larger ones are
    /// left alone: friction that jams, or a snap at another place, is not linear.
    fn most_visible(
        &self,
        metric: &Metric<'_>,
        span: &[DMatrix<f64>],
    ) -> (usize, Vec<DVector<f64>>, f64) {
        let far = |size: f64| size.max(1e-12).ln().abs();
        let nearest = self.sizes.iter().map(|&size| far(size)).fold(f64::INFINITY, f64::min);
        let mut best = (0, Vec::new(), f64::NEG_INFINITY);
        for (start, (does, &size)) in self.starts.iter().zip(&self.sizes).enumerate() {
            if far(size) > nearest + 2_f64.ln() {
                continue;
            }
            let typical: Vec<DVector<f64>> = does.iter().map(|own| own / size.max(1e-12)).collect();
            let distance = metric.distance(&typical, span);
            if distance > best.2 {
                best = (start, typical, distance);
            }
        }
        best
    }

    /// Everything that it can do, by trial.
    fn span(&self) -> Vec<DMatrix<f64>> {
        let trials = self.starts.first().map_or(0, Vec::len);
        let of = |trial: usize| {
            let own: Vec<DVector<f64>> = self.starts.iter().map(|s| s[trial].clone()).collect();
            let samples = own.first().map_or(0, |column| column.len());
            matrix(&own, samples)
        };
        (0..trials).map(of).collect()
    }
}

/// Nothing to stand out from but the nuisances.
fn nothing(base: &[DVector<f64>]) -> Vec<DMatrix<f64>> {
    base.iter().map(|own| DMatrix::zeros(own.len(), 0)).collect()
}

/// The nominal model, and effects of any size beside it.
struct Near<'a> {
    played: &'a Played<'a>,
    nominal: &'a Point,
    base: &'a [DVector<f64>],
    metric: &'a Metric<'a>,
}

impl Near<'_> {
    /// Where an effect is just seen, parameters that are not at their off value. `share`: of the
    /// way from off to `start`, where to look first. `None` beyond its bounds.
    fn just_seen(&self, effect: usize, start: &[f64], mut share: f64) -> Option<Vec<Size>> {
        let own = &self.played.plant.effects()[effect];
        let at = |share: f64| {
            let values = own.parameters.iter().zip(start);
            values.map(|(p, v)| p.off + share * (v - p.off)).collect::<Vec<f64>>()
        };
        let room = own.parameters.iter().zip(start).map(|(p, v)| match v - p.off {
            way if way > 0.0 => (p.high - p.off) / way,
            way if way < 0.0 => (p.low - p.off) / way,
            _ => f64::INFINITY,
        });
        let most = room.fold(f64::INFINITY, f64::min);
        if !share.is_finite() {
            return None;
        }
        for _ in 0..LOOKS {
            share = share.min(most);
            let mut point = self.nominal.clone();
            point.effects[effect] = at(share);
            let does = difference(&self.played.all(&point)?, self.base);
            let ratio = SEEN / self.metric.distance(&does, &nothing(self.base));
            if (NEAR..=1.0 / NEAR).contains(&ratio) {
                break;
            }
            if share >= most && ratio > 1.0 {
                return None;
            }
            share *= ratio.clamp(0.1, 10.0);
        }
        share = share.min(most);
        let values = at(share);
        let size = |(p, value): (&Parameter, f64)| {
            (value != p.off).then_some(Size { name: p.name, off: p.off, value, unit: p.unit })
        };
        Some(own.parameters.iter().zip(values).filter_map(size).collect())
    }
}

fn difference(a: &[DVector<f64>], b: &[DVector<f64>]) -> Vec<DVector<f64>> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn matrix(columns: &[DVector<f64>], rows: usize) -> DMatrix<f64> {
    if columns.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(columns) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Nuisance;
    use crate::toy::{Toy, effect};

    const SAMPLES: usize = 200;

    /// Over whole periods: orthogonal to each other and to a constant, of length 10.
    fn wave(effect: usize, i: usize) -> f64 {
        let angle = std::f64::consts::TAU * i as f64 / SAMPLES as f64;
        match effect {
            0 | 1 => (5.0 * angle).sin(),
            2 => (9.0 * angle).sin(),
            3 => 1.0,
            _ => 0.0,
        }
    }

    /// Unit noise; three effects, of which two do the same, one that is constant, one that does
    /// nothing, and a constant nuisance.
    fn toy() -> impl Plant {
        let predict = |i: usize, point: &Point| {
            // Beyond its typical size an effect does something else altogether.
            let does = |(e, p): (usize, &Vec<f64>)| {
                if p[0] > 1.0 { 1e3 * wave(2, i + 7) } else { p[0] * wave(e, i) }
            };
            point.effects.iter().enumerate().map(does).sum::<f64>() + point.nuisances[0]
        };
        let parameter =
            Parameter { name: "size", unit: "1", low: 0.0, high: 2.0, off: 0.0, scale: 0.5 };
        let starts = vec![vec![0.5], vec![50.0]];
        let mut toy = Toy::new(0.02, 1.0, [1e6; SAMPLES], predict);
        toy.effects = ["a", "like a", "other", "constant", "nothing"]
            .map(|id| effect(id, vec![parameter], starts.clone()))
            .into();
        toy.nuisances = vec![Nuisance { name: "bias", unit: "N", sd: 0.1, effect: None }];
        toy
    }

    #[test]
    fn distances_are_those_of_the_formula_whatever_was_measured() {
        let found = isolability(&toy(), &crate::unwatched).unwrap();
        let own = |id: &str| found.effects.iter().find(|e| e.id == id).unwrap();
        // A wave of length 10 at half its size.
        assert!((own("a").distance - 5.0).abs() < 1e-6, "{found:?}");
        let size = &own("a").smallest.as_ref().unwrap()[0];
        assert!((size.value - 0.5).abs() < 1e-6, "{size:?}");
        // ½ √200 against a bias of 0.1 on 200 samples: 50/(1 + 0.01 · 200).
        assert!((own("constant").distance - (50.0_f64 / 3.0).sqrt()).abs() < 1e-6, "{found:?}");
        assert_eq!((own("nothing").distance, &own("nothing").smallest), (0.0, &None));
    }

    #[test]
    fn effects_that_do_the_same_are_not_told_apart() {
        let found = isolability(&toy(), &crate::unwatched).unwrap();
        let pair = |a: &str, b: &str| {
            let own = found.pairs.iter().find(|p| p.effect == a && p.rival == b).unwrap();
            own.distance
        };
        assert!(pair("a", "like a") < 1e-3 && pair("like a", "a") < 1e-3);
        assert!((pair("a", "other") - pair("a", "nothing")).abs() < 1.0);
        assert_eq!(found.pairs.len(), 20);
        assert!(found.failed.is_empty());
    }
}
