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
///
/// `second` is the link that was opened last, perhaps minutes after `first`. What `first` has received until now is
/// dropped and not counted: no bus delivers frames from before somebody joined it.
pub fn bridge(
    first: &mut dyn Link,
    second: &mut dyn Link,
    stop: &AtomicBool,
) -> Result<Bridged, LinkError> {
    let mut bridged = Bridged::default();
    while first.receive(Duration::ZERO)?.is_some() {}
    let dropped_before = first.dropped();
    while !stop.load(Ordering::Relaxed) {
        carry(first, second, &mut bridged, 0)?;
        carry(second, first, &mut bridged, 1)?;
    }
    bridged.lost[0] += second.dropped();
    bridged.lost[1] += first.dropped() - dropped_before;
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

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::sync::Arc;

    use super::*;
    use crate::Frame;

    /// A bus on which those frames arrive in turn; an empty place is a moment without a frame.
    struct Scripted {
        arriving: VecDeque<Option<Frame>>,
        sent: Vec<Frame>,
        /// Set when nothing arrives any more.
        end: Arc<AtomicBool>,
    }

    impl Link for Scripted {
        fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            self.sent.push(*frame);
            Ok(())
        }

        fn flush(&mut self) -> Result<(), LinkError> {
            Ok(())
        }

        fn receive(&mut self, _: Duration) -> Result<Option<Frame>, LinkError> {
            if self.arriving.is_empty() {
                self.end.store(true, Ordering::Relaxed);
            }
            Ok(self.arriving.pop_front().flatten())
        }

        fn name(&self) -> &str {
            "scripted"
        }
    }

    #[test]
    fn frames_from_before_the_other_side_joined_do_not_cross() {
        let frame = |byte| Frame::new(0x123, &[byte]).unwrap();
        let end = Arc::new(AtomicBool::new(false));
        let bus = |arriving: Vec<Option<Frame>>| Scripted {
            arriving: arriving.into(),
            sent: Vec::new(),
            end: Arc::clone(&end),
        };
        let mut first = bus(vec![Some(frame(1)), Some(frame(2)), None, Some(frame(3)), None]);
        let mut second = bus(vec![Some(frame(4)), None, Some(frame(5)), None, None]);
        let bridged = bridge(&mut first, &mut second, &end).unwrap();
        assert_eq!((first.sent, second.sent), (vec![frame(4), frame(5)], vec![frame(3)]));
        assert_eq!(bridged, Bridged { crossed: [1, 2], lost: [0, 0] });
    }
}
