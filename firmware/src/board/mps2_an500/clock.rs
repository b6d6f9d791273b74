//! The clock of timers and counters.

/// Counts in a second of TIMER 0, the watchdog and the FPGA counter.
pub const CLOCK_HZ: u32 = 25_000_000;
/// Reload value of TIMER 0 for 1 ms: the reload itself takes one count.
pub const TICK_RELOAD: u32 = CLOCK_HZ / 1000 - 1;
