//! Where the fit of an effect that swings begins: by least squares over frequencies, without a
//! simulation.
//!
//! A wall that breathes is a registration that comes and goes, and a feed that ripples is an
//! insertion offset that does. What the nuisance k does to the residual r is known, S_k; to first
//! order the effect then does
//!
//! > Σ_k S_k (a_k sin 2πfu + b_k cos 2πfu),   u: time, or feed,
//!
//! which is linear in a and b at every frequency f, as a periodogram is (Lomb 1976). Friction makes
//! it only nearly true, which is enough to begin with: started at a wrong frequency, no descent
//! finds the right one.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::nuisance::{Nuisances, Refit};
use crate::plant::{Along, Swing};
use crate::problem::Problem;

/// Frequencies a cycle over the longest trial.
const PER_CYCLE: f64 = 4.0;
/// Frequencies at most.
const MOST: usize = 400;

/// Parameters of an effect that swings, at the frequency that explains most of what these trials
/// leave; `None` of one that does not swing, or where nothing swings.
///
/// `trials`: by index, refitted with these nuisances, which were linearised for all trials.
pub fn guess(
    problem: &Problem<'_>,
    effect: usize,
    nuisances: &Nuisances,
    trials: &[(usize, &Refit)],
) -> Option<Vec<f64>> {
    let swing = problem.plant.swing(effect)?;
    let argument = |trial: usize| -> Vec<f64> {
        let samples = &problem.plant.trials()[trial].samples;
        let first = samples.iter().min_by(|a, b| a.t_s.total_cmp(&b.t_s));
        let start_m = first.map_or(0.0, |sample| sample.arc_m);
        let of = samples.iter().map(|sample| match swing.along {
            Along::Time => sample.t_s,
            Along::Feed => sample.arc_m - start_m,
        });
        of.collect()
    };
    let own: Vec<Vec<f64>> = trials.iter().map(|(trial, _)| argument(*trial)).collect();
    let longest = own.iter().map(|u| range(u)).fold(0.0, f64::max);
    let [low, high] = swing.cycles;
    let count = (((high - low) * longest * PER_CYCLE).ceil() as usize).min(MOST);
    let mut best: Option<(f64, DVector<f64>, f64)> = None;
    for k in 0..=count {
        let cycles = low + (high - low) * k as f64 / count.max(1) as f64;
        let found = explained(&swing, nuisances, trials, &own, cycles);
        if let Some((gain, amplitudes)) = found
            && best.as_ref().is_none_or(|(most, ..)| gain > *most)
        {
            best = Some((gain, amplitudes, cycles));
        }
    }
    let (_, amplitudes, cycles) = best?;
    let sd = |k: &usize| problem.plant.nuisances()[*k].sd;
    let sds: Vec<f64> = swing.nuisances.iter().map(sd).collect();
    let (amplitude, phase) = one_phase(&amplitudes, &sds)?;
    let values = (swing.parameters)(&amplitude, cycles, phase);
    let parameters = &problem.plant.effects()[effect].parameters;
    Some(values.iter().zip(parameters).map(|(value, p)| value.clamp(p.low, p.high)).collect())
}

/// How much of the residuals' energy a frequency explains, and by which amplitudes: sine and cosine
/// of each nuisance in turn, in standard deviations of its prior.
fn explained(
    swing: &Swing,
    nuisances: &Nuisances,
    trials: &[(usize, &Refit)],
    arguments: &[Vec<f64>],
    cycles: f64,
) -> Option<(f64, DVector<f64>)> {
    let k = 2 * swing.nuisances.len();
    let (mut normal, mut slope) = (DMatrix::identity(k, k), DVector::zeros(k));
    for ((trial, refit), u) in trials.iter().zip(arguments) {
        let scaled = nuisances.scaled(*trial);
        let phases: Vec<(f64, f64)> = u.iter().map(|u| (TAU * cycles * u).sin_cos()).collect();
        let columns = DMatrix::from_fn(u.len(), k, |i, c| {
            let (sine, cosine) = phases[i];
            scaled[(i, swing.nuisances[c / 2])] * if c % 2 == 0 { sine } else { cosine }
        });
        let columns = refit.project(&columns);
        normal += columns.tr_mul(&columns);
        slope -= columns.tr_mul(&refit.residual);
    }
    let amplitudes = normal.cholesky()?.solve(&slope);
    Some((slope.dot(&amplitudes), amplitudes))
}

/// Amplitudes of all nuisances with the one phase that keeps most of them; `None` where nothing
/// swings.
fn one_phase(amplitudes: &DVector<f64>, sds: &[f64]) -> Option<(Vec<f64>, f64)> {
    let pairs = || sds.iter().enumerate().map(|(k, _)| (amplitudes[2 * k], amplitudes[2 * k + 1]));
    let (along, across) = pairs()
        .fold((0.0, 0.0), |(along, across), (a, b)| (along + a * a - b * b, across + 2.0 * a * b));
    let phase = 0.5 * f64::atan2(across, along);
    let (sine, cosine) = phase.sin_cos();
    let kept = pairs().zip(sds).map(|((a, b), sd)| sd * (a * cosine + b * sine));
    let kept: Vec<f64> = kept.collect();
    kept.iter().any(|a| *a != 0.0).then_some((kept, phase))
}

fn range(values: &[f64]) -> f64 {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (high - low).max(0.0)
}
