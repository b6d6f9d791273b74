//! Modes, and the only table that says how one follows another.

use crate::Fault;

/// What the device is doing. States carry their cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Mode {
    /// Configured; waiting for the self-test.
    #[default]
    Boot,
    /// Self-test passed; waiting for encoders.
    Idle,
    /// The model is fed from the empty guide to the measured insertion.
    Settling,
    /// The model tracks the drive; output is zero.
    Ready,
    /// Output follows the model.
    Armed,
    /// Output goes to zero.
    Ramp { cause: RampCause },
    /// Output is zero until the fault is cleared.
    Fault { cause: Fault },
}

/// Why output goes to zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RampCause {
    Disarm,
    Fault(Fault),
}

impl Mode {
    /// Code of the HAPTIC frame; the cause travels in the fault byte beside it.
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

    /// The inverse, from the mode and fault bytes; `None` if they do not belong together.
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

    /// Why output is stopping or has stopped.
    pub const fn fault(self) -> Option<Fault> {
        match self {
            Self::Ramp { cause: RampCause::Fault(cause) } | Self::Fault { cause } => Some(cause),
            _ => None,
        }
    }

    /// One word for people.
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
