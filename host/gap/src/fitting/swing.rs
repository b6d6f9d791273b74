//! Starting values of an effect that swings: least squares over frequencies, without a simulation.
//!
//! A breathing wall is a registration that varies in time, and a feed ripple is an insertion offset that
//! varies along the feed. The response of the residual r to the nuisance parameter k is known, S_k. To first
//! order the effect then adds
//!
//! > Σ_k S_k (a_k sin 2πfu + b_k cos 2πfu),   u: time, or feed,
//!
//! which is linear in a and b at every frequency f, as a periodogram is (Lomb 1976). Friction makes this
//! only approximate, which is enough for a starting value. From a wrong frequency no descent finds the
//! right one.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::fitting::refit::Refit;
use crate::plant::Swing;
use crate::signal::wrapped;

/// Frequencies a cycle over the longest trial.
const PER_CYCLE: f64 = 4.0;
/// Frequencies at most.
const MOST: usize = 400;
/// What swings with a phase of its own in every trial does so at least so often in the longest,
const OWN_CYCLES: f64 = 2.0;
/// explains to first order this share of what is left, and so many times what one phase does,
const OWN_SHARE: f64 = 0.1;
const TIMES_ONE: f64 = 3.0;
/// and by amplitudes that differ by no more than this share of their mean: a wall is one, what is fitted to
/// anything is not.
const ALIKE: f64 = 0.6;

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
    let own = Swung::of(problem, effect, &swing, trials);
    let mut best: Option<(f64, DVector<f64>, f64)> = None;
    for cycles in own.frequencies(&swing) {
        let found = own.explained(&swing, nuisances, 0..trials.len(), cycles);
        if let Some((gain, amplitudes)) = found
            && best.as_ref().is_none_or(|(most, ..)| gain > *most)
        {
            best = Some((gain, amplitudes, cycles));
        }
    }
    let (_, amplitudes, cycles) = best?;
    let (amplitude, phase) = one_phase(&amplitudes, &own.sds)?;
    let values = (swing.parameters)(&amplitude, cycles, phase);
    let parameters = &problem.plant.effects()[effect].parameters;
    Some(values.iter().zip(parameters).map(|(value, p)| value.clamp(p.low, p.high)).collect())
}

/// By how much later in its swing each trial begins than the first one \[rad\], where that is plain: with one
/// phase for all much less is explained. `None` else, and of what begins with the trial by its nature.
///
/// `trials`: all of them, refitted with these nuisances.
pub fn own_phases(
    problem: &Problem<'_>,
    effect: usize,
    nuisances: &Nuisances,
    trials: &[(usize, &Refit)],
) -> Option<Vec<f64>> {
    let swing = problem.plant.swing(effect).filter(|swing| swing.own_phase.is_some())?;
    let own = Swung::of(problem, effect, &swing, trials);
    let (mut with_one, mut best) = (0.0_f64, (0.0, Vec::new()));
    for cycles in own.frequencies(&swing).filter(|f| f * own.longest >= OWN_CYCLES) {
        let together = own.explained(&swing, nuisances, 0..trials.len(), cycles);
        with_one = with_one.max(together.map_or(0.0, |(gain, _)| gain));
        let apart = (0..trials.len()).map(|t| own.explained(&swing, nuisances, t..t + 1, cycles));
        let Some(apart) = apart.collect::<Option<Vec<_>>>() else { continue };
        let gain = apart.iter().map(|(gain, _)| gain).sum();
        if gain > best.0 {
            best = (gain, apart.into_iter().map(|(_, amplitudes)| amplitudes).collect());
        }
    }
    let (gain, amplitudes) = best;
    let all: f64 = trials.iter().map(|(_, refit)| refit.energy()).sum();
    if gain < OWN_SHARE * all || gain < TIMES_ONE * with_one {
        return None;
    }
    let mut swings: Vec<(DVector<f64>, f64)> = Vec::new();
    for amplitudes in amplitudes {
        let (amplitude, phase) = one_phase(&amplitudes, &own.sds)?;
        let amplitude = DVector::from_vec(amplitude);
        // To the other side half a turn later is the same.
        let turned = swings.first().is_some_and(|(first, _)| first.dot(&amplitude) < 0.0);
        swings.push(if turned { (-amplitude, phase + PI) } else { (amplitude, phase) });
    }
    let mean =
        swings.iter().map(|(amplitude, _)| amplitude).sum::<DVector<f64>>() / swings.len() as f64;
    let alike =
        |(amplitude, _): &(DVector<f64>, f64)| (amplitude - &mean).norm() <= ALIKE * mean.norm();
    let first = swings.first()?.1;
    swings
        .iter()
        .all(alike)
        .then(|| swings.iter().map(|(_, phase)| wrapped(phase - first)).collect())
}

/// Trials along what swings.
struct Swung<'a> {
    trials: &'a [(usize, &'a Refit)],
    /// By trial and sample, and by how much a trial is ahead \[rad\].
    along: Vec<Vec<f64>>,
    ahead_rad: Vec<f64>,
    longest: f64,
    /// Standard deviations of the nuisances that swing.
    sds: Vec<f64>,
}

impl<'a> Swung<'a> {
    fn of(
        problem: &Problem<'_>,
        effect: usize,
        swing: &Swing,
        trials: &'a [(usize, &'a Refit)],
    ) -> Self {
        let argument = |(trial, _): &(usize, &Refit)| -> Vec<f64> {
            let trial = &problem.plant.trials()[*trial];
            (0..trial.samples.len()).map(|sample| swing.along.of(trial, sample)).collect()
        };
        let along: Vec<Vec<f64>> = trials.iter().map(argument).collect();
        let ahead = |(trial, _): &(usize, &Refit)| problem.plant.own_phase_rad(effect, *trial);
        let sd = |k: &usize| problem.plant.nuisances()[*k].sd;
        Self {
            trials,
            longest: along.iter().map(|u| range(u)).fold(0.0, f64::max),
            along,
            ahead_rad: trials.iter().map(ahead).collect(),
            sds: swing.nuisances.iter().map(sd).collect(),
        }
    }

    /// That are tried.
    fn frequencies(&self, swing: &Swing) -> impl Iterator<Item = f64> + use<> {
        let [low, high] = swing.cycles;
        let count = (((high - low) * self.longest * PER_CYCLE).ceil() as usize).min(MOST);
        (0..=count).map(move |k| low + (high - low) * k as f64 / count.max(1) as f64)
    }

    /// How much of the residuals' energy of some trials a frequency explains, and by which amplitudes:
    /// sine and cosine of each nuisance in turn, in standard deviations of its prior.
    fn explained(
        &self,
        swing: &Swing,
        nuisances: &Nuisances,
        trials: Range<usize>,
        cycles: f64,
    ) -> Option<(f64, DVector<f64>)> {
        let k = 2 * swing.nuisances.len();
        let (mut normal, mut slope) = (DMatrix::identity(k, k), DVector::zeros(k));
        for own in trials {
            let ((trial, refit), u) = (self.trials[own], &self.along[own]);
            let scaled = nuisances.scaled(trial);
            let phase = |u: &f64| (TAU * cycles * u + self.ahead_rad[own]).sin_cos();
            let phases: Vec<(f64, f64)> = u.iter().map(phase).collect();
            let columns = DMatrix::from_fn(u.len(), k, |i, c| {
                let (sine, cosine) = phases[i];
                scaled[(i, swing.nuisances[c / 2])] * if c % 2 == 0 { sine } else { cosine }
            });
            let columns = refit.project(&columns);
            normal += columns.tr_mul(&columns);
            slope -= columns.tr_mul(&refit.pull);
        }
        let amplitudes = normal.cholesky()?.solve(&slope);
        Some((slope.dot(&amplitudes), amplitudes))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::floor::Floor;
    use crate::plant::{Along, Nuisance, Parameter, Plant, Point};
    use crate::toy::{Toy, effect};

    const SAMPLES: usize = 500;
    const STEP_S: f64 = 0.01;
    const FREQUENCY_HZ: f64 = 0.83;
    const PHASE_RAD: f64 = 2.1;
    /// Rows before the first sample.
    const BEFORE_S: f64 = 0.45;
    const AMPLITUDE_M: [f64; 2] = [1.2e-3, -0.4e-3];

    fn weight(nuisance: usize, i: usize) -> f64 {
        let depth = i as f64 / SAMPLES as f64;
        if nuisance == 0 { 5.0 * depth } else { 8.0 * (1.0 - depth) * (7.0 * depth).cos() }
    }

    /// Since the first row, as the effect counts it.
    fn time_s(i: usize) -> f64 {
        BEFORE_S + STEP_S * i as f64
    }

    /// Two nuisances whose weight changes along the trial; one effect that swings both.
    fn toy(measured: impl Fn(usize) -> f64) -> impl Plant {
        trials(1, &|_, i| measured(i))
    }

    /// The same of so many trials, by trial and sample.
    fn trials(count: usize, measured: &dyn Fn(usize, usize) -> f64) -> impl Plant + use<> {
        let predict = |i: usize, point: &Point| {
            let [x, y, cycles, phase] = point.effects[0][..] else { return f64::NAN };
            let swing = (TAU * cycles * time_s(i) + phase).sin();
            let moved = [point.nuisances[0] + x * swing, point.nuisances[1] + y * swing];
            moved[0] * weight(0, i) + moved[1] * weight(1, i)
        };
        let parameter = |name, most: f64, scale| Parameter {
            name,
            unit: "1",
            low: -most,
            high: most,
            off: 0.0,
            scale,
        };
        let parameters = vec![
            parameter("x_m", 5e-3, 1e-3),
            parameter("y_m", 5e-3, 1e-3),
            parameter("frequency_hz", 5.0, 0.5),
            parameter("phase_rad", 7.0, 2.0),
        ];
        let nuisance = |name| Nuisance { name, unit: "m", sd: 3e-4, effect: None };
        let toy = Toy::new(STEP_S, 1e-4, (0..SAMPLES).map(|_| 0.0), predict).begun(BEFORE_S);
        let mut toy = toy.times(count).each(measured).in_regimes(1, |_, _| 0);
        toy.cheap = false;
        toy.effects = vec![effect("motion", parameters, Vec::new())];
        toy.nuisances = vec![nuisance("x"), nuisance("y")];
        toy.swing = Some(Swing {
            nuisances: vec![0, 1],
            along: Along::Time,
            cycles: [0.15, 4.0],
            own_phase: Some(3),
            parameters: |amplitudes, cycles, phase| {
                amplitudes.iter().copied().chain([cycles, phase]).collect()
            },
        });
        toy
    }

    /// What is asked of the trials of a toy, refitted with the nuisances of its nominal model.
    fn asked<T>(
        toy: &dyn Plant,
        of: impl FnOnce(&Problem<'_>, &Nuisances, &[(usize, &Refit)]) -> T,
    ) -> T {
        let floor = Floor::of(toy);
        let problem = Problem::new(toy, &floor, &crate::unwatched);
        let point = Point::nominal(toy);
        let base = problem.residuals(&point).unwrap();
        let nuisances = Nuisances::at(&problem, &point, &base).unwrap();
        let refits: Vec<Refit> =
            base.iter().enumerate().map(|(t, r)| nuisances.refit(t, r)).collect();
        of(&problem, &nuisances, &refits.iter().enumerate().collect::<Vec<_>>())
    }

    fn guessed(toy: &dyn Plant) -> Option<Vec<f64>> {
        asked(toy, |problem, nuisances, trials| guess(problem, 0, nuisances, trials))
    }

    #[test]
    fn a_motion_is_found_with_its_frequency_amplitudes_and_phase() {
        // Not a sinusoid: with an overtone, which no frequency explains as well.
        let measured = |i: usize| {
            let turn = TAU * FREQUENCY_HZ * time_s(i) + PHASE_RAD;
            let swing = turn.sin() + 0.2 * (2.0 * turn).sin();
            (0..2).map(|k| AMPLITUDE_M[k] * swing * weight(k, i)).sum()
        };
        let found = guessed(&toy(measured)).unwrap();
        // Frequencies are tried every 0.05 Hz.
        assert!((found[2] - FREQUENCY_HZ).abs() < 0.03, "{found:?}");
        // Half way through the trial the phase is that of the motion, whatever the sign.
        let half = |cycles: f64, phase: f64| TAU * cycles * time_s(SAMPLES / 2) + phase;
        let turned = half(found[2], found[3]) - half(FREQUENCY_HZ, PHASE_RAD);
        let sign = turned.cos().signum();
        assert!(turned.sin().abs() < 0.3, "{found:?}");
        for (found, there) in found.iter().zip(AMPLITUDE_M) {
            assert!((sign * found - there).abs() < 0.25 * there.abs(), "{found}, {there}");
        }
    }

    #[test]
    fn where_nothing_moves_nothing_is_guessed() {
        assert_eq!(guessed(&toy(|_| 0.0)), None);
    }

    const AHEAD_RAD: [f64; 3] = [0.0, 1.9, -2.3];

    /// Trials that begin so far ahead in a swing of `times` the amplitude, by trial.
    fn breathing(ahead_rad: [f64; 3], times: [f64; 3]) -> impl Plant {
        trials(3, &|trial, i| {
            let swing = (TAU * FREQUENCY_HZ * time_s(i) + PHASE_RAD + ahead_rad[trial]).sin();
            let moved = |k: usize| times[trial] * AMPLITUDE_M[k] * swing * weight(k, i);
            (0..2).map(moved).sum::<f64>() + 1e-4 * crate::toy::noise(i + SAMPLES * trial)
        })
    }

    fn phases(toy: &dyn Plant) -> Option<Vec<f64>> {
        asked(toy, |problem, nuisances, trials| own_phases(problem, 0, nuisances, trials))
    }

    #[test]
    fn a_breath_that_does_not_begin_with_the_trial_has_a_phase_in_each() {
        let found = phases(&breathing(AHEAD_RAD, [1.0; 3])).expect("plain");
        for (found, there) in found.iter().zip(AHEAD_RAD) {
            assert!((found - there).sin().abs() < 0.2 && (found - there).cos() > 0.0, "{found}");
        }
        assert_eq!(phases(&breathing([0.0; 3], [1.0; 3])), None, "one phase explains as much");
        assert_eq!(phases(&breathing(AHEAD_RAD, [0.2, 1.0, 3.0])), None, "a wall is one");
    }

    #[test]
    fn what_swings_with_phases_of_its_own_is_named_and_said() {
        let toy = breathing(AHEAD_RAD, [1.0; 3]);
        let answer = crate::diagnosis::diagnose(&toy, "breath", &crate::unwatched);
        assert_eq!(
            answer.verdict,
            crate::diagnosis::report::Verdict::Named,
            "{}",
            answer.sentence()
        );
        let named = &answer.effects[0];
        let x_m = named.parameters["x_m"].value.abs();
        assert!((x_m / AMPLITUDE_M[0] - 1.0).abs() < 0.1, "{x_m}");
        let said =
            |remark: &String| remark.contains("motion has a phase of its own in every trial");
        assert!(answer.remarks.iter().any(said), "{:?}", answer.remarks);
    }
}
