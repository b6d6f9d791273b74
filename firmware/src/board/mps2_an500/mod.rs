//! QEMU's `mps2-an500`: a Cortex-M7 without a CAN controller.
//!
//! UART 0 carries CAN as SLCAN text, UART 1 the log. TIMER 0 is the tick timer. Under
//! `-icount shift=N` every instruction takes 2^N ns of virtual time, and the FPGA counter, at
//! 40 ns a count, counts instructions.

mod clock;
mod flash;
mod interrupts;
mod machine;
mod registers;
mod semihosting;
mod serial;
mod vectors;

pub use interrupts::{
    PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ, RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS,
};
pub use machine::{Mps2An500, feed_watchdog, outputs_off, start, time_us};
pub use serial::{BusIn, BusOut, LogOut, emergency_log};
