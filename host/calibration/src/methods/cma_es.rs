//! Evolution strategy with covariance matrix adaptation (Hansen 2016, "The CMA evolution strategy: a
//! tutorial", arXiv 1604.00772), restarted with twice as many agents where it has come to an end
//! (Auger and Hansen 2005).
//!
//! Bounds: a point outside the unit cube is mirrored into it, and counts as the mirrored one.

use nalgebra::{DMatrix, DVector};

use crate::ask::{Answer, Optimiser, Question};
use crate::methods::draw::Draw;

/// First step in the unit cube, for a minimum anywhere in it.
const FIRST_SIGMA: f64 = 0.3;
/// A distribution this narrow, or this many generations without a gain of this share, ends a run.
const LEAST_SD: f64 = 1e-6;
const IDLE_GENERATIONS: usize = 20;
const LEAST_GAIN: f64 = 1e-8;

type Found = (f64, Vec<f64>);

/// A search that learns the shape of the valley.
#[derive(Clone, Debug)]
pub struct CmaEs {
    start: Vec<f64>,
    seed: u64,
    restarts: usize,
    /// Of all runs.
    generation: usize,
    runs: usize,
    run: Run,
    asked: Vec<Vec<f64>>,
    converged: bool,
}

/// One run until it has come to an end.
#[derive(Clone, Debug)]
struct Run {
    agents: usize,
    weights: Vec<f64>,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    path: DVector<f64>,
    sigma_path: DVector<f64>,
    generation: usize,
    /// Best costs, one a generation.
    history: Vec<f64>,
}

impl CmaEs {
    /// `start` in the unit cube; `restarts` with twice as many agents each.
    pub fn new(start: Vec<f64>, restarts: usize, seed: u64) -> Self {
        let run = Run::new(&start, usual_agents(start.len()));
        let (generation, runs, asked, converged) = (0, 0, Vec::new(), false);
        Self { start, seed, restarts, generation, runs, run, asked, converged }
    }
}

fn usual_agents(count: usize) -> usize {
    4 + (3.0 * (count as f64).ln()).floor() as usize
}

impl Run {
    fn new(mean: &[f64], agents: usize) -> Self {
        let n = mean.len();
        let half = agents / 2;
        let raw = |k: usize| ((agents as f64 + 1.0) / 2.0).ln() - (k as f64 + 1.0).ln();
        let sum: f64 = (0..half).map(raw).sum();
        Self {
            agents,
            weights: (0..half).map(|k| raw(k) / sum).collect(),
            mean: DVector::from_column_slice(mean),
            sigma: FIRST_SIGMA,
            covariance: DMatrix::identity(n, n),
            path: DVector::zeros(n),
            sigma_path: DVector::zeros(n),
            generation: 0,
            history: Vec::new(),
        }
    }

    /// Axes and lengths of the distribution, C = B D² Bᵀ.
    fn axes(&self) -> (DMatrix<f64>, DVector<f64>) {
        let eigen = self.covariance.clone().symmetric_eigen();
        (eigen.eigenvectors, eigen.eigenvalues.map(|own| own.max(1e-30).sqrt()))
    }

    fn agent(&self, axes: &(DMatrix<f64>, DVector<f64>), draw: &mut Draw) -> Vec<f64> {
        let normal = DVector::from_fn(self.mean.len(), |_, _| draw.normal());
        let step = &axes.0 * normal.component_mul(&axes.1) * self.sigma;
        (&self.mean + step).iter().map(|u| mirrored(*u)).collect()
    }

    /// Equations (38) to (47) of the tutorial with its default constants, table 1, without negative
    /// weights.
    fn update(&mut self, best: &[Found]) {
        let n = self.mean.len() as f64;
        let mu_eff = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let damping = 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_c = (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let c_mu = 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff);
        let c_mu = c_mu.min(1.0 - c_1);
        let normal_length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

        let (axes, lengths) = self.axes();
        let steps: Vec<DVector<f64>> = best
            .iter()
            .map(|(_, at)| (DVector::from_column_slice(at) - &self.mean) / self.sigma)
            .collect();
        let weighted = self.weights.iter().zip(&steps);
        let step = weighted.fold(DVector::zeros(self.mean.len()), |sum, (w, own)| sum + own * *w);
        self.mean += &step * self.sigma;

        let whitened = &axes * axes.tr_mul(&step).component_div(&lengths);
        let keep = (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        self.sigma_path = &self.sigma_path * (1.0 - c_sigma) + whitened * keep;
        self.generation += 1;
        let faded = 1.0 - (1.0 - c_sigma).powi(2 * self.generation as i32);
        let length = self.sigma_path.norm();
        let is_short = length / faded.sqrt() < (1.4 + 2.0 / (n + 1.0)) * normal_length;
        let h = if is_short { 1.0 } else { 0.0 };
        let keep = h * (c_c * (2.0 - c_c) * mu_eff).sqrt();
        self.path = &self.path * (1.0 - c_c) + &step * keep;

        let kept = 1.0 - c_1 - c_mu + (1.0 - h) * c_1 * c_c * (2.0 - c_c);
        let mut covariance = &self.covariance * kept + &self.path * self.path.transpose() * c_1;
        for (w, own) in self.weights.iter().zip(&steps) {
            covariance += own * own.transpose() * (c_mu * w);
        }
        self.covariance = (&covariance + covariance.transpose()) * 0.5;
        self.sigma *= ((c_sigma / damping) * (length / normal_length - 1.0)).exp();
        // No wider than the cube, in which it would only be mirrored.
        self.sigma = self.sigma.min(1.0);
    }

    fn has_ended(&self) -> bool {
        let widest = self.covariance.diagonal().max().max(0.0).sqrt();
        let idle = self.history.len() > IDLE_GENERATIONS && {
            let (old, recent) = self.history.split_at(self.history.len() - IDLE_GENERATIONS);
            let least = |costs: &[f64]| costs.iter().copied().fold(f64::INFINITY, f64::min);
            let (before, now) = (least(old), least(recent));
            before.is_finite() && before - now <= LEAST_GAIN * before.abs()
        };
        self.sigma * widest < LEAST_SD || idle
    }
}

/// Mirrored at the sides of the unit cube.
fn mirrored(u: f64) -> f64 {
    let folded = u.rem_euclid(2.0);
    if folded <= 1.0 { folded } else { 2.0 - folded }
}

impl Optimiser for CmaEs {
    fn ask(&mut self) -> Vec<Question> {
        if self.converged {
            return Vec::new();
        }
        let mut draw = Draw::of(self.seed, self.generation);
        let axes = self.run.axes();
        self.asked = (0..self.run.agents).map(|_| self.run.agent(&axes, &mut draw)).collect();
        // The start itself is one of the first.
        if self.generation == 0 {
            self.asked[0].clone_from(&self.start);
        }
        self.asked.iter().cloned().map(Question::cost).collect()
    }

    fn tell(&mut self, answers: &[Answer]) {
        self.generation += 1;
        let asked = std::mem::take(&mut self.asked);
        let mut found: Vec<Found> = answers.iter().map(Answer::cost).zip(asked).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.run.history.push(found.first().map_or(f64::INFINITY, |(cost, _)| *cost));
        found.truncate(self.run.weights.len());
        if found.len() == self.run.weights.len() && found.iter().all(|(cost, _)| cost.is_finite()) {
            self.run.update(&found);
        } else {
            // Nearer to the middle more can be computed.
            self.run.sigma *= 0.7;
        }
        if self.run.has_ended() {
            self.converged = self.runs >= self.restarts;
            self.runs += 1;
            let mut draw = Draw::of(self.seed ^ 0x5EED, self.generation);
            let mean: Vec<f64> = self.start.iter().map(|_| draw.uniform()).collect();
            self.run = Run::new(&mean, 2 * self.run.agents);
        }
    }

    fn has_converged(&self) -> bool {
        self.converged
    }
}

#[cfg(test)]
mod tests {
    use super::mirrored;

    #[test]
    fn what_leaves_the_cube_comes_back_on_the_same_side() {
        for (u, inside) in [(0.3, 0.3), (-0.2, 0.2), (1.25, 0.75), (2.5, 0.5), (1.0, 1.0)] {
            assert!((mirrored(u) - inside).abs() < 1e-12, "{u}");
        }
    }
}
