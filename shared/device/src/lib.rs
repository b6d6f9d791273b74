//! The device without its hardware, in two halves.
//!
//! * [`ControlLoop`] belongs to the tick interrupt: process frames in, one control step, frames
//!   out. The host's replay and its virtual board run the same one.
//! * [`Service`] belongs to a task: it answers service messages and collects an uploaded
//!   image in a spare buffer. What it wants done it asks of the [`Board`].
//!
//! Frames with the id [`Id::ServiceRequest`](cathforce_bus::Id) go to the service, all
//! others to the ticker, in the order in which they arrived.

#![no_std]
#![forbid(unsafe_code)]

mod control_loop;
mod refusal;
mod service;

pub use control_loop::{ControlLoop, MAX_FRAMES_PER_TICK, TickFrames};
pub use service::{Board, Identity, Image, Service, copy_from};
