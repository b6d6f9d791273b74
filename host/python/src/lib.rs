//! The compiled part of the Python package `cathforce`: models of rigs, single catheters, many catheters at
//! once, and recordings.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `row` | positions of all drives in a tick, read from Python |
//! | `rig` | the configuration of a tick, with the image that it reads in |
//! | `twin` | one catheter: a rig and a state, in `f32` or in `f64` |
//! | `ticks` | what ticks computed, as arrays |
//! | `model`, `simulator`, `batch`, `recording` | the classes that Python sees |
//!
//! Everything else of the package is Python, in `python/cathforce/`.

#![forbid(unsafe_code)]

mod abreast;
mod arrays;
mod batch;
mod course;
mod errors;
mod interrupt;
mod model;
mod recording;
mod rig;
mod row;
mod simulator;
mod snapshot;
mod ticks;
mod trial;
mod twin;

use pyo3::prelude::*;

/// The compiled part of `cathforce`.
#[pymodule]
mod _cathforce {
    #[pymodule_export]
    use crate::batch::Batch;
    #[pymodule_export]
    use crate::model::{Model, settings};
    #[pymodule_export]
    use crate::recording::read_recording;
    #[pymodule_export]
    use crate::simulator::Simulator;
    #[pymodule_export]
    use crate::snapshot::Snapshot;
    #[pymodule_export]
    use crate::ticks::Ticks;
    #[pymodule_export]
    use crate::trial::read_trials;
}
