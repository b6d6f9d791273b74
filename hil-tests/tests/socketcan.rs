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
/// Exit code of a command whose device did not answer.
const NO_LINK: i32 = 4;
/// Force of the tip on the outer wall of the bend: less is none.
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
         step no-such-interface cathforce info --link socketcan:can7
         free vcan1",
    );
    check_session(&transcript, "vcan0");
    let record = times_to_the_record(&transcript, "vcan1");
    println!("ms from the kernel's stamp of a frame: {record}");
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
    // As Linux makes them: down, without a bit rate, with a short queue.
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

/// How long frames of a device that runs free take from the kernel's stamp, as candump logs it, to
/// the host's sight of them, and from there to the record. How fast an emulated computer is proves
/// nothing, so the times are printed; that every frame is in the record is tested.
fn times_to_the_record(transcript: &Transcript, interface: &str) -> String {
    let ok = |name: &str| transcript.ok(&format!("{interface}-{name}"));
    // A slow guest may miss the 5 ms after which the device ramps down; that is recorded as well. On
    // a slower one still the device has no time to answer while it keeps its pace.
    let run = transcript.step(&format!("{interface}-free"));
    if run.status == NO_LINK && run.stderr.contains("nothing heard") {
        return "not measured: the emulated computer cannot keep the pace".to_owned();
    }
    assert!(matches!(run.status, 0 | DEVICE_FAULT), "{run:?}");
    let frames = |name| ok(name).lines().map(stamped).collect::<Vec<_>>();
    let (heard, recorded) = (frames("heard"), frames("recorded"));
    assert!(recorded.len() > 500, "{} ticks", recorded.len());
    // The witness has listened longer: counters and forces say where the recording begins.
    let alike = |at: usize| heard[at..].iter().zip(&recorded).take_while(|(a, b)| a.1 == b.1);
    let at = (0..heard.len()).max_by_key(|&at| alike(at).take(200).count()).expect("heard");
    assert_eq!(alike(at).count(), recorded.len(), "a frame is missing in the record");
    let mut waits = alike(at).map(|(heard, seen)| 1e3 * (seen.0 - heard.0)).collect::<Vec<_>>();
    waits.sort_by(f64::total_cmp);
    let share = |share: f64| waits[((waits.len() - 1) as f64 * share) as usize];
    let stages = json(ok("latency"));
    let record = stages.as_array().expect("stages").iter().find(|s| s["name"] == "record");
    let record = &record.expect("it runs free")["times"];
    let ms = |name: &str| 1e3 * record[name].as_f64().expect("a number");
    format!(
        "to the host p50 {:.3}, p99 {:.3}; on to the record p50 {:.3}, p99 {:.3} ({} ticks)",
        share(0.5),
        share(0.99),
        ms("p50_s"),
        ms("p99_s"),
        recorded.len()
    )
}

/// Time \[s\] and frame of a line of candump.
fn stamped(line: &str) -> (f64, &str) {
    let (time, rest) = line.strip_prefix('(').and_then(|l| l.split_once(") ")).expect("a stamp");
    (time.parse().expect("seconds"), rest.split_once(' ').expect("an interface").1)
}

fn check_session(transcript: &Transcript, interface: &str) {
    let step = |name: &str| transcript.step(&format!("{interface}-{name}"));
    let ok = |name: &str| transcript.ok(&format!("{interface}-{name}"));

    assert_eq!(json(ok("up"))[0]["up"], true);
    assert_eq!(complaints(step("doctor"), ""), Vec::<String>::new());

    let run = json(ok("run"));
    assert!(run["ticks"].as_u64() >= Some(2000), "{run}");
    assert!(run["peak_contact_force_n"].as_f64() > Some(LEAST_PEAK_N), "{run}");
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

/// What the doctor does not find good, of the checks whose names begin so; each has its fix.
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
