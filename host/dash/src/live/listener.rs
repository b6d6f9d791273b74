//! Whoever hears the bus besides the pictures.

use cathforce_bus::{Direction, Frame};
use cathforce_recording::Measured;

/// Hears a device that runs. It is called on the thread of the bus, and must not wait.
pub trait Listener: Send {
    /// The device uses this image from now on.
    fn begins(&mut self, image: &[u8]);
    /// A frame was sent or received, of whatever kind.
    fn frame(&mut self, direction: Direction, frame: &Frame);
    /// A sensor measured this now.
    fn measured(&mut self, row: &Measured);
}
