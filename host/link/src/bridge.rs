//! Two buses that carry each other's frames, as where the adapter is in another computer.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::{Link, LinkError};

/// Longest wait for a frame of one side while the other one is not looked at: a tenth of a tick.
const WAIT: Duration = Duration::from_micros(100);

/// Counts of the frames that crossed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bridged {
    /// From the first link to the second, and back.
    pub crossed: [u64; 2],
    /// The same, of frames that the other link did not take.
    pub lost: [u64; 2],
}

/// Carries every frame of each link to the other, in its order, until `stop` is set or a link is lost.
pub fn bridge(
    first: &mut dyn Link,
    second: &mut dyn Link,
    stop: &AtomicBool,
) -> Result<Bridged, LinkError> {
    let mut bridged = Bridged::default();
    while !stop.load(Ordering::Relaxed) {
        carry(first, second, &mut bridged, 0)?;
        carry(second, first, &mut bridged, 1)?;
    }
    bridged.lost[0] += second.dropped();
    bridged.lost[1] += first.dropped();
    Ok(bridged)
}

/// Carries what is there; waits for a moment where there is nothing.
fn carry(
    from: &mut dyn Link,
    to: &mut dyn Link,
    bridged: &mut Bridged,
    way: usize,
) -> Result<(), LinkError> {
    let (mut wait, mut is_stuck) = (WAIT, false);
    while let Some(frame) = from.receive(wait)? {
        wait = Duration::ZERO;
        match if is_stuck { Ok(()) } else { to.send(&frame) } {
            Ok(()) => {}
            // A bus on which nobody listens takes nothing; the other one goes on.
            Err(LinkError::Stuck { .. } | LinkError::Alone { .. }) => is_stuck = true,
            Err(error) => return Err(error),
        }
        let counts = if is_stuck { &mut bridged.lost } else { &mut bridged.crossed };
        counts[way] += 1;
    }
    if is_stuck { Ok(()) } else { to.flush() }
}
