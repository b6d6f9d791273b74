//! Tests of the promises on the emulated board, over its bus.
//!
//! A [`Rig`] is a device that a test can switch on: the firmware in QEMU, or the same device
//! code in this process. Test bodies are written once and run on both; tests with a million executions run
//! in process only. A [`Bench`] is one such device in lock step with a host that seals every frame
//! correctly unless the test does otherwise.
//!
//! A [`real_board::RealBoard`] is a board on a bench, which runs free, and [`Free`] its host. [`places`] says which
//! promise is shown where.
//!
//! A [`lab::Lab`] is the emulated board with a debugger, which puts faults in from outside.
//!
//! A [`guest::Guest`] is a Linux machine with CAN, which this computer's kernel may lack.
//!
//! `docs/promises.md` says which test stands for which promise. Tests on the emulated board
//! need QEMU and the firmware: without them they fail and name the command that provides
//! them (`cargo xtask test` runs it first).

#![forbid(unsafe_code)]

mod bench;
mod chance;
mod fixture;
mod free;
pub mod guest;
pub mod lab;
pub mod places;
pub mod real_board;
mod rig;
mod trial;
mod watch;

pub use bench::{Bench, Tick, encoder};
pub use chance::Chance;
pub use fixture::{
    EXAMPLE, bundle, guidewire_bundle, image, image_with, program, small_image, strong_image,
};
pub use free::{Free, Paced, Plan};
pub use rig::Rig;
pub use trial::{Tape, drives, estimates, measured, play_armed, record, steps};
pub use watch::{LimitWatch, OutputReader};

/// Where a drive is: insertion \[m\], rotation \[rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    pub insertion_m: f64,
    pub rotation_rad: f64,
}
