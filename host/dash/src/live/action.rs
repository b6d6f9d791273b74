//! What somebody with the token may ask of a device.

use cathforce_control::{Fault, Mode};
use serde_json::Value;
use tokio::sync::oneshot;

use crate::settings::Changes;

/// The answer: data, or why nothing was done.
pub type Reply = oneshot::Sender<Result<Value, String>>;

/// A request and where its answer goes.
pub struct Action {
    pub wanted: Wanted,
    pub reply: Reply,
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Wanted {
    Arm,
    Disarm,
    SelfTest,
    /// Clears the fault on the device, if it still has it, and in the list.
    Acknowledge(Fault),
    /// Settings and the tip; they are read back.
    Apply(Changes),
    /// Starts or stops a recording.
    Record(bool),
    /// Starts or stops the motion of a trial that this program plays.
    Play(bool),
}

impl Wanted {
    /// The command that is sent to the device and the mode that it must reach.
    pub fn command(&self) -> Option<(cathforce_bus::Command, Mode)> {
        use cathforce_bus::Command;
        match self {
            Self::Arm => Some((Command::Arm, Mode::Armed)),
            Self::Disarm => Some((Command::Disarm, Mode::Ready)),
            Self::SelfTest => Some((Command::SelfTest, Mode::Ready)),
            Self::Acknowledge(_) | Self::Apply(_) | Self::Record(_) | Self::Play(_) => None,
        }
    }
}
