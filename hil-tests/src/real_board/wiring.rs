//! How a real board is reached: environment variables, and what is wrong with them.

use std::ffi::OsString;
use std::path::PathBuf;

use cathforce_link::{BOARDS, board};

/// Chooses the device that the tests run on: `qemu` (or unset), or `bench`.
pub const RIG: &str = "CATHFORCE_RIG";
/// The link to the board, such as `socketcan:can0`.
pub const LINK: &str = "CATHFORCE_BENCH_LINK";
/// The board's name; `nucleo-h743zi2` unless it is set.
pub const BOARD: &str = "CATHFORCE_BENCH_BOARD";
/// The debug probe, as `probe-rs list` names it: VID:PID or VID:PID:SERIAL. Needed only if there are several.
pub const PROBE: &str = "CATHFORCE_BENCH_PROBE";
/// The program `probe-rs`, if it is not on the `PATH`.
pub const PROBE_RS: &str = "CATHFORCE_BENCH_PROBE_RS";

const USUAL_BOARD: &str = "nucleo-h743zi2";

/// A board on a bench, and how to reach it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Address of the CAN link.
    pub link: String,
    /// Name that the board has to report.
    pub board: String,
    /// Chip, as `probe-rs chip list` names it.
    pub chip: String,
    /// Debug probe, if there are several.
    pub probe: Option<String>,
    /// The program `probe-rs`.
    pub probe_rs: PathBuf,
}

impl Wiring {
    /// What the environment asks for; `None` for the emulated board.
    ///
    /// Errors: a sentence that says which variable is wrong, and what to set.
    pub fn from_environment() -> Result<Option<Self>, String> {
        Self::from_variables(|name| std::env::var_os(name))
    }

    /// The same from any source of variables.
    pub fn from_variables(of: impl Fn(&str) -> Option<OsString>) -> Result<Option<Self>, String> {
        let text = |name: &str| match of(name).map(OsString::into_string) {
            None => Ok(None),
            Some(Ok(text)) => Ok(Some(text).filter(|text| !text.is_empty())),
            Some(Err(_)) => Err(format!("{name} is not UTF-8\n  fix: write it again")),
        };
        match text(RIG)?.as_deref() {
            None | Some("qemu") => return Ok(None),
            Some("bench") => {}
            Some(other) => {
                return Err(format!(
                    "{RIG}={other} is no rig\n  fix: `{RIG}=bench` is a real board, `{RIG}=qemu` or none the \
                     emulated one"
                ));
            }
        }
        let link = text(LINK)?.ok_or_else(|| {
            format!(
                "{RIG}=bench, but {LINK} does not say how to reach the board\n  fix: {LINK}=socketcan:can0, or \
                 slcan:/dev/ttyACM0; `cathforce doctor` lists the adapters of this computer"
            )
        })?;
        if link == "sim" || link == "qemu" || link.starts_with("qemu:") {
            return Err(format!(
                "{LINK}={link} is no real board\n  fix: unset {RIG} to test the emulated board"
            ));
        }
        let name = text(BOARD)?.unwrap_or_else(|| USUAL_BOARD.into());
        let Some(flash) = board(&name).and_then(|board| board.flash.as_ref()) else {
            let real = BOARDS.iter().filter(|board| board.flash.is_some());
            let names: Vec<_> = real.map(|board| board.name).collect();
            return Err(format!(
                "{BOARD}={name} is no real board that this version knows\n  fix: one of {}",
                names.join(", ")
            ));
        };
        Ok(Some(Self {
            link,
            board: name,
            chip: flash.chip.into(),
            probe: text(PROBE)?,
            probe_rs: of(PROBE_RS).map_or_else(|| "probe-rs".into(), PathBuf::from),
        }))
    }
}

/// Fails a test that needs the emulator, or the device's code in this process, when a real board was asked
/// for: what did not run on the board must not count as passed there.
#[track_caller]
pub fn refuse_on_a_bench(needs: &str) {
    let asked = Wiring::from_environment().unwrap_or_else(|why| panic!("{why}"));
    if asked.is_some() {
        let thread = std::thread::current();
        let test = thread.name().unwrap_or("this test");
        panic!(
            "NOT RUN on the bench: {test} needs {needs}\n  fix: `cargo test -p cathforce-hil-tests --test \
             on_a_bench` has the tests for a real board; unset {RIG} for the others"
        );
    }
}
