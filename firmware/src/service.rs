//! The task of service messages. It has the lowest priority, because a check of an image takes long.

use core::future::poll_fn;
use core::task::Poll;

use cathforce_bus::NextCounters;
use cathforce_bus::service::{Crash, Load, Refusal, Saved, SavedState, Status};
use cathforce_config::image;
use cathforce_control::Fault;
use cathforce_device::{Board as DeviceBoard, Identity, Image, Service, copy_from};
use static_cell::StaticCell;

use crate::board::{self, Board};
use crate::device::{self, Active, Buffer, Slot};
use crate::saved::SavedImages;
use crate::{bus, identity, record, requests, stack, watch};

const IMAGE_BUFFER_LEN: usize = board::This::IMAGE_BUFFER_LEN;

/// The service, and what it acts on.
pub struct Server {
    service: Service<Buffer>,
    /// The second buffer, which the service gets once the first one is in use.
    second: Option<Buffer>,
    desk: Desk,
}

/// Makes the service, and puts the saved image to use. Called once, before ticks run.
#[inline(never)]
pub fn prepare(board: board::This, spare: &'static mut Slot) -> &'static mut Server {
    static PLACE: StaticCell<Server> = StaticCell::new();
    let identity = Identity {
        firmware: identity::firmware(),
        board: board.name(),
        can_lock_step: board.can_lock_step(),
        max_image_len: IMAGE_BUFFER_LEN as u32,
    };
    let [first, second] = image_buffers();
    let server = PLACE.init_with(|| Server {
        service: Service::new(identity, first),
        second: Some(second),
        desk: Desk { board, spare, image: None, saved: SavedImages::new(board) },
    });
    server.restore();
    server
}

/// Answers requests.
#[embassy_executor::task]
pub async fn serve(server: &'static mut Server) {
    watch::SERVICE.over(server.answer()).await
}

impl Server {
    /// Puts the newest saved image to use that the device can use. Without any that it could, though some
    /// were saved, a fault holds the device (P16).
    fn restore(&mut self) {
        let Self { service, desk, .. } = self;
        // One of the two places may hold an image that only its decoder refuses.
        for _ in 0..board::This::SAVED_IMAGES.len() {
            match service.restore(desk) {
                Ok(0) => break,
                Ok(_) => {
                    desk.saved.fits();
                    break;
                }
                Err(refusal) => desk.saved.does_not_fit(why(refusal)),
            }
        }
        let Saved { state, refused, image_crc32, .. } = desk.saved.state();
        if !refused.is_empty() {
            defmt::warn!("a saved image is refused: {=str}", refused);
        }
        if state == SavedState::Lost {
            defmt::error!("no saved image can be used");
            device::hold(Fault::SavedImageLost);
        } else if image_crc32 != 0 {
            defmt::info!("booted with the saved image of CRC {=u32:08x}", image_crc32);
        }
    }

    async fn answer(&mut self) {
        let Self { service, second, desk } = self;
        let counts_a_us = board::This::COUNTS_A_SECOND / 1_000_000;
        loop {
            // The watch polls this task every few ticks.
            let frame = poll_fn(|context| match desk.saved.is_proven() {
                true => Poll::Ready(None),
                false => requests::poll_next(context).map(Some),
            });
            let Some(frame) = frame.await else {
                desk.saved.confirm();
                continue;
            };
            service.on_frame(&frame, desk);
            if desk.image.is_some()
                && let Some(buffer) = second.take()
            {
                service.lend(buffer);
            }
            while let Some(frame) = service.next_frame(desk.board.time() / counts_a_us) {
                bus::send_frame(frame).await;
            }
            requests::handled();
        }
    }
}

fn why(refusal: Refusal<'static>) -> &'static str {
    match refusal {
        Refusal::Image { field: "", reason, .. } => reason,
        Refusal::Image { field, .. } => field,
        _ => "it cannot be used",
    }
}

/// The two image buffers. Called once.
fn image_buffers() -> [Buffer; 2] {
    /// Memory for one, which is not initialised at boot. A board may have them in different memories.
    struct Place(core::cell::UnsafeCell<[u8; IMAGE_BUFFER_LEN]>);
    // SAFETY: `StaticCell` below hands it out once.
    unsafe impl Sync for Place {}
    #[unsafe(link_section = ".images.first")]
    static FIRST: Place = Place(core::cell::UnsafeCell::new([0; IMAGE_BUFFER_LEN]));
    #[unsafe(link_section = ".images.second")]
    static SECOND: Place = Place(core::cell::UnsafeCell::new([0; IMAGE_BUFFER_LEN]));
    static TAKEN: StaticCell<()> = StaticCell::new();
    // Panics on a second call.
    TAKEN.init(());
    // SAFETY: taken once, and bytes may have any value.
    [&FIRST, &SECOND].map(|place| unsafe { &mut *place.0.get() } as Buffer)
}

/// Access of the service to the device.
struct Desk {
    board: board::This,
    /// The slot that is not in use.
    spare: &'static mut Slot,
    /// The image in use.
    image: Option<&'static [u8]>,
    saved: SavedImages,
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
            self.saved.left();
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

    fn save_image(&mut self, image_crc32: u32) -> Result<(), Refusal<'static>> {
        self.saved.save(self.image.ok_or(Refusal::NoImage)?, image_crc32)
    }

    fn read_saved(&mut self, into: &mut [u8]) -> usize {
        self.saved.read(into)
    }

    fn saved(&mut self) -> Result<Saved<'static>, Refusal<'static>> {
        Ok(self.saved.state())
    }

    fn working(&mut self) {
        watch::service_works();
    }
}
