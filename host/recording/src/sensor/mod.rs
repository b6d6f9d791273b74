//! A force sensor that is read while a trial runs: ATI's Net F/T, and others that speak its protocol.

mod address;
mod collected;
mod configuration;
mod error;
mod packet;
mod receiver;
mod timing;

pub use address::SensorAddress;
pub use error::SensorError;
pub use receiver::{ForceSensor, SensedForces, SensorOptions};
