//! `cathforce flash`: loads a firmware into a board, by the program for it that is installed.
//!
//! Everything that can be known before is checked before: for which board the file is, whether its code
//! is as it was built, and whether this program speaks its messages.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cathforce_bus::service::PROTOCOL_HASH;
use cathforce_config::image::schema_hash;
use cathforce_link::{Board, Client, ClientError, Flash, Identity, firmware_of, update};
use clap::ValueEnum as _;
use serde_json::json;

use crate::args::{FlashArguments, Programmer};
use crate::failure::{Code, Failure};
use crate::output::shown;
use crate::session::{output_is_on, still_on};
use crate::ui::Ui;

const VERSION: &str = env!("CARGO_PKG_VERSION");

pub fn run(ui: &Ui, arguments: &FlashArguments) -> Result<(), Failure> {
    let board = arguments.board;
    let Some(flash) = &board.flash else {
        let message = format!(
            "{} is an emulated board, which has no flash to write\n  fix: {}",
            board.name,
            update(board.name)
        );
        return Err(Failure::new(Code::Usage, message));
    };
    let firmware = match &arguments.firmware {
        Some(file) => file.clone(),
        None => firmware_of(board.name)?,
    };
    let identity = identity(&firmware)?;
    check(&identity, &firmware, board)?;
    if let Some(link) = &arguments.link {
        check_device(link, board)?;
    }
    let programmer = programmer(arguments.programmer, flash, arguments.dry_run)?;
    let commands = commands(programmer, flash, &firmware)?;
    let lines: Vec<_> = commands.iter().map(|words| line(words)).collect();
    if !arguments.dry_run {
        for (words, line) in commands.iter().zip(&lines) {
            ui.say(format_args!("▶ {line}"));
            execute(words, line)?;
        }
    }
    let Identity { version, build, .. } = &identity;
    let done = if arguments.dry_run { "would be loaded" } else { "loaded" };
    let name = board.name;
    ui.data(
        &json!({
            "board": name,
            "firmware": shown(&firmware),
            "version": version,
            "build": build,
            "commands": lines,
            "loaded": !arguments.dry_run,
        }),
        format_args!("firmware {version}+{build} {done} into {name}:\n  {}\n", lines.join("\n  ")),
    )
}

fn identity(firmware: &Path) -> Result<Identity, Failure> {
    Identity::of_elf(firmware).map_err(|error| {
        Failure::input(format!(
            "{}: {error}\n  fix: name a file that `cargo xtask dist` made, \
             lib/cathforce/cathforce-firmware-BOARD.elf, or install the program again",
            firmware.display()
        ))
    })
}

/// Is it for this board, and does this program speak its language?
fn check(identity: &Identity, firmware: &Path, board: &Board) -> Result<(), Failure> {
    let file = firmware.display();
    if identity.board != board.name {
        return Err(Failure::input(format!(
            "{file} is firmware of the board {}, and --board names {}: nothing was loaded\n  fix: omit \
             --firmware, and the firmware of {} that was installed with this program is taken",
            identity.board, board.name, board.name
        )));
    }
    let differ = [
        ("protocol", identity.protocol_hash, PROTOCOL_HASH, 16),
        ("image schema", identity.image_schema_hash.into(), schema_hash().into(), 8),
    ];
    for (what, theirs, ours, digits) in differ {
        if theirs != ours {
            return Err(Failure::input(format!(
                "{file} is firmware {} of {what} {theirs:0digits$x}, and this program, version {VERSION}, \
                 is of {what} {ours:0digits$x}: it could not configure the board, so nothing was \
                 loaded\n  fix: `cathforce flash --board {}` without --firmware loads the one that was \
                 installed with this program; the other one is loaded by the program of its version",
                identity.version, board.name
            )));
        }
    }
    Ok(())
}

/// Asks the device for its board. One of another protocol still says which board it is.
fn check_device(link: &str, board: &Board) -> Result<(), Failure> {
    let found = match Client::connect(cathforce_link::open(link)?) {
        Ok(client) => {
            if let Some(mode) = output_is_on(&client) {
                return Err(Failure::new(Code::Device, still_on(mode, link)));
            }
            client.device().board.clone()
        }
        Err(ClientError::Protocol { device, .. }) => device.board,
        Err(error) => return Err(error.into()),
    };
    match found == board.name {
        true => Ok(()),
        false => Err(Failure::new(
            Code::Device,
            format!(
                "the device on {link} is the board {found}, and --board names {}: nothing was \
                 loaded\n  fix: connect the other board, or give --board {found}",
                board.name
            ),
        )),
    }
}

/// The program that is asked for, or the first that is installed and fits the board's probe.
fn programmer(
    asked: Option<Programmer>,
    flash: &Flash,
    is_dry: bool,
) -> Result<Programmer, Failure> {
    let all = Programmer::value_variants();
    let fits = |programmer: &Programmer| *programmer != Programmer::StFlash || flash.has_st_link;
    let candidates: Vec<_> =
        asked.map_or(all.to_vec(), |one| vec![one]).into_iter().filter(fits).collect();
    if let Some(found) = candidates.iter().find(|candidate| is_installed(name(**candidate))) {
        return Ok(*found);
    }
    // What would be run can be said without it.
    if let Some(first) = candidates.first().filter(|_| is_dry) {
        return Ok(*first);
    }
    let names: Vec<_> = candidates.iter().map(|candidate| name(*candidate)).collect();
    Err(Failure::new(
        Code::Failed,
        format!(
            "none of these programs that write flash is installed: {}\n  fix: `cargo install \
             probe-rs-tools --locked`, or `apt-get install openocd`, or `apt-get install stlink-tools`; \
             --dry-run prints the command of each (--programmer)",
            names.join(", ")
        ),
    ))
}

fn name(programmer: Programmer) -> &'static str {
    match programmer {
        Programmer::ProbeRs => "probe-rs",
        Programmer::OpenOcd => "openocd",
        Programmer::StFlash => "st-flash",
    }
}

fn is_installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// What is run, one after the other.
fn commands(
    programmer: Programmer,
    flash: &Flash,
    firmware: &Path,
) -> Result<Vec<Vec<OsString>>, Failure> {
    let words = |words: &[&str], file: Option<&Path>| {
        let mut all: Vec<OsString> = words.iter().map(OsString::from).collect();
        all.extend(file.map(|file| file.as_os_str().to_owned()));
        all
    };
    Ok(match programmer {
        Programmer::ProbeRs => vec![
            words(&["probe-rs", "download", "--verify", "--chip", flash.chip], Some(firmware)),
            words(&["probe-rs", "reset", "--chip", flash.chip], None),
        ],
        Programmer::OpenOcd => {
            let mut script = OsString::from("program {");
            script.push(firmware);
            script.push("} verify reset exit");
            let mut all = words(&["openocd", "-f", flash.openocd, "-c"], None);
            all.push(script);
            vec![all]
        }
        Programmer::StFlash => {
            let write = ["st-flash", "--reset", "--format", "ihex", "write"];
            vec![words(&write, Some(&hex_of(firmware)?))]
        }
    })
}

/// `st-flash` reads no ELF. The Intel hex of the same build lies beside it.
fn hex_of(firmware: &Path) -> Result<PathBuf, Failure> {
    let hex = firmware.with_extension("hex");
    match hex.is_file() {
        true => Ok(hex),
        false => Err(Failure::input(format!(
            "{}: no such file, and st-flash reads no ELF\n  fix: put the Intel hex file of the same build \
             there, or give --programmer probe-rs or openocd",
            hex.display()
        ))),
    }
}

fn line(words: &[OsString]) -> String {
    let words: Vec<_> = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let quoted = shlex::try_join(words.iter().map(String::as_str));
    quoted.unwrap_or_else(|_| words.join(" "))
}

fn execute(words: &[OsString], line: &str) -> Result<(), Failure> {
    let Some((program, arguments)) = words.split_first() else { return Ok(()) };
    // Its own output is progress; stdout stays for the result.
    let mut command = Command::new(program);
    let command = command.args(arguments).stdin(Stdio::null()).stdout(std::io::stderr());
    let failed = |why: String| {
        Failure::new(
            Code::Failed,
            format!(
                "`{line}` {why}\n  fix: check the cable of the debug probe and that no other program \
                 uses it; the board may hold half a firmware, so load it again before it is used"
            ),
        )
    };
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(failed(format!("failed ({status})"))),
        Err(error) => Err(failed(format!("cannot be started: {error}"))),
    }
}
