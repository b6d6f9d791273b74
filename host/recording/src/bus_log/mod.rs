//! Logs of a CAN bus as other tools write them: candump, Vector ASC and BLF, PEAK TRC, and the tables of
//! SavvyCAN and python-can; each of them packed by gzip or not.
//!
//! The format is told by the content, so that a name's ending does not matter.

mod asc;
mod blf;
mod candump;
mod log;
mod numbers;
mod read;
mod table;
mod trc;

pub use log::{BusLog, LogError, LogFormat, Logged};
