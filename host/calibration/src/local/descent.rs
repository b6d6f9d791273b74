//! Levenberg–Marquardt within bounds (Marquardt 1963; Moré 1978).
//!
//! > (JᵀJ + λ diag JᵀJ) δ = −Jᵀr
//!
//! for the coordinates that are not held at a bound by their pull. Three dampings λ are tried at once,
//! since cores would be idle otherwise.

use nalgebra::{DMatrix, DVector};

use crate::ask::{Answer, Optimiser, Question, Slope};

/// Damping of the first step, and what it is tried at beside that.
const FIRST_DAMPING: f64 = 1e-2;
const TRIED: [f64; 3] = [0.1, 1.0, 10.0];
/// Times more damping when none helped, and the most of it.
const MORE: f64 = 100.0;
const MOST_DAMPING: f64 = 1e8;
/// A step that lowers the cost by less than this share, or leads less far in the unit cube, ends the
/// search.
const LEAST_GAIN: f64 = 1e-6;
const LEAST_STEP: f64 = 1e-7;
/// Curvature that a coordinate without any counts as, over the largest.
const FLAT: f64 = 1e-12;
const MOST_STEPS: usize = 60;

#[derive(Clone, Debug)]
enum Wanted {
    Slope,
    /// One of these is better, or none.
    Trials(Vec<Vec<f64>>),
    Nothing,
}

/// A search from one point, for objectives that give residuals.
#[derive(Clone, Debug)]
pub struct Descent {
    at: Vec<f64>,
    cost: f64,
    slope: Option<Slope>,
    damping: f64,
    wanted: Wanted,
    steps: usize,
    least_gain: f64,
}

impl Descent {
    pub fn from(at: Vec<f64>) -> Self {
        Self {
            at,
            cost: f64::INFINITY,
            slope: None,
            damping: FIRST_DAMPING,
            wanted: Wanted::Slope,
            steps: 0,
            least_gain: LEAST_GAIN,
        }
    }

    /// The same, ended by a step that lowers the cost by less than this share.
    pub fn with_least_gain(self, least_gain: f64) -> Self {
        Self { least_gain, ..self }
    }

    /// Where it is, and the cost there.
    pub fn best(&self) -> (&[f64], f64) {
        (&self.at, self.cost)
    }

    /// Where a step with this damping leads; `None` where nothing can be solved.
    fn step(&self, slope: &Slope, damping: f64) -> Option<Vec<f64>> {
        let n = self.at.len();
        let curvature = DMatrix::from_row_slice(n, n, &slope.curvature);
        let most = curvature.diagonal().max();
        // What the pull presses against a bound stays there.
        let is_free = |k: &usize| {
            let (u, down) = (self.at[*k], slope.pull[*k]);
            !(u <= 0.0 && down > 0.0 || u >= 1.0 && down < 0.0)
        };
        let free: Vec<usize> = (0..n).filter(is_free).collect();
        if free.is_empty() || most <= 0.0 {
            return None;
        }
        let mut normal = curvature.select_columns(&free).select_rows(&free);
        for i in 0..free.len() {
            normal[(i, i)] += damping * normal[(i, i)] + FLAT * most;
        }
        let pull = DVector::from_iterator(free.len(), free.iter().map(|&k| -slope.pull[k]));
        let step = normal.cholesky()?.solve(&pull);
        let mut next = self.at.clone();
        for (&k, step) in free.iter().zip(step.iter()) {
            next[k] = (next[k] + step).clamp(0.0, 1.0);
        }
        Some(next)
    }

    fn propose(&mut self) {
        let Some(slope) = self.slope.clone() else {
            self.wanted = Wanted::Nothing;
            return;
        };
        let trials = TRIED.iter().filter_map(|times| self.step(&slope, times * self.damping));
        let far =
            |next: &Vec<f64>| next.iter().zip(&self.at).any(|(a, b)| (a - b).abs() > LEAST_STEP);
        let trials: Vec<Vec<f64>> = trials.filter(far).collect();
        let ends = trials.is_empty() || self.steps >= MOST_STEPS || self.damping > MOST_DAMPING;
        self.wanted = if ends { Wanted::Nothing } else { Wanted::Trials(trials) };
    }

    fn take_slope(&mut self, answer: &Answer) {
        if answer.cost.is_none() {
            self.wanted = Wanted::Nothing;
            return;
        }
        self.cost = answer.cost();
        self.slope.clone_from(&answer.slope);
        self.propose();
    }

    fn take_trials(&mut self, trials: &[Vec<f64>], answers: &[Answer]) {
        self.steps += 1;
        let tried = trials.iter().zip(answers).enumerate();
        let best = tried.min_by(|a, b| a.1.1.cost().total_cmp(&b.1.1.cost()));
        let Some((k, (next, answer))) = best else {
            self.wanted = Wanted::Nothing;
            return;
        };
        let gain = self.cost - answer.cost();
        if gain > 0.0 {
            let is_last = gain <= self.least_gain * self.cost;
            self.at.clone_from(next);
            self.cost = answer.cost();
            self.damping *= TRIED[k];
            self.wanted = if is_last { Wanted::Nothing } else { Wanted::Slope };
        } else {
            self.damping *= MORE;
            self.propose();
        }
    }
}

impl Optimiser for Descent {
    fn ask(&mut self) -> Vec<Question> {
        match &self.wanted {
            Wanted::Slope => vec![Question::slope(self.at.clone())],
            Wanted::Trials(trials) => trials.iter().cloned().map(Question::cost).collect(),
            Wanted::Nothing => Vec::new(),
        }
    }

    fn tell(&mut self, answers: &[Answer]) {
        match std::mem::replace(&mut self.wanted, Wanted::Nothing) {
            Wanted::Slope => {
                if let Some(answer) = answers.first() {
                    self.take_slope(answer);
                }
            }
            Wanted::Trials(trials) => self.take_trials(&trials, answers),
            Wanted::Nothing => {}
        }
    }

    fn has_converged(&self) -> bool {
        matches!(self.wanted, Wanted::Nothing)
    }
}
