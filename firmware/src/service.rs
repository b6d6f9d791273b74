//! The task of service messages. It has the lowest priority, because a check of an image takes long.

use cathforce_bus::NextCounters;
use cathforce_bus::service::{Crash, Load, Refusal, Status};
use cathforce_config::image;
use cathforce_device::{Board as DeviceBoard, Identity, Image, Service, copy_from};
use static_cell::StaticCell;

use crate::board::{self, Board};
use crate::device::{self, Active, Buffer, Slot};
use crate::{bus, identity, record, requests, stack, watch};

/// Size of an image buffer \[bytes\].
const IMAGE_BUFFER_LEN: usize = 2 << 20;

/// Answers requests.
#[embassy_executor::task]
pub async fn serve(board: board::This, spare: &'static mut Slot) {
    watch::SERVICE.over(answer(board, spare)).await
}

async fn answer(board: board::This, spare: &'static mut Slot) {
    let identity = Identity {
        firmware: identity::firmware(),
        board: board.name(),
        can_lock_step: board.can_lock_step(),
        max_image_len: IMAGE_BUFFER_LEN as u32,
    };
    // The service gets the second buffer once the first one is in use.
    let [first, second] = image_buffers();
    let (mut service, mut second) = (Service::new(identity, first), Some(second));
    let mut desk = Desk { board, spare, image: None };
    let counts_a_us = board::This::COUNTS_A_SECOND / 1_000_000;
    loop {
        let frame = requests::next().await;
        service.on_frame(&frame, &mut desk);
        if desk.image.is_some()
            && let Some(buffer) = second.take()
        {
            service.lend(buffer);
        }
        while let Some(frame) = service.next_frame(board.time() / counts_a_us) {
            bus::send_frame(frame).await;
        }
        requests::handled();
    }
}

/// The two image buffers. Called once.
fn image_buffers() -> [Buffer; 2] {
    /// Memory for both, which is not initialised at boot.
    struct Place(core::cell::UnsafeCell<[[u8; IMAGE_BUFFER_LEN]; 2]>);
    // SAFETY: `StaticCell` below hands it out once.
    unsafe impl Sync for Place {}
    #[unsafe(link_section = ".psram.images")]
    static PLACE: Place = Place(core::cell::UnsafeCell::new([[0; IMAGE_BUFFER_LEN]; 2]));
    static TAKEN: StaticCell<()> = StaticCell::new();
    // Panics on a second call.
    TAKEN.init(());
    // SAFETY: taken once, and bytes may have any value.
    let [a, b] = unsafe { &mut *PLACE.0.get() };
    [a, b]
}

/// Access of the service to the device.
struct Desk {
    board: board::This,
    /// The slot that is not in use.
    spare: &'static mut Slot,
    /// The image in use.
    image: Option<&'static [u8]>,
}

impl DeviceBoard<Buffer> for Desk {
    fn is_armed(&mut self) -> bool {
        device::control_loop(|control_loop| !control_loop.may_reconfigure())
    }

    fn status(&mut self) -> Status {
        let (used, size) = stack::use_bytes();
        let (carrier, load) = device::carrier_and_load();
        let load = Load { stack_used_bytes: used, stack_size_bytes: size, ..load };
        let mut status = device::control_loop(|control_loop| control_loop.report(load));
        status.counters = status.counters.merged(&carrier);
        status
    }

    fn next_counters(&mut self) -> NextCounters {
        device::control_loop(|control_loop| control_loop.next_counters())
    }

    fn activate(
        &mut self,
        image: Image<Buffer>,
    ) -> Result<Option<Buffer>, (Buffer, Refusal<'static>)> {
        let body_crc32 = image.body_crc32();
        let (buffer, len) = image.into_parts();
        let mut master = Default::default();
        let prepared = Active::new(buffer, len, |bytes| {
            master = image::master(bytes)?;
            image::decode_summed(bytes, body_crc32)
        });
        self.working();
        let active = prepared.map_err(|(buffer, _)| {
            let reason = "changed since it was checked";
            (buffer, Refusal::Image { offset: 0, reason, field: "" })
        })?;
        self.spare.control_loop.restart(master);
        self.spare.active = Some(active);
        let done = device::exchange(&mut self.spare);
        self.working();
        let unused = self.spare.active.take().map(Active::into_buffer);
        if done {
            self.image = device::image();
            defmt::info!("an image of {=usize} bytes is in use", len);
            return Ok(unused);
        }
        match unused {
            Some(buffer) => Err((buffer, Refusal::Armed)),
            None => panic!("a slot has lost its image"),
        }
    }

    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>> {
        if !self.board.can_lock_step() {
            return Err(Refusal::Unsupported);
        }
        if device::set_lock_step(on) { Ok(()) } else { Err(Refusal::Armed) }
    }

    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize> {
        Some(copy_from(self.image?, offset, into))
    }

    fn reset_counters(&mut self) {
        device::reset_counters();
    }

    fn crash(&mut self) -> Option<Crash<'static>> {
        record::read()
    }

    fn working(&mut self) {
        watch::SERVICE.advance();
    }
}
