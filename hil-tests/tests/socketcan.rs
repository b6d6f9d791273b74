//! Sessions through Linux' own CAN, in a guest: a virtual bus, two controllers on a bus, and the
//! emulated board behind a serial line.

use std::path::Path;

use cathforce_hil_tests::guest::{Guest, Machine, Transcript};
use cathforce_link::qemu::JoinedBoard;
use serde_json::Value;

const SESSION: &str = include_str!("guest/session.sh");
const BUNDLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/guest/short-bend");
/// Exit code of a command whose device reported a fault.
const DEVICE_FAULT: i32 = 5;
/// Largest 99th percentile of the time from the kernel's stamp to the record.
const MOST_TO_RECORD_MS: f64 = 1.0;
/// Least force of the tip on the outer wall of the bend.
const LEAST_PEAK_N: f64 = 0.005;

fn script(body: &str) -> String {
    format!("{SESSION}\n{body}")
}

fn run(machine: Machine, body: &str) -> Transcript {
    let files = [(Path::new(BUNDLE), "/bundle")];
    Guest::boot(&Machine { files: &files, ..machine }, &script(body)).transcript()
}

/// A device in lock step in the guest.
#[test]
fn a_session_over_a_virtual_bus() {
    let transcript = run(
        Machine::default(),
        "cathforce link up vcan0 > /dev/null
         cathforce --quiet link serve --lock-step socketcan:vcan0 &
         session vcan0
         step no-such-interface cathforce info --link socketcan:can7",
    );
    check_session(&transcript, "vcan0");
    let missing = transcript.step("no-such-interface");
    assert_eq!(missing.status, 4);
    assert!(missing.stderr.contains("cathforce link up can7"), "{missing:?}");
}

#[test]
fn a_session_between_two_controllers() {
    let transcript = run(
        Machine { controllers: true, ..Machine::default() },
        "step down cathforce --json doctor
         cathforce link up can1 > /dev/null
         cathforce --quiet link serve --lock-step socketcan:can1 &
         step slow cathforce --json link up can0 --bit-rate 500000 --queue 10
         session can0
         step list cathforce --json link list",
    );
    // Linux creates interfaces down, without a bit rate and with a short queue.
    let complaints = complaints(transcript.step("down"), "can0");
    assert_eq!(complaints, ["can0 interface", "can0 bit rate", "can0 queue"]);
    let complaints = self::complaints(transcript.step("can0-doctor-before"), "can0");
    assert_eq!(complaints, ["can0 bit rate", "can0 queue"]);
    check_session(&transcript, "can0");
    let list = json(transcript.ok("list"));
    for interface in list.as_array().expect("a list") {
        assert_eq!(interface["bit_rate"], 1_000_000);
        assert_eq!((&interface["up"], &interface["queue_frames"]), (&true.into(), &128.into()));
    }
}

#[test]
fn a_session_with_the_emulated_board_behind_a_serial_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("uart");
    let files = [(Path::new(BUNDLE), "/bundle")];
    let machine = Machine { serial_port: Some(&path), files: &files, ..Machine::default() };
    let guest =
        Guest::boot(&machine, &script("slcand -o -s8 -S 115200 ttyS1 can9 && session can9"));
    while !path.exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let mut board = JoinedBoard::boot(None, &path).unwrap_or_else(|error| panic!("{error}"));
    let transcript = guest.transcript();
    println!("the board's last words: {:?}", board.last_words());
    check_session(&transcript, "can9");
}

/// A device that runs free in a guest in which each instruction takes a nanosecond, so that this computer's
/// speed and load do not matter.
#[test]
fn every_frame_of_a_free_device_is_recorded_within_a_millisecond() {
    let transcript = run(Machine { virtual_time: true, ..Machine::default() }, "free vcan0");
    let ok = |name: &str| transcript.ok(&format!("vcan0-{name}"));
    println!("{}{}", ok("free"), transcript.timeline());
    // Nothing is missing, by the device's counters and by an independent listener.
    assert_eq!(json(ok("check"))["survey"]["dropouts"], Value::Array(Vec::new()));
    let of_host = |frame: &&str| {
        ["080#", "100#", "108#", "110#", "600#"].into_iter().any(|id| frame.starts_with(id))
    };
    let part = |name, host| -> Vec<&str> {
        ok(name).lines().filter(|frame| of_host(frame) == host).collect()
    };
    for host in [true, false] {
        let (heard, recorded) = (part("heard", host), part("recorded", host));
        assert!(recorded.len() > 1000, "{} frames", recorded.len());
        assert_eq!(first_difference(&heard, &recorded), None, "frames of {}", recorded.len());
    }
    let stages = json(ok("latency"));
    let time = |stage: &str, name: &str| {
        let found = stages.as_array().expect("stages").iter().find(|s| s["name"] == stage);
        found.expect("a stage")["times"][name].as_f64().expect("a number")
    };
    for stage in ["reception", "record", "frame to record"] {
        let [p50, p99, p999, max] =
            ["p50_s", "p99_s", "p999_s", "max_s"].map(|name| 1e3 * time(stage, name));
        println!("{stage}: p50 {p50:.3} ms, p99 {p99:.3}, p99.9 {p999:.3}, max {max:.3}");
    }
    let frames = part("recorded", false).len() as f64;
    assert_eq!(time("frame to record", "count"), frames, "percentiles of all frames");
    assert!(1e3 * time("frame to record", "p99_s") <= MOST_TO_RECORD_MS);
}

/// The first difference between recorded frames and those of a listener that listened for longer: its
/// index, the recorded frame and the one that was heard.
fn first_difference(heard: &[&str], recorded: &[&str]) -> Option<(usize, String, String)> {
    let alike = |at: &usize| {
        let pairs = recorded.iter().zip(&heard[*at..]);
        pairs.take_while(|(recorded, heard)| recorded == heard).count()
    };
    let at = (0..heard.len()).max_by_key(alike)?;
    let number = alike(&at);
    let near = |frames: &[&str], at: usize| {
        frames.iter().skip(at.saturating_sub(2)).take(6).copied().collect::<Vec<_>>().join(" ")
    };
    (number < recorded.len()).then(|| (number, near(recorded, number), near(heard, at + number)))
}

fn check_session(transcript: &Transcript, interface: &str) {
    let step = |name: &str| transcript.step(&format!("{interface}-{name}"));
    let ok = |name: &str| transcript.ok(&format!("{interface}-{name}"));

    assert_eq!(json(ok("up"))[0]["up"], true);
    assert_eq!(complaints(step("doctor"), ""), Vec::<String>::new());

    let run = json(ok("run"));
    assert!(run["ticks"].as_u64() >= Some(2000), "{run}");
    assert!(run["peak_contact_force_N"].as_f64() > Some(LEAST_PEAK_N), "{run}");
    assert_eq!((&run["differing_bits"], &run["missed_ticks"]), (&0.into(), &0.into()), "{run}");
    // Sealed frames of 8 bytes under HAPTIC's identifier, as another program heard them.
    let witness = ok("witness");
    assert_eq!(witness.lines().count(), 20, "{witness}");
    for line in witness.lines() {
        let (_, frame) = line.rsplit_once(' ').expect("candump's format");
        assert!(frame.starts_with("180#") && frame.len() == 4 + 16, "{line}");
    }

    let attacked = step("attacked");
    assert_eq!(attacked.status, DEVICE_FAULT, "{attacked:?}");
    let cause = "more than 3 of 10 frames were rejected";
    assert!(attacked.stderr.contains(cause), "{attacked:?}");
    let fault = json(ok("fault"));
    assert_eq!((&fault[0]["name"], &fault[0]["cause"]), (&"BadFrames".into(), &cause.into()));
    ok("clear");
    assert_eq!(json(ok("after")), Value::Array(Vec::new()));
    println!("{interface}:{}", transcript.timeline());
}

/// Failed checks of the doctor whose names begin with `prefix`; each must have its fix.
fn complaints(doctor: &cathforce_hil_tests::guest::Step, prefix: &str) -> Vec<String> {
    let checks = json(&doctor.stdout);
    let checks = checks.as_array().expect("a list").iter();
    let bad = checks.filter(|check| check["verdict"] != "good");
    let bad = bad.inspect(|check| assert!(check["fix"].is_string(), "{check}"));
    let names = bad.map(|check| check["name"].as_str().expect("a name").to_owned());
    names.filter(|name| name.starts_with(prefix)).collect()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}
