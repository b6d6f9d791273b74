//! `check`, and what a recording of some minutes loses.

use std::fs;
use std::path::Path;

use cathforce_bus::Id;
use cathforce_recording::{Attachments, Direction, Recorder, Recording};

use crate::{assert_fails, cathforce, data, example, recording, text};

#[test]
fn a_whole_recording_is_complete_and_replays() {
    let found = data(["check", text(recording())]);
    assert_eq!(found["replays"], true);
    assert_eq!((&found["complete"], &found["cut_at_byte"]), (&true.into(), &().into()));
    let survey = &found["survey"];
    assert_eq!((&survey["ticks_missing"], &survey["dropouts"]), (&0.into(), &[0; 0][..].into()));
    assert!((0.5..0.6).contains(&survey["bus_load"].as_f64().unwrap()), "{survey}");
    let ids = survey["ids"].as_array().unwrap();
    let haptic = ids.iter().find(|id| id["name"] == "HAPTIC").unwrap();
    assert!((haptic["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1.0, "{haptic}");
}

/// P24: what is missing has a cause, and makes the check fail.
#[test]
fn p24_missing_frames_fail_the_check_with_their_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("holes.mcap");
    let whole = Recording::open(recording()).unwrap();
    let attachments = Attachments {
        image: &whole.image,
        rig_toml: &whole.rig_toml,
        dbc: &whole.dbc,
        vessel: &[],
    };
    let mut info = whole.info.clone();
    info.lock_step = false;
    let mut recorder = Recorder::create(&path, &info, attachments).unwrap();
    let hole = 500_000_000..507_000_000;
    let lost = |f: &cathforce_recording::BusFrame| {
        f.direction == Direction::ToHost && hole.contains(&f.at_ns)
    };
    for frame in whole.frames.iter().filter(|f| !lost(f)) {
        recorder.frame(frame, frame.at_ns).unwrap();
    }
    recorder.finish(None).unwrap();
    let output = cathforce(["check", text(&path), "--json"]);
    assert_fails(&output, 6, &["7 ticks are missing", "--allow-missing"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let dropouts = found["survey"]["dropouts"].as_array().unwrap();
    assert_eq!(dropouts.len(), 1);
    assert_eq!(dropouts[0]["cause"], "lost");
    assert!(dropouts[0]["meaning"].as_str().unwrap().contains("ip -details"), "{dropouts:?}");
    assert_eq!(found["survey"]["longest_tick_gap_s"], 0.008);
    let allowed = cathforce(["check", text(&path), "--allow-missing", "100"]);
    assert!(allowed.status.success());
}

#[test]
fn a_cut_recording_says_so_and_replays_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let bytes = fs::read(recording()).unwrap();
    fs::write(&path, &bytes[..bytes.len() - 1000]).unwrap();
    let found = data(["check", text(&path)]);
    assert_eq!(found["complete"], false);
    assert!(found["cut_at_byte"].is_u64(), "{found}");
    fs::write(&path, b"not a recording").unwrap();
    assert_fails(&cathforce(["check", text(&path)]), 3, &["cut.mcap: byte 0"]);
}

/// A recording of an older version is refused with both versions.
#[test]
fn another_format_is_refused_and_both_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.mcap");
    let mut bytes = fs::read(recording()).unwrap();
    let (now, before) = (b"cathforce-recording/3", b"cathforce-recording/2");
    let at = bytes.windows(now.len()).position(|w| w == now).unwrap();
    bytes[at..at + now.len()].copy_from_slice(before);
    fs::write(&path, bytes).unwrap();
    let words = ["cathforce-recording/2", "cathforce-recording/3", "use the version of cathforce"];
    assert_fails(&cathforce(["check", text(&path)]), 3, &words);
}

/// Seconds to record; 600 for the whole promise.
const SECONDS: &str = "CATHFORCE_RECORD_SECONDS";

/// A bundle whose only trial is one slow insertion.
fn slow_insertion(folder: &Path, seconds: u32) -> std::path::PathBuf {
    let bundle = folder.join("slow");
    fs::create_dir_all(bundle.join("trials")).unwrap();
    for name in ["rig.toml", "vessel.stl"] {
        fs::copy(example().join(name), bundle.join(name)).unwrap();
    }
    let rows = 10 * seconds;
    let row = |k: u32| {
        format!("{},{},0\n", 0.1 * f64::from(k), 0.028 + 0.028 * f64::from(k) / f64::from(rows))
    };
    let rows =
        "t_s,insertion_m,rotation_rad\n".to_owned() + &(0..=rows).map(row).collect::<String>();
    fs::write(bundle.join("trials/000.csv"), rows).unwrap();
    bundle
}

/// P24: a recording at 1 kHz loses nothing.
#[test]
fn p24_minutes_at_a_kilohertz_lose_nothing() {
    let seconds = std::env::var(SECONDS).ok().map_or(10, |seconds| seconds.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let bundle = slow_insertion(folder.path(), seconds);
    let file = folder.path().join("long.mcap");
    data(["simulate", text(&bundle), "--out", text(&file), "--quiet"]);
    let found = data(["check", text(&file), "--no-replay"]);
    let survey = &found["survey"];
    let ticks = survey["ticks"].as_u64().unwrap();
    println!(
        "{ticks} ticks, {} frames, {} missing, {} MB",
        survey["frames"],
        survey["ticks_missing"],
        fs::metadata(&file).unwrap().len() / 1_000_000
    );
    assert!(ticks > u64::from(seconds) * 1000);
    assert_eq!((&survey["ticks_missing"], &survey["dropouts"]), (&0.into(), &[0; 0][..].into()));
    let whole = Recording::open(&file).unwrap();
    let encoders = whole.frames.iter().filter(|f| Id::from_raw(f.frame.id()) == Some(Id::Encoder));
    assert_eq!(encoders.count() as u64, ticks);
}
