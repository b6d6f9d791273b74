//! `cathforce import camera`, on pictures of a known scene.
#![cfg(feature = "camera")]

mod support;

use std::fs;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_camera::render::lab;
use cathforce_camera::render::stand::Stand;
use support::{assert_fails, cathforce, command, stderr, text};

const FRAMES: usize = 10;

#[test]
fn a_trial_is_made_of_frames_and_a_motion() {
    let folder = tempfile::tempdir().unwrap();
    lab::write(folder.path(), FRAMES).unwrap();
    fs::remove_file(folder.path().join("frames/0004.png")).unwrap();
    let import = |extra: &[&str]| {
        let mut command = command();
        command.current_dir(folder.path()).args(["import", "camera"]).args(extra);
        command.output().unwrap()
    };
    let board = ["--pictures", "pictures", "--board", "9x6", "--square-mm", "12"];
    let saved = import(&[&board[..], &["--save-calibration", "camera.toml"]].concat());
    assert!(saved.status.success(), "{}", stderr(&saved));
    let frames = ["frames", "--calibration", "camera.toml", "--plane", "plane.toml"];
    let rig = ["--bundle", "rig", "--rate", "30", "--motion", "motion.csv"];
    let all = [&frames[..], &rig].concat();

    let dry = import(&[&all[..], &["--offset", "0.5", "--dry-run", "--json"]].concat());
    assert!(dry.status.success(), "{}", stderr(&dry));
    let said: serde_json::Value = serde_json::from_slice(&dry.stdout).unwrap();
    assert_eq!((&said["found"], &said["path"]), (&9.into(), &serde_json::Value::Null));
    assert_eq!(said["dropped"][0]["frame"], 4);
    assert!(said["calibration"]["quality"]["reprojection_rms_px"].as_f64().unwrap() < 0.1);

    let out = ["--out", "rig/trials/000.csv"];
    let done = import(&[&all[..], &["--offset", "0.5"], &out].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(stderr(&done).contains("frame 4: there is no picture"), "{}", stderr(&done));
    check(folder.path());

    let again = import(&[&all[..], &["--offset", "0.5"], &out].concat());
    assert_fails(&again, 2, &["000.csv"]);
    let late = import(&[&all[..], &["--offset", "90", "--out", "rig/trials/001.csv"]].concat());
    assert_fails(&late, 3, &["none of its frames is within the time of motion.csv", "--offset"]);
    let light = [&all[..], &["--polarity", "light", "--out", "rig/trials/001.csv"]].concat();
    assert_fails(&import(&light), 3, &["no frame shows the catheter", "frame", "fix:"]);
    assert_eq!(fs::read_dir(folder.path().join("rig/trials")).unwrap().count(), 1);
}

/// The trial holds the tip and the shape in the rows of the camera, and a bundle reads it.
fn check(folder: &Path) {
    let bundle = Bundle::open(folder.join("rig")).unwrap();
    let trial = &bundle.trials[0];
    let columns = trial.catheter().unwrap();
    let tips: Vec<_> = columns.tip_m.as_ref().unwrap().iter().enumerate().collect();
    let tips: Vec<_> = tips.into_iter().filter_map(|(i, tip)| tip.map(|tip| (i, tip))).collect();
    assert_eq!((tips.len(), columns.shape_m.len()), (FRAMES - 1, 16));
    let stand = Stand::webcam();
    for (i, tip_m) in tips {
        let line = stand.catheter(lab::length_m(trial.t_s[i]));
        let truth = line[line.len() - 1];
        let error = (tip_m[0] - truth.x).hypot(tip_m[1] - truth.y).hypot(tip_m[2]);
        assert!(error < 0.3e-3, "{error}");
        let entry = columns.shape_m[15][i].unwrap();
        assert!(entry[0].abs() < 1e-6 && (entry[1] + 0.02).abs() < 0.3e-3, "{entry:?}");
        assert!((columns.insertion_m[i] - lab::length_m(trial.t_s[i])).abs() < 1e-6);
    }
}

#[test]
fn what_is_missing_is_said_at_once() {
    let nothing = cathforce(["import", "camera", "frames"]);
    assert_fails(&nothing, 2, &["--bundle", "--plane", "--motion", "--out"]);
    let folder = tempfile::tempdir().unwrap();
    let out = ["--dry-run", "--plane", "p.toml", "--bundle", "b"];
    let mut uncalibrated = command();
    uncalibrated.args(["import", "camera", text(folder.path())]).args(out);
    assert_fails(&uncalibrated.output().unwrap(), 2, &["not calibrated", "--pictures"]);
}

#[test]
fn a_board_is_drawn_for_a_printer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("board.svg");
    let drawn = cathforce([
        "import",
        "camera",
        "--board",
        "9x6",
        "--square-mm",
        "12",
        "--draw-board",
        text(&path),
    ]);
    assert!(drawn.status.success(), "{}", stderr(&drawn));
    assert!(fs::read_to_string(&path).unwrap().contains("144mm"));
    let even = folder.path().join("even.svg");
    let drawn = cathforce([
        "import",
        "camera",
        "--board",
        "8x6",
        "--square-mm",
        "12",
        "--draw-board",
        text(&even),
    ]);
    assert!(stderr(&drawn).contains("half a turn"), "{}", stderr(&drawn));
}
