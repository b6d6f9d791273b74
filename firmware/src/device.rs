//! The device on its board: the state that the tick owns, and the tasks' access to it.

use core::cell::RefCell;
use core::ptr::NonNull;

use cathforce_bus::service::{Load, Refusal, Status};
use cathforce_bus::{Counter, Counters, Frame, NextCounters};
use cathforce_config::image;
use cathforce_control::{Config, Mode, Notice};
use cathforce_device::{Board as DeviceBoard, ControlLoop, Image, copy_from};
use critical_section::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use static_cell::StaticCell;

use crate::board::{self, Board, BootOptions};
use crate::stack;

/// Size of an image buffer \[bytes\].
pub const IMAGE_BUFFER_LEN: usize = 2 << 20;

/// Lateness from which on a tick counts as missed (promise P10) \[µs\].
const LATE_US: u32 = 2;

/// An image buffer in the large, slow memory.
pub type Buffer = &'static mut [u8];

/// State of the tick. Tasks access it with the tick masked, for microseconds.
struct Core {
    board: board::This,
    control_loop: ControlLoop,
    active: Option<Active>,
    carrier: Counters,
    load: Load,
    /// Consecutive ticks that ran into the next one.
    overruns: u32,
}

/// A configuration, and the buffer that its lumen is read from.
struct Active {
    config: Config<'static>,
    buffer: NonNull<[u8]>,
    /// Length of the image in the buffer \[bytes\].
    len: usize,
}

// SAFETY: the pointer represents a `&'static mut [u8]`, which is `Send`.
unsafe impl Send for Active {}

static CORE: Mutex<RefCell<Option<&'static mut Core>>> = Mutex::new(RefCell::new(None));

/// Signalled when the ticks granted by a SYNC have run.
pub static GRANT_USED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Creates the device. Called once, before ticks run.
///
/// It is not inlined into `main`, whose stack frame lies below every interrupt. The state passes through
/// this function's frame, which is larger than all others.
#[inline(never)]
pub fn start(board: board::This) {
    static PLACE: StaticCell<Core> = StaticCell::new();
    let core = PLACE.init_with(|| Core {
        board,
        control_loop: ControlLoop::new(),
        active: None,
        carrier: Counters::default(),
        load: Load::default(),
        overruns: 0,
    });
    critical_section::with(|cs| CORE.borrow_ref_mut(cs).replace(core));
}

/// Boot options of the board, applied to the control loop.
pub fn boot_options(board: board::This) -> BootOptions {
    let options = board.boot_options();
    with(|core| core.control_loop.set_lock_step(options.lock_step));
    options
}

/// Runs `f` with the tick masked.
fn with<R>(f: impl FnOnce(&mut Core) -> R) -> R {
    critical_section::with(|cs| match CORE.borrow_ref_mut(cs).as_mut() {
        Some(core) => f(core),
        None => panic!("the device is used before it is started"),
    })
}

/// The tick, for the board's timer interrupt.
///
/// `send`: queues a frame; returns `false` if the queue is full.
pub fn tick(send: impl Fn(Frame) -> bool) {
    with(|core| {
        let late = core.board.lateness();
        // Once after every reset of the counters, because painting the stack takes long.
        if core.load.tick_stack_bytes == 0 {
            core.load.tick_stack_bytes = stack::measure(|| core.tick(late, &send));
        } else {
            core.tick(late, &send);
        }
    });
}

impl Core {
    /// One tick of the device, which began `late` counts after it was due.
    fn tick(&mut self, late: u32, send: impl Fn(Frame) -> bool) {
        let board = self.board;
        let began = board.time();
        let notice = (self.overruns >= 2).then_some(Notice::Overrun);
        let number = self.control_loop.ticks();
        let frames = self.control_loop.tick(self.active.as_ref().map(|a| &a.config), notice);
        let armed = self.control_loop.outputs().is_some_and(|outputs| outputs.mode == Mode::Armed);
        board.enable_outputs(armed || !self.control_loop.may_reconfigure());
        for frame in frames.into_iter().flatten() {
            if !send(frame) {
                self.carrier.count(Counter::QueueFull);
            }
        }
        board.alive();
        if self.control_loop.lock_step() && self.control_loop.granted() == 0 {
            board.hold_ticks();
            GRANT_USED.signal(());
        }
        self.account(number, late, board.time().wrapping_sub(began));
    }

    /// Records the cost of the tick, and whether it was on time.
    fn account(&mut self, number: u32, late: u32, counts: u32) {
        let instructions = self.board.instructions(counts);
        if instructions > self.load.worst_instructions {
            self.load.worst_instructions = instructions;
            self.load.worst_tick = number;
        }
        let overran = self.board.tick_pending();
        self.overruns = if overran { self.overruns + 1 } else { 0 };
        let is_late = late > board::This::COUNTS_A_SECOND / 1_000_000 * LATE_US;
        self.load.missed_ticks += u32::from(overran || is_late);
    }
}

/// What becomes of a frame given to the control loop.
pub enum FrameOutcome {
    /// It is kept for the next tick.
    Waits,
    /// It granted ticks; the next frame must wait for [`GRANT_USED`].
    Granted,
}

/// Gives a process frame to the control loop.
pub fn on_frame(frame: &Frame) -> FrameOutcome {
    with(|core| {
        core.control_loop.on_frame(frame);
        if core.control_loop.granted() == 0 {
            return FrameOutcome::Waits;
        }
        GRANT_USED.reset();
        core.board.start_ticks();
        FrameOutcome::Granted
    })
}

/// Counts a frame that cannot be ours.
pub fn on_foreign() {
    with(|core| core.control_loop.on_foreign());
}

/// Counts an event of the carrier: a line or a queue.
pub fn count(counter: Counter) {
    with(|core| core.carrier.count(counter));
}

/// An image is in use.
pub fn is_configured() -> bool {
    with(|core| core.active.is_some())
}

/// The two image buffers. Called once.
pub fn image_buffers() -> [Buffer; 2] {
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
pub struct ServiceBoard(pub board::This);

impl DeviceBoard<Buffer> for ServiceBoard {
    fn is_armed(&mut self) -> bool {
        with(|core| !core.control_loop.may_reconfigure())
    }

    fn status(&mut self) -> Status {
        let (used, size) = stack::use_bytes();
        with(|core| {
            let load = Load { stack_used_bytes: used, stack_size_bytes: size, ..core.load };
            let mut status = core.control_loop.report(load);
            status.counters = status.counters.merged(&core.carrier);
            status
        })
    }

    fn next_counters(&mut self) -> NextCounters {
        with(|core| core.control_loop.next_counters())
    }

    fn activate(
        &mut self,
        image: Image<Buffer>,
    ) -> Result<Option<Buffer>, (Buffer, Refusal<'static>)> {
        let (buffer, len) = image.into_parts();
        let buffer = NonNull::from(buffer);
        // SAFETY: nobody writes to the buffer until `give_back`, after the configuration.
        let bytes: &'static [u8] = unsafe { buffer.as_ref() };
        let changed =
            Refusal::Image { offset: 0, reason: "changed since it was checked", field: "" };
        let decoded = bytes.get(..len).and_then(|bytes| image::decode(bytes).ok());
        let master = bytes.get(..len).and_then(|bytes| image::master(bytes).ok());
        let Some((config, master)) = decoded.zip(master) else {
            return Err((give_back(buffer), changed));
        };
        with(|core| {
            if !core.control_loop.may_reconfigure() {
                return Err((give_back(buffer), Refusal::Armed));
            }
            core.control_loop.restart(master);
            core.load = Load::default();
            core.overruns = 0;
            let old = core.active.replace(Active { config, buffer, len });
            Ok(old.map(|Active { config, buffer, .. }| {
                drop(config);
                give_back(buffer)
            }))
        })
    }

    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>> {
        if !self.0.can_lock_step() {
            return Err(Refusal::Unsupported);
        }
        with(|core| {
            if !core.control_loop.set_lock_step(on) {
                return Err(Refusal::Armed);
            }
            if on {
                core.board.hold_ticks()
            } else {
                core.board.start_ticks()
            }
            Ok(())
        })
    }

    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize> {
        with(|core| {
            let active = core.active.as_ref()?;
            // SAFETY: nobody writes to the buffer of the configuration in use.
            let buffer: &[u8] = unsafe { active.buffer.as_ref() };
            Some(copy_from(buffer.get(..active.len).unwrap_or_default(), offset, into))
        })
    }

    fn reset_counters(&mut self) {
        with(|core| {
            core.control_loop.reset_counters();
            core.carrier = Counters::default();
            core.load = Load::default();
        });
    }
}

/// Turns the pointer of a dropped configuration back into its buffer.
fn give_back(buffer: NonNull<[u8]>) -> Buffer {
    // SAFETY: the pointer was a `&'static mut [u8]`, and its readers have been dropped.
    unsafe { &mut *buffer.as_ptr() }
}
