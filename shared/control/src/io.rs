//! Inputs and outputs of a tick.

use cathforce_mechanics as mechanics;

use crate::{Fault, Grip, HalfWidths, HapticSource, Mode};

/// Everything that the device received since the last tick, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Inputs {
    /// The newest sample of the catheter's encoder in a valid frame; `None` if there was none.
    pub encoder: Option<EncoderSample>,
    /// The newest sample of the guidewire's encoder, likewise; ignored without a guidewire.
    pub guidewire: Option<GuidewireSample>,
    /// The newest displacements of the tendons' drives, two tendons in each; ignored without tendons.
    pub tendons: [Option<TendonPair>; TENDON_PAIRS],
    /// What the operator holds. `None`: unchanged; before the first one, the handle counts as held.
    pub grip: Option<Grip>,
    /// Frames rejected since the last tick by CRC, counter or length; saturating.
    pub rejected_frames: u8,
    /// At most one command a tick.
    pub command: Option<Command>,
    /// A problem that the device has detected in itself.
    pub notice: Option<Notice>,
}

/// Position of a drive by its encoder.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct EncoderSample {
    /// Length of instrument past the entry plane \[m\].
    pub insertion_m: f32,
    /// Rotation at the entry plane, right-handed about the direction of insertion \[rad\].
    pub rotation_rad: f32,
}

/// Position of the guidewire's drive by its encoder, and whether the operator holds its button.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct GuidewireSample {
    pub at: EncoderSample,
    /// The operator holds the guidewire's button, and feels its load.
    pub held: bool,
}

/// Frames that state the displacements of all tendons.
pub const TENDON_PAIRS: usize = mechanics::MAX_TENDONS / 2;

/// Displacements of two tendons by the encoders of their drives.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct TendonPair {
    /// From where the tendon is taut in the straight instrument, positive when pulling \[m\].
    pub displacements_m: [f32; 2],
}

/// A command of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Check settings and limiter, then wait for the encoders.
    SelfTest,
    /// Start the output; accepted only when ready.
    Arm,
    /// Ramp the output to zero.
    Disarm,
    /// Clear a latched fault; `token`: the fault's [`Fault::clear_token`].
    ClearFault { token: u32 },
}

/// A problem that only the device around the tick can detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// The last two ticks both exceeded their time.
    Overrun,
    /// The bus controller went bus-off.
    BusOff,
    /// The device reset itself because the tick or a task hung.
    Hang,
    /// It reset itself after a panic.
    Panic,
    /// It reset itself after a fault of the processor.
    HardFault,
    /// It reset itself after its stack overflowed.
    StackOverflow,
    /// It had saved images, and none can be used.
    SavedImageLost,
}

impl Notice {
    /// The fault that the notice raises.
    pub const fn fault(self) -> Fault {
        match self {
            Self::Overrun => Fault::Overrun,
            Self::BusOff => Fault::BusOff,
            Self::Hang => Fault::Hang,
            Self::Panic => Fault::Panic,
            Self::HardFault => Fault::HardFault,
            Self::StackOverflow => Fault::StackOverflow,
            Self::SavedImageLost => Fault::SavedImageLost,
        }
    }

    /// The notice that raises a fault; `None` for faults that the tick finds itself.
    pub const fn of(fault: Fault) -> Option<Self> {
        match fault {
            Fault::Overrun => Some(Self::Overrun),
            Fault::BusOff => Some(Self::BusOff),
            Fault::Hang => Some(Self::Hang),
            Fault::Panic => Some(Self::Panic),
            Fault::HardFault => Some(Self::HardFault),
            Fault::StackOverflow => Some(Self::StackOverflow),
            Fault::SavedImageLost => Some(Self::SavedImageLost),
            _ => None,
        }
    }
}

/// Outputs of a tick. Results per node are read from [`crate::State::mechanics`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    pub mode: Mode,
    /// The fault for which output is stopping or has stopped.
    pub fault: Option<Fault>,
    /// The limits that changed the output in this tick.
    pub limited: LimitFlags,
    /// The instrument whose load is rendered.
    pub haptic_source: HapticSource,
    /// Force on the operator's linear axis, positive against insertion \[N\].
    pub force_n: f32,
    /// Torque on the operator's rotary axis, positive against positive rotation \[N·m\].
    pub torque_n_m: f32,
    /// Outputs of the model; all zero in modes that do not track.
    pub contact: mechanics::Outputs<f32>,
    /// Uncertainty of these forces.
    pub band: HalfWidths,
    /// Ticks since the newest accepted encoder sample, saturating; 0 if it came in this tick.
    pub encoder_age_ticks: u8,
    /// Age of the guidewire's newest accepted sample, likewise; 0 without a guidewire.
    pub guidewire_age_ticks: u8,
    /// Rolling hash over all bits of all outputs since configuration.
    pub digest: u32,
}

/// Set of reasons why the output of a tick differs from the demand of the haptic law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct LimitFlags(u8);

impl LimitFlags {
    /// The force was limited to `force_limit_n`.
    pub const FORCE: Self = Self(1 << 0);
    /// The torque was limited to `torque_limit_n_m`.
    pub const TORQUE: Self = Self(1 << 1);
    /// The rate of the force was limited to `force_slew_n_per_s`.
    pub const FORCE_SLEW: Self = Self(1 << 2);
    /// The rate of the torque was limited to `torque_slew_n_m_per_s`.
    pub const TORQUE_SLEW: Self = Self(1 << 3);
    /// Force or torque was limited, because the energy that its axis has delivered approaches half of
    /// `energy_limit_j`.
    pub const ENERGY: Self = Self(1 << 4);
    /// The model did not resolve this tick; the last trusted force and torque are held.
    pub const HELD: Self = Self(1 << 5);
    /// A number that is not finite was replaced by zero.
    pub const NOT_FINITE: Self = Self(1 << 6);
    /// Nobody holds the handle; force and torque slew to zero and stay there.
    pub const RELEASED: Self = Self(1 << 7);

    /// No reason: the output equals the demand.
    pub const fn none() -> Self {
        Self(0)
    }

    /// The bits as on the bus.
    pub const fn bits(self) -> u8 {
        self.0
    }

    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// All reasons of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl core::ops::BitOr for LimitFlags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl core::ops::BitOrAssign for LimitFlags {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}
