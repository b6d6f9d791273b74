//! Segmented messages: ISO 15765-2 with normal addressing, without padding.
//!
//! | first byte | segment | then |
//! | --- | --- | --- |
//! | `0L` | single, L = 1…7 bytes | the message |
//! | `1L LL` | first, 12-bit length | 6 bytes |
//! | `2S` | consecutive, S = 1, 2, … 15, 0, … | up to 7 bytes |
//! | `3F` | flow control: 0 go on, 1 wait, 2 overflow | block size, least separation time |
//!
//! The receiver requests one block at a time, so that its frame queue need not hold more. Lengths over
//! 4095 (the 32-bit escape) are refused as overflow. Longer data is sent in several messages
//! ([`crate::service::Request::ImageChunk`]), each with its own CRC and answer, so that a loss costs a
//! chunk and not an image.
//!
//! The receiving side has no clock. An unfinished message is dropped when the next one begins. The side
//! that sent the request watches the time.

use heapless::Vec;

use crate::{Counter, Counters, Frame};

const LONGEST: usize = 0xFFF;

/// The message is empty, longer than 4095 bytes or longer than the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadLength;

/// Both directions of one connection: receives messages of up to `RX` bytes, sends up to `TX` bytes.
#[derive(Clone, Debug)]
pub struct Endpoint<const RX: usize, const TX: usize> {
    send_id: u32,
    block_size: u8,
    receiving: Receiving,
    inbox: Vec<u8, RX>,
    flow_control: Option<u8>,
    sending: Sending,
    outbox: Vec<u8, TX>,
}

#[derive(Clone, Copy, Debug)]
enum Receiving {
    Idle,
    Consecutive { total: usize, sequence: u8, left_in_block: u8 },
}

#[derive(Clone, Copy, Debug)]
enum Sending {
    Idle,
    /// No segment of the message has been sent.
    Begin,
    /// Waiting for flow control, or told to wait.
    AwaitFlowControl {
        sent: usize,
        sequence: u8,
    },
    Consecutive {
        sent: usize,
        sequence: u8,
        /// `None`: to the end of the message.
        left_in_block: Option<u8>,
        separation_us: u32,
        last_us: Option<u32>,
    },
}

const GO_ON: u8 = 0;
const WAIT: u8 = 1;
const OVERFLOW: u8 = 2;

impl<const RX: usize, const TX: usize> Endpoint<RX, TX> {
    /// `send_id`: identifier of every sent frame. `block_size`: number of segments that fit into the own
    /// frame queue; 0 for any number.
    pub fn new(send_id: u32, block_size: u8) -> Self {
        Self {
            send_id,
            block_size,
            receiving: Receiving::Idle,
            inbox: Vec::new(),
            flow_control: None,
            sending: Sending::Idle,
            outbox: Vec::new(),
        }
    }

    /// Takes one frame of the other side; returns the message that it completes.
    ///
    /// Afterwards [`Self::next_frame`] may have frames to send.
    pub fn receive(&mut self, frame: &Frame, counters: &mut Counters) -> Option<&[u8]> {
        let Some((&control, rest)) = frame.data().split_first() else {
            counters.count(Counter::SegmentBroken);
            return None;
        };
        let (kind, low) = (control >> 4, control & 0xF);
        let (counter, whole) = match (kind, rest) {
            (0, _) => self.on_single(usize::from(low), rest),
            (1, &[length, ref first @ ..]) if first.len() == 6 => {
                (self.on_first(usize::from(low) << 8 | usize::from(length), first), false)
            }
            (2, _) => self.on_consecutive(low, rest),
            (3, &[block_size, separation, ..]) => {
                (self.on_flow_control(low, block_size, separation), false)
            }
            _ => (Counter::SegmentBroken, false),
        };
        counters.count(counter);
        whole.then_some(&self.inbox)
    }

    /// Begins to send a message; drops one that is not finished.
    ///
    /// Errors: the message is empty, longer than 4095 bytes, or longer than `TX`.
    pub fn send(&mut self, message: &[u8]) -> Result<(), BadLength> {
        self.sending = Sending::Idle;
        self.outbox.clear();
        if message.is_empty() || message.len() > LONGEST {
            return Err(BadLength);
        }
        self.outbox.extend_from_slice(message).map_err(|_| BadLength)?;
        self.sending = Sending::Begin;
        Ok(())
    }

    /// Sends the last message again from its beginning.
    pub fn send_again(&mut self) {
        if !self.outbox.is_empty() {
            self.sending = Sending::Begin;
        }
    }

    /// A message is being sent.
    pub fn is_sending(&self) -> bool {
        !matches!(self.sending, Sending::Idle)
    }

    /// The next frame to send, if one may be sent now.
    ///
    /// `now_us`: any wrapping clock \[µs\]. It is used only if the other side requests a separation time.
    pub fn next_frame(&mut self, now_us: u32) -> Option<Frame> {
        if let Some(status) = self.flow_control.take() {
            return Frame::new(self.send_id, &[0x30 | status, self.block_size, 0]);
        }
        match self.sending {
            Sending::Idle | Sending::AwaitFlowControl { .. } => None,
            Sending::Begin if self.outbox.len() <= 7 => {
                self.sending = Sending::Idle;
                self.segment(&[self.outbox.len() as u8], &self.outbox)
            }
            Sending::Begin => {
                let [high, low] = (self.outbox.len() as u16).to_be_bytes();
                self.sending = Sending::AwaitFlowControl { sent: 6, sequence: 1 };
                self.segment(&[0x10 | high & 0xF, low], self.outbox.get(..6)?)
            }
            Sending::Consecutive { sent, sequence, left_in_block, separation_us, last_us } => {
                if last_us.is_some_and(|last| now_us.wrapping_sub(last) < separation_us) {
                    return None;
                }
                let rest = self.outbox.get(sent..)?;
                let payload = rest.get(..7).unwrap_or(rest);
                let frame = self.segment(&[0x20 | sequence], payload);
                let sent = sent + payload.len();
                let sequence = (sequence + 1) & 0xF;
                let left_in_block = left_in_block.map(|left| left.saturating_sub(1));
                self.sending = if sent >= self.outbox.len() {
                    Sending::Idle
                } else if left_in_block == Some(0) {
                    Sending::AwaitFlowControl { sent, sequence }
                } else {
                    let last_us = Some(now_us);
                    Sending::Consecutive { sent, sequence, left_in_block, separation_us, last_us }
                };
                frame
            }
        }
    }

    fn segment(&self, control: &[u8], payload: &[u8]) -> Option<Frame> {
        let bytes: Vec<u8, 8> = control.iter().chain(payload).copied().take(8).collect();
        Frame::new(self.send_id, &bytes)
    }

    fn on_single(&mut self, len: usize, rest: &[u8]) -> (Counter, bool) {
        let Some(message) = rest.get(..len).filter(|m| !m.is_empty()) else {
            return (Counter::SegmentBroken, false);
        };
        let counter = self.begin();
        if self.inbox.extend_from_slice(message).is_err() {
            return (Counter::MessageTooLong, false);
        }
        (counter, true)
    }

    fn on_first(&mut self, total: usize, first: &[u8]) -> Counter {
        // Up to 7 bytes must be a single segment. A length of 0 announces a 32-bit length.
        if (1..=7).contains(&total) {
            return Counter::SegmentBroken;
        }
        let counter = self.begin();
        if total == 0 || total > RX || self.inbox.extend_from_slice(first).is_err() {
            self.flow_control = Some(OVERFLOW);
            return Counter::MessageTooLong;
        }
        let left_in_block = self.block_size;
        self.receiving = Receiving::Consecutive { total, sequence: 1, left_in_block };
        self.flow_control = Some(GO_ON);
        counter
    }

    fn on_consecutive(&mut self, number: u8, rest: &[u8]) -> (Counter, bool) {
        let Receiving::Consecutive { total, sequence, left_in_block } = self.receiving else {
            return (Counter::SegmentSequence, false);
        };
        let wanted = (total - self.inbox.len().min(total)).min(7);
        let payload = rest.get(..wanted);
        let (true, Some(payload)) = (number == sequence, payload) else {
            self.receiving = Receiving::Idle;
            return (Counter::SegmentSequence, false);
        };
        if self.inbox.extend_from_slice(payload).is_err() {
            self.receiving = Receiving::Idle;
            return (Counter::MessageTooLong, false);
        }
        if self.inbox.len() >= total {
            self.receiving = Receiving::Idle;
            return (Counter::Segment, true);
        }
        let mut left_in_block = left_in_block.saturating_sub(1);
        if self.block_size != 0 && left_in_block == 0 {
            self.flow_control = Some(GO_ON);
            left_in_block = self.block_size;
        }
        let sequence = (sequence + 1) & 0xF;
        self.receiving = Receiving::Consecutive { total, sequence, left_in_block };
        (Counter::Segment, false)
    }

    fn on_flow_control(&mut self, status: u8, block_size: u8, separation: u8) -> Counter {
        let Sending::AwaitFlowControl { sent, sequence } = self.sending else {
            return Counter::SegmentSequence;
        };
        match status {
            GO_ON => {
                self.sending = Sending::Consecutive {
                    sent,
                    sequence,
                    left_in_block: (block_size != 0).then_some(block_size),
                    separation_us: separation_us(separation),
                    last_us: None,
                };
                Counter::Segment
            }
            WAIT => Counter::Segment,
            OVERFLOW => {
                self.sending = Sending::Idle;
                Counter::MessageTooLong
            }
            _ => Counter::SegmentBroken,
        }
    }

    /// Drops an unfinished message, and counts it as out of sequence.
    fn begin(&mut self) -> Counter {
        let unfinished = matches!(self.receiving, Receiving::Consecutive { .. });
        self.receiving = Receiving::Idle;
        self.flow_control = None;
        self.inbox.clear();
        if unfinished { Counter::SegmentSequence } else { Counter::Segment }
    }
}

/// Separation time of a code \[µs\]. Reserved codes mean the longest time, as the standard requires.
fn separation_us(code: u8) -> u32 {
    match code {
        0..=0x7F => 1000 * u32::from(code),
        0xF1..=0xF9 => 100 * u32::from(code - 0xF0),
        _ => 127_000,
    }
}

#[cfg(test)]
mod tests;
