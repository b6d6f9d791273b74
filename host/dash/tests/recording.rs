//! A recording that is started and stopped from the page.

#![cfg(unix)]

#[path = "support/program.rs"]
mod program;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use cathforce_recording::Recording;
use program::{Dash, example, text};
use serde_json::Value;

/// How long anything may take: other tests run beside.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until the state is as wanted, and gives it.
#[track_caller]
fn until(dash: &Dash, is: impl Fn(&Value) -> bool) -> Value {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let state = dash.get("/api/state");
        if is(&state) {
            return state;
        }
        assert!(Instant::now() < deadline, "{state}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_recording_begins_and_ends_from_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let example = example();
    let arguments = ["sim", "--bundle", text(&example), "--play", "--recordings"];
    let dash = Dash::start(&[&arguments[..], &[text(folder.path())]].concat());
    assert_eq!(dash.get("/api/source")["can_record"], true);
    until(&dash, |state| state["mode"] == "armed");
    assert!(dash.get("/api/state")["recording"].is_null());
    let (status, answer) = dash.change("stop_recording");
    assert_eq!((status, &answer["error"]), (409, &"there is no recording to stop".into()));

    let (status, begun) = dash.change("record");
    assert_eq!(status, 200, "{begun}");
    let path = PathBuf::from(begun["file"].as_str().unwrap());
    let (status, twice) = dash.change("record");
    assert!(status == 409 && twice["error"].as_str().unwrap().contains("stop it first"), "{twice}");
    until(&dash, |state| state["recording"]["frames"].as_u64().is_some_and(|n| n > 3000));
    let (status, ended) = dash.change("stop_recording");
    assert_eq!((status, &ended["file"]), (200, &begun["file"]), "{ended}");
    until(&dash, |state| state["recording"].is_null());

    // It stands alone, with what the sensor measured meanwhile.
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.completeness(), "yes");
    assert_eq!(recording.frames.len() as u64, ended["frames"].as_u64().unwrap());
    assert!(recording.trial.rows.iter().any(|row| row.force_n.is_some()));

    // One that is under way when the program ends is complete too.
    let (_, begun) = dash.change("record");
    until(&dash, |state| state["recording"]["frames"].as_u64().is_some_and(|n| n > 1000));
    dash.end();
    let path = PathBuf::from(begun["file"].as_str().unwrap());
    assert_eq!(Recording::open(&path).unwrap().completeness(), "yes");
}

/// Who only watches another program's device is told how to record it.
#[test]
fn where_nothing_is_known_of_the_rig_nothing_is_recorded() {
    let dash = Dash::start(&["sim"]);
    assert_eq!(dash.get("/api/source")["can_record"], false);
    let (status, answer) = dash.change("record");
    assert!(status == 409 && answer["error"].as_str().unwrap().contains("--bundle"), "{answer}");
    dash.end();
}
