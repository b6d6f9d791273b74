//! Every effect alone: the first sets of the search, and what each effect does.

use nalgebra::DVector;

use crate::fitting::fit::{Depth, Start};
use crate::fitting::nuisance::Nuisances;
use crate::parallel::{each, each_some};
use crate::scoring::candidate::Candidate;
use crate::searching::selector::Selector;

/// What one effect does to the nominal model.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Change of the raw residuals, by trial.
    pub does: Vec<DVector<f64>>,
}

impl Selector<'_> {
    /// Every single effect: a glance at all, then the whole fit of those that may win.
    pub fn singles(&self, nominal: &Candidate, nuisances: &Nuisances) -> Vec<Option<Candidate>> {
        let effects = self.problem.plant.effects().len();
        let glance = |effect: usize| {
            if self.problem.is_cut() {
                return None;
            }
            let start = Start::Fit(&nominal.fit);
            self.candidate(Depth::Glance, nuisances, start, &[effect], Some(effect))
        };
        let mut tried: Vec<Option<Candidate>> = each(0..effects, glance);
        if self.problem.plant.cheap() {
            // A glance was the whole fit.
            return tried;
        }
        let mut losses: Vec<(f64, usize)> = tried
            .iter()
            .enumerate()
            .filter_map(|(effect, c)| Some((c.as_ref()?.fit.loss, effect)))
            .collect();
        losses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rules = &self.problem.rules.search;
        let closed = |loss: f64| nominal.fit.loss - loss;
        let enough = losses.first().map_or(0.0, |(loss, _)| rules.fitted_within * closed(*loss));
        let near = losses.iter().take_while(|(loss, _)| closed(*loss) >= enough).count();
        losses.truncate(near.clamp(rules.fewest_singles, rules.fitted_singles));
        let first = losses.into_iter().map(|(_, effect)| effect);
        let refined: Vec<(usize, Option<Candidate>)> = each_some(first, |effect| {
            let from = Start::Fit(&tried[effect].as_ref()?.fit);
            if self.problem.is_cut() {
                return None;
            }
            let whole = self.candidate(Depth::Whole, nuisances, from, &[effect], None);
            Some((effect, whole))
        });
        for (effect, candidate) in refined {
            if let (Some(mut whole), Some(glance)) = (candidate, &tried[effect]) {
                whole.fit.tried.clone_from(&glance.fit.tried);
                tried[effect] = Some(whole);
            }
        }
        tried
    }

    /// Where each single effect shows what it does: where it was fitted to alone, or, of one that
    /// helps nothing alone, the switch-on value that promised most.
    pub fn shown(&self, nominal: &Candidate, singles: &[Option<Candidate>]) -> Vec<Option<Shown>> {
        let shown = |single: &Option<Candidate>| {
            let fit = &single.as_ref()?.fit;
            let own = |raw: Vec<DVector<f64>>| {
                let pairs = raw.iter().zip(&nominal.fit.trials);
                let does = pairs.map(|(on, off)| on - &off.raw).collect();
                Some(Shown { does })
            };
            if fit.point != nominal.fit.point {
                return own(fit.trials.iter().map(|trial| trial.raw.clone()).collect());
            }
            let tried = fit.tried.as_ref()?;
            own(self.problem.residuals(tried)?)
        };
        each(singles, shown)
    }
}
