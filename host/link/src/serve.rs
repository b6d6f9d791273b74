//! A device in this process on a real bus, for masters that are tried without a board.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::{Link, LinkError, Sim};

/// How long an order to stop may go unnoticed. Running free, the device's tick is shorter.
const WAIT: Duration = Duration::from_millis(50);
const TICK: Duration = Duration::from_millis(1);

/// What crossed the bus meanwhile \[frames\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    pub received: u64,
    pub sent: u64,
    /// Sent by the device and taken by nobody: no other node acknowledged them.
    pub unsent: u64,
}

/// Lets `device` answer on `link` until `stop` is set or the link is lost.
pub fn serve(
    link: &mut dyn Link,
    device: &mut Sim,
    stop: &AtomicBool,
) -> Result<Served, LinkError> {
    let mut served = Served::default();
    while !stop.load(Ordering::Relaxed) {
        let wait = if device.ticker().lock_step() { WAIT } else { TICK };
        if let Some(frame) = link.receive(wait)? {
            served.received += 1;
            device.send(&frame)?;
        }
        let mut is_stuck = false;
        while let Some(frame) = device.receive(Duration::ZERO)? {
            // A bus on which nobody listens is no reason to end: a device does not either.
            match if is_stuck { Ok(()) } else { link.send(&frame) } {
                Ok(()) => {}
                Err(LinkError::Stuck { .. }) => is_stuck = true,
                Err(error) => return Err(error),
            }
            let count = if is_stuck { &mut served.unsent } else { &mut served.sent };
            *count += 1;
        }
        if !is_stuck {
            link.flush()?;
        }
    }
    Ok(served)
}
