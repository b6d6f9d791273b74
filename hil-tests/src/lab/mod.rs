//! The emulated board on a bench: faults are put in from outside, through the debugger's port.
//!
//! No code for tests is compiled into the firmware. The lab stops the processor, overwrites instructions,
//! registers and memory, and lets it go on, as a probe would on a real board.

mod code;
mod debugger;
mod symbols;

use std::time::Duration;

use cathforce_bus::Frame;
use cathforce_link::qemu::{BoardOptions, Qemu, find_firmware};
use cathforce_link::{Link, LinkError};

pub use code::{Code, Function};
pub use debugger::Debugger;
pub use symbols::Symbols;

use crate::Rig;
use crate::real_board::refuse_on_a_bench;

/// `b .`: an instruction that branches to itself.
pub const HANG: u16 = 0xE7FE;
/// `udf #0`: an instruction that no processor has.
pub const UNDEFINED: u16 = 0xDE00;

/// `wfi`, by which the processor sleeps, and `nop`.
const SLEEP: u16 = 0xBF30;
const DO_NOTHING: u16 = 0xBF00;

/// Counter of the board at 25 MHz, from the boot on.
const COUNTER: u32 = 0x4002_8018;
const COUNTS_A_MS: f64 = 25_000.0;
/// LEDs of the board; the first one is the enable line of the motor drives.
const LEDS: u32 = 0x4002_8000;

/// Where the executor's header of a task keeps the function that polls it \[bytes\].
const POLL_OFFSET: u32 = 0xC;

/// The emulated board with its debugger's port.
pub struct Lab {
    board: Qemu,
    pub debugger: Debugger,
    pub symbols: Symbols,
}

impl Lab {
    /// A board that starts again when it resets itself.
    pub fn start(runs_free: bool) -> Self {
        Self::start_with(BoardOptions { runs_free, reboots: true, ..BoardOptions::default() })
    }

    /// A board that is started otherwise.
    pub fn start_with(options: BoardOptions) -> Self {
        refuse_on_a_bench("the emulator's debugger, which puts faults in");
        let elf = find_firmware(None).unwrap_or_else(|error| panic!("{error}"));
        let symbols = Symbols::of(&elf);
        let waiting = Debugger::listen();
        let options = BoardOptions { debugger: Some(waiting.port()), ..options };
        let accepted = std::thread::spawn(move || waiting.accept());
        let board = Qemu::boot_with(Some(&elf), options).unwrap_or_else(|error| panic!("{error}"));
        let debugger = accepted.join().expect("the emulator connects");
        Self { board, debugger, symbols }
    }

    /// Resets the board as somebody does who presses its button: nothing is written down before. It runs again.
    pub fn reset(&mut self) {
        // A processor that sleeps goes on nowhere else: an empty line wakes it.
        let awake = self.symbols.address("vectors::uart0_receive");
        self.debugger.go_on_to(awake);
        self.send_bytes(b"\r");
        self.debugger.wait_until_at(awake);
        let reset = self.symbols.address("cathforce_reset");
        self.debugger.set_program_counter(reset);
        self.run_to(self.symbols.address("Reset"));
        self.debugger.go_on();
    }

    /// Where the function that polls a task begins; `task` is the path of its function.
    pub fn poll_of(&mut self, task: &str) -> u32 {
        let header = self.symbols.address(&format!("{task}::POOL"));
        self.debugger.word(header + POLL_OFFSET) & !1
    }

    /// Overwrites an instruction; gives what was there.
    pub fn patch(&mut self, at: u32, instruction: u16) -> Patch {
        let before = self.debugger.read(at, 2);
        self.debugger.write(at, &instruction.to_le_bytes());
        Patch { at, before }
    }

    /// Puts back what was there.
    pub fn mend(&mut self, patch: &Patch) {
        self.debugger.write(patch.at, &patch.before);
    }

    /// Keeps the processor from sleeping. The emulator skips the time for which a processor sleeps, in which
    /// a bus could bring frames; awake, a millisecond of the board takes a few of this computer's.
    pub fn keep_awake(&mut self) {
        let main = self.symbols.address("__cortex_m_rt_main");
        let len = self.symbols.after(main) - main;
        let code = self.debugger.read(main, len as usize);
        let halves = code.chunks_exact(2).map(|half| u16::from_le_bytes([half[0], half[1]]));
        let found: Vec<_> = halves.enumerate().filter(|(_, half)| *half == SLEEP).collect();
        let [(index, _)] = found[..] else { panic!("{} places to sleep in", found.len()) };
        self.patch(main + 2 * index as u32, DO_NOTHING);
    }

    /// Time since the boot \[ms\].
    pub fn time_ms(&mut self) -> f64 {
        f64::from(self.debugger.word(COUNTER)) / COUNTS_A_MS
    }

    /// The motor drives have power.
    pub fn outputs_are_on(&mut self) -> bool {
        self.debugger.word(LEDS) & 1 != 0
    }

    /// Sends any bytes to the board's UART.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.board.send_bytes(bytes);
        self.board.flush().unwrap_or_else(|error| panic!("{error}"));
    }

    /// How often the board has opened its channel.
    pub fn openings(&self) -> u32 {
        self.board.openings()
    }

    /// Lets the board run until it is about to execute `at`. The processor is stopped there.
    pub fn run_to(&mut self, at: u32) {
        self.debugger.run_to(at);
    }
}

/// An instruction that was overwritten.
#[derive(Clone, Debug)]
pub struct Patch {
    at: u32,
    before: Vec<u8>,
}

impl Rig for Lab {
    fn boot() -> Self {
        let mut lab = Self::start(false);
        lab.debugger.go_on();
        lab
    }

    fn again(mut self) -> Self {
        self.reset();
        self
    }
}

impl Link for Lab {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.board.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.board.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.board.receive(timeout)
    }

    fn name(&self) -> &str {
        self.board.name()
    }
}
