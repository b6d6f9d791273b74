//! The tasks of the bus: text in, frames to the service or the ticker, frames and answers out.

use cathforce_bus::service::BLOCK_SIZE;
use cathforce_bus::slcan::{self, Decoder, Line};
use cathforce_bus::{Frame, Id};
use cathforce_device::{Identity, Service};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;

use crate::board::{self, Board, BusIn, BusOut};
use crate::device::{self, FrameOutcome, GRANT_USED, IMAGE_BUFFER_LEN, ServiceBoard};
use crate::identity;

/// What can wait to be sent: a block of service frames and more ticks than a host lets pile up.
const QUEUE: usize = 4 * BLOCK_SIZE as usize;

/// What goes out.
enum Out {
    Frame(Frame),
    /// An answer to a command of SLCAN.
    Answer(&'static [u8]),
}

static OUT: Channel<CriticalSectionRawMutex, Out, QUEUE> = Channel::new();

/// Queues a frame of the tick; `false` if there is no room.
pub fn queue(frame: Frame) -> bool {
    OUT.try_send(Out::Frame(frame)).is_ok()
}

/// Sends what is queued; first of all an empty line, which says that frames are taken now.
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

/// Takes what arrives, in order. After a SYNC the next line waits until its ticks have run:
/// what belongs to which tick never depends on when it arrived.
#[embassy_executor::task]
pub async fn receive(mut port: BusIn, board: board::This) {
    let identity = Identity {
        firmware: identity::firmware(),
        board: board.name(),
        can_lock_step: board.can_lock_step(),
        max_image_len: IMAGE_BUFFER_LEN as u32,
    };
    // The second buffer is lent once the first one is in use.
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
            // A bare carriage return ends whatever was cut off before it.
            Line::Done | Line::Error => {}
            Line::Bad(bad) => {
                device::count(bad.counter());
                OUT.send(Out::Answer(slcan::ANSWER_ERROR)).await;
            }
        }
    }
}
