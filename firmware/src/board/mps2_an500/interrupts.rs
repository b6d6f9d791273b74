//! The interrupt lines in use, and the executors that run in two of them.

use cortex_m::interrupt::InterruptNumber;
use embassy_executor::InterruptExecutor;

/// The interrupts in use.
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Irq {
    Uart0Receive = 0,
    Uart0Transmit = 1,
    Timer0 = 8,
    /// Lines that the hardware does not use, for the executors.
    Software29 = 29,
    Software30 = 30,
    Software31 = 31,
}

// SAFETY: the numbers are those of the board's interrupt lines, all below 32.
unsafe impl InterruptNumber for Irq {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Tasks of the bus.
pub static URGENT_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const URGENT_IRQ: Irq = Irq::Software30;
/// Tasks that can wait.
pub static RELAXED_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const RELAXED_IRQ: Irq = Irq::Software31;
/// Tasks that may take long.
pub static PATIENT_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const PATIENT_IRQ: Irq = Irq::Software29;
