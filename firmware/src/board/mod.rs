//! The board that this firmware is built for, behind the interface that every board has: the emulated one, or
//! with the feature `board-nucleo-h743` ST's Nucleo-H743ZI2.
//!
//! A board knows nothing of the device or the bus: `main` hands its tick handler to [`start`].

mod interface;
#[cfg(not(feature = "board-nucleo-h743"))]
mod mps2_an500;
#[cfg(feature = "board-nucleo-h743")]
mod nucleo_h743;

pub use interface::{Board, BootOptions};
#[cfg(not(feature = "board-nucleo-h743"))]
pub use mps2_an500::{
    BusIn, BusOut, LogOut, Mps2An500 as This, PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ,
    RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS, emergency_log, feed_watchdog, outputs_off, start,
    time_us,
};
#[cfg(feature = "board-nucleo-h743")]
pub use nucleo_h743::{
    BusIn, BusOut, LogOut, NucleoH743 as This, PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ,
    RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS, emergency_log, feed_watchdog, outputs_off, start,
    time_us,
};
