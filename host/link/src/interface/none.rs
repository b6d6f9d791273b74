//! Where there is no SocketCAN.

use super::{Interface, Setup};
use crate::LinkError;

fn no_can() -> LinkError {
    LinkError::no_can("socketcan")
}

/// Always an error: CAN sockets need Linux.
pub fn check_sockets() -> Result<(), LinkError> {
    Err(no_can())
}

/// Always empty: CAN interfaces need Linux.
pub fn list() -> Vec<Interface> {
    Vec::new()
}

/// Always an error: CAN interfaces need Linux.
pub fn find(_: &str) -> Result<Interface, LinkError> {
    Err(no_can())
}

/// Always an error: CAN interfaces need Linux.
pub fn bring_up(_: &str, _: Setup) -> Result<Interface, LinkError> {
    Err(no_can())
}

/// Always an error: CAN interfaces need Linux.
pub fn bring_down(_: &str) -> Result<(), LinkError> {
    Err(no_can())
}
