//! Analysis of a recording: comparison with the sensor, snaps, latencies.

pub(crate) mod analyse;
pub(crate) mod compare;
pub(crate) mod coverage;
pub(crate) mod estimates;
pub mod latency;
pub(crate) mod noise;
pub(crate) mod sensed;
pub mod snap;
pub(crate) mod summary;
