//! What happens in real time: `run --free`, `latency`, `monitor`, `play`.

use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cathforce_bus::slcan::{Decoder, Line};
use cathforce_bus::{Frame, Id};
use cathforce_recording::{Direction, Recording};

use crate::{assert_fails, cathforce, command, data, example, recording, stderr, text};

#[test]
fn a_free_run_is_recorded_and_its_latency_known() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("free.mcap");
    let example = example();
    let run = ["run", "--link", "sim", "--free", text(&example), "--duration", "0.5"];
    let output = command().args(run).args(["--out", text(&file)]).output().unwrap();
    // A busy computer may miss the 5 ms after which the device ramps down; it is recorded as well.
    assert!(matches!(output.status.code(), Some(0 | 5)), "{}", stderr(&output));
    let free = Recording::open(&file).unwrap();
    assert!(!free.info.lock_step && free.frames.len() > 500);
    let later = free.frames.iter().zip(&free.logged_ns).all(|(f, logged)| *logged >= f.at_ns);
    assert!(later, "nothing is recorded before it was seen");

    let stages = data(["latency", text(&file)]);
    let names = stages.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap());
    let names = names.collect::<Vec<_>>();
    for name in ["encoder period", "end to end", "tick period", "record"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    let within = cathforce(["latency", text(&file), "--budget", "60000"]);
    assert!(within.status.success(), "{}", stderr(&within));
    let above = cathforce(["latency", text(&file), "--budget", "1e-9"]);
    assert_fails(&above, 6, &["end to end", "of --budget"]);
    let check = cathforce(["check", text(&file)]);
    assert!(String::from_utf8_lossy(&check.stdout).contains("recorded without lock step"));
}

/// Its page is there while it runs, and a port that is taken ends it before it begins.
#[test]
fn a_run_is_shown_in_a_browser_while_it_lasts() {
    let mut run = command();
    run.args(["run", "--free", "--link", "sim", text(&example()), "--cell", "3", "--json"]);
    run.args(["--duration", "1.5", "--dash=127.0.0.1:0"]);
    let mut child = run.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let said = lines.find(|line| line.contains("watch the run at")).unwrap();
    let address = said.split("http://").nth(1).unwrap().trim_end_matches('/').to_owned();
    let taken = format!("--dash={address}");
    let second = cathforce(["run", "--link", "sim", text(&example()), &taken]);
    assert_fails(&second, 1, &["cannot listen on", "fix:", "--listen"]);
    let ask = |path: &str| {
        let mut stream = TcpStream::connect(&address).unwrap();
        let head = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let body = answer.split_once("\r\n\r\n").unwrap().1;
        serde_json::from_str::<serde_json::Value>(body).unwrap()
    };
    let deadline = Instant::now() + Duration::from_secs(60);
    while !ask("/api/state")["forces"]["fx_N"].is_number() {
        assert!(Instant::now() < deadline, "no force was shown");
    }
    assert_eq!(ask("/api/scene")["error"], serde_json::Value::Null, "the vessel is known");
    lines.for_each(drop);
    // A busy computer may miss the 5 ms after which the device ramps down.
    assert!(matches!(child.wait().unwrap().code(), Some(0 | 5)));
}

/// A computer that is too busy is no fault of the drive's cable.
#[cfg(unix)]
#[test]
fn a_computer_that_was_late_is_named_with_what_helps() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("late.mcap");
    let mut run = command();
    run.args(["run", "--free", "--link", "sim", text(&example()), "--cell", "3", "--quiet"]);
    let run = run.args(["--out", text(&file)]).stderr(Stdio::piped()).stdout(Stdio::null());
    let child = run.spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while std::fs::metadata(&file).map_or(0, |file| file.len()) == 0 {
        assert!(Instant::now() < deadline, "no recording was begun");
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(800));
    for (signal, then_ms) in [("-STOP", 200), ("-CONT", 0)] {
        let id = child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        std::thread::sleep(Duration::from_millis(then_ms));
    }
    let output = child.wait_with_output().unwrap();
    assert_fails(&output, 5, &["ms after its time", "fix:", "chrt -r 10"]);
    // Whichever the device missed first: the encoder for too long, or the way between two samples.
    let faults = ["no valid encoder sample", "encoder samples jumped farther"];
    assert!(faults.iter().any(|fault| stderr(&output).contains(fault)), "{}", stderr(&output));
}

#[test]
fn latency_without_real_time_says_so() {
    let output = cathforce(["latency", text(recording()), "--budget", "1"]);
    assert_fails(&output, 3, &["lock step", "runs free"]);
    let nothing = cathforce(["latency"]);
    assert_fails(&nothing, 2, &["<FILE.mcap|--link <LINK>>"]);
    assert!(!stderr(&nothing).contains("--settings"), "{}", stderr(&nothing));
    // A device on its own ticks without encoders.
    let stages = data(["latency", "--link", "sim", "--duration", "0.2"]);
    assert_eq!(stages[0]["name"], "tick period");
}

#[test]
fn a_monitor_without_a_terminal_prints_a_line_a_second() {
    let output = cathforce(["monitor", text(recording()), "--duration", "1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let first = output.stdout.split(|b| *b == b'\n').next().unwrap();
    let shown: serde_json::Value = serde_json::from_slice(first).unwrap();
    assert!(shown["ticks"].as_u64().unwrap() >= 900, "{shown}");
    assert!(shown["fx_N"].is_number() && shown["mode"].is_string(), "{shown}");
    assert!(shown["targets"].is_null(), "{shown}");
    assert_fails(&cathforce(["monitor"]), 2, &["--link"]);
    assert_fails(&cathforce(["monitor", "absent.mcap"]), 3, &["absent.mcap"]);
}

/// The first target is anywhere near the vessel, the second one far outside.
#[test]
fn a_monitor_tells_which_targets_the_tip_has_reached() {
    let far = ["--target", "0,0,0", "--target", "9000,0,-3", "--within-mm", "500"];
    let run = ["monitor", text(recording()), "--duration", "1", "--json"];
    let output = command().args(run).args(far).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let last = output.stdout.split(|b| *b == b'\n').rfind(|line| !line.is_empty()).unwrap();
    let shown: serde_json::Value = serde_json::from_slice(last).unwrap();
    let targets = &shown["targets"];
    assert_eq!((&targets["targets"], &targets["next_m"][0]), (&2.into(), &9.0.into()), "{shown}");
    assert_eq!(targets["reached_s"].as_array().unwrap().len(), 1, "{shown}");
    assert!((8.5..9.1).contains(&targets["distance_m"].as_f64().unwrap()), "{shown}");
    let wrong = cathforce(["monitor", text(recording()), "--target", "12"]);
    assert_fails(&wrong, 2, &["write three numbers"]);
}

#[test]
fn frames_are_played_at_their_time() {
    let played = data(["play", text(recording()), "--link", "sim", "--speed", "8"]);
    let seconds = played["seconds"].as_f64().unwrap();
    assert!(played["frames"].as_u64().unwrap() > 3000 && seconds >= 3.0 / 8.0, "{played}");
    let log = tempfile::Builder::new().suffix(".log").tempfile().unwrap();
    std::fs::write(log.path(), "(1.0) can0 7F0#00\n").unwrap();
    let nothing = cathforce(["play", text(log.path()), "--link", "sim"]);
    assert_fails(&nothing, 3, &["none of its 0 frames", "--all"]);
    std::fs::write(log.path(), "(1.0) can0 ENCODER\n").unwrap();
    let broken = cathforce(["play", text(log.path()), "--link", "sim"]);
    assert_fails(&broken, 3, &[".log:1:", "is no frame"]);
    let nowhere = cathforce(["play", text(recording()), "--link", "pigeon"]);
    assert_fails(&nowhere, 2, &["socketcan:can0"]);
}

/// A master of its own: its frames are none of ours, and the bus sees them as they were.
#[test]
fn what_is_played_is_what_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let [file, settings, log] =
        ["run.mcap", "s.toml", "run.log"].map(|name| folder.path().join(name));
    let signal = |bit: u8| {
        format!("{{ start_bit = {bit}, bits = 16, signed = true, scale = 1e-5, offset = 0.0 }}")
    };
    let master = format!(
        "schema_version = 1\nrig = \"tapered-bifurcation\"\n[master.catheter]\nid = 0x3a1\ninsertion = {}\n\
         rotation = {}\n",
        signal(0),
        signal(16)
    );
    std::fs::write(&settings, master).unwrap();
    let example = example();
    let simulate = ["simulate", text(&example), "--duration", "0.1", "--cell", "3", "--quiet"];
    let to = ["--settings", text(&settings), "--out", text(&file)];
    let output = command().args(simulate).args(to).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    data(["export", text(&file), "--candump", text(&log)]);

    let recording = Recording::open(&file).unwrap();
    let ours = recording.frames.iter().filter(|f| f.direction == Direction::ToDevice);
    let sent = ours.filter(|f| f.frame.id() == 0x3a1).collect::<Vec<_>>();
    assert!(sent.len() > 100, "{} frames of the master", sent.len());
    let frames = sent.iter().map(|f| f.frame).collect::<Vec<_>>();
    let span_s = (sent.last().unwrap().at_ns - sent[0].at_ns) as f64 * 1e-9;
    for (source, more) in [(&file, &[][..]), (&log, &["--settings", text(&settings)])] {
        let (played, heard) = play(source, more);
        assert!(heard == frames, "{} frames, {} heard", frames.len(), heard.len());
        assert!(played["seconds"].as_f64().unwrap() >= span_s, "{played} of {span_s} s");
    }
    // With the device's frames; transfers and grants of ticks are for no other device.
    let (_, heard) = play(&file, &["--all"]);
    let is_played = |frame: &&Frame| {
        let id = Id::from_raw(frame.id());
        !matches!(id, Some(Id::Sync | Id::Command | Id::ServiceRequest | Id::ServiceResponse))
    };
    // In lock step what goes to the device was recorded before the answers of earlier ticks.
    let mut all: Vec<_> = recording.frames.iter().collect();
    assert!(!all.is_sorted_by_key(|f| f.at_ns));
    all.sort_by_key(|f| f.at_ns);
    let all = all.into_iter().map(|f| f.frame);
    assert!(heard == all.filter(|frame| is_played(&frame)).collect::<Vec<_>>());
}

/// Plays a file into an SLCAN server: what the command says of it, and what arrived.
fn play(file: &std::path::Path, more: &[&str]) -> (serde_json::Value, Vec<Frame>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("slcan:tcp:{}", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
        let mut decoder = Decoder::default();
        let lines = bytes.into_iter().filter_map(|byte| decoder.push(byte));
        let frames = lines.filter_map(|line| match line {
            Line::Frame(frame) => Some(frame),
            _ => None,
        });
        frames.collect()
    });
    let mut command = command();
    command.args(["play", text(file), "--link", &link, "--json"]);
    let output = command.args(more).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    (serde_json::from_slice(&output.stdout).unwrap(), server.join().unwrap())
}

/// `cathforce … | head -1`: whoever closed the pipe has seen enough.
#[test]
fn a_closed_pipe_is_no_error() {
    for arguments in [&["completions", "bash"][..], &["config"], &["--help"]] {
        let mut child = command()
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut byte = [0];
        child.stdout.take().unwrap().read_exact(&mut byte).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn shells_complete_and_every_command_has_a_page() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = cathforce(["completions", shell]);
        let script = String::from_utf8(script.stdout).unwrap();
        assert!(script.contains("cathforce") && script.contains("latency"), "{shell}");
    }
    let folder = tempfile::tempdir().unwrap();
    data(["man", text(folder.path())]);
    let page = std::fs::read_to_string(folder.path().join("cathforce-import-ati.1")).unwrap();
    assert!(page.contains("counts"), "{page}");
}
