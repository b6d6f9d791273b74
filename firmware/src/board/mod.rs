//! What the firmware needs of a board; the boards.

mod mps2_an500;

pub use mps2_an500::{
    BusIn, BusOut, LogOut, RELAXED_IRQ, RELAXED_TASKS, URGENT_IRQ, URGENT_TASKS, emergency_log,
    outputs_off, start, time_us,
};

use crate::device::BootOptions;

/// The board that this firmware is built for.
pub type This = mps2_an500::Mps2An500;

/// What the tick and the tasks need; everything may be called from any interrupt.
///
/// The board's timer interrupt calls [`crate::device::tick`].
pub trait Board: Copy {
    /// Time counts in a second, of [`Board::time`] and [`Board::lateness`].
    const COUNTS_A_SECOND: u32;

    /// Its name, as the host is told.
    fn name(self) -> &'static str;

    /// The tick timer can stand still: ticks can be granted.
    fn can_lock_step(self) -> bool;

    /// A free-running counter.
    fn time(self) -> u32;

    /// Counts since the tick was due; called first thing in the tick.
    fn lateness(self) -> u32;

    /// The next tick is already due.
    fn tick_pending(self) -> bool;

    /// Instructions in `counts` of [`Board::time`]; 0 where instructions cannot be counted.
    fn instructions(self, counts: u32) -> u32;

    /// Lets the tick timer run: the next tick is due after a whole period, or after what
    /// was left of it.
    fn start_ticks(self);

    /// Holds the tick timer, with a whole period to go.
    fn hold_ticks(self);

    /// The tick has run: the watchdog may wait for the next one.
    fn alive(self);

    /// Enables the motor drives, or takes their power away.
    fn enable_outputs(self, on: bool);

    /// What whoever started the board wants.
    fn boot_options(self) -> BootOptions;

    /// Starts ticking, as the options say.
    fn run(self, options: BootOptions);

    /// Sleeps until the next interrupt has been handled.
    fn idle(self);
}
