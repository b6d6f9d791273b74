//! The cross-entropy method for continuous minimisation (Rubinstein and Kroese 2004, chapter 5).
//!
//! Agents are drawn from independent normal distributions within the bounds, whose means and standard
//! deviations follow the best of them, smoothed:
//!
//! > μ ← α mean(best) + (1 − α) μ,   σ ← α sd(best) + (1 − α) σ
//!
//! Some agents only explore: they are drawn anywhere within the bounds, and count if they are among the
//! best. The best point so far is always among the best, so that a few agents lose nothing.

use crate::ask::{Answer, Optimiser, Question};
use crate::methods::draw::Draw;

/// α. Larger ones end a search with few agents before it has looked around.
const SMOOTHING: f64 = 0.7;
/// Share of the agents that count as the best.
const BEST_SHARE: f64 = 0.3;
/// Standard deviation of the first generation in the unit cube: nearly uniform.
const FIRST_SD: f64 = 0.5;

type Found = (f64, Vec<f64>);

/// A search by agents.
#[derive(Clone, Debug)]
pub struct CrossEntropy {
    agents: usize,
    explorers: usize,
    /// By coordinate, the standard deviation in the unit cube below which it has converged.
    converged_sd: Vec<f64>,
    seed: u64,
    generation: usize,
    mean: Vec<f64>,
    sd: Vec<f64>,
    best: Option<Found>,
    asked: Vec<Vec<f64>>,
}

impl CrossEntropy {
    /// `explorers` of the `agents` are drawn anywhere. At least two agents must not be.
    pub fn new(agents: usize, explorers: usize, converged_sd: Vec<f64>, seed: u64) -> Self {
        let count = converged_sd.len();
        Self {
            agents: agents.max(explorers + 2),
            explorers,
            converged_sd,
            seed,
            generation: 0,
            mean: vec![0.5; count],
            sd: vec![FIRST_SD; count],
            best: None,
            asked: Vec::new(),
        }
    }

    /// Beginning around a point of the unit cube, in place of its middle.
    pub fn around(self, mean: Vec<f64>) -> Self {
        Self { mean, ..self }
    }

    /// Means and standard deviations in the unit cube.
    pub fn distribution(&self) -> (&[f64], &[f64]) {
        (&self.mean, &self.sd)
    }

    /// Generations that were told.
    pub fn generations(&self) -> usize {
        self.generation
    }

    fn update(&mut self, best: &[Found]) {
        let count = best.len() as f64;
        for k in 0..self.mean.len() {
            let mean = best.iter().map(|(_, at)| at[k]).sum::<f64>() / count;
            let squares = best.iter().map(|(_, at)| (at[k] - mean).powi(2)).sum::<f64>();
            let sd = (squares / (count - 1.0).max(1.0)).sqrt();
            self.mean[k] += SMOOTHING * (mean - self.mean[k]);
            self.sd[k] += SMOOTHING * (sd - self.sd[k]);
        }
    }
}

impl Optimiser for CrossEntropy {
    fn ask(&mut self) -> Vec<Question> {
        if self.has_converged() {
            return Vec::new();
        }
        let mut draw = Draw::of(self.seed, self.generation);
        let (mean, sd) = (&self.mean, &self.sd);
        let mut agent = |explores: bool| -> Vec<f64> {
            let coordinate = |(mean, sd): (&f64, &f64)| match explores {
                true => draw.uniform(),
                false => draw.within(*mean, *sd),
            };
            mean.iter().zip(sd).map(coordinate).collect()
        };
        self.asked = (0..self.agents).map(|k| agent(k >= self.agents - self.explorers)).collect();
        self.asked.iter().cloned().map(Question::cost).collect()
    }

    fn tell(&mut self, answers: &[Answer]) {
        self.generation += 1;
        let asked = std::mem::take(&mut self.asked);
        let found = answers.iter().map(Answer::cost).zip(asked).chain(self.best.take());
        let mut found: Vec<Found> = found.filter(|(cost, _)| cost.is_finite()).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(((BEST_SHARE * self.agents as f64).round() as usize).max(2));
        self.best = found.first().cloned();
        if found.len() > 1 {
            self.update(&found);
        }
    }

    fn has_converged(&self) -> bool {
        self.sd.iter().zip(&self.converged_sd).all(|(sd, enough)| sd < enough)
    }
}
