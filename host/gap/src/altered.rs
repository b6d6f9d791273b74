//! A plant that differs from another in what is known of it: effects that its model already has,
//! or trials that nobody has seen.

use crate::plant::{
    Channel, Effect, Impostor, Nuisance, Plant, Point, Repeat, Segment, Swing, Trial,
};
use crate::silhouette::Silhouette;

/// Another plant with other effects or fewer trials; everything else is the other's.
pub struct Altered<'a> {
    inner: &'a dyn Plant,
    effects: Vec<Effect>,
    trials: usize,
    repeats: Vec<Repeat>,
}

impl<'a> Altered<'a> {
    /// With effects that are there from the start: what was diagnosed before, or validated
    /// otherwise. What is left to diagnose is everything else, and any change of those.
    ///
    /// `present`: identifiers with the values of all their parameters; others stay off.
    pub fn assuming(inner: &'a dyn Plant, present: &[(&str, &[f64])]) -> Self {
        let mut altered = Self::first_trials(inner, inner.trials().len());
        for effect in &mut altered.effects {
            if let Some((_, values)) = present.iter().find(|(id, _)| *id == effect.id) {
                for (parameter, value) in effect.parameters.iter_mut().zip(*values) {
                    parameter.off = *value;
                }
            }
        }
        altered
    }

    /// Without its last trials. `trials`: how many are left, from the first one on.
    pub fn first_trials(inner: &'a dyn Plant, trials: usize) -> Self {
        let left = |repeat: &&Repeat| repeat.first.0 < trials && repeat.second.0 < trials;
        let repeats = inner.repeats().iter().filter(left).cloned().collect();
        let effects = inner.effects().to_vec();
        Self { inner, effects, trials: trials.min(inner.trials().len()), repeats }
    }
}

impl Plant for Altered<'_> {
    fn channels(&self) -> &[Channel] {
        self.inner.channels()
    }

    fn phases(&self) -> &[&'static str] {
        self.inner.phases()
    }

    fn regimes(&self) -> &[String] {
        self.inner.regimes()
    }

    fn trials(&self) -> &[Trial] {
        &self.inner.trials()[..self.trials]
    }

    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn nuisances(&self) -> &[Nuisance] {
        self.inner.nuisances()
    }

    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>> {
        self.inner.simulate(trial, point)
    }

    fn along(&self, trial: usize, channel: usize) -> f64 {
        self.inner.along(trial, channel)
    }

    fn vessel(&self) -> Option<Silhouette> {
        self.inner.vessel()
    }

    fn places_m(&self, trial: usize) -> Vec<[f64; 3]> {
        self.inner.places_m(trial)
    }

    fn ways(&self) -> usize {
        self.inner.ways()
    }

    fn cheap(&self) -> bool {
        self.inner.cheap()
    }

    fn far_off(&self) -> f64 {
        self.inner.far_off()
    }

    fn swing(&self, effect: usize) -> Option<Swing> {
        self.inner.swing(effect)
    }

    fn impostor(&self, effect: usize) -> Option<Impostor> {
        self.inner.impostor(effect)
    }

    fn repeats(&self) -> &[Repeat] {
        &self.repeats
    }

    fn segments(&self) -> &[Segment] {
        self.inner.segments()
    }

    fn simulate_segment(&self, segment: usize, point: &Point) -> Option<Vec<f64>> {
        self.inner.simulate_segment(segment, point)
    }

    fn complaint(&self) -> Option<&str> {
        self.inner.complaint()
    }

    fn hidden(&self, floor_n: f64, measured_n: f64) -> Option<String> {
        self.inner.hidden(floor_n, measured_n)
    }

    fn remarks(&self) -> &[String] {
        self.inner.remarks()
    }

    fn compared(&self) -> &'static str {
        self.inner.compared()
    }
}
