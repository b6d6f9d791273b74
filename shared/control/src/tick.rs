//! The order of the stages in a tick, generic over the estimator of the forces.

use cathforce_mechanics as mechanics;

use crate::band::{Band, HalfWidths, InsertionHistory};
use crate::digest::Digest;
use crate::freshness::{Bounds, EncoderStatus, Freshness, Motion, Status};
use crate::haptics::{Haptics, Rendered};
use crate::limits::{AxisLimits, Limited, Limiter};
use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::passivity::Passivity;
use crate::selftest;
use crate::supervisor::{Event, next};
use crate::{
    Command, EncoderSample, Fault, Grip, HapticSource, Inputs, LimitFlags, Mode, Outputs,
    RampCause, Settings, TENDON_PAIRS, TendonPair,
};

/// The estimator of the forces, as the tick uses it.
pub(crate) trait Estimator {
    /// Time of one tick that it is configured for \[s\].
    fn tick_s(&self) -> f32;
    /// The longest insertion it can represent \[m\].
    fn reach_m(&self) -> f32;
    /// There is a second drive for a guidewire.
    fn has_guidewire(&self) -> bool;
    /// Number of tendons that drives pull.
    fn tendons(&self) -> usize {
        0
    }
    /// Uncertainty of its forces, if known.
    fn band(&self) -> Option<&Band> {
        None
    }
    fn step(&mut self, drives: mechanics::Drives<f32>) -> mechanics::Outputs<f32>;
    fn settle(&mut self, drives: mechanics::Drives<f32>) -> bool;
    /// Resets to the empty guide.
    fn rebuild(&mut self);
    /// Numbers from which position and force of every node follow, from the tip on.
    fn nodes(&self) -> impl Iterator<Item = [f32; 6]>;
    /// All of these numbers are finite.
    fn nodes_finite(&self) -> bool {
        // x · 0 is NaN exactly if x is not finite, and the sum keeps NaN.
        let sum = self.nodes().flatten().fold(0.0, |sum, x| sum + x * 0.0);
        sum == 0.0
    }
}

/// A tick whose forces are not estimated yet.
pub(crate) struct Begun {
    before: Mode,
    ages_ticks: [u8; 2],
    /// Positions of all drives; `None` if one is not known.
    drives: Option<mechanics::Drives<f32>>,
}

/// State of the tick, without the model's.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    pub tick: u32,
    mode: Mode,
    settling_ticks: u16,
    freshness: Freshness<EncoderSample>,
    guidewire: Freshness<EncoderSample>,
    haptic_source: HapticSource,
    /// Nobody holds the handle, so nothing is rendered.
    released: bool,
    haptics: Haptics,
    insertion_history: InsertionHistory,
    force: Axis,
    torque: Axis,
    digest: Digest,
    tendons: [Freshness<TendonPair>; TENDON_PAIRS],
}

/// State of one axis of the operator.
#[derive(Clone, Debug)]
struct Axis {
    passivity: Passivity,
    limiter: Limiter,
}

impl Axis {
    fn new() -> Self {
        Self { passivity: Passivity::new(), limiter: Limiter::new() }
    }

    /// Accounts for the energy since the last output.
    fn observe(&mut self, motion: Motion, moved: f32, step: f32) {
        self.passivity.observe(self.limiter.output(), motion, moved, step);
    }

    fn output(
        &mut self,
        limits: &AxisLimits,
        wanted: f32,
        budget_j: f32,
        step: f32,
    ) -> (f32, Limited) {
        let bound = self.passivity.bound(budget_j, limits.slew, step);
        self.limiter.limit(limits, wanted, bound)
    }
}

/// Result of the checks on all encoders in one tick.
struct Encoders {
    catheter: EncoderStatus,
    /// `None` without a guidewire.
    guidewire: Option<EncoderStatus>,
    /// `None` without tendons.
    tendons: Option<TendonStatus>,
}

/// Of each pair of tendons; `None` for pairs that there are not.
type TendonStatus = [Option<Status<TendonPair>>; TENDON_PAIRS];

impl Encoders {
    /// The encoder of the drive whose load is rendered.
    #[inline(always)]
    fn of(&self, source: HapticSource) -> &EncoderStatus {
        match source {
            HapticSource::Catheter => &self.catheter,
            HapticSource::Guidewire => self.guidewire.as_ref().unwrap_or(&self.catheter),
        }
    }

    /// The first fault of an encoder.
    #[inline(always)]
    fn fault(&self) -> Option<Fault> {
        let wire = || self.guidewire.as_ref().and_then(|wire| wire.fault);
        let tendons = || self.tendons.iter().flatten().flatten().find_map(|pair| pair.fault);
        self.catheter.fault.or_else(wire).or_else(tendons)
    }

    /// Every encoder had an accepted sample in this tick.
    #[inline(always)]
    fn are_fresh(&self) -> bool {
        self.catheter.age_ticks == 0
            && self.guidewire.as_ref().is_none_or(|wire| wire.age_ticks == 0)
            && self.tendons.iter().flatten().flatten().all(|pair| pair.age_ticks == 0)
    }

    /// Positions of all drives; `None` if one is not known.
    #[inline(always)]
    fn positions(&self) -> Option<mechanics::Drives<f32>> {
        let mut drives = match &self.guidewire {
            Some(wire) => {
                let (catheter, wire) = self.catheter.position.zip(wire.position)?;
                mechanics::Drives {
                    catheter: drive(catheter),
                    guidewire: drive(wire),
                    ..mechanics::Drives::default()
                }
            }
            None => drive(self.catheter.position?).into(),
        };
        if let Some(tendons) = &self.tendons {
            for (place, pair) in drives.tendons_m.chunks_exact_mut(2).zip(tendons) {
                if let Some(pair) = pair {
                    place.copy_from_slice(&pair.position?.displacements_m);
                }
            }
        }
        Some(drives)
    }

    /// Ages of the newest accepted samples of catheter and guidewire \[ticks\].
    #[inline(always)]
    fn ages_ticks(&self) -> [u8; 2] {
        [self.catheter.age_ticks, self.guidewire.as_ref().map_or(0, |wire| wire.age_ticks)]
    }
}

/// Outputs of both axes.
#[derive(Clone, Copy, Default)]
struct AxisOutputs {
    force_n: f32,
    torque_n_m: f32,
    limited: LimitFlags,
}

impl Memory {
    pub fn new() -> Self {
        Self {
            tick: 0,
            mode: Mode::Boot,
            settling_ticks: 0,
            freshness: Freshness::new(),
            guidewire: Freshness::new(),
            haptic_source: HapticSource::Catheter,
            released: false,
            haptics: Haptics::new(),
            insertion_history: InsertionHistory::new(),
            force: Axis::new(),
            torque: Axis::new(),
            digest: Digest::new(),
            tendons: [const { Freshness::new() }; TENDON_PAIRS],
        }
    }

    /// Computes one tick.
    #[inline(always)]
    pub fn tick(
        &mut self,
        settings: &Settings,
        model: &mut impl Estimator,
        inputs: &Inputs,
    ) -> Outputs {
        let begun = self.begin(settings, model, inputs);
        let mut outputs = self.complete(settings, model, begun);
        model.nodes().flatten().for_each(|x| self.digest.add(x.to_bits()));
        outputs.digest = self.digest.value();
        outputs
    }

    /// The stages before the forces are estimated.
    #[inline(always)]
    pub fn begin(&mut self, settings: &Settings, model: &impl Estimator, inputs: &Inputs) -> Begun {
        self.tick = self.tick.wrapping_add(1);
        let before = self.mode;
        let bounds = Bounds::new(settings, model.reach_m());
        let encoders = self.check_encoders(&bounds, model, inputs);
        self.account_energy(&bounds, encoders.of(self.haptic_source));
        if let (Some(sample), true) = (inputs.guidewire, model.has_guidewire()) {
            self.select_haptic_source(HapticSource::for_guidewire_button(sample.held));
        }

        self.released = inputs.grip.map_or(self.released, Grip::is_released);

        if let Some(notice) = inputs.notice {
            self.handle_event(Event::Fault(notice.fault()));
        }
        match encoders.fault() {
            Some(fault) => self.handle_event(Event::Fault(fault)),
            None if encoders.are_fresh() => self.handle_event(Event::EncoderFresh),
            None => (),
        }
        // A command is ignored if the mode changed in this tick, because its sender could not see the
        // new mode. Otherwise a fault could be raised and cleared in one tick without a trace.
        let command = inputs.command.filter(|_| self.mode == before);
        if let Some(event) = command.and_then(|c| self.event_for_command(settings, model, c)) {
            self.handle_event(event);
        }

        Begun { before, ages_ticks: encoders.ages_ticks(), drives: encoders.positions() }
    }

    /// Positions of the drives that the model is to follow in this tick; `None` in modes without forces.
    #[cfg_attr(target_os = "none", expect(dead_code, reason = "of catheters abreast"))]
    pub fn followed(&self, begun: &Begun) -> Option<mechanics::Drives<f32>> {
        let follows = matches!(
            self.mode,
            Mode::Ready | Mode::Armed | Mode::Ramp { cause: RampCause::Disarm }
        );
        begun.drives.filter(|_| follows)
    }

    /// The stages from the estimate of the forces on. The digest is still without the nodes.
    #[inline(always)]
    pub fn complete(
        &mut self,
        settings: &Settings,
        model: &mut impl Estimator,
        begun: Begun,
    ) -> Outputs {
        let Begun { before, ages_ticks, drives } = begun;
        let bounds = Bounds::new(settings, model.reach_m());
        let contact = self.estimate(settings, model, drives);
        let band = self.band(model, drives, &contact);
        let applied = self.limit_outputs(settings, &bounds);
        if matches!(self.mode, Mode::Ramp { .. }) && applied.is_zero() {
            self.handle_event(Event::RampDone);
        }
        if matches!(self.mode, Mode::Fault { .. }) && !matches!(before, Mode::Fault { .. }) {
            // Memory that may have caused the fault is reset.
            self.haptics = Haptics::new();
            model.rebuild();
        }
        self.report(ages_ticks, (contact, band), applied)
    }

    /// Checks the samples of all encoders of this tick.
    #[inline(always)]
    fn check_encoders(
        &mut self,
        bounds: &Bounds,
        model: &impl Estimator,
        inputs: &Inputs,
    ) -> Encoders {
        let catheter = self.freshness.update(bounds, inputs.encoder, inputs.rejected_frames);
        // Rejected frames are a problem of the bus and not of one drive, so they count once.
        let sample = inputs.guidewire.map(|sample| sample.at);
        let guidewire = model.has_guidewire().then(|| self.guidewire.update(bounds, sample, 0));
        let count = model.tendons();
        let tendons = (count > 0).then(|| self.check_tendons(bounds, count, inputs));
        Encoders { catheter, guidewire, tendons }
    }

    /// Checks the samples of the drives of `count` tendons. A call, so that it costs nothing without them.
    #[inline(never)]
    fn check_tendons(&mut self, bounds: &Bounds, count: usize, inputs: &Inputs) -> TendonStatus {
        let mut pairs = [None; TENDON_PAIRS];
        for (i, (pair, freshness)) in pairs.iter_mut().zip(&mut self.tendons).enumerate() {
            if 2 * i < count {
                *pair = Some(freshness.update(bounds, inputs.tendons[i], 0));
            }
        }
        pairs
    }

    fn handle_event(&mut self, event: Event) {
        let before = self.mode;
        self.mode = next(before, event);
        match (before, self.mode) {
            (Mode::Idle, Mode::Settling) => self.settling_ticks = 0,
            (Mode::Settling, Mode::Ready) => self.haptics = Haptics::new(),
            (Mode::Ready, Mode::Armed) => {
                self.force.passivity = Passivity::new();
                self.torque.passivity = Passivity::new();
            }
            _ => (),
        }
    }

    /// The event that a command causes; `None` if it is not allowed in this mode.
    fn event_for_command(
        &self,
        settings: &Settings,
        model: &impl Estimator,
        command: Command,
    ) -> Option<Event> {
        match (self.mode, command) {
            (Mode::Boot, Command::SelfTest) => {
                Some(match selftest::run(settings, model.tick_s()) {
                    true => Event::SelfTestPassed,
                    false => Event::Fault(Fault::SelfTest),
                })
            }
            (Mode::Ready, Command::Arm) => self.haptics.is_trusted().then_some(Event::Arm),
            (_, Command::Disarm) => Some(Event::Disarm),
            (Mode::Fault { cause }, Command::ClearFault { token }) => {
                (token == cause.clear_token()).then_some(Event::ClearFault)
            }
            _ => None,
        }
    }

    fn account_energy(&mut self, bounds: &Bounds, fresh: &EncoderStatus) {
        let motion = fresh.motion();
        let (insertion_m, rotation_rad) = match motion {
            Motion::Unknown => (0.0, 0.0),
            Motion::Known { insertion_m, rotation_rad, .. } => (insertion_m, rotation_rad),
        };
        self.force.observe(motion, insertion_m, bounds.insertion_step_m);
        self.torque.observe(motion, rotation_rad, bounds.rotation_step_rad);
    }

    /// Selects the drive whose load the operator's axes render from here on.
    fn select_haptic_source(&mut self, haptic_source: HapticSource) {
        if self.haptic_source != haptic_source {
            self.haptic_source = haptic_source;
            self.force.passivity.change_drive();
            self.torque.passivity.change_drive();
        }
    }

    /// Lets the model follow the drives, in modes that track.
    fn estimate(
        &mut self,
        settings: &Settings,
        model: &mut impl Estimator,
        drives: Option<mechanics::Drives<f32>>,
    ) -> mechanics::Outputs<f32> {
        let nothing = mechanics::Outputs::default();
        let Some(drives) = drives else { return nothing };
        match self.mode {
            Mode::Settling => {
                let settled = model.settle(drives);
                self.settling_ticks = self.settling_ticks.saturating_add(1);
                if !model.nodes_finite() {
                    self.handle_event(Event::Fault(Fault::ModelNotFinite));
                } else if settled {
                    self.handle_event(Event::Settled);
                } else if self.settling_ticks > settings.settle_timeout_ticks {
                    self.handle_event(Event::Fault(Fault::SettleTimeout));
                }
                nothing
            }
            Mode::Ready | Mode::Armed | Mode::Ramp { cause: RampCause::Disarm } => {
                let contact = model.step(drives);
                if contact.lost || !(outputs_finite(&contact) && model.nodes_finite()) {
                    self.handle_event(Event::Fault(Fault::ModelNotFinite));
                    return nothing;
                }
                if let Some(fault) = self.haptics.observe(settings, &contact) {
                    self.handle_event(Event::Fault(fault));
                }
                contact
            }
            Mode::Boot
            | Mode::Idle
            | Mode::Ramp { cause: RampCause::Fault(_) }
            | Mode::Fault { .. } => nothing,
        }
    }

    /// Uncertainty of the forces of this tick, in modes that have forces.
    fn band(
        &mut self,
        model: &impl Estimator,
        drives: Option<mechanics::Drives<f32>>,
        contact: &mechanics::Outputs<f32>,
    ) -> HalfWidths {
        match (self.mode, drives) {
            (
                Mode::Ready | Mode::Armed | Mode::Ramp { cause: RampCause::Disarm },
                Some(mechanics::Drives { catheter, .. }),
            ) => self.insertion_history.update(
                model.band(),
                catheter.insertion_m,
                contact.unresolved,
            ),
            _ => {
                self.insertion_history = InsertionHistory::new();
                HalfWidths::default()
            }
        }
    }

    /// The last stage: demands of the mode, through passivity and limiter.
    fn limit_outputs(&mut self, settings: &Settings, bounds: &Bounds) -> AxisOutputs {
        let rendered = match self.mode {
            Mode::Armed if !self.released => self.haptics.render(settings, self.haptic_source),
            Mode::Armed | Mode::Ramp { .. } => {
                Rendered { force_n: 0.0, torque_n_m: 0.0, held: false }
            }
            Mode::Boot | Mode::Idle | Mode::Settling | Mode::Ready | Mode::Fault { .. } => {
                self.force.limiter.cut();
                self.torque.limiter.cut();
                return AxisOutputs::default();
            }
        };
        // Each axis has half of the budget, so energy received by one is never delivered by the other.
        let budget_j = settings.energy_limit_j * 0.5;
        let (force_n, force) = self.force.output(
            &AxisLimits::force(settings),
            rendered.force_n,
            budget_j,
            bounds.insertion_step_m,
        );
        let (torque_n_m, torque) = self.torque.output(
            &AxisLimits::torque(settings),
            rendered.torque_n_m,
            budget_j,
            bounds.rotation_step_rad,
        );
        let mut limited = LimitFlags::none();
        for (is_set, flag) in [
            (force.magnitude, LimitFlags::FORCE),
            (torque.magnitude, LimitFlags::TORQUE),
            (force.slew, LimitFlags::FORCE_SLEW),
            (torque.slew, LimitFlags::TORQUE_SLEW),
            (force.energy || torque.energy, LimitFlags::ENERGY),
            (rendered.held, LimitFlags::HELD),
            (force.not_finite || torque.not_finite, LimitFlags::NOT_FINITE),
            (self.released && self.mode == Mode::Armed, LimitFlags::RELEASED),
        ] {
            if is_set {
                limited |= flag;
            }
        }
        AxisOutputs { force_n, torque_n_m, limited }
    }

    fn report(
        &mut self,
        [encoder_age_ticks, guidewire_age_ticks]: [u8; 2],
        (contact, band): (mechanics::Outputs<f32>, HalfWidths),
        applied: AxisOutputs,
    ) -> Outputs {
        let outputs = Outputs {
            mode: self.mode,
            fault: self.mode.fault(),
            limited: applied.limited,
            haptic_source: self.haptic_source,
            force_n: applied.force_n,
            torque_n_m: applied.torque_n_m,
            contact,
            band,
            encoder_age_ticks,
            guidewire_age_ticks,
            digest: 0,
        };
        for word in outputs.digest_words() {
            self.digest.add(word);
        }
        outputs
    }

    /// Of the outputs so far.
    #[cfg_attr(target_os = "none", expect(dead_code, reason = "of catheters abreast"))]
    pub fn digest(&mut self) -> &mut Digest {
        &mut self.digest
    }
}

impl AxisOutputs {
    fn is_zero(&self) -> bool {
        self.force_n == 0.0 && self.torque_n_m == 0.0
    }
}

fn drive(at: EncoderSample) -> mechanics::Drive<f32> {
    mechanics::Drive { insertion_m: at.insertion_m, rotation_rad: at.rotation_rad }
}

fn outputs_finite(contact: &mechanics::Outputs<f32>) -> bool {
    contact.force_on_vessel_n.iter().all(|x| x.is_finite())
        && contact.moment_on_vessel_n_m.iter().all(|x| x.is_finite())
        && contact.drive_force_n.is_finite()
        && contact.drive_torque_n_m.is_finite()
        && contact.guidewire_force_n.is_finite()
        && contact.guidewire_torque_n_m.is_finite()
        && contact.peak_contact_force_n.is_finite()
}

impl VisitMemory for Memory {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::U32(&mut self.tick));
        visit(MemoryWord::U16(&mut self.settling_ticks));
        self.freshness.visit_memory(visit);
        self.guidewire.visit_memory(visit);
        self.haptics.visit_memory(visit);
        self.insertion_history.visit_memory(visit);
        for axis in [&mut self.force, &mut self.torque] {
            axis.passivity.visit_memory(visit);
            axis.limiter.visit_memory(visit);
        }
        self.digest.visit_memory(visit);
        self.tendons.iter_mut().for_each(|pair| pair.visit_memory(visit));
    }
}

#[cfg(test)]
mod tests;
