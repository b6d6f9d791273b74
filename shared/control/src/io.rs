//! What goes into a tick and what comes out.

use cathforce_mechanics as mechanics;

use crate::{Fault, Grip, HalfWidths, HapticSource, Mode};

/// Everything that reached the device since the last tick, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Inputs {
    /// The newest encoder sample whose frame was valid; `None` if there was none.
    pub encoder: Option<EncoderSample>,
    /// Likewise of the guidewire's drive; of no effect where there is none.
    pub guidewire: Option<GuidewireSample>,
    /// What the operator holds. `None`: unchanged; before the first one, the handle counts as held.
    pub grip: Option<Grip>,
    /// Frames rejected since the last tick (CRC, counter, length); saturates.
    pub rejected_frames: u8,
    /// At most one command a tick.
    pub command: Option<Command>,
    /// What the device noticed about itself.
    pub notice: Option<Notice>,
}

/// Where the drive says it is.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct EncoderSample {
    /// Length of instrument past the entry plane \[m\].
    pub insertion_m: f32,
    /// Rotation at the entry plane, right-handed about the direction of insertion \[rad\].
    pub rotation_rad: f32,
}

/// Where the guidewire's drive says it is, and whether the operator holds on to it.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct GuidewireSample {
    pub at: EncoderSample,
    /// The operator holds the guidewire's button: its load is felt.
    pub held: bool,
}

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Check settings and limiter, then wait for encoders.
    SelfTest,
    /// Start output; only when ready.
    Arm,
    /// Ramp output to zero.
    Disarm,
    /// Leave a latched fault; `token` is that fault's [`Fault::clear_token`].
    ClearFault { token: u32 },
}

/// What only the device around the tick can notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// The last two ticks both ran over their time.
    Overrun,
    /// The bus controller went bus-off.
    BusOff,
}

/// What a tick gives. Per-node results are read from [`crate::State::mechanics`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    pub mode: Mode,
    /// Why output is stopping or has stopped.
    pub fault: Option<Fault>,
    /// What changed the output in this tick.
    pub limited: LimitFlags,
    /// Whose load the output renders.
    pub haptic_source: HapticSource,
    /// On the operator's linear axis, positive against insertion \[N\].
    pub force_n: f32,
    /// On the operator's rotary axis, positive against positive rotation \[N·m\].
    pub torque_n_m: f32,
    /// What the model found; all zero in modes that do not track.
    pub contact: mechanics::Outputs<f32>,
    /// How far these forces may be off.
    pub band: HalfWidths,
    /// Ticks since the newest accepted encoder sample, saturating; 0 if it came in this tick.
    pub encoder_age_ticks: u8,
    /// Likewise of the guidewire's; 0 where there is none.
    pub guidewire_age_ticks: u8,
    /// Rolling hash over the bits of every output of every tick since configuration.
    pub digest: u32,
}

/// Set of reasons why the output of a tick is not what the haptic law asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct LimitFlags(u8);

impl LimitFlags {
    /// Force cut to `force_limit_n`.
    pub const FORCE: Self = Self(1 << 0);
    /// Torque cut to `torque_limit_n_m`.
    pub const TORQUE: Self = Self(1 << 1);
    /// Force changed no faster than `force_slew_n_per_s`.
    pub const FORCE_SLEW: Self = Self(1 << 2);
    /// Torque changed no faster than `torque_slew_n_m_per_s`.
    pub const TORQUE_SLEW: Self = Self(1 << 3);
    /// Force or torque scaled down: the energy that its axis has given out has come near half of
    /// `energy_limit_j`.
    pub const ENERGY: Self = Self(1 << 4);
    /// The model did not converge in this tick: the last trusted force and torque are held.
    pub const HELD: Self = Self(1 << 5);
    /// A number that is not finite was replaced by zero.
    pub const NOT_FINITE: Self = Self(1 << 6);
    /// Nobody holds the handle: force and torque slew to zero and stay there.
    pub const RELEASED: Self = Self(1 << 7);

    /// No reason: the output is what was asked for.
    pub const fn none() -> Self {
        Self(0)
    }

    /// As on the bus.
    pub const fn bits(self) -> u8 {
        self.0
    }

    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Every reason of `other` is set.
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
