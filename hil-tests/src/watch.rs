//! Observers of the bus that check promises without knowing the implementation.

use cathforce_bus::{Command, HapticForce, HapticTorque, Process};
use cathforce_config::Settings;
use cathforce_control::{Mode, Reaction, TICK_S};

use crate::Tick;

/// P02: checks the haptic output of every tick against the limits.
#[derive(Clone, Debug)]
pub struct LimitWatch {
    force: AxisWatch,
    torque: AxisWatch,
}

/// One axis, in codes of the HAPTIC frame.
#[derive(Clone, Debug)]
struct AxisWatch {
    /// Largest magnitude allowed.
    limit: f32,
    /// Largest change of the quantity in a tick.
    slew: f32,
    last: i16,
    largest: u16,
    fastest: u16,
}

impl LimitWatch {
    /// Begins with a device with these settings whose output is zero.
    pub fn new(settings: &Settings) -> Self {
        let axis = |limit: f32, slew_per_s: f32, unit: f32| AxisWatch {
            limit: limit / unit,
            slew: slew_per_s * TICK_S / unit,
            last: 0,
            largest: 0,
            fastest: 0,
        };
        let Settings { force_limit_n, force_slew_n_per_s, .. } = *settings;
        let Settings { torque_limit_n_m, torque_slew_n_m_per_s, .. } = *settings;
        Self {
            force: axis(force_limit_n, force_slew_n_per_s, HapticForce::UNIT),
            torque: axis(torque_limit_n_m, torque_slew_n_m_per_s, HapticTorque::UNIT),
        }
    }

    /// Fails if this tick's output exceeds the limit, or changes by more than the slew allows. Only a fault
    /// that cuts may set it to zero at once.
    pub fn check(&mut self, tick: &Tick) {
        let fault = tick.mode().and_then(Mode::fault);
        let cut = tick.is_silent() && fault.is_some_and(|f| f.reaction() == Reaction::Cut);
        let axes =
            [(&mut self.force, tick.haptic.force.0), (&mut self.torque, tick.haptic.torque.0)];
        for (axis, code) in axes {
            axis.check(code, cut, tick);
        }
    }

    /// Largest magnitude and largest change seen of each axis, as shares of what is allowed.
    pub fn shares(&self) -> [f32; 4] {
        let [force, torque] = [&self.force, &self.torque];
        let share = |axis: &AxisWatch| {
            [f32::from(axis.largest) / axis.limit, f32::from(axis.fastest) / axis.slew]
        };
        let ([a, b], [c, d]) = (share(force), share(torque));
        [a, b, c, d]
    }
}

impl AxisWatch {
    fn check(&mut self, code: i16, cut: bool, tick: &Tick) {
        // Rounding adds at most half a count to a code and one count to a change.
        assert!(f32::from(code.unsigned_abs()) <= self.limit + 0.5, "{tick:?} is over the limit");
        let change = code.abs_diff(self.last);
        if !cut {
            let from = self.last;
            assert!(f32::from(change) <= self.slew + 1.0, "{tick:?} comes too fast after {from}");
            self.fastest = self.fastest.max(change);
        }
        self.largest = self.largest.max(code.unsigned_abs());
        self.last = code;
    }
}

/// P18: whether output is allowed, judged by the frames sent and the mode seen.
#[derive(Clone, Debug, Default)]
pub struct OutputReader {
    tested: bool,
    sampled: bool,
    armed: bool,
    mode: Option<Mode>,
}

impl OutputReader {
    /// Fails if a tick outputs anything before self-test, an encoder sample and arming,
    /// in this order. `sent`: what the host sent for this tick.
    pub fn check(&mut self, sent: &[Process], tick: &Tick) {
        let command = |wanted| sent.contains(&Process::Command(wanted));
        let configured = tick.mode().is_some();
        self.tested |= configured && command(Command::SelfTest);
        self.sampled |= self.tested && sent.iter().any(|p| matches!(p, Process::Encoder(_)));
        self.armed |= self.sampled && command(Command::Arm) && self.mode == Some(Mode::Ready);
        let allowed = self.tested && self.sampled && self.armed;
        assert!(tick.is_silent() || allowed, "{self:?} and {tick:?}");
        match tick.mode() {
            // From here self-test or arming is needed again.
            Some(Mode::Boot | Mode::Fault { .. }) | None => {
                *self = Self { mode: tick.mode(), ..Self::default() };
            }
            Some(Mode::Idle | Mode::Settling | Mode::Ready) => self.armed = false,
            Some(Mode::Armed | Mode::Ramp { .. }) => (),
        }
        self.mode = tick.mode();
    }
}
