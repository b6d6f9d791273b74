//! Where there is no SocketCAN.

use super::{Interface, Setup};
use crate::LinkError;

fn no_can() -> LinkError {
    LinkError::no_can("socketcan")
}

/// As on Linux, where a raw socket can be opened.
pub fn check_sockets() -> Result<(), LinkError> {
    Err(no_can())
}

/// As on Linux: here there are none.
pub fn list() -> Vec<Interface> {
    Vec::new()
}

/// As on Linux: here there is none.
pub fn find(_: &str) -> Result<Interface, LinkError> {
    Err(no_can())
}

/// As on Linux, where it works.
pub fn bring_up(_: &str, _: Setup) -> Result<Interface, LinkError> {
    Err(no_can())
}

/// As on Linux, where it works.
pub fn bring_down(_: &str) -> Result<(), LinkError> {
    Err(no_can())
}
