//! Evaluates what a method asks for, on every core, until it or the budget has come to an end.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use crate::ask::{Answer, Optimiser, Question, Slope};
use crate::methods::choice::{Choice, Method};
use crate::objective::{Evaluation, Objective};
use crate::parameter::{Parameter, ParameterError, check, coordinates, values};
use crate::state::{State, StateError};

/// How a run goes.
#[derive(Clone, Debug)]
pub struct Options {
    /// `None` for the one that fits the problem.
    pub method: Option<Method>,
    /// Evaluations at most. A batch that is begun is finished.
    pub budget: usize,
    pub seed: u64,
    /// What the objective depends on besides the parameters; a state of another one is not resumed.
    pub objective: String,
    /// Where what is known is kept after every batch.
    pub state: Option<PathBuf>,
    /// Whether to go on with what is kept there.
    pub resume: bool,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The method came to its end.
    Converged,
    /// The budget was spent.
    Budget,
    /// Somebody interrupted it.
    Interrupted,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    pub evaluations: usize,
    pub budget: usize,
    /// The least cost so far; infinite before the first batch.
    pub best: f64,
}

/// Where a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// By parameter, in its unit.
    pub best: Vec<f64>,
    pub cost: f64,
    pub evaluations: usize,
    /// Those of them that an earlier run had done.
    pub resumed: usize,
    pub stop: Stop,
    pub choice: Choice,
}

/// Why a run has no outcome.
#[derive(Debug, Error)]
pub enum RunError {
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    #[error(transparent)]
    State(#[from] StateError),
    #[error("nothing could be computed at any of {0} points within the bounds")]
    Nowhere(usize),
}

/// Minimises an objective with a method by name.
///
/// `tell` is called from several threads. Where `interrupted` becomes true, the run ends after the
/// batch that is under way, with the best point so far; the state that was kept resumes it.
pub fn minimise(
    parameters: &[Parameter],
    objective: &dyn Objective,
    options: &Options,
    interrupted: &AtomicBool,
    tell: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, RunError> {
    check(parameters)?;
    let has_residuals = objective.has_residuals();
    let kept = match (&options.state, options.resume) {
        (Some(path), true) => Some(State::read(path)?),
        _ => None,
    };
    let choice = match (options.method, &kept) {
        (Some(method), _) => Choice { method, reason: "it was asked for".into() },
        (None, Some(kept)) => Choice { method: kept.method, reason: "it is resumed".into() },
        (None, None) => Method::choose(parameters.len(), options.budget, has_residuals),
    };
    let mut state = State::new(options.objective.clone(), choice.method, options.seed, parameters);
    if let (Some(kept), Some(path)) = (kept, &options.state) {
        kept.check_same(path, &state)?;
        state.answers = kept.answers;
    }
    let start: Vec<f64> = parameters.iter().map(|own| own.start).collect();
    let start = coordinates(parameters, &start);
    let mut search = choice.method.optimiser(&start, has_residuals, options.seed);
    let run = Run { parameters, objective, budget: options.budget, interrupted, tell };
    let keep = |state: &State| options.state.as_ref().map_or(Ok(()), |path| state.write(path));
    let found = run.go(search.as_mut(), &mut state, &keep)?;
    let best = found.best.ok_or(RunError::Nowhere(found.evaluations))?;
    Ok(Outcome {
        cost: best.0,
        best: values(parameters, &best.1),
        evaluations: found.evaluations,
        resumed: found.resumed,
        stop: found.stop,
        choice,
    })
}

/// Minimises an objective with a search of one's own, such as [`crate::CrossEntropy`] with other
/// numbers. Gives the best point, its cost, the evaluations, and why it ended.
pub fn optimise(
    parameters: &[Parameter],
    objective: &dyn Objective,
    search: &mut dyn Optimiser,
    budget: usize,
    interrupted: &AtomicBool,
    tell: &(dyn Fn(Progress) + Sync),
) -> Result<(Vec<f64>, f64, usize, Stop), RunError> {
    check(parameters)?;
    let run = Run { parameters, objective, budget, interrupted, tell };
    let mut state = State::new(String::new(), Method::MultiStart, 0, parameters);
    let found = run.go(search, &mut state, &|_| Ok(()))?;
    let (cost, at) = found.best.ok_or(RunError::Nowhere(found.evaluations))?;
    Ok((values(parameters, &at), cost, found.evaluations, found.stop))
}

struct Run<'a> {
    parameters: &'a [Parameter],
    objective: &'a dyn Objective,
    budget: usize,
    interrupted: &'a AtomicBool,
    tell: &'a (dyn Fn(Progress) + Sync),
}

struct Found {
    best: Option<(f64, Vec<f64>)>,
    evaluations: usize,
    resumed: usize,
    stop: Stop,
}

impl Run<'_> {
    /// Lets a search go on to its end. What `state` knows is told, not computed.
    fn go(
        &self,
        search: &mut dyn Optimiser,
        state: &mut State,
        keep: &dyn Fn(&State) -> Result<(), StateError>,
    ) -> Result<Found, RunError> {
        let mut found = Found { best: None, evaluations: 0, resumed: 0, stop: Stop::Converged };
        let mut known = 0;
        loop {
            let asked = search.ask();
            if asked.is_empty() {
                return Ok(found);
            }
            let cost: usize = asked.iter().map(Question::evaluations).sum();
            let answers = match state.answers.get(known..known + asked.len()) {
                Some(answers) => {
                    found.resumed += cost;
                    answers.to_vec()
                }
                None => {
                    let spent = found.evaluations > 0 && found.evaluations + cost > self.budget;
                    if spent || self.interrupted.load(Ordering::Relaxed) {
                        found.stop = if spent { Stop::Budget } else { Stop::Interrupted };
                        return Ok(found);
                    }
                    let answers = self.answers(&asked, &found);
                    state.answers.truncate(known);
                    state.answers.extend(answers.iter().cloned());
                    keep(state)?;
                    answers
                }
            };
            known += asked.len();
            found.evaluations += cost;
            for (question, answer) in asked.iter().zip(&answers) {
                let own = answer.cost();
                if own.is_finite() && found.best.as_ref().is_none_or(|(least, _)| own < *least) {
                    found.best = Some((own, question.at.clone()));
                }
            }
            search.tell(&answers);
        }
    }

    /// Everything that is asked for, side by side.
    fn answers(&self, asked: &[Question], found: &Found) -> Vec<Answer> {
        let points: Vec<Vec<f64>> = asked.iter().flat_map(|own| self.points(own)).collect();
        let done = AtomicUsize::new(found.evaluations);
        let best = found.best.as_ref().map_or(f64::INFINITY, |(cost, _)| *cost);
        let evaluate = |at: &Vec<f64>| {
            let evaluation = self.objective.evaluate(&values(self.parameters, at));
            let evaluations = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.tell)(Progress { evaluations, budget: self.budget, best });
            evaluation
        };
        let evaluations: Vec<Option<Evaluation>> = points.par_iter().map(evaluate).collect();
        let mut rest = evaluations.iter().zip(&points);
        asked
            .iter()
            .map(|question| {
                let own: Vec<_> = rest.by_ref().take(question.evaluations()).collect();
                answer(question, &own)
            })
            .collect()
    }

    /// The point of a question, then those at which the slope is told.
    fn points(&self, question: &Question) -> Vec<Vec<f64>> {
        let mut points = vec![question.at.clone()];
        if question.slope {
            points
                .extend((0..question.at.len()).map(|k| stepped(self.parameters, &question.at, k)));
        }
        points
    }
}

/// A step of a difference along one coordinate, within the cube.
fn stepped(parameters: &[Parameter], at: &[f64], k: usize) -> Vec<f64> {
    let own = &parameters[k];
    let value = own.value(at[k]);
    let up = value + own.step <= own.high;
    let mut moved = at.to_vec();
    moved[k] = own.coordinate(if up { value + own.step } else { value - own.step });
    moved
}

fn answer(question: &Question, found: &[(&Option<Evaluation>, &Vec<f64>)]) -> Answer {
    let Some(((base, at), moved)) = found.split_first() else {
        return Answer { cost: None, slope: None };
    };
    let cost = base.as_ref().map(Evaluation::cost).filter(|cost| cost.is_finite());
    let slope = || {
        let Some(Evaluation::Residuals(base)) = base else { return None };
        let columns = columns(base, at, moved)?;
        let n = question.at.len();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let pull = columns.iter().map(|column| dot(column, base)).collect();
        let curvature = (0..n * n).map(|i| dot(&columns[i / n], &columns[i % n])).collect();
        Some(Slope { pull, curvature })
    };
    Answer { cost, slope: if question.slope { slope() } else { None } }
}

/// Derivatives with respect to the coordinates of the unit cube. A coordinate along which nothing can
/// be computed counts as one that changes nothing.
fn columns(
    base: &[f64],
    at: &[f64],
    moved: &[(&Option<Evaluation>, &Vec<f64>)],
) -> Option<Vec<Vec<f64>>> {
    let column = |(k, (evaluation, point)): (usize, &(&Option<Evaluation>, &Vec<f64>))| {
        let step = point[k] - at[k];
        match evaluation {
            Some(Evaluation::Residuals(own)) if own.len() == base.len() && step != 0.0 => {
                Some(own.iter().zip(base).map(|(a, b)| (a - b) / step).collect())
            }
            Some(Evaluation::Cost(_)) => None,
            _ => Some(vec![0.0; base.len()]),
        }
    };
    moved.iter().enumerate().map(column).collect()
}

/// Residuals at some values and their derivatives, samples × parameters, in the parameters' units;
/// `None` where nothing can be computed there or beside, or where there are no residuals.
pub fn jacobian(
    parameters: &[Parameter],
    objective: &dyn Objective,
    at: &[f64],
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let side = |k: usize, sign: f64| {
        let own = &parameters[k];
        let mut moved = at.to_vec();
        moved[k] = (at[k] + sign * own.step).clamp(own.low, own.high);
        moved
    };
    let points: Vec<Vec<f64>> = std::iter::once(at.to_vec())
        .chain((0..at.len()).flat_map(|k| [side(k, 1.0), side(k, -1.0)]))
        .collect();
    let found = points.par_iter().map(|point| match objective.evaluate(point) {
        Some(Evaluation::Residuals(own)) => Some(own),
        _ => None,
    });
    let found: Option<Vec<Vec<f64>>> = found.collect();
    let found = found?;
    let (base, moved) = found.split_first()?;
    let column = |i: usize, k: usize| {
        let span = points[1 + 2 * k][k] - points[2 + 2 * k][k];
        (moved[2 * k][i] - moved[2 * k + 1][i]) / span
    };
    Some((base.clone(), DMatrix::from_fn(base.len(), at.len(), column)))
}
