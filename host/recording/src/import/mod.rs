//! Imports measurements of other tools as the rows of a trial.
//!
//! It reads the log of a force/torque sensor, any CSV whose columns the user names, and bags of ROS 2.

mod ati;
pub mod drive;
mod error;
mod join;
mod join_seen;
mod ros;
mod table;

pub use ati::{AtiLog, AtiOptions, AxisMap, ForceCalibration, ForceSample, read_ati};
pub(crate) use ati::{status, units};
pub use cathforce_bundle::bundle::ColumnMap;
pub use error::ImportError;
pub use join::{Joined, join};
pub use join_seen::{JoinedSeen, Seen, best_offset, join_seen};
pub use ros::{ImportedBag, RosClock, RosError, RosFile, RosTopic, list_ros, read_ros};
pub use table::{ImportedTable, ImportedTrial, is_trial, read_csv, read_motion};
