//! Tasks of the bus: receive text, pass frames to the service or the control loop, send frames and
//! answers.

use cathforce_bus::service::BLOCK_SIZE;
use cathforce_bus::slcan::{self, Decoder, Line};
use cathforce_bus::{Frame, Id};
use cathforce_device::{Identity, Service};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;

use crate::board::{self, Board, BusIn, BusOut};
use crate::device::{self, FrameOutcome, GRANT_USED, IMAGE_BUFFER_LEN, ServiceBoard};
use crate::identity;

/// Length of the send queue: a block of service frames, and frames of more ticks than a host leaves
/// unread.
const QUEUE: usize = 4 * BLOCK_SIZE as usize;

/// An item to send.
enum Out {
    Frame(Frame),
    /// An answer to a command of SLCAN.
    Answer(&'static [u8]),
}

static OUT: Channel<CriticalSectionRawMutex, Out, QUEUE> = Channel::new();

/// Queues a frame of the tick; returns `false` if the queue is full.
pub fn queue(frame: Frame) -> bool {
    OUT.try_send(Out::Frame(frame)).is_ok()
}

/// Sends the queue. It begins with an empty line, which tells the host that frames are accepted.
#[embassy_executor::task]
pub async fn send(mut port: BusOut) {
    port.write(slcan::ANSWER_DONE);
    loop {
        match OUT.receive().await {
            Out::Frame(frame) => port.write(&slcan::encode(&frame)),
            Out::Answer(bytes) => port.write(bytes),
        }
    }
}

/// Receives lines in order. After a SYNC the next line waits until the granted ticks have run, so that
/// the tick of a frame never depends on its time of arrival.
#[embassy_executor::task]
pub async fn receive(mut port: BusIn, board: board::This) {
    let identity = Identity {
        firmware: identity::firmware(),
        board: board.name(),
        can_lock_step: board.can_lock_step(),
        max_image_len: IMAGE_BUFFER_LEN as u32,
    };
    // The service gets the second buffer once the first one is in use.
    let [first, second] = device::image_buffers();
    let (mut service, mut second) = (Service::new(identity, first), Some(second));
    let mut desk = ServiceBoard(board);
    let mut decoder = Decoder::default();
    loop {
        let Some(line) = decoder.push(port.read().await) else { continue };
        match line {
            Line::Frame(frame) if Id::from_raw(frame.id()) == Some(Id::ServiceRequest) => {
                service.on_frame(&frame, &mut desk);
                if device::is_configured()
                    && let Some(buffer) = second.take()
                {
                    service.lend(buffer);
                }
                let counts_a_us = board::This::COUNTS_A_SECOND / 1_000_000;
                while let Some(frame) = service.next_frame(board.time() / counts_a_us) {
                    OUT.send(Out::Frame(frame)).await;
                }
            }
            Line::Frame(frame) => {
                if let FrameOutcome::Granted = device::on_frame(&frame) {
                    port.pause();
                    GRANT_USED.wait().await;
                }
            }
            Line::Foreign => device::on_foreign(),
            Line::Open | Line::Close | Line::BitRate(_) => {
                OUT.send(Out::Answer(slcan::ANSWER_DONE)).await;
            }
            // A bare carriage return ends a truncated line.
            Line::Done | Line::Error => {}
            Line::Bad(bad) => {
                device::count(bad.counter());
                OUT.send(Out::Answer(slcan::ANSWER_ERROR)).await;
            }
        }
    }
}
