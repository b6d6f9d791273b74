//! What the firmware needs of a board.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

/// How whoever started the board wants it to run.
#[derive(Clone, Copy, Default)]
pub struct BootOptions {
    /// The tick timer is held until ticks are granted.
    pub lock_step: bool,
}

/// What the tick and the tasks need of a board. Every method may be called from any interrupt.
pub trait Board: Copy {
    /// Time counts in a second, of [`Board::time`] and [`Board::lateness`].
    const COUNTS_A_SECOND: u32;

    /// Size of an image buffer \[bytes\].
    const IMAGE_BUFFER_LEN: usize;

    /// The two places for saved images in the flash.
    const SAVED_IMAGES: [Range<u32>; 2];

    /// Memory that keeps saved images while the board has no power.
    type Flash: NorFlash;

    /// The flash, for the task that saves images. Nothing of it delays an interrupt. It calls `working` at
    /// least every few milliseconds of a long operation, so that a watchdog sees it advance.
    fn flash(self, working: fn()) -> Self::Flash;

    /// Name of the board, as the host sees it.
    fn name(self) -> &'static str;

    /// The tick timer can be held, so ticks can be granted.
    fn can_lock_step(self) -> bool;

    /// Count of a free-running counter, wrapping.
    fn time(self) -> u32;

    /// Counts since the tick was due. Called first in the tick.
    fn lateness(self) -> u32;

    /// The next tick is already due.
    fn tick_pending(self) -> bool;

    /// Instructions in `counts` of [`Board::time`]; 0 where instructions cannot be counted.
    fn instructions(self, counts: u32) -> u32;

    /// Count of the processor's cycles, wrapping; 0 where they cannot be counted.
    fn cycles(self) -> u32 {
        0
    }

    /// Shows the force on the operator's linear axis \[N\] by a voltage, where there is a converter.
    fn show_force(self, _force_n: f32) {}

    /// Starts the tick timer. The next tick is due after a whole period, or after the rest of it.
    fn start_ticks(self);

    /// Holds the tick timer at the beginning of a period.
    fn hold_ticks(self);

    /// Feeds the watchdog. Without it the outputs go off within 10 ms, and the device is reset.
    fn alive(self);

    /// The bus may give as many bytes again as a full bus has in a tick. Called by every tick that runs
    /// free, so that no flood takes the time of the tasks.
    fn renew_input(self);

    /// Enables the motor drives, or removes their power.
    fn enable_outputs(self, on: bool);

    /// Options with which the board was started.
    fn boot_options(self) -> BootOptions;

    /// Ends the boot: starts the tick timer, or holds it if the options say so.
    fn run(self, options: BootOptions);

    /// Sleeps until an interrupt has been handled.
    fn idle(self);
}
