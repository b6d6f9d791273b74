//! One effect more on top of the best model.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::criteria::{by_cost, pays};
use crate::fit::{Depth, Fit, Start};
use crate::select::{Rival, Selection, Selector, Step};

/// Candidates that are refitted in every round.
const REFITTED_MORE: usize = 3;

impl Selector<'_> {
    /// Adds the effect that helps most, if it pays.
    pub fn extend(&self, selection: &mut Selection) -> bool {
        let base = &selection.best;
        let Some(nuisances) = self.nuisances_at(&base.fit) else { return false };
        let mut screened: Vec<(f64, usize)> = (0..self.problem.plant.effects().len())
            .into_par_iter()
            .filter(|effect| !base.fit.effects.contains(effect))
            .filter_map(|effect| Some((self.promise(selection, effect)?, effect)))
            .collect();
        screened.sort_by(|a, b| b.0.total_cmp(&a.0));
        screened.truncate(REFITTED_MORE);
        let fitted = |(_, effect): (f64, usize)| {
            let mut effects = base.fit.effects.clone();
            effects.push(effect);
            let start = Start::Fit(&base.fit);
            let candidate = self.candidate(Depth::Whole, &nuisances, start, &effects, Some(effect));
            Some((effect, candidate.filter(|c| !c.fit.failed)?))
        };
        let mut refitted: Vec<_> = screened.into_par_iter().filter_map(fitted).collect();
        // What acts on the plant comes before what acts on its sensors.
        refitted.sort_by_key(|(effect, _)| *effect);
        by_cost(
            self.problem.plant,
            selection.nominal.score.excess(),
            &mut refitted,
            |(_, candidate)| candidate,
        );
        let Some((effect, best)) = refitted.first() else { return false };
        if !pays(
            selection.nominal.score.excess(),
            &base.score,
            &best.score,
            self.parameters(*effect),
        ) {
            return false;
        }
        let rivals = refitted[1..].iter().map(|(e, c)| Rival::of(*e, c)).collect();
        let (effect, best) = (*effect, best.clone());
        let step = Step::of(effect, &best, rivals);
        self.accept(selection, best, step);
        true
    }

    /// How much of the residual an effect explains to first order, on top of the best model.
    fn promise(&self, selection: &Selection, effect: usize) -> Option<f64> {
        let base = &selection.best.fit;
        let columns = self.effect_on(selection, effect)?;
        let (mut normal, mut cross) = (base_normal(base), DVector::zeros(base.coordinates.len()));
        let (mut own, mut slope) = (0.0, 0.0);
        for (trial, column) in base.trials.iter().zip(&columns) {
            let column = trial.refit.project_column(column);
            own += column.norm_squared();
            slope += column.dot(&trial.refit.residual);
            cross += trial.jacobian.tr_mul(&column);
        }
        // What the parameters that are on already cannot do themselves.
        for i in 0..normal.nrows() {
            normal[(i, i)] *= 1.0 + 1e-9;
        }
        let explained = normal.cholesky().map_or(0.0, |c| cross.dot(&c.solve(&cross)));
        let left = own - explained;
        (left > 1e-9 * own).then(|| slope * slope / left)
    }

    /// What an effect does to the residuals of the best model, at the size that it shows alone.
    fn effect_on(&self, selection: &Selection, effect: usize) -> Option<Vec<DVector<f64>>> {
        let shown = selection.shown[effect].as_ref()?;
        let base = &selection.best.fit;
        let mut point = base.point.clone();
        point.effects[effect].clone_from(&shown.point.effects[effect]);
        let on = self.problem.residuals(&point)?;
        Some(on.iter().zip(&base.trials).map(|(on, off)| on - &off.raw).collect())
    }
}

fn base_normal(base: &Fit) -> DMatrix<f64> {
    let k = base.coordinates.len();
    base.trials
        .iter()
        .fold(DMatrix::zeros(k, k), |sum, trial| sum + trial.jacobian.tr_mul(&trial.jacobian))
}
