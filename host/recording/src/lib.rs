//! Recordings of the bus: written while a trial runs, read, decoded, compared with the
//! sensor and replayed through the same tick on the host.
//!
//! A recording is an MCAP file that stands alone: raw frames in bus order, the device image,
//! the rig's description, the rows of the trial that was played, and what the frames mean.
//! Decoded quantities are in it too, for tools that plot; nothing is ever read back from them.

#![forbid(unsafe_code)]

mod analysis;
mod atomic;
mod background;
mod bundle;
mod candump;
mod clock;
mod columns;
mod compare;
mod coverage;
mod dropout;
mod frame;
pub mod import;
mod info;
pub mod latency;
mod layout;
mod messages;
mod noise;
mod parquet_file;
mod reader;
mod replay;
mod sensed;
mod series;
pub mod snap;
mod summary;
mod survey;
mod tick;
mod topics;
mod trial;
mod writer;

pub use cathforce_bus::Direction;

pub use analysis::{Analysis, PeakContact, analyse};
pub use atomic::{make_folder, put_whole, write_whole};
pub use background::BackgroundRecorder;
pub use bundle::{write_bundle, write_drive, write_trial};
pub use candump::{
    CandumpError, CandumpLog, Gap, NoLockStep, SecondRun, direction, read_candump, write_candump,
};
pub use clock::BusClock;
pub use compare::{
    ChannelError, Comparison, FEED_BEFORE_SCORE_M, ForceError, SNAP_GUARD_S, SnapPair, compare,
};
pub use coverage::{COLUMNS, Coverage, Covered, NORMAL_NINETY};
pub use dropout::{Dropout, DropoutCause};
pub use frame::BusFrame;
pub use info::{FORMAT, RunInfo, RunResult};
pub use layout::VESSEL_FILES;
pub use noise::white_noise;
pub use parquet_file::write_ticks_parquet;
pub use reader::{Cut, ReadError, Recording, is_recording};
pub use replay::{Difference, ReplayError, ReplayReport, Track, replay};
pub use sensed::as_sensed;
pub use series::{estimates, trial_time_s, write_nodes_csv, write_ticks_csv};
pub use summary::Summary;
pub use survey::{DropoutCount, IdCount, Survey, bus_load, name as frame_name, survey};
pub use tick::{
    Completed, Decoder, GuidewireEstimate, NodeEstimate, NodePass, TickEstimate, decode,
};
pub use trial::{Estimate, Measured, MeasuredDrive, SensorNoise, Trial};
pub use writer::{Attachments, Recorder, WriteError};
