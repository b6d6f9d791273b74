//! The device's model against the reference solver, case by case.
//!
//! A [`Case`] is a rod, an analytic vessel and a schedule of the drive. [`solve`] gives the
//! reference's answer, [`play`] that of the model as the device runs it (single precision,
//! 64 links, a stored wall), and [`compare`] the errors.

#![forbid(unsafe_code)]

mod cases;
mod causes;
mod compare;
mod device;
mod export;
mod links;
mod summary;

pub use cases::{Case, Kind, cases};
pub use causes::causes;
pub use compare::{Errors, Record, Score, Snap, compare};
pub use device::{Choices, Links, play, play_on_device, play_watched};
pub use export::export;
pub use links::{by_links, finest, links_table};
pub use summary::{Accuracy, Row, measure, measure_all, solve, table};
