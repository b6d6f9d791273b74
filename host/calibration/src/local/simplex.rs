//! Nelder and Mead's simplex (1965) within bounds, for objectives that give a cost only.

use crate::ask::{Answer, Optimiser, Question};

/// Edge of the first simplex in the unit cube.
const EDGE: f64 = 0.05;
/// Reflection, expansion, contraction and shrinkage as Nelder and Mead chose them.
const REFLECTED: f64 = -1.0;
const EXPANDED: f64 = -2.0;
const CONTRACTED: f64 = 0.5;
const SHRUNK: f64 = 0.5;
/// A simplex this small, or with costs this much alike, has come to its end.
const LEAST_EDGE: f64 = 1e-6;
const LEAST_GAIN: f64 = 1e-10;
const MOST_STEPS: usize = 400;

type Corner = (f64, Vec<f64>);

#[derive(Clone, Debug)]
enum Wanted {
    Corners(Vec<Vec<f64>>),
    Reflected(Vec<f64>),
    Expanded { reflected: Corner, expanded: Vec<f64> },
    Contracted(Vec<f64>),
    Nothing,
}

/// A search from one point.
#[derive(Clone, Debug)]
pub struct Simplex {
    /// The best one first.
    corners: Vec<Corner>,
    wanted: Wanted,
    steps: usize,
}

impl Simplex {
    pub fn from(at: Vec<f64>) -> Self {
        let corner = |k: usize| {
            let mut corner = at.clone();
            corner[k] += if corner[k] + EDGE <= 1.0 { EDGE } else { -EDGE };
            corner
        };
        let corners = std::iter::once(at.clone()).chain((0..at.len()).map(corner)).collect();
        Self { corners: Vec::new(), wanted: Wanted::Corners(corners), steps: 0 }
    }

    /// Its best corner, and the cost there.
    pub fn best(&self) -> Option<(&[f64], f64)> {
        self.corners.first().map(|(cost, at)| (at.as_slice(), *cost))
    }

    /// Of all corners but the worst.
    fn centre(&self) -> Vec<f64> {
        let count = self.corners.len() - 1;
        let sum = |k: usize| self.corners[..count].iter().map(|(_, at)| at[k]).sum::<f64>();
        (0..count).map(|k| sum(k) / count as f64).collect()
    }

    /// From the centre to the worst corner by so much.
    fn along(&self, share: f64) -> Vec<f64> {
        let (_, worst) = &self.corners[self.corners.len() - 1];
        let point =
            |(centre, worst): (f64, &f64)| (centre + share * (worst - centre)).clamp(0.0, 1.0);
        self.centre().into_iter().zip(worst).map(point).collect()
    }

    fn replace_worst(&mut self, corner: Corner) {
        self.corners.pop();
        self.corners.push(corner);
        self.next();
    }

    fn next(&mut self) {
        self.steps += 1;
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (best, worst) = (&self.corners[0], &self.corners[self.corners.len() - 1]);
        let edge = |(_, at): &Corner| {
            at.iter().zip(&best.1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let size = self.corners.iter().map(edge).fold(0.0, f64::max);
        let alike = worst.0 - best.0 <= LEAST_GAIN * best.0.abs() && worst.0.is_finite();
        let ends = size < LEAST_EDGE || alike || self.steps > MOST_STEPS || !best.0.is_finite();
        self.wanted = if ends { Wanted::Nothing } else { Wanted::Reflected(self.along(REFLECTED)) };
    }

    fn shrink(&mut self) {
        let best = self.corners[0].1.clone();
        let towards = |(_, at): &Corner| {
            at.iter().zip(&best).map(|(a, b)| b + SHRUNK * (a - b)).collect::<Vec<f64>>()
        };
        let corners = self.corners[1..].iter().map(towards).collect();
        self.corners.truncate(1);
        self.wanted = Wanted::Corners(corners);
    }

    fn take_reflected(&mut self, at: Vec<f64>, cost: f64) {
        let second_worst = self.corners[self.corners.len() - 2].0;
        if cost < self.corners[0].0 {
            let expanded = self.along(EXPANDED);
            self.wanted = Wanted::Expanded { reflected: (cost, at), expanded };
        } else if cost < second_worst {
            self.replace_worst((cost, at));
        } else {
            let worst = self.corners[self.corners.len() - 1].0;
            let outside = self.along(-CONTRACTED);
            let contracted = if cost < worst { outside } else { self.along(CONTRACTED) };
            self.wanted = Wanted::Contracted(contracted);
        }
    }
}

impl Optimiser for Simplex {
    fn ask(&mut self) -> Vec<Question> {
        let points = match &self.wanted {
            Wanted::Corners(corners) => corners.clone(),
            Wanted::Reflected(at) | Wanted::Contracted(at) => vec![at.clone()],
            Wanted::Expanded { expanded, .. } => vec![expanded.clone()],
            Wanted::Nothing => Vec::new(),
        };
        points.into_iter().map(Question::cost).collect()
    }

    fn tell(&mut self, answers: &[Answer]) {
        let first = answers.first().map_or(f64::INFINITY, Answer::cost);
        match std::mem::replace(&mut self.wanted, Wanted::Nothing) {
            Wanted::Corners(corners) => {
                let costs = answers.iter().map(Answer::cost);
                self.corners.extend(costs.zip(corners));
                self.next();
            }
            Wanted::Reflected(at) => self.take_reflected(at, first),
            Wanted::Expanded { reflected, expanded } => {
                let better = first < reflected.0;
                self.replace_worst(if better { (first, expanded) } else { reflected });
            }
            Wanted::Contracted(at) => {
                if first < self.corners[self.corners.len() - 1].0 {
                    self.replace_worst((first, at));
                } else {
                    self.shrink();
                }
            }
            Wanted::Nothing => {}
        }
    }

    fn has_converged(&self) -> bool {
        matches!(self.wanted, Wanted::Nothing)
    }
}
