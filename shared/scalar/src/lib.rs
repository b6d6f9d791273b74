//! The number type of the model.
//!
//! The model is written once, generic over [`Real`]: `f32` on the device and in every
//! host computation that must agree with it to the last bit, `f64` as the twin that
//! shows what single precision costs.
//!
//! Only operations that IEEE 754 rounds correctly (+ − × ÷ √) and functions built from
//! them may be used in the model; that, and no fused multiply-add, is why host and
//! device agree to the last bit.

#![no_std]

// On a host it knows what the processor can do.
#[cfg(target_arch = "x86_64")]
extern crate std;

mod number;
mod pack;
mod real;
mod storage;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86_64;

pub use number::Number;
pub use pack::{Kernel, Pack};
pub use real::Real;
pub use storage::{ScalarStorage, Storage3};
pub use vector::Vector3;
