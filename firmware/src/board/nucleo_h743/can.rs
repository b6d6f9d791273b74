//! The bus: FDCAN1 with classic frames at 1 Mbit/s.
//!
//! The controller has two queues of three frames. Those of the host have one for themselves, so that foreign
//! frames, with identifiers of 11 or 29 bits, cannot fill it while a tick runs. The controller rejects remote
//! frames. An interrupt below the tick moves frames into a ring.

use core::fmt::Debug;
use core::future::poll_fn;
use core::task::Poll;

use cathforce_bus::slcan::Line;
use cathforce_bus::{EXTENDED, FROM_HOST, Frame, Id, MAX_EXTENDED_ID};
use embassy_stm32::can::config::{GlobalFilter, NonMatchingFilter};
use embassy_stm32::can::filter::{
    Action, ExtendedFilterSlot, Filter, FilterType, StandardFilterSlot,
};
use embassy_stm32::can::frame::Envelope;
use embassy_stm32::can::{
    BufferedCan, BufferedCanReceiver, BufferedCanSender, CanConfigurator, IT0InterruptHandler,
    IT1InterruptHandler, RxBuf, TxBuf, frame,
};
use embassy_stm32::peripherals::{FDCAN1, PD0, PD1};
use embassy_stm32::{Peri, bind_interrupts, pac};
use embedded_can::{ExtendedId, Id as CanId, StandardId};
use static_cell::StaticCell;

use crate::placement::PLACEMENT;

const BIT_RATE: u32 = 1_000_000;
/// Frames that arrive while the tasks are busy: two milliseconds of a full bus.
const RECEIVED: usize = 48;
/// Frames on their way to the controller, of which it takes three.
const SENT: usize = 8;

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// Slots of the filters of the host's frames, where they have 11 bits and where they have 29.
const SLOTS: [(StandardFilterSlot, ExtendedFilterSlot); 7] = [
    (StandardFilterSlot::_0, ExtendedFilterSlot::_0),
    (StandardFilterSlot::_1, ExtendedFilterSlot::_1),
    (StandardFilterSlot::_2, ExtendedFilterSlot::_2),
    (StandardFilterSlot::_3, ExtendedFilterSlot::_3),
    (StandardFilterSlot::_4, ExtendedFilterSlot::_4),
    (StandardFilterSlot::_5, ExtendedFilterSlot::_5),
    (StandardFilterSlot::_6, ExtendedFilterSlot::_6),
];

/// Input of the bus.
pub struct BusIn {
    frames: BufferedCanReceiver,
    /// The controller was bus-off when it was looked at last.
    was_off: bool,
    /// Keeps the driver alive.
    _can: &'static BufferedCan<'static, SENT, RECEIVED>,
}

/// Output of the bus.
pub struct BusOut(BufferedCanSender);

/// Starts the controller. Called once.
pub fn start(
    fdcan: Peri<'static, FDCAN1>,
    receive: Peri<'static, PD0>,
    transmit: Peri<'static, PD1>,
) -> (BusIn, BusOut) {
    static TRANSMIT: StaticCell<TxBuf<SENT>> = StaticCell::new();
    static RECEIVE: StaticCell<RxBuf<RECEIVED>> = StaticCell::new();
    static CAN: StaticCell<BufferedCan<'static, SENT, RECEIVED>> = StaticCell::new();
    let mut can = CanConfigurator::new(fdcan, receive, transmit, Interrupts);
    can.set_bitrate(BIT_RATE);
    let filter = GlobalFilter {
        handle_standard_frames: NonMatchingFilter::IntoRxFifo1,
        handle_extended_frames: NonMatchingFilter::IntoRxFifo1,
        reject_remote_standard_frames: true,
        reject_remote_extended_frames: true,
    };
    let config = can.config().set_global_filter(filter).set_automatic_bus_off_recovery(false);
    can.set_config(config);
    let of_host = FROM_HOST.into_iter().chain([Id::ServiceRequest]);
    for ((standard, extended), id) in SLOTS.into_iter().zip(of_host) {
        match on_bus(PLACEMENT.exchange_id(id.raw())) {
            Some(CanId::Standard(id)) => {
                can.properties().set_standard_filter(standard, into_fifo0(id));
            }
            Some(CanId::Extended(id)) => {
                can.properties().set_extended_filter(extended, into_fifo0(id));
            }
            None => {}
        }
    }
    let can = can.into_normal_mode();
    let can = can.buffered(TRANSMIT.init(TxBuf::new()), RECEIVE.init(RxBuf::new()));
    let can: &'static _ = CAN.init(can);
    (BusIn { frames: can.reader(), was_off: false, _can: can }, BusOut(can.writer()))
}

fn into_fifo0<ID: Copy + Debug, UNIT: Copy + Debug>(id: ID) -> Filter<ID, UNIT> {
    Filter { filter: FilterType::DedicatedSingle(id), action: Action::StoreInFifo0 }
}

/// An identifier as the controller has it.
fn on_bus(id: u32) -> Option<CanId> {
    let raw = id & MAX_EXTENDED_ID;
    match id & EXTENDED {
        0 => StandardId::new(raw as u16).map(CanId::Standard),
        _ => ExtendedId::new(raw).map(CanId::Extended),
    }
}

impl BusIn {
    /// What has happened on the bus next: a frame, or that the controller is bus-off or no longer. The watch
    /// polls this every few ticks.
    pub async fn next(&mut self) -> Line {
        poll_fn(|context| {
            let off = pac::FDCAN1.psr().read().bo();
            if off != self.was_off {
                self.was_off = off;
                return Poll::Ready(Line::BusOff(off));
            }
            match self.frames.poll_receive(context) {
                Poll::Ready(Ok(envelope)) => Poll::Ready(line(&envelope)),
                // An error on the wire is no frame; the state of the controller tells what follows from it.
                Poll::Ready(Err(_)) => {
                    context.waker().wake_by_ref();
                    Poll::Pending
                }
                Poll::Pending => Poll::Pending,
            }
        })
        .await
    }

    /// A board without lock step has nothing to wait for.
    pub fn pause(&mut self) {}
}

fn line(envelope: &Envelope) -> Line {
    let id = match envelope.frame.id() {
        CanId::Standard(id) => id.as_raw().into(),
        CanId::Extended(id) => id.as_raw() | EXTENDED,
    };
    Frame::new(id, envelope.frame.data()).map_or(Line::Foreign, Line::Frame)
}

impl BusOut {
    /// Sends a frame as soon as there is room for it.
    pub async fn frame(&mut self, frame: &Frame) {
        // Cannot fail: a frame has an identifier of the controller and at most 8 bytes.
        let Some(id) = on_bus(frame.id()) else { return };
        if let Ok(frame) = frame::Frame::new_data(id, frame.data()) {
            self.0.write(frame).await;
        }
    }

    /// A controller has no adapter that could be answered.
    pub async fn answer(&mut self, _: &'static [u8]) {}

    /// Starts the controller again after bus-off: it waits for 128 times 11 recessive bits by itself.
    pub async fn reopen(&mut self) {
        pac::FDCAN1.cccr().modify(|w| w.set_init(false));
    }
}
