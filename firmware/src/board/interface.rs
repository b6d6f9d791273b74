//! What the firmware needs of a board.

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
