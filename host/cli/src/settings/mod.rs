//! Settings of one rig, kept in a file: what `--set` takes, with where each value comes from.

pub mod band;
pub mod entry;
mod file;
pub mod master;
pub mod model;
pub mod parse;
mod problem;
mod staged;
mod table;
pub mod units;

pub use entry::Setting;
pub use file::{SettingsFile, master_of, parse_file};
pub use problem::{Problem, refused};
pub use staged::{Staged, replaceable};

/// Version of the layout and the names that this program writes.
pub const SCHEMA_VERSION: u32 = 1;
