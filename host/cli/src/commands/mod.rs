//! The commands, each in a file of its own.

pub mod bundle;
pub mod calibrate;
pub mod check;
pub mod config;
#[cfg(feature = "dash")]
pub mod dash;
pub mod demo;
pub mod doctor;
pub mod export;
pub mod fault;
pub mod filter;
pub mod flash;
pub mod gap;
pub mod haptics;
pub mod identify;
pub mod import;
pub mod info;
pub mod latency;
mod left_out;
pub mod link;
pub mod lumen;
#[cfg(feature = "wall")]
pub mod material;
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
#[cfg(feature = "wall")]
pub mod ultrasound;
#[cfg(feature = "wall")]
pub mod wall;

#[cfg(not(feature = "monitor"))]
pub use left_out::monitor;
#[cfg(not(feature = "dash"))]
pub use left_out::{dash, web};
#[cfg(not(feature = "wall"))]
pub use left_out::{material, ultrasound, wall};
