//! Recordings of the bus: written while a trial runs, read, decoded, compared with the
//! sensor and replayed through the same tick on the host.
//!
//! A recording is an MCAP file that stands alone: raw frames in bus order, the device image,
//! the rig's description, the rows of the trial that was played, and what the frames mean.
//! Decoded quantities are in it too, for tools that plot; nothing is ever read back from them.

#![forbid(unsafe_code)]

mod analysis;
mod bus_log;
mod candump;
mod container;
mod decoding;
mod export;
mod format;
pub mod import;
mod reading;
mod replay;
pub mod sensor;
mod writing;

pub use cathforce_bus::Direction;

pub use analysis::analyse::{Analysis, PeakContact, analyse};
pub use analysis::compare::{
    ChannelError, Comparison, FEED_BEFORE_SCORE_M, ForceError, SNAP_GUARD_S, SnapPair, compare,
};
pub use analysis::coverage::{COLUMNS, Coverage, Covered, NORMAL_NINETY};
pub use analysis::estimates::{estimates, trial_time_s};
pub use analysis::noise::white_noise;
pub use analysis::sensed::as_sensed;
pub use analysis::summary::Summary;
pub use analysis::{latency, snap};
pub use bus_log::{BusLog, LogError, LogFormat, Logged};
pub use candump::{
    CandumpLog, Gap, NoLockStep, SecondRun, direction, has_checksum, read_candump, read_log,
    write_candump,
};
pub use container::{Cut, Damage};
pub use decoding::live::{
    MESSAGE_ENCODING, SCHEMA_ENCODING, Topic, TopicError, TopicMessage, Topics,
};
pub use decoding::tick::{
    Completed, Decoder, GuidewireEstimate, NodeEstimate, NodePass, TickEstimate, decode,
};
pub use export::bundle::{write_bundle, write_drive, write_transmission, write_trial};
pub use export::columns::{Column, tick_columns};
#[cfg(feature = "parquet")]
pub use export::parquet_file::write_ticks_parquet;
pub use export::series::{write_nodes_csv, write_ticks_csv};
pub use export::synthetic::{CAMERA_HZ, FORCE_HZ, synthetic_trial};
pub use format::clock::BusClock;
pub use format::dropout::{Dropout, DropoutCause};
pub use format::frame::BusFrame;
pub use format::info::{FORMAT, RunInfo, RunResult};
pub use format::layout::VESSEL_FILES;
pub use format::trial::{Estimate, Measured, MeasuredDrive, SensorNoise, Trial};
pub use reading::reader::{ReadError, Recording, is_recording};
pub use reading::survey::{DropoutCount, IdCount, Survey, bus_load, name as frame_name, survey};
pub use replay::{Difference, ReplayError, ReplayReport, Track, replay};
pub use writing::atomic::{make_folder, put_whole, write_whole};
pub use writing::background::BackgroundRecorder;
pub use writing::writer::{Attachments, Recorder, WriteError, is_being_recorded};
