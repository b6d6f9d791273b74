//! Number types of the model.
//!
//! The model is generic over [`Real`]. The device uses `f32`, and so does every host computation that
//! must agree with it to the last bit. The twin in `f64` shows the cost of single precision.
//!
//! The model uses only operations that IEEE 754 rounds correctly (+ − × ÷ √), functions built from
//! them, and no fused multiply-add. Host and device therefore agree to the last bit.

#![no_std]

// For the detection of processor features on a host.
#[cfg(target_arch = "x86_64")]
extern crate std;

mod abreast;
mod catheters;
mod number;
mod pack;
mod real;
mod storage;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86_64;

pub use abreast::Abreast;
pub use catheters::{Blend, Catheters};
pub use number::Number;
pub use pack::{Gather, Kernel, Pack, PlainPack};
pub use real::Real;
pub use storage::{ScalarStorage, Storage3};
pub use vector::Vector3;
