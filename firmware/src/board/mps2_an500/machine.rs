//! Clocks, tick timer, watchdog and outputs of the machine.

use core::ops::Range;
use core::sync::atomic::{AtomicU32, Ordering};

use super::clock::{CLOCK_HZ, TICK_RELOAD};
use super::flash::{self, MemoryFlash};
use super::registers::{fpga_io, timer0, watchdog};
use super::semihosting::{self, CALIBRATION_INSTRUCTIONS};
use super::serial::{self, Ports};
use super::vectors;
use crate::board::interface::{Board, BootOptions};

/// The watchdog interrupts after 10 ms and resets after another 10 ms.
const WATCHDOG_LOAD: u32 = CLOCK_HZ / 100;
/// The boot takes 20 ms, with the outputs off.
const BOOT_WATCHDOG_LOAD: u32 = CLOCK_HZ / 10;
/// LED 0 represents the enable line of the motor drives.
const OUTPUT_ENABLE: u32 = 1;

/// Instructions in 1024 counts, measured at boot.
static INSTRUCTIONS_IN_1024: AtomicU32 = AtomicU32::new(0);

/// The board. Its existence proves that it has been started.
#[derive(Clone, Copy)]
pub struct Mps2An500(());

/// Sets up clocks, UARTs and interrupts. Called once, by `main`.
///
/// `tick`: called by the tick timer's interrupt, which nothing can interrupt.
pub fn start(tick: fn()) -> (Mps2An500, Ports) {
    outputs_off();
    // SAFETY: the reload value belongs to a stopped timer. The watchdog watches over the boot, until ticks
    // are started or held.
    unsafe {
        watchdog().load.write(BOOT_WATCHDOG_LOAD);
        watchdog().control.write(0b11);
        timer0().control.write(0);
        timer0().reload.write(TICK_RELOAD);
        timer0().value.write(TICK_RELOAD);
        fpga_io().prescale.write(0);
    }
    let (counts, _) = semihosting::calibrate();
    let in_1024 = u64::from(CALIBRATION_INSTRUCTIONS) * 1024 / u64::from(counts.max(1));
    INSTRUCTIONS_IN_1024.store(in_1024 as u32, Ordering::Relaxed);
    let ports = serial::start();
    vectors::enable(tick);
    (Mps2An500(()), ports)
}

/// Removes the power of the motor drives. Safe in any state, also before [`start`].
pub fn outputs_off() {
    // SAFETY: one register, on which nothing else depends.
    unsafe { fpga_io().leds.modify(|leds| leds & !OUTPUT_ENABLE) }
}

/// Gives the watchdog its whole time again.
pub fn feed_watchdog() {
    // SAFETY: any value reloads the watchdog.
    unsafe { watchdog().interrupt_clear.write(1) }
}

/// Time since boot, wrapping \[µs\].
pub fn time_us() -> u32 {
    fpga_io().counter.read() / (CLOCK_HZ / 1_000_000)
}

impl Board for Mps2An500 {
    const COUNTS_A_SECOND: u32 = CLOCK_HZ;
    const IMAGE_BUFFER_LEN: usize = flash::LONGEST_IMAGE;
    const SAVED_IMAGES: [Range<u32>; 2] = flash::SLOTS;
    type Flash = MemoryFlash;

    fn flash(self, working: fn()) -> MemoryFlash {
        MemoryFlash::new(working)
    }

    fn name(self) -> &'static str {
        "mps2-an500"
    }

    fn can_lock_step(self) -> bool {
        true
    }

    fn time(self) -> u32 {
        fpga_io().counter.read()
    }

    fn lateness(self) -> u32 {
        // The interrupt comes when the value reaches 0, and the reload takes one more count.
        let late = match timer0().value.read() {
            0 => 0,
            value => (TICK_RELOAD + 1).saturating_sub(value),
        };
        // SAFETY: clears the timer's interrupt, which is being handled.
        unsafe { timer0().interrupt.write(1) }
        late
    }

    fn tick_pending(self) -> bool {
        timer0().interrupt.read() & 1 != 0
    }

    fn instructions(self, counts: u32) -> u32 {
        let in_1024 = INSTRUCTIONS_IN_1024.load(Ordering::Relaxed);
        (u64::from(counts) * u64::from(in_1024) / 1024) as u32
    }

    fn start_ticks(self) {
        // SAFETY: the tick's handler and state exist before `run`.
        unsafe {
            watchdog().load.write(WATCHDOG_LOAD);
            watchdog().control.write(0b11);
            timer0().control.write(0b1001);
        }
        serial::limit_input(true);
    }

    fn hold_ticks(self) {
        // SAFETY: the watchdog must not run while time stands still.
        unsafe {
            timer0().control.write(0);
            timer0().value.write(TICK_RELOAD);
            watchdog().control.write(0);
        }
        serial::limit_input(false);
    }

    fn alive(self) {
        feed_watchdog();
    }

    fn renew_input(self) {
        serial::renew_input();
    }

    fn enable_outputs(self, on: bool) {
        // SAFETY: only the tick writes this register, and a fault after the last tick.
        unsafe {
            fpga_io()
                .leds
                .modify(|leds| if on { leds | OUTPUT_ENABLE } else { leds & !OUTPUT_ENABLE })
        }
    }

    fn boot_options(self) -> BootOptions {
        let arguments = semihosting::Arguments::read();
        if arguments.has("self-test") {
            semihosting::report_and_exit();
        }
        BootOptions { lock_step: arguments.has("lock-step") }
    }

    fn run(self, options: BootOptions) {
        if options.lock_step {
            self.hold_ticks();
        } else {
            self.start_ticks();
        }
    }

    /// Works around a race in QEMU. Its main loop may see the processor asleep before the last
    /// instructions are accounted for, and advance the clock to the next tick, which these instructions
    /// then delay. Reading a clock accounts for them. With interrupts masked, no instructions can follow
    /// before the sleep, which an interrupt ends all the same.
    fn idle(self) {
        cortex_m::interrupt::disable();
        self.time();
        cortex_m::asm::wfi();
        // SAFETY: undoes the above.
        unsafe { cortex_m::interrupt::enable() }
    }
}
