//! ST's Nucleo-H743ZI2: an STM32H743 (Cortex-M7, 400 MHz) with a CAN controller.
//!
//! FDCAN1 is the bus, USART3 the log, which the board's ST-LINK passes on by USB. TIM2 is the tick timer, TIM5 the
//! free-running counter, TIM6 the first stage of the watchdog, and the independent watchdog the second.
//!
//! It has not run on hardware yet (`docs/how-to/bring-up-a-board.md`).

mod can;
mod flash;
mod interrupts;
mod log;
mod machine;

pub use can::{BusIn, BusOut};
pub use interrupts::{
    PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ, RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS,
};
pub use log::{LogOut, emergency_log};
pub use machine::{NucleoH743, feed_watchdog, outputs_off, start, time_us};
