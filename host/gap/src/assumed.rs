//! A plant whose model already has some effects: what was diagnosed before, or validated
//! otherwise. What is left to diagnose is everything else, and any change of those.

use crate::plant::{Channel, Effect, Nuisance, Plant, Point, Repeat, Segment, Trial};

/// Another plant with effects that are there from the start.
pub struct Assumed<'a> {
    inner: &'a dyn Plant,
    effects: Vec<Effect>,
}

impl<'a> Assumed<'a> {
    /// `present`: identifiers with the values of all their parameters; others stay off.
    pub fn new(inner: &'a dyn Plant, present: &[(&str, &[f64])]) -> Self {
        let mut effects = inner.effects().to_vec();
        for effect in &mut effects {
            if let Some((_, values)) = present.iter().find(|(id, _)| *id == effect.id) {
                for (parameter, value) in effect.parameters.iter_mut().zip(*values) {
                    parameter.off = *value;
                }
            }
        }
        Self { inner, effects }
    }
}

impl Plant for Assumed<'_> {
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
        self.inner.trials()
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

    fn cheap(&self) -> bool {
        self.inner.cheap()
    }

    fn repeats(&self) -> &[Repeat] {
        self.inner.repeats()
    }

    fn segments(&self) -> &[Segment] {
        self.inner.segments()
    }

    fn simulate_segment(&self, segment: usize, point: &Point) -> Option<Vec<f64>> {
        self.inner.simulate_segment(segment, point)
    }

    fn remarks(&self) -> &[String] {
        self.inner.remarks()
    }

    fn compared(&self) -> &'static str {
        self.inner.compared()
    }
}
