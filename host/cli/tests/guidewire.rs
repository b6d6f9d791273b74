//! A bundle with a guidewire through every command that shows one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn example(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name);
    path.to_str().unwrap().to_owned()
}

fn cathforce<const N: usize>(arguments: [&str; N]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1").args(arguments).output().unwrap()
}

#[track_caller]
fn data<const N: usize>(arguments: [&str; N]) -> serde_json::Value {
    let output = cathforce(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The wire in the lead and the catheter on its way, with the wire's button held.
fn simulate(folder: &Path) -> (PathBuf, serde_json::Value) {
    let file = folder.join("run.mcap");
    let (bundle, out) = (example("bend-guidewire"), file.to_str().unwrap());
    let arguments = ["simulate", &bundle, "--duration", "2.5", "--feel", "guidewire"];
    let [a, b, c, d, e, f] = arguments;
    let summary = data([a, b, c, d, e, f, "--out", out, "--json", "--quiet"]);
    (file, summary)
}

#[test]
fn a_wire_is_played_replayed_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let (file, summary) = simulate(folder.path());
    let file = file.to_str().unwrap();
    assert_eq!(summary["differing_bits"], 0);
    assert!(summary["guidewire_peak_drive_fx_N"].as_f64().unwrap() > 1e-3, "{summary}");
    assert!(summary["guidewire_peak_drive_torque_N_m"].as_f64().unwrap() > 0.0, "{summary}");

    let replay = data(["replay", file, "--json"]);
    assert_eq!((&replay["differing_bits"], &replay["extra_frames"]), (&0.into(), &0.into()));
    let frames_a_tick =
        replay["frames_compared"].as_f64().unwrap() / replay["ticks"].as_f64().unwrap();
    assert!((frames_a_tick - 7.0 / 3.0).abs() < 1e-3, "{frames_a_tick}");

    let load = data(["info", file, "--json"])["bus_load"].as_f64().unwrap();
    assert!((0.58..0.6).contains(&load), "{load}");

    let [csv, html] = ["ticks.csv", "page.html"].map(|name| folder.path().join(name));
    data(["export", file, "--csv", csv.to_str().unwrap(), "--json"]);
    check_rows(&fs::read_to_string(csv).unwrap());
    data(["report", file, "--html", html.to_str().unwrap(), "--json"]);
    let page = fs::read_to_string(html).unwrap();
    for shown in
        ["Drive force of the guidewire", "Insertion of the guidewire", "guidewire_radius_mm\":0.4"]
    {
        assert!(page.contains(shown), "{shown}");
    }
}

/// Both drives are where the trial says, and the operator feels the wire.
fn check_rows(rows: &str) {
    let mut lines = rows.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let played = lines.map(|line| line.split(',').collect::<Vec<_>>());
    let at_2_s = played.into_iter().find(|row| row[column("t_s")] == "2.000000").unwrap();
    let number = |name: &str| at_2_s[column(name)].parse::<f64>().unwrap();
    // Rows of the trial at 2.0 s: insertion_m 0.030833, guidewire_insertion_m 0.075000.
    assert!((number("insertion_m") - 0.030833).abs() < 1e-6);
    assert!((number("guidewire_insertion_m") - 0.075).abs() < 1e-6);
    assert!((number("guidewire_rotation_rad") - 2.25).abs() < 1e-4);
    assert_eq!(number("guidewire_felt"), 1.0);
    assert!((number("haptic_force_N") - number("guidewire_drive_fx_N")).abs() < 0.01);
    assert!(number("guidewire_drive_torque_N_m").is_finite());
}

#[test]
fn a_bundle_and_its_image_tell_of_their_wire() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("wire.cfim");
    let (bundle, image) = (example("bend-guidewire"), image.to_str().unwrap());
    assert_eq!(data(["info", &bundle, "--json"])["guidewire_diameter_m"], 0.89e-3);
    data(["config", "image", &bundle, "--out", image, "--guidewire-tip", "j", "--json"]);
    let radius_m = data(["info", image, "--json"])["guidewire_radius_m"].as_f64().unwrap();
    assert!((radius_m - 0.445e-3).abs() < 1e-9);
    let without = example("tapered-none");
    assert_eq!(data(["info", &without, "--json"]).get("guidewire_diameter_m"), None);
}

#[test]
fn what_needs_a_wire_says_so() {
    let bundle = example("tapered-none");
    for (option, value, code) in [("--feel", "guidewire", 2), ("--guidewire-tip", "j", 3)] {
        let output = cathforce(["simulate", &bundle, option, value]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        assert!(stderr.contains("[guidewire]") && stderr.contains("rig"), "{stderr}");
    }
}
