//! How often the thread does what.

use std::time::Duration;

/// From one question for the device's status to the next.
pub const STATUS: Duration = Duration::from_secs(1);
pub const TICK: Duration = Duration::from_millis(1);
