//! A device that another part of the program runs: its frames come through a channel.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use cathforce_bus::{Direction, Frame};

/// Frames that wait to be gathered: three seconds of a full bus. Whoever runs the device never waits.
const WAITING: usize = 1 << 15;

/// What a follower hears.
pub(super) enum Heard {
    Begins { image: Vec<u8>, lock_step: bool },
    Frame(Direction, Frame),
}

/// The end of the channel of whoever runs the device.
#[derive(Clone, Debug)]
pub struct Feed {
    to: SyncSender<Heard>,
    lost: Arc<AtomicU64>,
}

/// The other end, of which pictures are made.
pub struct FollowSource {
    pub(super) heard: Receiver<Heard>,
    lost: Arc<AtomicU64>,
}

/// Both ends.
pub fn feed() -> (Feed, FollowSource) {
    let (to, heard) = sync_channel(WAITING);
    let lost = Arc::new(AtomicU64::new(0));
    (Feed { to, lost: Arc::clone(&lost) }, FollowSource { heard, lost })
}

impl Feed {
    /// The device uses this image from now on.
    pub fn begins(&self, image: &[u8], lock_step: bool) {
        self.hear(Heard::Begins { image: image.to_vec(), lock_step });
    }

    /// A frame was sent or received.
    pub fn frame(&self, direction: Direction, frame: &Frame) {
        self.hear(Heard::Frame(direction, *frame));
    }

    fn hear(&self, heard: Heard) {
        // Where nobody watches any more, nothing is missed.
        if let Err(TrySendError::Full(_)) = self.to.try_send(heard) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl FollowSource {
    /// Frames that found no room since the last call.
    pub(super) fn take_lost(&self) -> u64 {
        self.lost.swap(0, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_runs_the_device_never_waits_and_what_is_lost_is_counted() {
        let (feed, source) = feed();
        let frame = Frame::new(0x100, &[1]).unwrap();
        for _ in 0..WAITING + 3 {
            feed.frame(Direction::ToHost, &frame);
        }
        assert_eq!((source.take_lost(), source.take_lost()), (3, 0));
        drop(source);
        feed.frame(Direction::ToHost, &frame);
    }
}
