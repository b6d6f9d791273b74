//! The device on its board: the state that the tick owns, and the tasks' access to it.

use core::cell::Cell;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU32, Ordering};

use cathforce_bus::service::Load;
use cathforce_bus::{Counter, Counters, Frame};
use cathforce_control::{Config, Fault, Mode, Notice};
use cathforce_device::{BusRecovery, ControlLoop, Health};
use critical_section::{CriticalSection, Mutex};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use static_cell::StaticCell;

use crate::board::{self, Board, BootOptions};
use crate::{record, stack, watch};

/// Lateness from which on a tick counts as missed (promise P10) \[µs\].
const LATE_US: u32 = 2;

/// An image buffer in the large, slow memory.
pub type Buffer = &'static mut [u8];

/// State of the tick. Tasks access it with the tick masked, for less than 2 µs (promise P10).
struct Core {
    board: board::This,
    slot: &'static mut Slot,
    carrier: Counters,
    load: Load,
    /// Consecutive ticks that ran into the next one.
    overruns: u32,
    /// What holds the device from its boot on, until somebody has cleared this fault: why it reset itself, or
    /// that its saved images are lost.
    held_by: Option<Fault>,
    /// How often it has since it was switched on.
    resets: u32,
    bus: BusRecovery,
    /// Ticks until the tasks are asked again whether they run.
    until_asked: u8,
}

/// A control loop and its configuration. There are two: a new configuration is prepared in the one that
/// is not in use, however long that takes, and then exchanged in a few instructions.
pub struct Slot {
    pub control_loop: ControlLoop,
    pub active: Option<Active>,
}

/// A configuration, and the buffer that its lumen is read from.
pub struct Active {
    config: Config<'static>,
    buffer: NonNull<[u8]>,
    /// Length of the image in the buffer \[bytes\].
    len: usize,
}

// SAFETY: the pointer represents a `&'static mut [u8]`, which is `Send`.
unsafe impl Send for Active {}

impl Active {
    /// `decode`: reads a configuration in the first `len` bytes of `buffer`; on an error the buffer comes
    /// back with it.
    pub fn new<E>(
        buffer: Buffer,
        len: usize,
        decode: impl FnOnce(&'static [u8]) -> Result<Config<'static>, E>,
    ) -> Result<Self, (Buffer, E)> {
        let buffer = NonNull::from(buffer);
        // SAFETY: nobody writes to the buffer until `into_buffer`, after the configuration.
        let bytes: &'static [u8] = unsafe { buffer.as_ref() };
        match decode(bytes.get(..len).unwrap_or_default()) {
            Ok(config) => Ok(Self { config, buffer, len }),
            Err(error) => Err((give_back(buffer), error)),
        }
    }

    /// Drops the configuration and gives its buffer back.
    pub fn into_buffer(self) -> Buffer {
        let Self { config, buffer, .. } = self;
        drop(config);
        give_back(buffer)
    }
}

/// Turns the pointer of a dropped configuration back into its buffer.
fn give_back(buffer: NonNull<[u8]>) -> Buffer {
    // SAFETY: the pointer was a `&'static mut [u8]`, and its readers have been dropped.
    unsafe { &mut *buffer.as_ptr() }
}

/// Whoever accesses the core takes it out and puts it back, with the tick masked.
static CORE: Mutex<Cell<Option<&'static mut Core>>> = Mutex::new(Cell::new(None));

/// Number of the tick that runs, for faults: a hanging tick keeps the core.
static TICK: AtomicU32 = AtomicU32::new(0);

/// Signalled when the ticks granted by a SYNC have run.
pub static GRANT_USED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Where the frames of a tick go.
pub trait Outgoing {
    /// Queues a frame; returns `false` if the queue is full.
    fn send(&self, frame: Frame) -> bool;
    /// All frames of the tick are queued.
    fn tick_ends(&self);
    /// Starts the bus controller again after bus-off.
    fn reopen(&self);
}

/// Makes a slot in its place.
///
/// It is not inlined, because the state passes through this function's frame, which is larger than all
/// others. In the frame of `main`, which lies below every interrupt, it would stay.
#[inline(never)]
fn place(cell: &'static StaticCell<Slot>) -> &'static mut Slot {
    cell.init_with(|| Slot { control_loop: ControlLoop::new(), active: None })
}

/// Creates the device. Called once, before ticks run. Returns the slot that is not in use.
pub fn start(board: board::This) -> &'static mut Slot {
    static FIRST: StaticCell<Slot> = StaticCell::new();
    static SECOND: StaticCell<Slot> = StaticCell::new();
    static PLACE: StaticCell<Core> = StaticCell::new();
    let crash = record::read();
    let core = PLACE.init(Core {
        board,
        slot: place(&FIRST),
        carrier: Counters::default(),
        load: Load::default(),
        overruns: 0,
        held_by: crash.and_then(|crash| Fault::from_code(crash.fault)),
        resets: crash.map_or(0, |crash| crash.resets),
        bus: BusRecovery::default(),
        until_asked: watch::ASK_EVERY_TICKS,
    });
    let spare = place(&SECOND);
    adopt(core);
    spare
}

fn adopt(core: &'static mut Core) {
    critical_section::with(|cs| CORE.borrow(cs).set(Some(core)));
}

/// Boot options of the board, applied to the control loop.
pub fn boot_options(board: board::This) -> BootOptions {
    let options = board.boot_options();
    with(|core| core.slot.control_loop.set_lock_step(options.lock_step));
    options
}

/// Holds the device by a fault that its boot has found, unless another one does already.
pub fn hold(fault: Fault) {
    with(|core| core.held_by = core.held_by.or(Some(fault)));
}

/// Runs `f` on the core, if it is there.
fn try_with<R>(cs: CriticalSection<'_>, f: impl FnOnce(&mut Core) -> R) -> Option<R> {
    let place = CORE.borrow(cs);
    let core = place.take()?;
    let result = f(core);
    place.set(Some(core));
    Some(result)
}

/// Runs `f` with the tick masked. For tasks.
fn with<R>(f: impl FnOnce(&mut Core) -> R) -> R {
    match critical_section::with(|cs| try_with(cs, f)) {
        Some(result) => result,
        None => panic!("the device is used before it is started, or its memory is corrupt"),
    }
}

/// The tick, for the board's timer interrupt. Nothing in it can panic (P13).
///
/// Without a core it does nothing, and the watchdog resets the device.
pub fn tick(out: &impl Outgoing) {
    critical_section::with(|cs| {
        try_with(cs, |core| {
            let late = core.board.lateness();
            // Once after every reset of the counters, because painting the stack takes long.
            if core.load.tick_stack_bytes == 0 {
                core.load.tick_stack_bytes = stack::measure(|| core.tick(late, out));
            } else {
                core.tick(late, out);
            }
        })
    });
}

impl Core {
    /// One tick of the device, which began `late` counts after it was due.
    fn tick(&mut self, late: u32, out: &impl Outgoing) {
        let board = self.board;
        let (began, began_cycles) = (board.time(), board.cycles());
        let Slot { control_loop, active } = &mut *self.slot;
        let number = control_loop.ticks();
        TICK.store(number, Ordering::Relaxed);
        let notice = if self.overruns >= 2 {
            Some(Notice::Overrun)
        } else if let Some(fault) = self.held_by {
            Notice::of(fault)
        } else {
            self.bus.is_off().then_some(Notice::BusOff)
        };
        control_loop.set_health(Health {
            resets: self.resets,
            crash: self.held_by.map_or(0, Fault::code),
            missed_ticks: self.load.missed_ticks,
        });
        let before = control_loop.outputs().map(|outputs| outputs.mode);
        let frames = control_loop.tick(active.as_ref().map(|a| &a.config), notice);
        let mode = control_loop.outputs().map(|outputs| outputs.mode);
        board.show_force(control_loop.outputs().map_or(0.0, |outputs| outputs.force_n));
        board.enable_outputs(mode == Some(Mode::Armed) || !control_loop.may_reconfigure());
        // A fault that has been cleared is past; before that it comes back with every configuration.
        if matches!(before, Some(Mode::Fault { cause }) if Some(cause) == self.held_by)
            && mode != before
        {
            self.held_by = None;
        }
        for frame in frames.into_iter().flatten() {
            if self.bus.is_off() {
                self.carrier.count(Counter::BusOff);
            } else if !out.send(frame) {
                self.carrier.count(Counter::QueueFull);
            }
        }
        if self.bus.tick() {
            out.reopen();
        }
        out.tick_ends();
        self.feed_watchdog();
        let control_loop = &self.slot.control_loop;
        if !control_loop.lock_step() {
            board.renew_input();
        } else if control_loop.granted() == 0 {
            board.hold_ticks();
            GRANT_USED.signal(());
        }
        self.account(
            number,
            late,
            board.time().wrapping_sub(began),
            board.cycles().wrapping_sub(began_cycles),
        );
    }

    /// Feeds the watchdog if every task has run since it was asked (P11).
    fn feed_watchdog(&mut self) {
        self.until_asked = self.until_asked.saturating_sub(1);
        if self.until_asked == 0 && watch::all_have_run() {
            self.until_asked = watch::ASK_EVERY_TICKS;
            self.board.alive();
        }
    }

    /// Records the cost of the tick, and whether it was on time.
    fn account(&mut self, number: u32, late: u32, counts: u32, cycles: u32) {
        let instructions = self.board.instructions(counts);
        if instructions > self.load.worst_instructions {
            self.load.worst_instructions = instructions;
            self.load.worst_tick = number;
        }
        if cycles > self.load.worst_cycles {
            self.load.worst_cycles = cycles;
            self.load.worst_tick = number;
        }
        let overran = self.board.tick_pending();
        self.overruns = if overran { self.overruns.saturating_add(1) } else { 0 };
        self.load.overruns = self.load.overruns.saturating_add(u32::from(overran));
        let is_late = late > board::This::COUNTS_A_SECOND / 1_000_000 * LATE_US;
        self.load.missed_ticks =
            self.load.missed_ticks.saturating_add(u32::from(overran || is_late));
        let late_ns = late.saturating_mul(1_000_000_000 / board::This::COUNTS_A_SECOND);
        self.load.latest_start_ns = self.load.latest_start_ns.max(late_ns);
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
        core.slot.control_loop.on_frame(frame);
        if core.slot.control_loop.granted() == 0 {
            return FrameOutcome::Waits;
        }
        GRANT_USED.reset();
        core.board.start_ticks();
        FrameOutcome::Granted
    })
}

/// Counts a frame that cannot be ours.
pub fn on_foreign() {
    with(|core| core.slot.control_loop.on_foreign());
}

/// The bus controller says whether it is bus-off.
pub fn on_bus_state(off: bool) {
    with(|core| core.bus.on_state(off));
}

/// Counts an event of the carrier: a line or a queue.
pub fn count(counter: Counter) {
    with(|core| core.carrier.count(counter));
}

/// Ticks run only when granted.
pub fn is_in_lock_step() -> bool {
    with(|core| core.slot.control_loop.lock_step())
}

/// Number of the last tick since configuration, for a fault.
pub fn ticks() -> u32 {
    TICK.load(Ordering::Relaxed)
}

/// Runs `f` on the control loop in use, with the tick masked.
pub fn control_loop<R>(f: impl FnOnce(&mut ControlLoop) -> R) -> R {
    with(|core| f(&mut core.slot.control_loop))
}

/// Counters of the carrier, and the load.
pub fn carrier_and_load() -> (Counters, Load) {
    with(|core| (core.carrier, core.load))
}

/// Zeroes counters and worst cases.
pub fn reset_counters() {
    with(|core| {
        core.slot.control_loop.reset_counters();
        core.carrier = Counters::default();
        core.load = Load::default();
    });
}

/// The bytes of the image in use. Valid until the next exchange.
pub fn image() -> Option<&'static [u8]> {
    with(|core| {
        let active = core.slot.active.as_ref()?;
        // SAFETY: the buffer is static, and only the caller of `exchange` gives it back.
        let buffer: &'static [u8] = unsafe { active.buffer.as_ref() };
        buffer.get(..active.len)
    })
}

/// Exchanges the slots, unless output is on. Returns whether it did.
pub fn exchange(spare: &mut &'static mut Slot) -> bool {
    with(|core| {
        if !core.slot.control_loop.may_reconfigure() {
            return false;
        }
        spare.control_loop.continue_from(&core.slot.control_loop);
        core::mem::swap(&mut core.slot, spare);
        core.load = Load::default();
        core.overruns = 0;
        true
    })
}

/// Switches between ticks by grant and ticks by the clock. Returns `false` while output is on.
pub fn set_lock_step(on: bool) -> bool {
    with(|core| {
        if !core.slot.control_loop.set_lock_step(on) {
            return false;
        }
        if on {
            core.board.hold_ticks();
        } else {
            core.board.start_ticks();
        }
        true
    })
}
