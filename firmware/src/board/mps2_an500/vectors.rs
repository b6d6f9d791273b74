//! The interrupts: who handles them, and who may interrupt whom.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use embassy_executor::InterruptExecutor;

use super::serial;
use crate::device;

/// The interrupts in use.
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Irq {
    Uart0Receive = 0,
    Timer0 = 8,
    /// Unused by the hardware; the executors' own.
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
/// Everything that can wait.
pub static RELAXED_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const RELAXED_IRQ: Irq = Irq::Software31;

/// Lower numbers interrupt higher ones. `log` masks everything but the tick.
const PRIORITIES: [(Irq, u8); 4] =
    [(Irq::Timer0, 0x00), (Irq::Uart0Receive, 0x40), (URGENT_IRQ, 0x80), (RELAXED_IRQ, 0xC0)];

/// Sets the priorities and lets in what `main` does not start itself.
pub fn enable() {
    // SAFETY: called once, before any of the interrupts can come; a priority is one byte.
    unsafe {
        let nvic = &*NVIC::PTR;
        for (irq, priority) in PRIORITIES {
            nvic.ipr[usize::from(irq.number())].write(priority);
        }
        NVIC::unmask(Irq::Uart0Receive);
        NVIC::unmask(Irq::Timer0);
    }
}

type Handler = unsafe extern "C" fn();

#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [Handler; 32] = {
    let mut handlers: [Handler; 32] = [unexpected; 32];
    handlers[Irq::Uart0Receive as usize] = uart0_receive;
    handlers[Irq::Timer0 as usize] = timer0;
    handlers[URGENT_IRQ as usize] = urgent;
    handlers[RELAXED_IRQ as usize] = relaxed;
    handlers
};

unsafe extern "C" fn uart0_receive() {
    // SAFETY: this is the receive interrupt.
    unsafe { serial::on_receive() }
}

unsafe extern "C" fn timer0() {
    device::tick();
}

unsafe extern "C" fn urgent() {
    // SAFETY: this is the executor's interrupt, enabled by starting it.
    unsafe { URGENT_TASKS.on_interrupt() }
}

unsafe extern "C" fn relaxed() {
    // SAFETY: as above.
    unsafe { RELAXED_TASKS.on_interrupt() }
}

unsafe extern "C" fn unexpected() {
    panic!("an interrupt that nobody asked for");
}
