//! The web front end: a device that runs, a recording, or a diagnosis, in a browser.
//!
//! [`serve`] answers one [`Source`] over HTTP and WebSocket. The pages are inside this library;
//! nothing is loaded from elsewhere. Everybody who can reach the address may watch; only who knows
//! the token may change anything.

#![forbid(unsafe_code)]

mod answers;
mod assets;
mod diagnosing;
mod diagnosis;
mod error;
#[cfg(feature = "foxglove")]
mod foxglove;
#[cfg(not(feature = "foxglove"))]
#[path = "foxglove_left_out.rs"]
mod foxglove;
mod guard;
mod joint_names;
mod live;
mod page;
mod recording;
#[cfg(feature = "ros2")]
mod ros2;
#[cfg(not(feature = "ros2"))]
#[path = "ros2_left_out.rs"]
mod ros2;
mod server;
mod settings;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
mod stamped;
mod tips;
mod token_file;

pub use diagnosing::Diagnosing;
pub use diagnosis::read_diagnosis;
pub use error::DashError;
pub use joint_names::JointNames;
pub use live::{Drive, Feed, FollowSource, LinkSource, Listener, Measurement, NewRecording, feed};
pub use page::page;
pub use ros2::{Joints, Ros2};
pub use server::{MOST_VIEWERS, Options, Source, Started, serve};
