//! A device in this process on a real bus, to try a master without a board.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::{Link, LinkError, Sim};

/// Longest wait in lock step, after which `stop` is looked at. Running free, the wait is a tick.
const WAIT: Duration = Duration::from_millis(50);
const TICK: Duration = Duration::from_millis(1);

/// Counts of the frames that crossed the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    pub received: u64,
    pub sent: u64,
    /// Sent by the device while nobody was there to take them.
    pub unsent: u64,
    /// Dropped by the link because somebody did not take them in time.
    pub dropped: u64,
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
            // A device goes on when nobody listens on its bus.
            match if is_stuck { Ok(()) } else { link.send(&frame) } {
                Ok(()) => {}
                Err(LinkError::Stuck { .. } | LinkError::Alone { .. }) => is_stuck = true,
                Err(error) => return Err(error),
            }
            let count = if is_stuck { &mut served.unsent } else { &mut served.sent };
            *count += 1;
        }
        if !is_stuck {
            link.flush()?;
        }
    }
    Ok(Served { dropped: link.dropped(), ..served })
}
