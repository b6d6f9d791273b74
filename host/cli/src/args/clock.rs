//! The time of a message.

use cathforce_recording::import::RosClock;

/// Which time of a message counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Clock {
    /// That of the message's header; of the recorder for messages without one.
    Stamp,
    /// When the recorder received it.
    Log,
}

impl From<Clock> for RosClock {
    fn from(clock: Clock) -> Self {
        match clock {
            Clock::Stamp => Self::Stamp,
            Clock::Log => Self::Log,
        }
    }
}
