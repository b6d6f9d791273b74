//! Service messages: the half of the device that runs in a task.

use cathforce_bus::service::{
    self, Crash, DeviceEndpoint, EnvelopeError, Hello, MAX_RESPONSE, PROTOCOL_HASH, Refusal,
    Request, Response, RunningCrc32, Saved, Status,
};
use cathforce_bus::{Counter, Counters, Frame, Id, NextCounters};
use cathforce_config::{ImageError, image};
use cathforce_control::Config;

use crate::refusal::refusal;

/// Access of the service to the hardware and to the control loop.
///
/// `B`: buffer for an image, `&'static mut [u8]` on a device, `Vec<u8>` on a host.
pub trait Board<B> {
    /// Output is armed or ramping down, so nothing may change: the opposite of
    /// [`crate::ControlLoop::may_reconfigure`].
    fn is_armed(&mut self) -> bool;

    /// [`crate::ControlLoop::report`], plus the counters of the carrier.
    fn status(&mut self) -> Status;

    /// [`crate::ControlLoop::next_counters`].
    fn next_counters(&mut self) -> NextCounters;

    /// Activates an image, which has been checked completely: between two ticks, exchanges the
    /// configuration and restarts the control loop, unless it has been armed in the meantime.
    ///
    /// Returns the buffer of the image used before, if there was one. On an error, returns the buffer of
    /// this image and the reason, and nothing has changed.
    fn activate(&mut self, image: Image<B>) -> Result<Option<B>, (B, Refusal<'static>)>;

    /// [`crate::ControlLoop::set_lock_step`]; [`Refusal::Unsupported`] on boards without lock step.
    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>>;

    /// Zeroes counters and worst cases.
    fn reset_counters(&mut self);

    /// [`copy_from`] of the image in use; `None` without one.
    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize>;

    /// What the device wrote down before it reset itself; `None` if it has not.
    fn crash(&mut self) -> Option<Crash<'static>> {
        None
    }

    /// Saves the image in use, so that the device boots with it. An image that was saved before is used until
    /// this one is complete.
    fn save_image(&mut self, _image_crc32: u32) -> Result<(), Refusal<'static>> {
        Err(Refusal::Unsupported)
    }

    /// Reads the saved image to boot with into a buffer; returns its length, 0 without one.
    fn read_saved(&mut self, _into: &mut [u8]) -> usize {
        0
    }

    /// What is saved; [`Refusal::Unsupported`] on boards that cannot save.
    fn saved(&mut self) -> Result<Saved<'static>, Refusal<'static>> {
        Err(Refusal::Unsupported)
    }

    /// Called after every [`WORK_BYTES`] of a long check, so that a watchdog sees it advance.
    fn working(&mut self) {}
}

/// Why the header of a saved image shows that this program cannot read it; `None` if it may.
pub fn refused_header(image: &[u8]) -> Option<&'static str> {
    match refusal(image::readable(image).err()?) {
        Refusal::Image { reason, .. } => Some(reason),
        _ => Some("not an image"),
    }
}

/// Bytes of an image that are checked between two calls of [`Board::working`].
pub const WORK_BYTES: usize = 8192;

/// Copies bytes of an image from `offset` on. Returns their number, 0 past the end of the image.
pub fn copy_from(image: &[u8], offset: usize, into: &mut [u8]) -> usize {
    let rest = image.get(offset..).unwrap_or_default();
    rest.iter().zip(into).map(|(byte, place)| *place = *byte).count()
}

/// Identity of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the firmware; its build after a `+`, if known.
    pub firmware: &'static str,
    /// Name of the board.
    pub board: &'static str,
    /// Ticks can be granted one by one.
    pub can_lock_step: bool,
    /// Size of an image buffer \[bytes\].
    pub max_image_len: u32,
}

/// A complete image, at the beginning of its buffer.
#[derive(Debug)]
pub struct Image<B> {
    buffer: B,
    len: usize,
    /// CRC-32 of everything behind the header.
    body_crc32: u32,
}

impl<B: AsRef<[u8]>> Image<B> {
    /// Bytes of the image.
    pub fn bytes(&self) -> &[u8] {
        self.buffer.as_ref().get(..self.len).unwrap_or_default()
    }

    /// Its configuration, without another pass over all of its bytes.
    pub fn decode(&self) -> Result<Config<'_>, ImageError> {
        image::decode_summed(self.bytes(), self.body_crc32)
    }

    /// CRC-32 of everything behind the header.
    pub fn body_crc32(&self) -> u32 {
        self.body_crc32
    }

    /// The buffer and the length of the image in it.
    pub fn into_parts(self) -> (B, usize) {
        (self.buffer, self.len)
    }
}

/// CRC-32 of all bytes of an image, and of those behind its header, in one pass.
fn sums<B: AsRef<[u8]>>(image: &Image<B>, board: &mut impl Board<B>) -> (u32, u32) {
    let (mut whole, mut body) = (RunningCrc32::default(), RunningCrc32::default());
    let mut header = image::HEADER_BYTES;
    for bytes in image.bytes().chunks(WORK_BYTES) {
        whole.add(bytes);
        body.add(bytes.get(header..).unwrap_or_default());
        header = 0;
        board.working();
    }
    (whole.value(), body.value())
}

/// Answers requests and collects uploads.
#[derive(Debug)]
pub struct Service<B> {
    endpoint: DeviceEndpoint,
    /// Sequence number and CRC of the last request that was done.
    answered: Option<(u8, u32)>,
    counters: Counters,
    handler: RequestHandler<B>,
}

/// State that requests act on, apart from the board.
#[derive(Debug)]
struct RequestHandler<B> {
    identity: Identity,
    spare: Option<B>,
    upload: Option<Upload>,
    /// CRC-32 of the image in use; 0 without one.
    image_crc32: u32,
    /// The part of it that was requested.
    read: [u8; service::MAX_READ],
}

#[derive(Clone, Copy, Debug)]
struct Upload {
    len: u32,
    crc32: u32,
    received: u32,
}

impl<B: AsRef<[u8]> + AsMut<[u8]>> Service<B> {
    /// `spare`: buffer for the first image. [`Board::activate`] or [`Service::lend`] supply the buffer for
    /// the next one, which must have the same size.
    pub fn new(identity: Identity, spare: B) -> Self {
        Self {
            endpoint: DeviceEndpoint::new(Id::ServiceResponse.raw(), service::BLOCK_SIZE),
            answered: None,
            counters: Counters::default(),
            handler: RequestHandler {
                identity,
                spare: Some(spare),
                upload: None,
                image_crc32: 0,
                read: [0; service::MAX_READ],
            },
        }
    }

    /// Lends a buffer for the next image if there is none.
    pub fn lend(&mut self, spare: B) {
        self.handler.spare.get_or_insert(spare);
    }

    /// Puts a saved image to use, before any request. Returns its CRC-32, 0 without one.
    pub fn restore(&mut self, board: &mut impl Board<B>) -> Result<u32, Refusal<'static>> {
        let spare = self.handler.spare.as_mut();
        let len = spare.map_or(0, |spare| board.read_saved(spare.as_mut()));
        if len > 0 {
            self.handler.put_to_use(len, None, board)?;
        }
        Ok(self.handler.image_crc32)
    }

    /// Takes a frame with the id [`Id::ServiceRequest`]; handles the request that it completes.
    /// Afterwards [`Service::next_frame`] may have frames to send.
    pub fn on_frame(&mut self, frame: &Frame, board: &mut impl Board<B>) {
        let Some(message) = self.endpoint.receive(frame, &mut self.counters) else {
            return;
        };
        let (sequence, result) = match service::open::<Request>(message) {
            Ok((sequence, request)) => {
                // A repeated question is answered anew, because its answer may have changed.
                let asks = matches!(
                    request,
                    Request::Hello
                        | Request::GetStatus
                        | Request::ReadImage { .. }
                        | Request::ReadCrash
                        | Request::ReadSaved
                );
                let this = (!asks).then(|| (sequence, service::crc32(message)));
                if this.is_some() && self.answered == this {
                    self.counters.count(Counter::MessageRepeat);
                    self.endpoint.send_again();
                    return;
                }
                self.answered = this;
                (sequence, self.handler.handle(request, board))
            }
            Err(EnvelopeError::Meaning { sequence }) => {
                self.counters.count(Counter::MessageBroken);
                self.answered = None;
                (sequence, Err(Refusal::Unknown))
            }
            // The sender is unknown; it will repeat the request.
            Err(EnvelopeError::Short | EnvelopeError::Crc) => {
                self.counters.count(Counter::MessageBroken);
                return;
            }
        };
        let response = match result {
            Ok(Answer::Reset) => {
                self.counters = Counters::default();
                Response::Done
            }
            Ok(Answer::Status(mut status)) => {
                status.counters = status.counters.merged(&self.counters);
                Response::Status(status)
            }
            Ok(Answer::Hello(hello)) => Response::Hello(hello),
            Ok(Answer::Crash(crash)) => Response::Crash(crash),
            Ok(Answer::Saved(saved)) => Response::Saved(saved),
            Ok(Answer::Done) => Response::Done,
            Ok(Answer::Bytes(len)) => {
                Response::ImageBytes(self.handler.read.get(..len).unwrap_or_default())
            }
            Err(refusal) => Response::Refused(refusal),
        };
        if let Some(bytes) = service::seal::<_, MAX_RESPONSE>(sequence, &response) {
            // Cannot fail: MAX_RESPONSE is large enough, which a test of the bus crate checks.
            let _ = self.endpoint.send(&bytes);
        }
    }

    /// The next frame to send, if one may go now. `now_us`: any clock, wrapping.
    pub fn next_frame(&mut self, now_us: u32) -> Option<Frame> {
        self.endpoint.next_frame(now_us)
    }

    /// Counters of segments and messages.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }
}

enum Answer {
    Hello(Hello<'static>),
    Status(Status),
    Crash(Option<Crash<'static>>),
    Saved(Saved<'static>),
    /// Number of bytes in [`RequestHandler::read`].
    Bytes(usize),
    Reset,
    Done,
}

impl<B: AsRef<[u8]> + AsMut<[u8]>> RequestHandler<B> {
    fn handle(
        &mut self,
        request: Request<'_>,
        board: &mut impl Board<B>,
    ) -> Result<Answer, Refusal<'static>> {
        match request {
            Request::Hello => return Ok(Answer::Hello(self.hello(board))),
            Request::GetStatus => {
                let image_crc32 = self.image_crc32;
                return Ok(Answer::Status(Status { image_crc32, ..board.status() }));
            }
            Request::ResetCounters => {
                board.reset_counters();
                return Ok(Answer::Reset);
            }
            Request::ReadImage { offset } => {
                let read = board.read_image(offset as usize, &mut self.read);
                return read.map(Answer::Bytes).ok_or(Refusal::NoImage);
            }
            Request::ReadCrash => return Ok(Answer::Crash(board.crash())),
            Request::ReadSaved => return board.saved().map(Answer::Saved),
            _ if board.is_armed() => return Err(Refusal::Armed),
            Request::BeginImage { len, crc32 } => self.begin(len, crc32)?,
            Request::ImageChunk { offset, bytes } => self.chunk(offset, bytes)?,
            Request::Activate => self.activate(board)?,
            Request::SetLockStep { on } => board.set_lock_step(on)?,
            Request::SaveImage if self.image_crc32 == 0 => return Err(Refusal::NoImage),
            Request::SaveImage => board.save_image(self.image_crc32)?,
        }
        Ok(Answer::Done)
    }

    fn hello(&self, board: &mut impl Board<B>) -> Hello<'static> {
        Hello {
            protocol_hash: PROTOCOL_HASH,
            image_schema_hash: image::schema_hash(),
            firmware: self.identity.firmware,
            board: self.identity.board,
            can_lock_step: self.identity.can_lock_step,
            max_image_len: self.identity.max_image_len,
            mode: board.status().mode,
            next_counters: board.next_counters(),
        }
    }

    /// Begins an upload. An interrupted upload of the same image is resumed: the next chunk is refused
    /// with the expected offset.
    fn begin(&mut self, len: u32, crc32: u32) -> Result<(), Refusal<'static>> {
        let unfinished = self.upload.take();
        let spare = self.spare.as_ref().ok_or(Refusal::Unsupported)?;
        let capacity = u32::try_from(spare.as_ref().len()).unwrap_or(u32::MAX);
        if len > capacity {
            return Err(Refusal::TooLong { capacity });
        }
        let same = unfinished.filter(|upload| (upload.len, upload.crc32) == (len, crc32));
        self.upload = Some(same.unwrap_or(Upload { len, crc32, received: 0 }));
        Ok(())
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal<'static>> {
        let upload = self.upload.as_mut().ok_or(Refusal::NoUpload)?;
        let refused = Refusal::Offset { expected: upload.received };
        let end = u32::try_from(bytes.len()).ok().and_then(|len| offset.checked_add(len));
        let end = end.filter(|&end| offset == upload.received && end <= upload.len);
        let end = end.ok_or(refused)?;
        let spare = self.spare.as_mut().ok_or(refused)?.as_mut();
        spare.get_mut(offset as usize..end as usize).ok_or(refused)?.copy_from_slice(bytes);
        upload.received = end;
        Ok(())
    }

    fn activate(&mut self, board: &mut impl Board<B>) -> Result<(), Refusal<'static>> {
        let Upload { len, crc32, received } = self.upload.ok_or(Refusal::NoUpload)?;
        if received != len {
            return Err(Refusal::Incomplete { expected: len, received });
        }
        self.upload = None;
        self.put_to_use(len as usize, Some(crc32), board)
    }

    /// Checks and activates the image at the beginning of the spare buffer.
    fn put_to_use(
        &mut self,
        len: usize,
        expected: Option<u32>,
        board: &mut impl Board<B>,
    ) -> Result<(), Refusal<'static>> {
        let buffer = self.spare.take().ok_or(Refusal::NoUpload)?;
        let mut image = Image { buffer, len, body_crc32: 0 };
        let (computed, body_crc32) = sums(&image, board);
        image.body_crc32 = body_crc32;
        let checked = match expected.filter(|&expected| expected != computed) {
            Some(expected) => Err(Refusal::Crc { expected, computed }),
            None => image.decode().map(|_| ()).map_err(refusal),
        };
        let result = match checked {
            Ok(()) => board.activate(image),
            Err(refusal) => Err((image.buffer, refusal)),
        };
        match result {
            Ok(spare) => {
                self.spare = spare;
                self.image_crc32 = computed;
                Ok(())
            }
            Err((buffer, refusal)) => {
                self.spare = Some(buffer);
                Err(refusal)
            }
        }
    }
}
