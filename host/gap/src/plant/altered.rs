//! A plant seen with other knowledge: with effects that its model already has, without some trials, or
//! with a phase for each trial.

use std::sync::Arc;

use cathforce_recording::snap::Snap;

use super::interface::{
    Channel, Effect, Impostor, Nuisance, Plant, Point, Repeat, Sample, Segment, Swing, Trial,
};
use super::silhouette::Silhouette;
use crate::signal::wrapped;

/// Another plant with other effects or fewer trials; everything else is the other's.
pub struct Altered<'a> {
    inner: &'a dyn Plant,
    effects: Vec<Effect>,
    trials: usize,
    repeats: Vec<Repeat>,
    /// Of one effect that swings.
    phases: Option<Phases>,
    nuisances: Vec<Nuisance>,
    remarks: Vec<String>,
}

/// Where in its swing every trial begins.
struct Phases {
    effect: usize,
    parameter: usize,
    /// By trial, later than the parameter says \[rad\].
    ahead_rad: Vec<f64>,
}

/// How well the phase of a trial is known that its residual shows to first order \[rad\].
const PHASE_SD_RAD: f64 = 0.3;

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
        Self {
            inner,
            effects: inner.effects().to_vec(),
            trials: trials.min(inner.trials().len()),
            repeats,
            phases: None,
            nuisances: inner.nuisances().to_vec(),
            remarks: inner.remarks().to_vec(),
        }
    }

    /// With an effect whose phase is every trial's own: by so much ahead of what its parameter says, and
    /// by a nuisance more. `None` of an effect that begins with the trial.
    pub fn with_phases(inner: &'a dyn Plant, effect: usize, ahead_rad: Vec<f64>) -> Option<Self> {
        let parameter = inner.swing(effect)?.own_phase?;
        let mut altered = Self::first_trials(inner, inner.trials().len());
        altered.nuisances.push(Nuisance {
            name: "phase of its own",
            unit: "rad",
            sd: PHASE_SD_RAD,
            effect: None,
        });
        let numbers = inner.trials().iter().map(|trial| trial.number);
        let phases: Vec<String> = numbers
            .zip(&ahead_rad)
            .map(|(number, ahead)| format!("{ahead:.1} rad in trial {number:03}"))
            .collect();
        altered.remarks.push(format!(
            "{} has a phase of its own in every trial, which is taken from it ({} ahead of the phase that \
             is named): nothing tells a device where in its swing a run begins",
            inner.effects()[effect].id,
            phases.join(", ")
        ));
        altered.phases = Some(Phases { effect, parameter, ahead_rad });
        Some(altered)
    }

    /// The point of the inner plant in a trial.
    fn inner_point(&self, trial: Option<usize>, point: &Point) -> Point {
        let mut own = point.clone();
        let Some(Phases { effect, parameter, ahead_rad }) = &self.phases else { return own };
        let nudged = own.nuisances.pop().unwrap_or_default();
        let ahead = trial.and_then(|trial| ahead_rad.get(trial)).copied().unwrap_or_default();
        let turn = |effects: &mut Vec<Vec<f64>>| {
            let (values, known) = (&mut effects[*effect], &self.effects[*effect].parameters);
            // What is off stays off to the last bit.
            if known.iter().zip(&*values).any(|(p, value)| p.off != *value) {
                values[*parameter] = wrapped(values[*parameter] + ahead + nudged);
            }
        };
        turn(&mut own.effects);
        let mut anchor = own.anchor.effects.to_vec();
        turn(&mut anchor);
        own.anchor.effects = Arc::new(anchor);
        own
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
        &self.nuisances
    }

    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>> {
        self.inner.simulate(trial, &self.inner_point(Some(trial), point))
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

    fn prior_sds(&self, effect: usize) -> Option<Vec<f64>> {
        self.inner.prior_sds(effect)
    }

    fn snaps(&self, trial: usize) -> Vec<Snap> {
        self.inner.snaps(trial)
    }

    fn predicted_snaps(&self, trial: usize, point: &Point) -> Option<Vec<Snap>> {
        self.inner.predicted_snaps(trial, &self.inner_point(Some(trial), point))
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

    fn open(&self, sample: &Sample) -> f64 {
        self.inner.open(sample)
    }

    fn least_amplitude(&self) -> f64 {
        self.inner.least_amplitude()
    }

    fn spread_share(&self) -> f64 {
        self.inner.spread_share()
    }

    fn has_other_models(&self) -> bool {
        self.inner.has_other_models()
    }

    fn swing(&self, effect: usize) -> Option<Swing> {
        self.inner.swing(effect)
    }

    fn own_phase_rad(&self, effect: usize, trial: usize) -> f64 {
        let own = self.phases.as_ref().filter(|own| own.effect == effect);
        own.and_then(|own| own.ahead_rad.get(trial)).copied().unwrap_or_default()
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
        self.inner.simulate_segment(segment, &self.inner_point(None, point))
    }

    fn complaint(&self) -> Option<&str> {
        self.inner.complaint()
    }

    fn hidden(&self, floor_n: f64, measured_n: f64) -> Option<String> {
        self.inner.hidden(floor_n, measured_n)
    }

    fn remarks(&self) -> &[String] {
        &self.remarks
    }

    fn units(&self) -> crate::plant::Units {
        self.inner.units()
    }

    fn compared(&self) -> &str {
        self.inner.compared()
    }
}
