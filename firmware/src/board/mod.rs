//! The board that this firmware is built for, behind the interface that every board has.
//!
//! A board knows nothing of the device or the bus: `main` hands its tick handler to [`start`].

mod interface;
mod mps2_an500;

pub use interface::{Board, BootOptions};
pub use mps2_an500::{
    BusIn, BusOut, LogOut, Mps2An500 as This, PATIENT_IRQ, PATIENT_TASKS, RELAXED_IRQ,
    RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS, emergency_log, feed_watchdog, outputs_off, start,
    time_us,
};
