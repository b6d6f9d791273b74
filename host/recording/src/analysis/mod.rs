//! Analysis of a recording: comparison with the sensor, snaps, latencies.

pub(crate) mod analyse;
pub(crate) mod compare;
pub mod latency;
pub(crate) mod sensed;
pub mod snap;
