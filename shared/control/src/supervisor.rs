//! Modes and their transition table.

use crate::{Fault, Reaction};

/// Mode of the device. Modes that stop the output carry their cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Mode {
    /// Configured, waiting for the self-test.
    #[default]
    Boot,
    /// Self-test passed, waiting for the encoders.
    Idle,
    /// The model is fed from the empty guide to the measured insertion.
    Settling,
    /// The model tracks the drives; output is zero.
    Ready,
    /// Output follows the model.
    Armed,
    /// Output ramps to zero.
    Ramp { cause: RampCause },
    /// Output is zero until the fault is cleared.
    Fault { cause: Fault },
}

/// Cause of a ramp to zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RampCause {
    Disarm,
    Fault(Fault),
}

impl Mode {
    /// Code in the HAPTIC frame; the fault byte beside it carries the cause.
    pub const fn code(self) -> u8 {
        match self {
            Self::Boot => 0,
            Self::Idle => 1,
            Self::Settling => 2,
            Self::Ready => 3,
            Self::Armed => 4,
            Self::Ramp { .. } => 5,
            Self::Fault { .. } => 6,
        }
    }

    /// The mode of a mode and a fault byte; `None` if they contradict each other.
    pub const fn from_codes(mode: u8, fault: u8) -> Option<Self> {
        match (mode, fault, Fault::from_code(fault)) {
            (0, 0, _) => Some(Self::Boot),
            (1, 0, _) => Some(Self::Idle),
            (2, 0, _) => Some(Self::Settling),
            (3, 0, _) => Some(Self::Ready),
            (4, 0, _) => Some(Self::Armed),
            (5, 0, _) => Some(Self::Ramp { cause: RampCause::Disarm }),
            (5, _, Some(cause)) => Some(Self::Ramp { cause: RampCause::Fault(cause) }),
            (6, _, Some(cause)) => Some(Self::Fault { cause }),
            _ => None,
        }
    }

    /// The fault for which output is stopping or has stopped.
    pub const fn fault(self) -> Option<Fault> {
        match self {
            Self::Ramp { cause: RampCause::Fault(cause) } | Self::Fault { cause } => Some(cause),
            _ => None,
        }
    }

    /// Name of the mode for display.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boot => "boot",
            Self::Idle => "idle",
            Self::Settling => "settling",
            Self::Ready => "ready",
            Self::Armed => "armed",
            Self::Ramp { .. } => "ramp",
            Self::Fault { .. } => "fault",
        }
    }
}

/// Something that happened in a tick. Commands become events only after they were checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    SelfTestPassed,
    /// Every encoder had an accepted sample in this tick, and none has a fault.
    EncoderFresh,
    /// The model has reached the measured insertion.
    Settled,
    Arm,
    Disarm,
    /// The token of the command belongs to the latched fault.
    ClearFault,
    /// Output has reached zero.
    RampDone,
    Fault(Fault),
}

/// The transition table: the mode after `event` in `mode`.
///
/// Encoder faults ([`Reaction::Ramp`]) latch only while there is output to stop. Before that, the device
/// waits for the encoders again. After a latched fault is cleared, the device starts over at the
/// self-test.
#[rustfmt::skip]
pub(crate) const fn next(mode: Mode, event: Event) -> Mode {
    use Event as E;
    use Mode as M;
    use Reaction::{Cut, Ramp};
    use RampCause as C;
    match (mode, event) {
        (M::Boot,                        E::SelfTestPassed) => M::Idle,
        (M::Idle,                        E::EncoderFresh)   => M::Settling,
        (M::Settling,                    E::Settled)        => M::Ready,
        (M::Ready,                       E::Arm)            => M::Armed,
        (M::Armed,                       E::Disarm)         => M::Ramp { cause: C::Disarm },
        (M::Ramp { cause: C::Disarm },   E::RampDone)       => M::Ready,
        (M::Ramp { cause: C::Fault(f) }, E::RampDone)       => M::Fault { cause: f },
        (M::Fault { .. },                E::ClearFault)     => M::Boot,

        // Faults. A latched fault stays, because later ones may only follow from it.
        (M::Fault { .. },                E::Fault(_))       => mode,
        (_,                              E::Fault(f)) => match (mode, f.reaction()) {
            (_,                                  Cut)  => M::Fault { cause: f },
            (M::Boot,                            Ramp) => M::Boot,
            (M::Idle | M::Settling | M::Ready,   Ramp) => M::Idle,
            (M::Armed,                           Ramp) => M::Ramp { cause: C::Fault(f) },
            (M::Ramp { cause: C::Disarm },       Ramp) => M::Ramp { cause: C::Fault(f) },
            (M::Ramp { cause: C::Fault(_) },     Ramp) => mode,
            (M::Fault { .. },                    Ramp) => mode,
        },

        // All other events change nothing.
        (_, E::SelfTestPassed | E::EncoderFresh | E::Settled | E::Arm | E::Disarm
          | E::ClearFault | E::RampDone)                    => mode,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modes() -> impl Iterator<Item = Mode> {
        let plain = [
            Mode::Boot,
            Mode::Idle,
            Mode::Settling,
            Mode::Ready,
            Mode::Armed,
            Mode::Ramp { cause: RampCause::Disarm },
        ];
        let faults = Fault::ALL.iter().flat_map(|&cause| {
            [Mode::Ramp { cause: RampCause::Fault(cause) }, Mode::Fault { cause }]
        });
        plain.into_iter().chain(faults)
    }

    fn events() -> impl Iterator<Item = Event> {
        use Event as E;
        [
            E::SelfTestPassed,
            E::EncoderFresh,
            E::Settled,
            E::Arm,
            E::Disarm,
            E::ClearFault,
            E::RampDone,
        ]
        .into_iter()
        .chain(Fault::ALL.iter().map(|&f| E::Fault(f)))
    }

    #[test]
    fn codes_go_there_and_back() {
        for mode in modes() {
            let fault = mode.fault().map_or(0, Fault::code);
            assert_eq!(Mode::from_codes(mode.code(), fault), Some(mode));
        }
        assert_eq!(Mode::from_codes(4, 1), None);
        assert_eq!(Mode::from_codes(6, 0), None);
        assert_eq!(Mode::from_codes(7, 0), None);
    }

    #[test]
    fn p18_armed_is_entered_only_by_arming_when_ready() {
        for mode in modes() {
            for event in events() {
                if next(mode, event) == Mode::Armed && mode != Mode::Armed {
                    assert_eq!((mode, event), (Mode::Ready, Event::Arm));
                }
            }
        }
    }

    #[test]
    fn p18_each_stage_is_entered_only_from_the_one_before() {
        for mode in modes() {
            for event in events() {
                let after = next(mode, event);
                if after == mode {
                    continue;
                }
                match after {
                    Mode::Boot => assert!(matches!(mode, Mode::Fault { .. })),
                    Mode::Settling => assert_eq!(mode, Mode::Idle),
                    Mode::Ready => assert!(matches!(
                        mode,
                        Mode::Settling | Mode::Ramp { cause: RampCause::Disarm }
                    )),
                    Mode::Ramp { .. } => assert!(matches!(
                        mode,
                        Mode::Armed | Mode::Ramp { cause: RampCause::Disarm }
                    )),
                    Mode::Idle | Mode::Armed | Mode::Fault { .. } => (),
                }
            }
        }
    }

    #[test]
    fn latched_faults_leave_only_by_clearing() {
        for cause in Fault::ALL.iter().copied() {
            let latched = Mode::Fault { cause };
            for event in events() {
                let expected = if event == Event::ClearFault { Mode::Boot } else { latched };
                assert_eq!(next(latched, event), expected);
            }
        }
    }

    #[test]
    fn no_fault_leaves_output_on() {
        for mode in modes() {
            for fault in Fault::ALL.iter().copied() {
                let after = next(mode, Event::Fault(fault));
                assert!(after != Mode::Armed && after != Mode::Ramp { cause: RampCause::Disarm });
                if fault.reaction() == Reaction::Cut {
                    assert!(matches!(after, Mode::Fault { .. }));
                }
            }
        }
    }
}
