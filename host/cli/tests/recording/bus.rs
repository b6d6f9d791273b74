//! Several programs on one bus, on one computer without CAN hardware.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Stdio};

use cathforce_recording::Recording;

use crate::{assert_fails, cathforce, command, data, example, stderr, text};

/// A program that runs beside the test, and ends with it.
struct Running(Child, BufReader<ChildStderr>, BufReader<ChildStdout>);

impl Running {
    fn start(arguments: &[&str]) -> Self {
        let mut command = command();
        command.args(arguments).stdin(Stdio::null());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let said = BufReader::new(child.stderr.take().unwrap());
        let data = BufReader::new(child.stdout.take().unwrap());
        Self(child, said, data)
    }

    /// The next line that it says beside its data.
    fn line(&mut self) -> String {
        let mut line = String::new();
        self.1.read_line(&mut line).unwrap();
        assert!(!line.is_empty(), "it has ended");
        line
    }

    /// The next line of its data.
    fn data(&mut self) -> String {
        let mut line = String::new();
        self.2.read_line(&mut line).unwrap();
        line
    }

    /// Its exit code and data after an interrupt.
    fn interrupt(self) -> (Option<i32>, String) {
        let id = self.0.id().to_string();
        let sent = std::process::Command::new("kill").args(["-INT", &id]).status().unwrap();
        assert!(sent.success());
        self.end()
    }

    fn end(mut self) -> (Option<i32>, String) {
        let mut data = String::new();
        self.2.read_to_string(&mut data).unwrap();
        (self.0.wait().unwrap().code(), data)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It has ended already where the test went well.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A device that waits, and the address under which others reach it.
fn device() -> (Running, String) {
    let mut device = Running::start(&["link", "serve", "slcan:listen:0"]);
    let line = device.line();
    assert!(line.starts_with("waiting on 127.0.0.1:") && line.contains("Ctrl-C"), "{line}");
    let address = line.split('`').nth(1).unwrap().trim_start_matches("--link ");
    let address = address.to_owned();
    (device, address)
}

#[test]
fn a_device_a_run_and_a_monitor_meet_in_three_commands() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let (device, link) = device();
    let mut monitor = Running::start(&["monitor", "--link", &link]);
    let first: serde_json::Value = serde_json::from_str(&monitor.data()).unwrap();
    let (before, advice) = (first["ticks"].as_u64().unwrap(), first["advice"].as_str().unwrap());
    assert!(advice.contains(&format!("cathforce run --link {link} BUNDLE")), "{advice}");
    let example = example();
    let run = ["run", "--link", &link, text(&example), "--duration", "0.3", "--cell", "3"];
    let output = command().args(run).args(["--out", text(&file)]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    // In lock step, whoever listens: what was recorded replays.
    let check = data(["check", text(&file)]);
    assert_eq!(check["replays"], true, "{check}");

    // A second host comes after the first, and runs by the device's own clock.
    let free = folder.path().join("free.mcap");
    let output = command().args(run).args(["--free", "--out", text(&free)]).output().unwrap();
    // A busy computer may miss the 5 ms after which the device ramps down.
    assert!(matches!(output.status.code(), Some(0 | 5)), "{}", stderr(&output));
    assert!(!Recording::open(&free).unwrap().info.lock_step);

    let (code, heard) = monitor.interrupt();
    assert_eq!(code, Some(0));
    let lines = heard.lines().map(|line| serde_json::from_str(line).unwrap());
    let lines: Vec<serde_json::Value> = lines.collect();
    assert!(lines.iter().any(|shown| shown["ticks"].as_u64().unwrap() > before + 300), "{heard}");
    let (code, served) = device.interrupt();
    assert_eq!(code, Some(0));
    assert!(served.contains("frames received") && !served.contains("dropped"), "{served}");
}

#[test]
fn whoever_waits_for_nobody_can_be_interrupted() {
    for arguments in [
        &["link", "serve", "slcan:listen:0"][..],
        &["monitor", "--link", "slcan:listen:0"],
        &["info", "--link", "slcan:listen:0"],
    ] {
        let mut waiting = Running::start(arguments);
        let line = waiting.line();
        assert!(line.contains("waiting on 127.0.0.1:"), "{line}");
        let (code, said) = waiting.interrupt();
        assert_eq!((code, &said[..]), (None, ""), "{arguments:?}");
    }
}

/// A computer with an adapter lends it to one without: the frames of both buses cross, in their order.
#[test]
fn a_device_behind_a_bridge_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let (device, link) = device();
    let mut bridge = Running::start(&["link", "bridge", &link, "slcan:listen:0"]);
    let line = bridge.line();
    let behind = line.split('`').nth(1).unwrap().trim_start_matches("--link ").to_owned();
    assert_ne!(behind, link);
    let example = example();
    let run = ["run", "--link", &behind, text(&example), "--duration", "0.3", "--cell", "3"];
    let output = command().args(run).args(["--out", text(&file)]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let check = data(["check", text(&file)]);
    assert_eq!(check["replays"], true, "{check}");
    let (code, crossed) = bridge.interrupt();
    assert_eq!(code, Some(0));
    let counts: Vec<u64> =
        crossed.lines().map(|line| line.split(' ').next().unwrap().parse().unwrap()).collect();
    assert!(counts.len() == 2 && counts.iter().all(|count| *count > 600), "{crossed}");
    assert!(!crossed.contains("nobody took"), "{crossed}");
    assert_eq!(device.interrupt().0, Some(0));
    let output = cathforce(["link", "bridge", &link, &link]);
    assert_fails(&output, 2, &["both ends are"]);
}

/// The host may listen as well as the device.
#[test]
fn a_host_may_wait_for_the_device() {
    let mut host = Running::start(&["info", "--link", "slcan:listen:0"]);
    let line = host.line();
    let link = line.split('`').nth(1).unwrap().trim_start_matches("--link ").to_owned();
    let device = Running::start(&["link", "serve", &link]);
    let (code, info) = host.end();
    assert_eq!(code, Some(0));
    assert!(info.contains("not configured"), "{info}");
    // Its bus is gone with the host.
    let (code, _) = device.end();
    assert_eq!(code, Some(4));
}

#[test]
fn a_port_that_is_taken_is_named_before_anything_is_built() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("slcan:listen:{}", taken.local_addr().unwrap());
    let output = cathforce(["run", "--link", &link, text(&example())]);
    assert_fails(&output, 4, &[&link, "no other program listens on this port"]);
    assert!(!stderr(&output).contains("building"), "{}", stderr(&output));
}

#[test]
fn a_list_names_what_to_type() {
    let list = data(["link", "list"]);
    for link in list.as_array().unwrap() {
        let (name, address) = (link["name"].as_str().unwrap(), link["address"].as_str().unwrap());
        let kind = if link["kind"] == "serial port" { "slcan" } else { "socketcan" };
        assert_eq!(address, format!("{kind}:{name}"));
    }
    let output = cathforce(["link", "list"]);
    assert!(stderr(&output).contains("link serve slcan:listen:"), "{}", stderr(&output));
}

/// An installed program has no checkout: what was tried is listed, and the variable wins.
#[test]
fn missing_firmware_is_looked_for_and_the_places_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let ask = |variable: Option<&Path>| {
        let mut command = command();
        command.args(["doctor", "--link", "qemu"]).env_remove("CATHFORCE_FIRMWARE");
        command.env("CARGO_TARGET_DIR", folder.path());
        command.envs(variable.map(|path| ("CATHFORCE_FIRMWARE", path)));
        command.output().unwrap()
    };
    let nowhere = ask(None);
    assert_fails(&nowhere, 4, &["1 check failed"]);
    let said = String::from_utf8_lossy(&nowhere.stdout);
    for word in ["CATHFORCE_FIRMWARE: not set", "lib/cathforce/cathforce-firmware", "fix: "] {
        assert!(said.contains(word), "{word} in {said}");
    }
    let elf = folder.path().join("absent.elf");
    let said = ask(Some(&elf));
    assert_eq!(said.status.code(), Some(4));
    let said = String::from_utf8_lossy(&said.stdout);
    assert!(said.contains("CATHFORCE_FIRMWARE names") && said.contains("absent.elf"), "{said}");
}
