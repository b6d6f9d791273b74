//! How probable the amplitudes and the sets of effects are by their prior.

use super::discrepancy::{Cell, Evidence, Size};
use crate::rules::{LogNormal, Prior};

impl Prior {
    /// ln p(set, data) and the same where a cause is outside the library, but for a constant.
    ///
    /// See docs/explanation/diagnosis.md (D12).
    pub fn log_posteriors(&self, evidence: &Evidence, effects: usize) -> [f64; 2] {
        let best = |of_kappa: &dyn Fn(f64) -> f64| {
            let cells = evidence.cells.iter();
            let cells = cells.map(|own| self.of_data(evidence, own) + of_kappa(own.kappa));
            cells.fold(f64::NEG_INFINITY, f64::max) + self.of_effect * effects as f64
        };
        let mine = match evidence.is_beyond_stated {
            true => f64::NEG_INFINITY,
            false => best(&|kappa| self.of_mine(kappa)),
        };
        [mine, best(&|kappa| self.of_a_cause_outside(kappa))]
    }

    /// The most probable amplitudes where all causes are in the library.
    pub fn best_without_others(&self, evidence: &Evidence) -> Option<Cell> {
        let of = |own: &&Cell| self.of_data(evidence, own) + self.of_mine(own.kappa);
        evidence.cells.iter().max_by(|a, b| of(a).total_cmp(&of(b))).cloned()
    }

    /// The most probable amplitudes, whatever the causes.
    pub fn best(&self, evidence: &Evidence) -> Option<Cell> {
        let of = |own: &&Cell| {
            let of_kappa = self.of_mine(own.kappa).max(self.of_a_cause_outside(own.kappa));
            self.of_data(evidence, own) + of_kappa
        };
        evidence.cells.iter().max_by(|a, b| of(a).total_cmp(&of(b))).cloned()
    }

    /// A sum over trials, in which each counts as the independent observations that it has.
    ///
    /// `of_trials`: ln p of each trial, or a difference of two.
    pub fn tempered(&self, of_trials: &[f64], size: &Size) -> f64 {
        of_trials.iter().zip(&size.bins).map(|(own, n)| own * self.temper_of(*n, size)).sum()
    }

    /// The mean temper of all bins.
    pub fn mean_temper(&self, size: &Size) -> f64 {
        let counted: f64 = size.bins.iter().map(|n| *n as f64 * self.temper_of(*n, size)).sum();
        counted / size.bins.iter().sum::<usize>() as f64
    }

    /// What each bin counts in a trial of that many.
    fn temper_of(&self, bins: usize, size: &Size) -> f64 {
        let least = self.of_channel * size.channels as f64 / bins as f64;
        least.max(self.temper).min(1.0)
    }

    fn of_data(&self, evidence: &Evidence, cell: &Cell) -> f64 {
        self.tempered(&cell.log_densities, &evidence.size)
    }

    fn of_mine(&self, kappa: f64) -> f64 {
        at_most(kappa, self.kappa)
    }

    fn of_a_cause_outside(&self, kappa: f64) -> f64 {
        about(kappa, self.kappa_with_others) + self.of_others
    }
}

/// ln p of a size that is about its median, but for a constant that is the same for all priors.
fn about(x: f64, (median, sd): LogNormal) -> f64 {
    -0.5 * ((x / median).ln() / sd).powi(2) - sd.ln()
}

/// The same of a size that is rarely larger than its median, and may be as small as it likes.
fn at_most(x: f64, (median, sd): LogNormal) -> f64 {
    about(x.max(median), (median, sd))
}

#[cfg(test)]
mod tests {
    use super::{Prior, Size};
    use crate::rules::Rules;

    #[test]
    fn what_is_small_costs_nothing_and_what_is_large_points_outside() {
        let own = Rules::USED.prior;
        assert_eq!(own.of_mine(0.005), own.of_mine(own.kappa.0));
        assert!(own.of_mine(0.05) > own.of_a_cause_outside(0.05) + 3.0);
        assert!(own.of_a_cause_outside(0.64) > own.of_mine(0.64) + 3.0);
    }

    #[test]
    fn a_short_trial_tells_something_of_every_channel_and_a_few_bins_are_no_more_than_they_are() {
        let own = Prior { of_channel: 2.0, temper: 0.05, ..Rules::USED.prior };
        let size = Size { bins: vec![4, 40, 400], channels: 3 };
        assert!((own.tempered(&[-4.0, -40.0, -400.0], &size) + 30.0).abs() < 1e-12);
        assert!((own.mean_temper(&size) - 30.0 / 444.0).abs() < 1e-12);
    }
}
