//! Multi-level single linkage (Rinnooy Kan and Timmer 1987): samples of the whole space, and a local
//! search from each sample that has no better one near.
//!
//! After k rounds of N samples a search begins at each of the best tenths, unless a better sample or a
//! minimum that is known lies within
//!
//! > r_k = π^(−1/2) (Γ(1 + n/2) ς ln(kN)/(kN))^(1/n),   ς = 2,
//!
//! so that with probability 1 every valley is searched, and few are searched twice. Samples follow
//! Sobol's sequence, scrambled (Burley 2020), which leaves smaller holes than random ones do (Kucherenko
//! and Sytsko 2005). Rounds end when a valley that is not known is unlikely (Boender and Rinnooy Kan
//! 1987): w(kN − 1)/(kN − w − 2) < w + ½ for w known ones, and the last round has found none.

use crate::ask::{Answer, Optimiser, Question};
use crate::local::{Descent, Simplex};

/// Samples of a round for each parameter, and at least.
const SAMPLES_EACH: usize = 8;
const FEWEST_SAMPLES: usize = 16;
/// Share of all samples from which searches begin.
const BEST_SHARE: f64 = 0.3;
/// ς, as NLopt takes it (Johnson, its MLSL): Rinnooy Kan and Timmer's 4 leaves valleys out for long.
const SIGMA: f64 = 2.0;
/// Two searches that end this near in the unit cube have found one minimum.
const SAME: f64 = 1e-3;
/// Searches of a round at most, the best samples first.
const MOST_SEARCHES: usize = 6;
/// Rounds at least. The rule that ends them counts searches, of which few begin in a round.
const FEWEST_ROUNDS: usize = 3;

#[derive(Clone, Debug)]
enum Search {
    Descent(Descent),
    Simplex(Simplex),
}

#[derive(Clone, Debug)]
struct Sample {
    cost: f64,
    at: Vec<f64>,
    /// Whether a search has begun there.
    searched: bool,
}

/// A search from many starts.
#[derive(Clone, Debug)]
pub struct MultiStart {
    start: Vec<f64>,
    has_residuals: bool,
    seed: u32,
    /// Samples of each round.
    round_samples: usize,
    rounds: usize,
    samples: Vec<Sample>,
    minima: Vec<(f64, Vec<f64>)>,
    /// Known when the round began.
    known: usize,
    asked: Vec<Vec<f64>>,
    searches: Vec<Search>,
    /// Questions of each search in the batch that was asked.
    shares: Vec<usize>,
    converged: bool,
}

impl MultiStart {
    /// `start` in the unit cube is the first sample. `has_residuals`: as the objective says.
    pub fn new(start: Vec<f64>, has_residuals: bool, seed: u64) -> Self {
        let round_samples = (SAMPLES_EACH * start.len()).max(FEWEST_SAMPLES);
        Self {
            start,
            has_residuals,
            seed: (seed ^ (seed >> 32)) as u32,
            round_samples,
            rounds: 0,
            samples: Vec::new(),
            minima: Vec::new(),
            known: 0,
            asked: Vec::new(),
            searches: Vec::new(),
            shares: Vec::new(),
            converged: false,
        }
    }

    /// Costs and places of the minima that were found, the best one first.
    pub fn minima(&self) -> &[(f64, Vec<f64>)] {
        &self.minima
    }

    fn sample(&mut self) -> Vec<Question> {
        let from = (self.rounds * self.round_samples) as u32;
        let point = |index: u32| -> Vec<f64> {
            (0..self.start.len() as u32)
                .map(|axis| f64::from(sobol_burley::sample(index, axis, self.seed)))
                .collect()
        };
        self.asked = (from..from + self.round_samples as u32).map(point).collect();
        if self.rounds == 0 {
            self.asked[0].clone_from(&self.start);
        }
        self.asked.iter().cloned().map(Question::cost).collect()
    }

    fn take_samples(&mut self, answers: &[Answer]) {
        let asked = std::mem::take(&mut self.asked);
        let sample =
            |(answer, at): (&Answer, _)| Sample { cost: answer.cost(), at, searched: false };
        self.samples.extend(answers.iter().zip(asked).map(sample));
        self.samples.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        self.rounds += 1;
        let reach = self.reach();
        let best = (BEST_SHARE * self.samples.len() as f64).ceil() as usize;
        let near = |a: &[f64], b: &[f64]| distance(a, b) < reach;
        for k in 0..best {
            let (better, own) = (&self.samples[..k], &self.samples[k]);
            let is_linked = better.iter().any(|other| near(&other.at, &own.at))
                || self.minima.iter().any(|(_, at)| near(at, &own.at));
            if own.searched || is_linked || !own.cost.is_finite() {
                continue;
            }
            let at = own.at.clone();
            self.samples[k].searched = true;
            self.searches.push(match self.has_residuals {
                true => Search::Descent(Descent::from(at)),
                false => Search::Simplex(Simplex::from(at)),
            });
            if self.searches.len() == MOST_SEARCHES {
                break;
            }
        }
        if self.searches.is_empty() {
            self.end_round();
        }
    }

    /// r_k.
    fn reach(&self) -> f64 {
        let (n, count) = (self.start.len() as f64, self.samples.len() as f64);
        let volume = gamma_half(self.start.len() + 2) * SIGMA * count.ln() / count;
        volume.powf(1.0 / n) / std::f64::consts::PI.sqrt()
    }

    fn take_searches(&mut self, answers: &[Answer]) {
        let mut rest = answers;
        let shares = std::mem::take(&mut self.shares);
        for (search, share) in self.searches.iter_mut().zip(shares) {
            let (own, others) = rest.split_at(share);
            rest = others;
            match search {
                Search::Descent(own_search) => own_search.tell(own),
                Search::Simplex(own_search) => own_search.tell(own),
            }
        }
        for search in std::mem::take(&mut self.searches) {
            let (has_converged, found) = match &search {
                Search::Descent(own) => (own.has_converged(), Some(own.best())),
                Search::Simplex(own) => (own.has_converged(), own.best()),
            };
            match (has_converged, found) {
                (false, _) => self.searches.push(search),
                (true, Some((at, cost))) => add(&mut self.minima, cost, at),
                (true, None) => {}
            }
        }
        if self.searches.is_empty() {
            self.end_round();
        }
    }

    fn end_round(&mut self) {
        let (w, count) = (self.minima.len() as f64, self.samples.len() as f64);
        let expected = w * (count - 1.0) / (count - w - 2.0);
        let is_known = w > 0.0 && count > w + 2.0 && expected < w + 0.5;
        let is_new = self.minima.len() > self.known;
        self.converged = is_known && !is_new && self.rounds >= FEWEST_ROUNDS;
        self.known = self.minima.len();
    }
}

fn add(minima: &mut Vec<(f64, Vec<f64>)>, cost: f64, at: &[f64]) {
    let is_new = minima.iter().all(|(_, known)| distance(known, at) > SAME);
    if cost.is_finite() && is_new {
        minima.push((cost, at.to_vec()));
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Γ(k/2).
fn gamma_half(k: usize) -> f64 {
    match k {
        0 | 1 => std::f64::consts::PI.sqrt(),
        2 => 1.0,
        k => (k as f64 / 2.0 - 1.0) * gamma_half(k - 2),
    }
}

impl Optimiser for MultiStart {
    fn ask(&mut self) -> Vec<Question> {
        if self.converged {
            return Vec::new();
        }
        if self.searches.is_empty() {
            return self.sample();
        }
        let asked: Vec<Vec<Question>> = self
            .searches
            .iter_mut()
            .map(|search| match search {
                Search::Descent(own) => own.ask(),
                Search::Simplex(own) => own.ask(),
            })
            .collect();
        self.shares = asked.iter().map(Vec::len).collect();
        asked.into_iter().flatten().collect()
    }

    fn tell(&mut self, answers: &[Answer]) {
        match self.searches.is_empty() {
            true => self.take_samples(answers),
            false => self.take_searches(answers),
        }
    }

    fn has_converged(&self) -> bool {
        self.converged
    }
}

#[cfg(test)]
mod tests {
    use super::gamma_half;

    #[test]
    fn gamma_of_halves_is_known() {
        let root = std::f64::consts::PI.sqrt();
        for (k, known) in
            [(1, root), (2, 1.0), (3, root / 2.0), (4, 1.0), (5, 0.75 * root), (8, 6.0)]
        {
            assert!((gamma_half(k) - known).abs() < 1e-12, "{k}");
        }
    }
}
