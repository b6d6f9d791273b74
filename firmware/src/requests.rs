//! Frames on their way from the receiver to the service.

use core::task::{Context, Poll};

use cathforce_bus::Frame;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

use crate::device;

/// Frames for the service, as many as come between two flow controls and a few more.
static REQUESTS: Channel<
    CriticalSectionRawMutex,
    Frame,
    { cathforce_bus::service::BLOCK_SIZE as usize + 8 },
> = Channel::new();
/// Signalled when a frame has been handled.
static HANDLED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Hands a frame to the service. In lock step it waits until the frame has been handled, so that the order
/// of all frames decides what happens, and not the time that something takes.
pub async fn take(frame: Frame) {
    let wait = device::is_in_lock_step();
    HANDLED.reset();
    REQUESTS.send(frame).await;
    if wait {
        HANDLED.wait().await;
    }
}

/// The next frame for the service.
pub fn poll_next(context: &mut Context<'_>) -> Poll<Frame> {
    REQUESTS.poll_receive(context)
}

/// The service is done with the frame that it took last.
pub fn handled() {
    HANDLED.signal(());
}
