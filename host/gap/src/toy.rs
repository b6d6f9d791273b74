//! A plant for tests: one trial, one channel, and a prediction that is a formula.

use crate::plant::{
    Channel, Effect, Nuisance, Parameter, Plant, Point, Quantity, Repeat, Sample, Swing, Trial,
};

/// Built with [`Toy::new`] and filled in by the test.
pub struct Toy<F> {
    pub effects: Vec<Effect>,
    pub nuisances: Vec<Nuisance>,
    pub swing: Option<Swing>,
    channels: Vec<Channel>,
    regimes: Vec<String>,
    trials: Vec<Trial>,
    predict: F,
}

impl<F: Fn(usize, &Point) -> f64> Toy<F> {
    /// Samples in steps of `step_s`, measured to within `noise`; `predict` has the index of one.
    pub fn new(
        step_s: f64,
        noise: f64,
        measured: impl IntoIterator<Item = f64>,
        predict: F,
    ) -> Self {
        let sample = |(i, value): (usize, f64)| Sample {
            t_s: step_s * i as f64,
            channel: 0,
            value,
            noise,
            model: 0.0,
            phase: 0,
            regime: 0,
            arc_m: 0.0,
            speed_m_per_s: 0.0,
            block: 0,
        };
        let samples = measured.into_iter().enumerate().map(sample).collect();
        Self {
            effects: Vec::new(),
            nuisances: Vec::new(),
            swing: None,
            channels: vec![Channel { name: "fx_N".into(), quantity: Quantity::Force }],
            regimes: vec!["standing".into()],
            trials: vec![Trial { number: 0, samples, blocks: 1 }],
            predict,
        }
    }
}

/// An effect by its parameters and the values that fits start from.
pub fn effect(id: &'static str, parameters: Vec<Parameter>, starts: Vec<Vec<f64>>) -> Effect {
    Effect { id, what: "", parameters, starts, confused_with: &[] }
}

impl<F: Fn(usize, &Point) -> f64 + Sync> Plant for Toy<F> {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn phases(&self) -> &[&'static str] {
        &["free"]
    }

    fn regimes(&self) -> &[String] {
        &self.regimes
    }

    fn trials(&self) -> &[Trial] {
        &self.trials
    }

    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn nuisances(&self) -> &[Nuisance] {
        &self.nuisances
    }

    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>> {
        let samples = 0..self.trials[trial].samples.len();
        Some(samples.map(|i| (self.predict)(i, point)).collect())
    }

    fn cheap(&self) -> bool {
        true
    }

    fn swing(&self, _effect: usize) -> Option<Swing> {
        self.swing.clone()
    }

    fn repeats(&self) -> &[Repeat] {
        &[]
    }

    fn remarks(&self) -> &[String] {
        &[]
    }

    fn compared(&self) -> &'static str {
        ""
    }
}
