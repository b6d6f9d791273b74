//! The vector table: which function handles which interrupt, and which may interrupt which.

use core::cell::UnsafeCell;

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

use super::interrupts::{
    Irq, PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ, RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS,
};
use super::serial;

/// Priorities; lower numbers interrupt higher ones. `log` masks everything except the tick.
const PRIORITIES: [(Irq, u8); 6] = [
    (Irq::Timer0, 0x00),
    (Irq::Uart0Receive, 0x40),
    (Irq::Uart0Transmit, 0x40),
    (URGENT_IRQ, 0x80),
    (RELAXED_IRQ, 0xC0),
    (PATIENT_IRQ, 0xE0),
];

/// What the tick timer's interrupt calls.
struct TickHandler(UnsafeCell<fn()>);
// SAFETY: written once before the interrupt is enabled, then read by its handler only.
unsafe impl Sync for TickHandler {}
static TICK: TickHandler = TickHandler(UnsafeCell::new(|| ()));

/// Sets the priorities and enables the interrupts, apart from the executors', which `main` starts.
///
/// `tick`: called by TIMER 0's interrupt.
pub fn enable(tick: fn()) {
    // SAFETY: called once, before any of the interrupts can come; a priority is one byte.
    unsafe {
        *TICK.0.get() = tick;
        let nvic = &*NVIC::PTR;
        for (irq, priority) in PRIORITIES {
            nvic.ipr[usize::from(irq.number())].write(priority);
        }
        NVIC::unmask(Irq::Uart0Receive);
        NVIC::unmask(Irq::Uart0Transmit);
        NVIC::unmask(Irq::Timer0);
    }
}

type Handler = unsafe extern "C" fn();

#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [Handler; 32] = {
    let mut handlers: [Handler; 32] = [unexpected; 32];
    handlers[Irq::Uart0Receive as usize] = uart0_receive;
    handlers[Irq::Uart0Transmit as usize] = uart0_transmit;
    handlers[Irq::Timer0 as usize] = timer0;
    handlers[URGENT_IRQ as usize] = urgent;
    handlers[RELAXED_IRQ as usize] = relaxed;
    handlers[PATIENT_IRQ as usize] = patient;
    handlers
};

unsafe extern "C" fn uart0_receive() {
    // SAFETY: this is the receive interrupt.
    unsafe { serial::on_receive() }
}

unsafe extern "C" fn uart0_transmit() {
    serial::on_transmitted();
}

unsafe extern "C" fn timer0() {
    // SAFETY: written before this interrupt was enabled.
    unsafe { (*TICK.0.get())() }
}

unsafe extern "C" fn urgent() {
    // SAFETY: this is the executor's interrupt, enabled by starting it.
    unsafe { URGENT_TASKS.on_interrupt() }
}

unsafe extern "C" fn relaxed() {
    // SAFETY: as above.
    unsafe { RELAXED_TASKS.on_interrupt() }
}

unsafe extern "C" fn patient() {
    // SAFETY: as above.
    unsafe { PATIENT_TASKS.on_interrupt() }
}

unsafe extern "C" fn unexpected() {
    panic!("an interrupt that nobody asked for");
}
