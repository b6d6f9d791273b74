//! A link whose frames are all gathered, whoever talks over it.

use std::time::{Duration, Instant};

use cathforce_bus::Frame;
use cathforce_link::{Link, LinkError};

use super::gather::Gather;

/// Longest wait for a frame, after which a picture may be due.
const WAIT: Duration = Duration::from_millis(8);

/// A link and what was seen on it.
pub struct Bus {
    pub link: Box<dyn Link>,
    pub gather: Gather,
}

impl Link for &mut Bus {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)?;
        self.gather.sent(frame);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.link.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let until = Instant::now() + timeout;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let frame = self.link.receive(left.min(WAIT))?;
            if let Some(frame) = &frame {
                self.gather.received(frame);
            }
            self.gather.due();
            if frame.is_some() || left <= WAIT {
                return Ok(frame);
            }
        }
    }

    fn waited(&self) -> Option<Duration> {
        self.link.waited()
    }

    fn dropped(&self) -> u64 {
        self.link.dropped()
    }

    fn name(&self) -> &str {
        self.link.name()
    }
}
