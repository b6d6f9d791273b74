//! The commands, each in a file of its own.

pub mod bundle;
pub mod check;
pub mod config;
pub mod doctor;
pub mod export;
pub mod fault;
pub mod gap;
pub mod import;
pub mod info;
pub mod latency;
mod left_out;
pub mod link;
pub mod lumen;
#[cfg(feature = "monitor")]
pub mod monitor;
pub mod play;
pub mod replay;
pub mod report;
pub mod reproduce;
pub mod run;
pub mod shell;
pub mod simulate;
pub mod tips;

#[cfg(not(feature = "monitor"))]
pub use left_out::monitor;
