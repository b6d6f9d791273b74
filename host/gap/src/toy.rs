//! A plant for tests: one channel, one or several equal trials, and a prediction given by a formula.

use cathforce_recording::snap::Snap;

use crate::fitting::problem::Problem;
use crate::noise::floor::Floor;
use crate::plant::Silhouette;
use crate::plant::{
    Channel, Effect, Impostor, Nuisance, Parameter, Plant, Point, Quantity, Repeat, Sample, Swing,
    Trial,
};
use crate::scoring::folds::{FoldKind, Folds};
use crate::searching::selection::Selection;
use crate::searching::selector::Selector;

/// Built with [`Toy::new`] and filled in by the test.
pub struct Toy<F> {
    pub effects: Vec<Effect>,
    pub nuisances: Vec<Nuisance>,
    pub swing: Option<Swing>,
    /// Of the first effect.
    pub impostor: Option<Impostor>,
    pub cheap: bool,
    pub spread_share: f64,
    /// Added to the predictions of the last trial, by the way that its finer model goes.
    pub forks: Vec<f64>,
    /// Value of the first parameter of the first effect above which they are.
    pub forks_above: f64,
    /// Of the first effect.
    pub prior_sds: Option<Vec<f64>>,
    /// When each trial snapped \[s\]; the model does when the first parameter of the first effect says.
    pub snaps_s: Vec<f64>,
    pub vessel: Option<Silhouette>,
    /// Where each sample of a trial belongs.
    pub places_m: Vec<[f64; 3]>,
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
            impostor: None,
            cheap: true,
            spread_share: 1.0,
            forks: vec![0.0],
            forks_above: f64::NEG_INFINITY,
            prior_sds: None,
            snaps_s: Vec::new(),
            vessel: None,
            places_m: Vec::new(),
            channels: vec![Channel { name: "fx_N".into(), quantity: Quantity::Force }],
            regimes: vec!["standing".into()],
            trials: vec![trial(samples)],
            predict,
        }
    }

    /// A trial whose rows began so long before its first sample \[s\].
    pub fn begun(mut self, before_s: f64) -> Self {
        self.trials[0].start_s -= before_s;
        self
    }

    /// A trial of which so much is fed until each sample \[m\].
    pub fn fed(mut self, until_m: impl Fn(usize) -> f64) -> Self {
        for (i, sample) in self.trials[0].samples.iter_mut().enumerate() {
            sample.arc_m = until_m(i);
        }
        self
    }

    /// Samples of other channels: which channel each is of, and when.
    pub fn placed(mut self, channels: Vec<Channel>, at: impl Fn(usize) -> (usize, f64)) -> Self {
        self.channels = channels;
        for (i, sample) in self.trials[0].samples.iter_mut().enumerate() {
            (sample.channel, sample.t_s) = at(i);
        }
        self
    }

    /// The same trial so many times, numbered from 0 on.
    pub fn times(mut self, trials: usize) -> Self {
        let numbered = |number| Trial { number, ..self.trials[0].clone() };
        self.trials = (0..trials as u32).map(numbered).collect();
        self
    }

    /// What each trial measures.
    pub fn each(mut self, of: impl Fn(usize, usize) -> f64) -> Self {
        for (t, trial) in self.trials.iter_mut().enumerate() {
            trial.samples.iter_mut().enumerate().for_each(|(i, own)| own.value = of(t, i));
        }
        self
    }

    /// In four blocks a trial, and in so many regimes by trial and block.
    pub fn in_regimes(mut self, count: usize, of: impl Fn(usize, usize) -> usize) -> Self {
        self.regimes = (0..count).map(|k| format!("regime {k}")).collect();
        for (t, trial) in self.trials.iter_mut().enumerate() {
            trial.blocks = 4;
            let samples = trial.samples.len();
            for (i, sample) in trial.samples.iter_mut().enumerate() {
                sample.block = 4 * i / samples;
                sample.regime = of(t, sample.block);
            }
        }
        self
    }

    /// What the last trial measures instead of this.
    pub fn last_is(mut self, of: impl Fn(f64) -> f64) -> Self {
        let last = self.trials.last_mut().into_iter();
        last.flat_map(|trial| &mut trial.samples).for_each(|own| own.value = of(own.value));
        self
    }
}

/// Does something with an explanation of a plant by these effects, every fourth sample held out
/// in turn.
pub fn explained_by<T>(
    plant: &dyn Plant,
    effects: &[usize],
    then: impl FnOnce(&Selector<'_>, Selection) -> T,
) -> T {
    let samples = plant.trials()[0].samples.len();
    let folds = Folds {
        kind: FoldKind::Block,
        of_sample: vec![(0..samples).map(|i| i % 4).collect(); plant.trials().len()],
        scored: vec![vec![true; samples]; plant.trials().len()],
        count: 4,
        unseen_share: 0.0,
        unseen: Vec::new(),
    };
    let problem = Problem::new(plant, &Floor::of(plant), &crate::unwatched);
    let selector = Selector { problem: &problem, folds: &folds };
    let nominal = selector.nominal().expect("a formula does not break down");
    let selection = selector.take(nominal, effects).expect("a formula does not break down");
    then(&selector, selection)
}

/// A trial of one block from a stand.
pub fn trial(samples: Vec<Sample>) -> Trial {
    Trial { number: 0, start_s: 0.0, start_m: 0.0, samples, blocks: 1, forks: Vec::new() }
}

/// One at this time, fed at 10 mm/s.
pub fn snap(t_s: f64) -> Snap {
    Snap { t_s, span_s: [t_s; 2], insertion_m: 0.01 * t_s, jump_n: 0.2 }
}

/// A parameter from −10 to 10 with a prior of 1 around 0.
pub fn parameter(name: &'static str) -> Parameter {
    Parameter { name, unit: "1", low: -10.0, high: 10.0, off: 0.0, scale: 1.0 }
}

/// Noise of standard deviation 1, the same every time.
pub fn noise(i: usize) -> f64 {
    // Twelve draws from a linear congruential generator, less their mean.
    let mut state = (i as u32 + 1).wrapping_mul(2_654_435_761);
    let draws = (0..12).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX)
    });
    draws.sum::<f64>() - 6.0
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
        let way = point.anchor.ways.get(trial).copied().unwrap_or_default();
        let first = point.effects.first().and_then(|own| own.first()).copied();
        let is_forked = trial + 1 == self.trials.len() && first.unwrap_or(0.0) > self.forks_above;
        let fork = if is_forked { *self.forks.get(way)? } else { 0.0 };
        Some(samples.map(|i| (self.predict)(i, point) + fork).collect())
    }

    fn vessel(&self) -> Option<Silhouette> {
        self.vessel.clone()
    }

    fn places_m(&self, _trial: usize) -> Vec<[f64; 3]> {
        self.places_m.clone()
    }

    fn prior_sds(&self, effect: usize) -> Option<Vec<f64>> {
        self.prior_sds.clone().filter(|_| effect == 0)
    }

    fn snaps(&self, trial: usize) -> Vec<Snap> {
        self.snaps_s.get(trial).copied().map(snap).into_iter().collect()
    }

    fn predicted_snaps(&self, trial: usize, point: &Point) -> Option<Vec<Snap>> {
        Some(self.snaps_s.get(trial).map(|_| snap(point.effects[0][0])).into_iter().collect())
    }

    fn ways(&self) -> usize {
        self.forks.len()
    }

    fn cheap(&self) -> bool {
        self.cheap
    }

    fn far_off(&self) -> f64 {
        if self.cheap { f64::INFINITY } else { 3.0 }
    }

    fn spread_share(&self) -> f64 {
        self.spread_share
    }

    fn swing(&self, _effect: usize) -> Option<Swing> {
        self.swing.clone()
    }

    fn impostor(&self, effect: usize) -> Option<Impostor> {
        self.impostor.clone().filter(|_| effect == 0)
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
