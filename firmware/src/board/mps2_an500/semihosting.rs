//! Semihosting: the command line of the emulator, and a self-test of its clock.

use core::arch::asm;
use core::fmt::Write as _;

use super::clock::TICK_RELOAD;
use super::registers::{fpga_io, timer0};

/// Instructions of the loop that measures how many of them a count stands for.
pub const CALIBRATION_INSTRUCTIONS: u32 = 2 * 50_000;

const SYS_WRITE0: u32 = 0x04;
const SYS_GET_CMDLINE: u32 = 0x15;
const SYS_EXIT: u32 = 0x18;
const EXIT_SUCCESS: u32 = 0x2_0026;

/// One semihosting call; QEMU must run with `-semihosting-config enable=on`.
///
/// # Safety
/// `parameter` must be valid for the operation.
unsafe fn call(operation: u32, parameter: usize) -> u32 {
    let result;
    // SAFETY: the emulator changes only r0 and the memory that the caller passed.
    unsafe {
        asm!("bkpt 0xAB", inout("r0") operation => result, in("r1") parameter, options(nostack));
    }
    result
}

/// Words of `-semihosting-config arg=`.
pub struct Arguments {
    text: [u8; 128],
    len: usize,
}

impl Arguments {
    pub fn read() -> Self {
        let mut text = [0; 128];
        let mut block = [text.as_mut_ptr() as usize, text.len()];
        // SAFETY: pointer and length of a buffer that outlives the call.
        let failed = unsafe { call(SYS_GET_CMDLINE, block.as_mut_ptr() as usize) } != 0;
        Self { text, len: if failed { 0 } else { block[1].min(text.len()) } }
    }

    pub fn has(&self, word: &str) -> bool {
        let words = self.text.get(..self.len).unwrap_or_default();
        words.split(|&b| b == b' ' || b == 0).any(|w| w == word.as_bytes())
    }
}

/// Runs [`CALIBRATION_INSTRUCTIONS`]. Returns the counts of the FPGA counter and of TIMER 0 meanwhile.
///
/// TIMER 0 is stopped and reloaded afterwards.
pub fn calibrate() -> (u32, u32) {
    // SAFETY: called before ticks run, and the timer's interrupt stays disabled.
    unsafe {
        timer0().value.write(TICK_RELOAD);
        timer0().control.write(1);
    }
    let (counter, value) = (fpga_io().counter.read(), timer0().value.read());
    // SAFETY: two instructions per iteration, one register.
    unsafe {
        asm!("2:", "subs {n}, #1", "bne 2b", n = inout(reg) CALIBRATION_INSTRUCTIONS / 2 => _,
            options(nomem, nostack));
    }
    let counts =
        (fpga_io().counter.read().wrapping_sub(counter), value.wrapping_sub(timer0().value.read()));
    // SAFETY: as above.
    unsafe {
        timer0().control.write(0);
        timer0().value.write(TICK_RELOAD);
        timer0().interrupt.write(1);
    }
    counts
}

/// Reports instructions against clocks to the caller of the emulator, and ends the emulation.
pub fn report_and_exit() -> ! {
    let (counter, timer) = calibrate();
    let mut line = heapless::String::<128>::new();
    // Cannot fail: four words and three numbers of at most 10 digits fit.
    let _ = writeln!(
        line,
        "self-test instructions={CALIBRATION_INSTRUCTIONS} counter={counter} timer={timer}\0"
    );
    // SAFETY: a string with a terminating 0; then the emulation ends.
    unsafe {
        call(SYS_WRITE0, line.as_ptr() as usize);
        call(SYS_EXIT, EXIT_SUCCESS as usize);
    }
    loop {
        cortex_m::asm::wfi();
    }
}
