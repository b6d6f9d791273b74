//! P23: a recorder killed at any moment leaves a file that is read up to less than a second
//! before its end.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cathforce_bus::{Direction, Haptic, HapticForce, HapticTorque, Process, Sealer, Status};
use cathforce_recording::{Attachments, BusFrame, Recorder, Recording, RunInfo};

/// Variable that tells a child of this test where to record.
const FILE: &str = "CATHFORCE_TEST_RECORD_INTO";
/// How often to kill; 20 if it is not set.
const KILLS: &str = "CATHFORCE_KILLS";
const MOST_LOST: Duration = Duration::from_secs(1);
/// Children that record at the same time.
const SIDE_BY_SIDE: usize = 10;

fn now() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap()
}

/// The program of the children of the test below, which run it until they are killed. It records a tick a
/// millisecond, stamped with the time of day.
#[test]
fn record_until_killed() {
    let Some(file) = std::env::var_os(FILE) else { return };
    let attachments = Attachments { image: b"", rig_toml: "", dbc: "", vessel: &[] };
    let mut recorder =
        Recorder::create(Path::new(&file), &RunInfo::default(), attachments).unwrap();
    let mut sealer = Sealer::default();
    let started = Instant::now();
    let mut sent = 0;
    // Children whose parent is gone end here.
    while started.elapsed() < Duration::from_secs(60) {
        while sent < started.elapsed().as_millis() {
            let (force, torque) = (HapticForce(0), HapticTorque(0));
            let haptic = Process::Haptic(Haptic { force, torque, mode: 4, fault: 0 });
            let frame = sealer.seal(haptic, Status::default());
            let at_ns = now().as_nanos() as u64;
            let frame = BusFrame { at_ns, direction: Direction::ToHost, frame };
            recorder.frame(&frame, at_ns).unwrap();
            sent += 1;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A reproducible number between 0 and 1.
fn spread(i: usize) -> f64 {
    (i as f64 * 0.618_033_988_749_895).fract()
}

/// Kills a recorder after some time; returns how much of its end is missing.
fn kill_after(recorded: Duration, file: &Path) -> Duration {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "record_until_killed"])
        .env(FILE, file)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !std::fs::metadata(file).is_ok_and(|file| file.len() > 0) {
        assert!(begun.elapsed() < Duration::from_secs(30), "no recording was begun");
        std::thread::sleep(Duration::from_millis(2));
    }
    let recording_since = now();
    std::thread::sleep(recorded);
    child.kill().unwrap();
    let killed_at = now();
    child.wait().unwrap();
    let recording = Recording::open(file).unwrap();
    assert!(recording.cut.is_some() && recording.dropouts.is_empty());
    let last = recording.frames.last();
    let last = last.map_or(recording_since, |frame| Duration::from_nanos(frame.at_ns));
    killed_at.saturating_sub(last)
}

#[test]
fn p23_recorders_killed_at_random_times_lose_less_than_a_second() {
    let kills = std::env::var(KILLS).ok().map_or(20, |kills| kills.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let numbers = (0..kills).collect::<Vec<usize>>();
    let mut lost = Vec::new();
    for batch in numbers.chunks(SIDE_BY_SIDE) {
        let started = batch.iter().map(|&i| {
            let file = folder.path().join(format!("{i}.mcap"));
            std::thread::spawn(move || {
                kill_after(Duration::from_secs_f64(0.02 + 2.0 * spread(i)), &file)
            })
        });
        let started = started.collect::<Vec<_>>();
        lost.extend(started.into_iter().map(|child| child.join().unwrap()));
    }
    let most = lost.iter().max().unwrap();
    println!("{} recorders killed, at most {} ms lost", lost.len(), most.as_millis());
    assert!(*most <= MOST_LOST, "{most:?}");
}
