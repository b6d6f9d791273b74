//! Talking to one device over a link.

use std::fmt;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bus::master::Master;
use cathforce_bus::service::{
    self, HostEndpoint, MAX_CHUNK, MAX_REQUEST, PROTOCOL_HASH, Refusal, Request, Response,
    SavedState, Status,
};
use cathforce_bus::{
    Command, Counters, Direction, FROM_HOST, Frame, Id, NextCounters, Process, Sealer,
};
use cathforce_config::image;
use cathforce_control::Fault;

use crate::boards::update;
use crate::ticks::Assembler;
use crate::{Link, LinkError, TickReport};

/// How often a request is sent before the device counts as silent.
const ATTEMPTS: u32 = 3;
/// How long a response may take. An emulated board may be many times slower than real.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(2);
/// The same for checking or saving a whole image.
const LONG_TIMEOUT: Duration = Duration::from_secs(20);

/// How often an upload continues at the offset that the device asks for, before it is given up.
const MOST_RESTARTS: u32 = 8;

/// Called with every frame, in the order in which it was sent or received. A received frame comes
/// with the time that it had waited on this computer ([`Link::waited`]).
pub type Tap = Box<dyn FnMut(Direction, &Frame, Option<Duration>) + Send>;

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    pub firmware: String,
    pub board: String,
    pub protocol_hash: u64,
    pub image_schema_hash: u32,
    pub can_lock_step: bool,
    /// Longest image it can take \[bytes\].
    pub max_image_len: u32,
    /// Code of its mode, as in the HAPTIC frame.
    pub mode: u8,
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} with firmware {}", self.board, self.firmware)
    }
}

/// What a device wrote down before it reset itself; see [`service::Crash`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// The fault; `None` if this version does not know its code.
    pub fault: Option<Fault>,
    pub resets: u32,
    pub tick: u32,
    pub time_us: u32,
    pub program_counter: u32,
    pub link_register: u32,
    pub status: u32,
    pub address: u32,
    pub hung_tasks: u8,
    pub text: String,
}

impl From<service::Crash<'_>> for CrashRecord {
    fn from(crash: service::Crash<'_>) -> Self {
        Self {
            fault: Fault::from_code(crash.fault),
            resets: crash.resets,
            tick: crash.tick,
            time_us: crash.time_us,
            program_counter: crash.program_counter,
            link_register: crash.link_register,
            status: crash.status,
            address: crash.address,
            hung_tasks: crash.hung_tasks,
            text: crash.text.into(),
        }
    }
}

/// What a device has saved; see [`service::Saved`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedImage {
    pub state: SavedState,
    pub image_crc32: u32,
    pub on_trial: bool,
    pub refused: String,
}

impl From<service::Saved<'_>> for SavedImage {
    fn from(saved: service::Saved<'_>) -> Self {
        let service::Saved { state, image_crc32, on_trial, refused } = saved;
        Self { state, image_crc32, on_trial, refused: refused.into() }
    }
}

/// Why a device did not do what it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    #[error(transparent)]
    Link(#[from] LinkError),

    /// Nothing has changed on the device.
    #[error("the device refused {request}: {reason}")]
    Refused { request: &'static str, reason: String },

    #[error(
        "the device ({device}) speaks protocol {found:016x}, this program speaks {expected:016x}: \
         it cannot be armed from here\n  fix: {}; or use the program of the device's version (this one \
         is {})", update(&device.board), env!("CARGO_PKG_VERSION")
    )]
    Protocol { device: Device, expected: u64, found: u64 },

    #[error(
        "the image of {len} bytes is longer than the {capacity} that this device can take: make \
         the lumen's grid coarser (--cell) or its part of the vessel smaller"
    )]
    ImageTooLong { len: usize, capacity: u32 },

    /// The caller stopped the upload when it was told the progress.
    #[error("interrupted while the image was sent; the device goes on using what it had")]
    Stopped,

    #[error("the device was asked {request}, and its answer belongs to another request")]
    Answer { request: &'static str },
}

/// One device, reached over a link.
pub struct Client<L = Box<dyn Link>> {
    pub(crate) link: L,
    endpoint: HostEndpoint,
    endpoint_counters: Counters,
    sequence: u8,
    sealer: Sealer,
    assembler: Assembler,
    tap: Option<Tap>,
    device: Device,
    pub(crate) lock_step: bool,
    pub(crate) host_tick: u32,
    pub(crate) latest_step: Duration,
    /// How the drives' positions go to the device, as its image says.
    pub(crate) master: Master,
    started: Instant,
}

/// A response that does not borrow.
enum Reply {
    Device(Device, NextCounters),
    Status(Box<Status>),
    Bytes(Vec<u8>),
    Crash(Option<CrashRecord>),
    Saved(Option<SavedImage>),
    /// The chunk of an image was not the next one.
    WantsOffset(u32),
    /// No upload is under way.
    WantsBeginning,
    Done,
}

impl<L: Link> Client<L> {
    /// Finds out who is there. A device of another protocol is refused, naming both (P21).
    pub fn connect(link: L) -> Result<Self, ClientError> {
        let nobody = Device {
            firmware: String::new(),
            board: String::new(),
            protocol_hash: 0,
            image_schema_hash: 0,
            can_lock_step: false,
            max_image_len: 0,
            mode: cathforce_bus::MODE_UNCONFIGURED,
        };
        let mut client = Self {
            link,
            // The host reads as fast as frames come: one block, however long the message.
            endpoint: HostEndpoint::new(Id::ServiceRequest.raw(), 0),
            endpoint_counters: Counters::default(),
            sequence: 0,
            sealer: Sealer::default(),
            assembler: Assembler::default(),
            tap: None,
            device: nobody,
            lock_step: false,
            host_tick: 0,
            latest_step: Duration::ZERO,
            master: Master::default(),
            started: Instant::now(),
        };
        client.hello()?;
        client.lock_step = client.status()?.lock_step;
        Ok(client)
    }

    /// Asks the device again who it is.
    pub fn hello(&mut self) -> Result<&Device, ClientError> {
        let Reply::Device(device, next_counters) = self.request(Request::Hello)? else {
            return Err(ClientError::Answer { request: "hello" });
        };
        if device.protocol_hash != PROTOCOL_HASH {
            let found = device.protocol_hash;
            return Err(ClientError::Protocol { device, expected: PROTOCOL_HASH, found });
        }
        for (id, next) in FROM_HOST.into_iter().zip(next_counters) {
            self.sealer.continue_at(id, next);
        }
        self.device = device;
        Ok(&self.device)
    }

    /// Who the device said it was.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// How the device is.
    pub fn status(&mut self) -> Result<Status, ClientError> {
        match self.request(Request::GetStatus)? {
            Reply::Status(status) => Ok(*status),
            _ => Err(ClientError::Answer { request: "for its status" }),
        }
    }

    /// Why the device reset itself last; `None` if it has not since it was switched on.
    pub fn crash(&mut self) -> Result<Option<CrashRecord>, ClientError> {
        match self.request(Request::ReadCrash)? {
            Reply::Crash(crash) => Ok(crash),
            _ => Err(ClientError::Answer { request: "for its last crash" }),
        }
    }

    /// What the device has saved; `None` on a device that cannot save.
    pub fn saved(&mut self) -> Result<Option<SavedImage>, ClientError> {
        match self.request(Request::ReadSaved)? {
            Reply::Saved(saved) => Ok(saved),
            _ => Err(ClientError::Answer { request: "for what it has saved" }),
        }
    }

    /// Lets the device save the image that it uses, so that it boots with it.
    pub fn save_image(&mut self) -> Result<(), ClientError> {
        self.done(Request::SaveImage)
    }

    /// Sends an image and puts it to use; `progress` is told the bytes sent so far and may
    /// stop it. On an error the device goes on using what it had.
    ///
    /// Continues where an earlier upload of the same image was cut. A device that was reset
    /// meanwhile gets the image from the beginning.
    pub fn upload_image(
        &mut self,
        image: &[u8],
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Result<(), ClientError> {
        let capacity = self.device.max_image_len;
        let len = u32::try_from(image.len()).ok().filter(|&len| len <= capacity);
        let len = len.ok_or(ClientError::ImageTooLong { len: image.len(), capacity })?;
        let begin = Request::BeginImage { len, crc32: service::crc32(image) };
        self.done(begin)?;
        let (mut sent, mut restarts) = (0, 0);
        while let Some(rest) = image.get(sent..).filter(|rest| !rest.is_empty()) {
            let bytes = rest.get(..MAX_CHUNK).unwrap_or(rest);
            match self.request(Request::ImageChunk { offset: sent as u32, bytes })? {
                Reply::Done => sent += bytes.len(),
                Reply::WantsOffset(expected) if restarts < MOST_RESTARTS => {
                    restarts += 1;
                    sent = expected as usize;
                }
                Reply::WantsBeginning if restarts < MOST_RESTARTS => {
                    restarts += 1;
                    sent = 0;
                    self.hello()?;
                    self.done(begin)?;
                }
                _ => {
                    let reason = "it keeps losing what it was sent: does another program upload \
                                  too, or is its supply weak?";
                    let request = "a part of the image";
                    return Err(ClientError::Refused { request, reason: reason.into() });
                }
            }
            if progress(sent).is_break() {
                return Err(ClientError::Stopped);
            }
        }
        self.done(Request::Activate)?;
        self.assembler.restart();
        self.host_tick = 0;
        // The device has accepted the image, so it can be read.
        self.master = image::master(image).unwrap_or_default();
        Ok(())
    }

    /// The first bytes of the image in use, as many as `wanted` says when it is shown those read
    /// so far; the whole image if it asks for more than there is.
    pub fn read_image(&mut self, wanted: impl Fn(&[u8]) -> usize) -> Result<Vec<u8>, ClientError> {
        let mut image = Vec::new();
        while image.len() < wanted(&image) {
            let Reply::Bytes(bytes) =
                self.request(Request::ReadImage { offset: image.len() as u32 })?
            else {
                return Err(ClientError::Answer { request: "for its image" });
            };
            if bytes.is_empty() {
                break;
            }
            image.extend(bytes);
        }
        Ok(image)
    }

    /// Lets ticks run only when granted, or by the device's clock.
    pub fn set_lock_step(&mut self, on: bool) -> Result<(), ClientError> {
        self.done(Request::SetLockStep { on })?;
        self.lock_step = on;
        Ok(())
    }

    /// Ticks run only when granted.
    pub fn lock_step(&self) -> bool {
        self.lock_step
    }

    /// How long after its time a step was sent at most; in lock step none has a time.
    pub fn latest_step(&self) -> Duration {
        self.latest_step
    }

    /// Zeroes the device's counters and worst cases.
    pub fn reset_counters(&mut self) -> Result<(), ClientError> {
        self.done(Request::ResetCounters)
    }

    /// Sends a command; it acts in the next tick. Where it led is seen in the next reports.
    pub fn command(&mut self, command: Command) -> Result<(), ClientError> {
        self.send_process(Process::Command(command))?;
        Ok(self.link.flush()?)
    }

    /// Shows every frame from now on to `tap`, for a recording. In lock step several ticks
    /// may be under way: frames to the device are seen before the answers to earlier ones.
    pub fn set_tap(&mut self, tap: Option<Tap>) {
        self.tap = tap;
    }

    /// Counts of what became of the frames from the device.
    pub fn counters(&self) -> Counters {
        self.assembler.counters().merged(&self.endpoint_counters)
    }

    /// The link.
    pub fn link(&self) -> &L {
        &self.link
    }

    /// Gives back the link and ends the client.
    pub fn into_link(self) -> L {
        self.link
    }

    /// The link, to send frames past the client. The tap does not see them.
    pub fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    pub(crate) fn send_process(&mut self, process: Process) -> Result<(), LinkError> {
        self.send_sealed(process, cathforce_bus::Status::default())
    }

    pub(crate) fn send_sealed(
        &mut self,
        process: Process,
        status: cathforce_bus::Status,
    ) -> Result<(), LinkError> {
        let frame = self.sealer.seal(process, status);
        self.send(&frame)
    }

    pub(crate) fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)?;
        if let Some(tap) = &mut self.tap {
            tap(Direction::ToDevice, frame, None);
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.link.receive(timeout)?;
        if let (Some(frame), Some(tap)) = (&frame, &mut self.tap) {
            tap(Direction::ToHost, frame, self.link.waited());
        }
        Ok(frame)
    }

    /// The next tick of the device, `None` after `timeout`.
    pub(crate) fn receive_tick(
        &mut self,
        timeout: Duration,
    ) -> Result<Option<TickReport>, LinkError> {
        let deadline = Instant::now() + timeout;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Some(frame) = self.receive(left)? else {
                if Instant::now() >= deadline {
                    return Ok(None);
                }
                continue;
            };
            if Id::from_raw(frame.id()) == Some(Id::ServiceResponse) {
                self.endpoint.receive(&frame, &mut self.endpoint_counters);
            } else if let Some(report) = self.assembler.push(frame) {
                return Ok(Some(report));
            }
        }
    }

    fn done(&mut self, request: Request<'_>) -> Result<(), ClientError> {
        match self.request(request)? {
            Reply::Done => Ok(()),
            _ => Err(ClientError::Answer { request: name(&request) }),
        }
    }

    /// Sends a request until it is answered; a device does a repeated one only once.
    fn request(&mut self, request: Request<'_>) -> Result<Reply, ClientError> {
        self.sequence = self.sequence.wrapping_add(1);
        let sealed = service::seal::<_, MAX_REQUEST>(self.sequence, &request);
        let Some(bytes) = sealed else {
            return Err(ClientError::Answer { request: name(&request) });
        };
        let timeout = match request {
            Request::Activate | Request::SaveImage => LONG_TIMEOUT,
            _ => RESPONSE_TIMEOUT,
        };
        for _ in 0..ATTEMPTS {
            if self.endpoint.send(&bytes).is_err() {
                break;
            }
            if let Some(reply) = self.exchange(&request, Instant::now() + timeout)? {
                return reply;
            }
        }
        Err(ClientError::Link(LinkError::Silent {
            link: self.link.name().into(),
            waited: timeout * ATTEMPTS,
            awaited: "an answer from the device",
            check: "that the device is powered and runs cathforce firmware, that both sides use \
                    1 Mbit/s and that no other program talks to it; identifiers that were moved need \
                    `,id-base=BASE` behind the link",
        }))
    }

    /// Sends what the transfer allows and waits for the answer; `None` at the deadline.
    fn exchange(
        &mut self,
        request: &Request<'_>,
        deadline: Instant,
    ) -> Result<Option<Result<Reply, ClientError>>, LinkError> {
        loop {
            while let Some(frame) =
                self.endpoint.next_frame(self.started.elapsed().as_micros() as u32)
            {
                self.send(&frame)?;
            }
            self.link.flush()?;
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            // While a separation time is kept, there is more to send soon.
            let wait =
                if self.endpoint.is_sending() { left.min(Duration::from_millis(1)) } else { left };
            let Some(frame) = self.receive(wait)? else { continue };
            if Id::from_raw(frame.id()) != Some(Id::ServiceResponse) {
                // Ticks go on meanwhile: the tap has seen the frame, and it is counted.
                self.assembler.push(frame);
                continue;
            }
            let Some(message) = self.endpoint.receive(&frame, &mut self.endpoint_counters) else {
                continue;
            };
            match service::open::<Response>(message) {
                Ok((sequence, response)) if sequence == self.sequence => {
                    return Ok(Some(reply(request, response)));
                }
                // A late answer to an earlier request, or a broken one: the request is repeated.
                _ => {}
            }
        }
    }
}

fn reply(request: &Request<'_>, response: Response<'_>) -> Result<Reply, ClientError> {
    Ok(match response {
        Response::Hello(hello) => Reply::Device(
            Device {
                firmware: hello.firmware.into(),
                board: hello.board.into(),
                protocol_hash: hello.protocol_hash,
                image_schema_hash: hello.image_schema_hash,
                can_lock_step: hello.can_lock_step,
                max_image_len: hello.max_image_len,
                mode: hello.mode,
            },
            hello.next_counters,
        ),
        Response::Status(status) => Reply::Status(Box::new(status)),
        Response::Done => Reply::Done,
        Response::ImageBytes(bytes) => Reply::Bytes(bytes.to_vec()),
        Response::Crash(crash) => Reply::Crash(crash.map(CrashRecord::from)),
        Response::Saved(saved) => Reply::Saved(Some(saved.into())),
        Response::Refused(Refusal::Unsupported) if matches!(request, Request::ReadSaved) => {
            Reply::Saved(None)
        }
        Response::Refused(Refusal::Offset { expected }) => Reply::WantsOffset(expected),
        Response::Refused(Refusal::NoUpload) if matches!(request, Request::ImageChunk { .. }) => {
            Reply::WantsBeginning
        }
        Response::Refused(refusal) => {
            return Err(ClientError::Refused { request: name(request), reason: explain(refusal) });
        }
    })
}

fn name(request: &Request<'_>) -> &'static str {
    match request {
        Request::Hello => "to say who it is",
        Request::GetStatus => "its status",
        Request::BeginImage { .. } => "to take an image",
        Request::ImageChunk { .. } => "a part of the image",
        Request::Activate => "to use the image",
        Request::SetLockStep { .. } => "to change between lock step and its own clock",
        Request::ResetCounters => "to reset its counters",
        Request::ReadImage { .. } => "for its image",
        Request::ReadCrash => "for its last crash",
        Request::SaveImage => "to save its image",
        Request::ReadSaved => "for what it has saved",
    }
}

/// What a refusal means and what to do.
fn explain(refusal: Refusal<'_>) -> String {
    match refusal {
        Refusal::Unknown => {
            "it does not know this request: its firmware is of another version".into()
        }
        Refusal::Armed => "its output is armed: disarm it first".into(),
        Refusal::Unsupported => "this board cannot do that".into(),
        Refusal::NoImage => "it is not configured".into(),
        Refusal::NoUpload => {
            "no upload is under way: has the device been restarted? Upload again".into()
        }
        Refusal::TooLong { capacity } => format!("it can take {capacity} bytes at most"),
        Refusal::Offset { expected } => {
            format!("it waits for byte {expected}: does another program upload too? Upload again")
        }
        Refusal::Incomplete { expected, received } => {
            format!("only {received} of {expected} bytes have arrived: upload again")
        }
        Refusal::Crc { expected, computed } => format!(
            "the bytes that arrived are not those sent (CRC {computed:08x}, not {expected:08x}): \
             upload again, and if that does not help check the device's memory"
        ),
        Refusal::Flash { reason } => format!(
            "its flash failed: {reason}. What it had saved before is there still: save again, and if \
             that does not help replace the board"
        ),
        Refusal::Image { offset, reason, field: "" } => {
            format!("the image is wrong at byte {offset}: {reason}")
        }
        Refusal::Image { offset, reason, field } => {
            format!("the image is wrong at byte {offset}: {field}: {reason}")
        }
    }
}
