//! A device that runs: what its bus carries, gathered into one picture of the present, and what may be
//! done with the device.

mod action;
mod bus;
mod drive;
mod faults;
mod follow;
mod gather;
mod listener;
mod pilot;
mod record;
mod timing;
mod twin;

pub use action::{Action, Wanted};
pub use drive::{Drive, Measurement};
pub use follow::{Feed, FollowSource, feed};
pub use listener::Listener;
pub use pilot::{LinkSource, Pilot};
pub use record::NewRecording;
