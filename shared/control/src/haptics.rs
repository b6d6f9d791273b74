//! From the forces at the drive to the demands on the operator's axes.
//!
//! The force against insertion is the gain times the axial force at the drive, which is positive when
//! pushing; the torque likewise. With a guidewire there are two drives, and the operator feels the load
//! on the one that is held. In a tick that the model did not resolve (a snap), the forces are
//! uncertain. The last trusted ones are then held, and a flag reports it.

use cathforce_mechanics as mechanics;

use crate::limits::finite;
use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::{Fault, HapticSource, Settings};

/// Demands on the operator's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rendered {
    pub force_n: f32,
    pub torque_n_m: f32,
    /// The forces are held from an earlier tick.
    pub held: bool,
}

/// Load on one drive.
#[derive(Clone, Debug)]
struct DriveLoad {
    force_n: f32,
    torque_n_m: f32,
}

/// The last trusted loads on the drives.
#[derive(Clone, Debug)]
pub(crate) struct Haptics {
    catheter: DriveLoad,
    guidewire: DriveLoad,
    unresolved_ticks: u16,
}

impl Haptics {
    pub fn new() -> Self {
        let nothing = DriveLoad { force_n: 0.0, torque_n_m: 0.0 };
        Self { catheter: nothing.clone(), guidewire: nothing, unresolved_ticks: 0 }
    }

    /// Takes in the outputs of the model; a fault if it has been unresolved for too long.
    pub fn observe(
        &mut self,
        settings: &Settings,
        contact: &mechanics::Outputs<f32>,
    ) -> Option<Fault> {
        if contact.unresolved {
            self.unresolved_ticks = self.unresolved_ticks.saturating_add(1);
        } else {
            self.unresolved_ticks = 0;
            self.catheter =
                DriveLoad { force_n: contact.drive_force_n, torque_n_m: contact.drive_torque_n_m };
            self.guidewire = DriveLoad {
                force_n: contact.guidewire_force_n,
                torque_n_m: contact.guidewire_torque_n_m,
            };
        }
        let lasted = self.unresolved_ticks > settings.unresolved_limit_ticks;
        lasted.then_some(Fault::ModelUnresolved)
    }

    /// The loads are those of the newest tick.
    pub fn is_trusted(&self) -> bool {
        self.unresolved_ticks == 0
    }

    /// The haptic law. With a large gain the result may be infinite; the limiter handles that.
    pub fn render(&self, settings: &Settings, haptic_source: HapticSource) -> Rendered {
        let load = match haptic_source {
            HapticSource::Catheter => &self.catheter,
            HapticSource::Guidewire => &self.guidewire,
        };
        let law =
            |gain: f32, deadband: f32, drive: f32| gain * apply_deadband(deadband, finite(drive));
        Rendered {
            force_n: law(settings.force_gain, settings.force_deadband_n, load.force_n),
            torque_n_m: law(settings.torque_gain, settings.torque_deadband_n_m, load.torque_n_m),
            held: !self.is_trusted(),
        }
    }
}

/// The part of `x` beyond ±`deadband`, continuous at its edge.
fn apply_deadband(deadband: f32, x: f32) -> f32 {
    if x > deadband {
        x - deadband
    } else if x < -deadband {
        x + deadband
    } else {
        0.0
    }
}

impl VisitMemory for Haptics {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        for load in [&mut self.catheter, &mut self.guidewire] {
            visit(MemoryWord::F32(&mut load.force_n));
            visit(MemoryWord::F32(&mut load.torque_n_m));
        }
        visit(MemoryWord::U16(&mut self.unresolved_ticks));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(drive_force_n: f32, unresolved: bool) -> mechanics::Outputs<f32> {
        mechanics::Outputs { drive_force_n, unresolved, ..Default::default() }
    }

    #[test]
    fn a_spike_in_an_unresolved_tick_is_held_back() {
        let (settings, mut haptics) = (Settings::default(), Haptics::new());
        haptics.observe(&settings, &found(0.4, false));
        haptics.observe(&settings, &found(-70.0, true));
        let rendered = haptics.render(&settings, HapticSource::Catheter);
        assert_eq!((rendered.force_n, rendered.held), (0.4, true));
        haptics.observe(&settings, &found(0.3, false));
        let rendered = haptics.render(&settings, HapticSource::Catheter);
        assert_eq!((rendered.force_n, rendered.held), (0.3, false));
    }

    #[test]
    fn an_unresolved_model_is_a_fault_after_the_limit() {
        let (settings, mut haptics) = (Settings::default(), Haptics::new());
        for _ in 0..settings.unresolved_limit_ticks {
            assert_eq!(haptics.observe(&settings, &found(0.0, true)), None);
        }
        let fault = haptics.observe(&settings, &found(0.0, true));
        assert_eq!(fault, Some(Fault::ModelUnresolved));
    }

    #[test]
    fn the_deadband_is_subtracted_on_both_sides() {
        let settings = Settings { force_gain: 2.0, force_deadband_n: 0.25, ..Settings::default() };
        let mut haptics = Haptics::new();
        for (drive, rendered) in [(1.0, 1.5), (-1.0, -1.5), (0.25, 0.0), (-0.2, 0.0)] {
            haptics.observe(&settings, &found(drive, false));
            assert_eq!(haptics.render(&settings, HapticSource::Catheter).force_n, rendered);
        }
    }
}
