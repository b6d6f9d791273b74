//! This library was built without Foxglove's server: it says so.

use std::net::SocketAddr;

use cathforce_bus::master::Master;
use cathforce_recording::Recording;

use crate::error::DashError;
use crate::live::Listener;

/// There is none.
pub enum Bridge {}

impl Bridge {
    pub async fn live(
        _: SocketAddr,
        _: &str,
        _: Master,
    ) -> Result<(Self, Box<dyn Listener>), DashError> {
        Err(DashError::WithoutFoxglove)
    }

    pub async fn replay(_: SocketAddr, _: &str, _: Recording) -> Result<Self, DashError> {
        Err(DashError::WithoutFoxglove)
    }

    pub fn address(&self) -> SocketAddr {
        match *self {}
    }
}
