//! The commands, each in a file of its own.

pub mod check;
pub mod config;
pub mod doctor;
pub mod export;
pub mod fault;
pub mod gap;
pub mod import;
pub mod info;
pub mod latency;
pub mod link;
pub mod lumen;
pub mod monitor;
pub mod play;
pub mod replay;
pub mod report;
pub mod run;
pub mod shell;
pub mod tips;

// The commands of `gap` reach these by their parent.
pub use crate::image::{by_hand, described, image_with, options, set_all};
pub use crate::open::{open_bundle, open_recording};
