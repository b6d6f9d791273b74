//! Closes the operator's loop in the computer: a hand, the handle of a master with its motors, a bus with
//! delay and jitter, and the device, whose control loop is the one that runs on a board.
//!
//! | file | what it does |
//! | --- | --- |
//! | `handle` | the handle and the hand that holds it, along one axis |
//! | `carrier` | frames on their way: delayed, and each a little more or less |
//! | `operation` | one operation: insert, press, hold still; what happened to the handle |
//! | `map` | many operations: which hands, gains and delays are stable, with and without the passivity observer |
//!
//! The equations are in docs/explanation/haptics.md.

#![forbid(unsafe_code)]

mod carrier;
mod handle;
mod map;
mod operation;

pub use carrier::Delay;
pub use handle::{Axis, Hand, Handle};
pub use map::{Cell, Map, Outcome};
pub use operation::{HapticsError, Operation, Passed};
