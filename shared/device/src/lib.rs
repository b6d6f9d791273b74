//! The device without its hardware, in two halves.
//!
//! * [`ControlLoop`] belongs to the tick interrupt. It collects process frames, computes one control
//!   step and returns the frames to send. The host's replay and its virtual board run the same code.
//! * [`Service`] belongs to a task. It answers service messages and collects an uploaded image in a
//!   spare buffer. It acts on the rest of the device through [`Board`].
//!
//! Frames with the id [`Id::ServiceRequest`](cathforce_bus::Id) go to the service, all others to the
//! control loop, in the order of their arrival.

#![no_std]
#![forbid(unsafe_code)]

mod bus_off;
mod control_loop;
mod refusal;
mod service;

pub use bus_off::BusRecovery;
pub use control_loop::{ControlLoop, Health, MAX_FRAMES_PER_TICK, TickFrames};
pub use service::{Board, Identity, Image, Service, WORK_BYTES, copy_from, refused_header};
