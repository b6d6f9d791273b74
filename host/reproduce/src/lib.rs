//! The published systems that the model stands on, computed again: one row for every printed figure.
//!
//! No recording of these experiments is public. The truth therefore comes from the reference solver
//! under the published dimensions, speeds and sensor noise ([`TRUTH`] says so on every page), and
//! "ours" is what the device's model makes of the same experiment. A figure that cannot be had this
//! way keeps its row, with the reason.

#![forbid(unsafe_code)]

mod cantilever;
mod cathbot;
mod elastica;
mod errors;
mod experiment;
mod ice;
mod iliac;
mod instruments;
#[cfg(not(feature = "wall"))]
mod left_out;
mod li;
mod meter;
mod noise;
mod part;
mod pescio;
mod plot;
mod registry;
mod report;
mod resin;
mod row;
mod shape;
#[cfg(feature = "wall")]
mod silicone;
mod text;
#[cfg(feature = "wall")]
mod ultrasound;

pub use instruments::{INSTRUMENTS, Instrument};
pub use plot::{Curve, Plot, Style};
pub use registry::{SYSTEMS, System};
pub use report::{Report, SystemReport, TRUTH, reproduce, work};
pub use row::Row;
pub use text::{groups, markdown, number, number_or_dash, table};
