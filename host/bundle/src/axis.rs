//! The kind of an axis on its own, and of what it is commanded by.

/// The kind of axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// m, N, kg.
    Linear,
    /// rad, N·m, kg·m².
    Rotary,
}

impl Axis {
    /// Of its positions.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Linear => "m",
            Self::Rotary => "rad",
        }
    }

    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }
}

/// What a drive was commanded by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandKind {
    /// The whole force, or torque, at the axis.
    Force,
    /// Current of the motor \[A\].
    Current,
    /// Voltage of the motor \[V\].
    Voltage,
}
