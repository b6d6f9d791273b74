//! `docs/cathforce.dbc` read by cantools, which is independent of this project. It decodes our frames to the
//! intended values, and encodes these values to the same bytes.

mod support;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cathforce_bus::{Frame, Id, Process, Sealer, Status, crc8};
use support::{meant, process_ids};

const HERE: &str = env!("CARGO_MANIFEST_DIR");
/// Payloads of every frame; those of a command have to be one.
const PAYLOADS: [[u8; 6]; 4] = [
    [0; 6],
    [1, 0, 0, 0, 1, 1],
    [0xFF, 0xFF, 0xFF, 0x7F, 0x80, 1],
    [0x12, 0x34, 0x56, 0x78, 0x9A, 0],
];

#[test]
fn cantools_reads_and_writes_every_frame_as_we_do() {
    let Some(python) = python() else {
        // Past the test runner, which shows what a test prints only when it fails.
        let why = b"\nNOT RUN: cantools: no Python with venv here, or pip reaches no packages\n";
        return std::io::stderr().write_all(why).unwrap();
    };
    let mut sealer = Sealer::default();
    let mut lines = String::new();
    for id in process_ids() {
        for payload in PAYLOADS {
            let payload = if id == Id::Command { [4, 0, payload[2], 3, 4, 5] } else { payload };
            let Some(process) = Process::decode(id, payload) else { continue };
            lines += &line(process, &mut sealer);
        }
    }
    let script = Path::new(HERE).join("tests/cantools/check.py");
    let dbc = Path::new(HERE).join("../../docs/cathforce.dbc");
    let mut child = Command::new(python)
        .arg(script)
        .arg(dbc)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A script that ended early says why on stderr.
    let _ = child.stdin.take().unwrap().write_all(lines.as_bytes());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(said.trim(), format!("{} frames", lines.lines().count()));
}

/// A sealed frame and its intended values, as JSON.
fn line(process: Process, sealer: &mut Sealer) -> String {
    let id = process.id();
    let status = match id.is_from_host() {
        false => Status { unresolved: true, last: true, ..Status::default() },
        true => Status { hand: matches!(id, Id::Encoder | Id::Guidewire), ..Status::default() },
    };
    let frame: Frame = sealer.seal(process, status);
    let [.., tail, crc] = *frame.data() else { panic!("{frame} is short") };
    assert_eq!(crc, crc8(id.raw(), frame.data()[..7].try_into().unwrap()));
    let mut signals = meant(&process);
    if !id.is_from_host() {
        signals.extend([("Unresolved", 1.0), ("Limited", 0.0), ("Last", 1.0)]);
    } else if id == Id::Guidewire {
        signals.push(("Held", 1.0));
    } else if id == Id::Encoder {
        signals.push(("Released", 1.0));
    }
    signals.extend([("Counter", f64::from(tail & 0xF)), ("Crc", f64::from(crc))]);
    let signals = signals.iter().map(|(name, value)| format!("\"{name}\":{value}"));
    let signals = signals.collect::<Vec<_>>().join(",");
    let data = frame.data().iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    format!("{{\"id\":{},\"data\":\"{data}\",\"signals\":{{{signals}}}}}\n", id.raw())
}

/// Python with the packages of the requirements, installed once under `target`; `None` if it cannot be
/// installed.
fn python() -> Option<PathBuf> {
    let requirements = Path::new(HERE).join("tests/cantools/requirements.txt");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cantools");
    let python = folder.join("bin/python");
    let wanted = std::fs::read_to_string(&requirements).unwrap();
    // Written last: an installation that broke off is begun anew.
    let installed = folder.join("installed.txt");
    if std::fs::read_to_string(&installed).is_ok_and(|text| text == wanted) {
        return Some(python);
    }
    let run = |command: &mut Command| {
        let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success()).then_some(())
    };
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
        .args(["--timeout", "5", "--retries", "1", "-r"])
        .arg(&requirements))?;
    std::fs::write(installed, wanted).unwrap();
    Some(python)
}
