//! The interrupts in use, which may interrupt which, and the executors that run in three of them.

use core::cell::UnsafeCell;

use cortex_m::peripheral::{NVIC, SCB};
use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt::{Interrupt, InterruptExt as _, Priority};
use embassy_stm32::pac;

/// Tasks of the bus.
pub static URGENT_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const URGENT_IRQ: Interrupt = Interrupt::UART7;
/// Tasks that can wait.
pub static RELAXED_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const RELAXED_IRQ: Interrupt = Interrupt::UART8;
/// Tasks that may take long.
pub static PATIENT_TASKS: InterruptExecutor = InterruptExecutor::new();
pub const PATIENT_IRQ: Interrupt = Interrupt::UART5;

/// Lower numbers interrupt higher ones, as on the emulated board. The UARTs are not in use; their interrupts
/// run the executors.
const PRIORITIES: [(Interrupt, Priority); 7] = [
    (Interrupt::TIM2, Priority::P0),
    (Interrupt::TIM6_DAC, Priority::P0),
    (Interrupt::FDCAN1_IT0, Priority::P4),
    (Interrupt::FDCAN1_IT1, Priority::P4),
    (URGENT_IRQ, Priority::P8),
    (RELAXED_IRQ, Priority::P12),
    (PATIENT_IRQ, Priority::P14),
];

/// What the tick timer's interrupt calls.
struct TickHandler(UnsafeCell<fn()>);
// SAFETY: written once before the interrupt is enabled, then read by its handler only.
unsafe impl Sync for TickHandler {}
static TICK: TickHandler = TickHandler(UnsafeCell::new(|| ()));

/// Sets the priorities and enables the timers' interrupts. The executors' are enabled by `main`, and those of
/// the CAN controller by its driver.
///
/// `tick`: called by TIM2's interrupt.
pub fn enable(tick: fn()) {
    for (irq, priority) in PRIORITIES {
        irq.set_priority(priority);
    }
    // SAFETY: called once, before any of the interrupts can come.
    unsafe {
        *TICK.0.get() = tick;
        NVIC::unmask(Interrupt::TIM2);
        NVIC::unmask(Interrupt::TIM6_DAC);
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn TIM2() {
    // SAFETY: written before this interrupt was enabled.
    unsafe { (*TICK.0.get())() }
}

/// The watchdog's first stage: its handler is that of the non-maskable interrupt, which every board has.
#[unsafe(no_mangle)]
unsafe extern "C" fn TIM6_DAC() {
    const NMIPENDSET: u32 = 1 << 31;
    pac::TIM6.sr().modify(|w| w.set_uif(false));
    // SAFETY: the handler never returns.
    unsafe { (*SCB::PTR).icsr.write(NMIPENDSET) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn UART7() {
    // SAFETY: this is the executor's interrupt, enabled by starting it.
    unsafe { URGENT_TASKS.on_interrupt() }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn UART8() {
    // SAFETY: as above.
    unsafe { RELAXED_TASKS.on_interrupt() }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn UART5() {
    // SAFETY: as above.
    unsafe { PATIENT_TASKS.on_interrupt() }
}
