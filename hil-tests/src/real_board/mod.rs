//! A real board on a bench: a CAN adapter to talk to it, and `probe-rs` to reset it.
//!
//! The program `probe-rs` is called, as `cathforce flash` does: a bench has it already. The library of the same
//! name would be built with every test, with its own USB drivers, to press one button.

mod virtual_board;
mod wiring;

use std::fs::File;
use std::io::ErrorKind;
use std::process::Command;
use std::time::{Duration, Instant};

use cathforce_bus::{Frame, Id};
use cathforce_link::{Client, Link, LinkError};

pub use virtual_board::VirtualBoard;
pub use wiring::{BOARD, LINK, PROBE, PROBE_RS, RIG, Wiring, refuse_on_a_bench};

use crate::Rig;

/// Longest time in which a board that was reset has to answer.
const BOOT: Duration = Duration::from_secs(10);
/// Longest wait for a tick of a board that runs free.
const TICK: Duration = Duration::from_secs(5);

/// A real board that runs free.
pub struct RealBoard {
    link: Box<dyn Link>,
    wiring: Wiring,
    /// Held while the board is in use: tests run side by side, and there is one board.
    _turn: Option<File>,
}

impl RealBoard {
    /// The board that the environment names, after a reset; waits until no other test uses it.
    ///
    /// Errors: a sentence that says what is missing and what to do.
    pub fn from_environment() -> Result<Self, String> {
        let Some(wiring) = Wiring::from_environment()? else {
            return Err(format!("no real board was asked for\n  fix: {RIG}=bench"));
        };
        let path = std::env::temp_dir().join("cathforce-bench.lock");
        let turn = File::create(&path).and_then(|file| file.lock().map(|()| file));
        let turn = turn.map_err(|why| format!("{}: {why}", path.display()))?;
        let board = Self::start(wiring)?;
        Ok(Self { _turn: Some(turn), ..board })
    }

    /// This board after a reset, found to be the right one and to run by its own clock.
    ///
    /// Errors: a sentence that says what is missing and what to do.
    pub fn start(wiring: Wiring) -> Result<Self, String> {
        // The link first: a wrong name of an interface is told before anything is touched.
        let link = cathforce_link::open(&wiring.link).map_err(|why| why.to_string())?;
        let board = Self { link, wiring, _turn: None };
        board.press_reset()?;
        board.wait_for_it()
    }

    /// Resets the processor.
    fn press_reset(&self) -> Result<(), String> {
        let Wiring { chip, probe, probe_rs, .. } = &self.wiring;
        let mut command = Command::new(probe_rs);
        command.args(["reset", "--chip", chip]);
        if let Some(probe) = probe {
            command.args(["--probe", probe]);
        }
        let output = command.output().map_err(|why| match why.kind() {
            ErrorKind::NotFound => format!(
                "the board cannot be reset: there is no program `{}`\n  fix: `cargo install probe-rs-tools`, or \
                 {PROBE_RS}=PATH",
                probe_rs.display()
            ),
            _ => format!("`{}` does not start: {why}", probe_rs.display()),
        })?;
        if output.status.success() {
            return Ok(());
        }
        Err(format!(
            "the board was not reset: `{} reset --chip {chip}` says\n{}\n  fix: plug in its debug probe; \
             `probe-rs list` shows which there are, and {PROBE} chooses one",
            probe_rs.display(),
            String::from_utf8_lossy(&output.stderr).trim()
        ))
    }

    /// Waits until the board answers, and checks what it says.
    fn wait_for_it(self) -> Result<Self, String> {
        let Self { mut link, wiring, _turn } = self;
        // What it sent before the reset.
        while link.receive(Duration::ZERO).map_err(|why| why.to_string())?.is_some() {}
        let until = Instant::now() + BOOT;
        let client = loop {
            match Client::connect(link) {
                Ok(client) => break client,
                Err(why) if Instant::now() >= until => {
                    return Err(format!(
                        "no board answers on {} after its reset: {why}\n  fix: load its firmware with `cathforce \
                         flash --board {}`; check wires, terminators and the bit rate (`cathforce doctor`)",
                        wiring.link, wiring.board
                    ));
                }
                // The client has ended its link.
                Err(_) => {
                    link = cathforce_link::open(&wiring.link).map_err(|why| why.to_string())?
                }
            }
        };
        let device = client.device().clone();
        if device.board != wiring.board {
            return Err(format!(
                "{} answers on {}, and {} was asked for\n  fix: {BOARD}={}, or another {LINK}",
                device, wiring.link, wiring.board, device.board
            ));
        }
        let mut link = client.into_link();
        let until = Instant::now() + TICK;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let frame = link.receive(left).map_err(|why| why.to_string())?;
            match frame {
                Some(frame) if Id::from_raw(frame.id()) == Some(Id::Haptic) => {
                    return Ok(Self { link, wiring, _turn });
                }
                _ if left.is_zero() => {
                    return Err(format!(
                        "{device} answers on {} and sends no tick by its own clock\n  fix: a board on a bench runs \
                         free; load the firmware that is made for it",
                        wiring.link
                    ));
                }
                _ => {}
            }
        }
    }
}

impl Rig for RealBoard {
    fn boot() -> Self {
        Self::from_environment().unwrap_or_else(|why| panic!("{why}"))
    }

    fn again(self) -> Self {
        let reset = self.press_reset().and_then(|()| self.wait_for_it());
        reset.unwrap_or_else(|why| panic!("{why}"))
    }
}

impl Link for RealBoard {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.link.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.link.receive(timeout)
    }

    fn name(&self) -> &str {
        self.link.name()
    }
}
