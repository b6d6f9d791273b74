//! `cathforce identify`, as people meet it.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use support::{assert_fails, cathforce, stderr, text};

/// An example in a folder of its own; gives its description.
fn example(kind: &str, folder: &Path) -> PathBuf {
    let out = folder.join("records");
    let output = cathforce(["identify", "example", kind, text(&out)]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(String::from_utf8(output.stdout).unwrap().contains("next: cathforce identify fit "));
    out.join("description.toml")
}

/// Fits an example, and compares what was found with what its description says is true. `not_told`: the
/// parameters that its records cannot tell. Gives the text and the JSON.
fn recovers(kind: &str, not_told: &[&str]) -> (String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let description = example(kind, folder.path());
    let out = folder.path().join("fit.json");
    let output = cathforce(["identify", "fit", text(&description), "--out", text(&out)]);
    assert!(output.status.success(), "{}", stderr(&output));
    let remarks = stderr(&output).to_owned();
    let said = String::from_utf8(output.stdout).unwrap();
    let json: Value = serde_json::from_slice(&fs::read(&out).unwrap()).unwrap();
    println!("{said}\n{remarks}");
    assert_eq!(json["kind"], kind);
    let written = fs::read_to_string(&description).unwrap();
    for trial in json["trials"].as_array().unwrap() {
        for own in trial["parameters"].as_array().unwrap() {
            let name = own["name"].as_str().unwrap();
            let line = written.lines().find(|line| line.starts_with(name)).unwrap();
            if not_told.contains(&name) {
                assert_eq!(own["known"], "not_told", "{own}");
                assert!(!own["advice"].as_str().unwrap().is_empty(), "{own}");
                continue;
            }
            let Some((_, truth)) = line.split_once("true: ") else {
                assert_eq!(own["known"], "given", "{own}");
                continue;
            };
            let truth: f64 = truth.parse().unwrap();
            let end = |k: usize| own["interval_95"][k].as_f64().unwrap();
            assert!(end(0) <= truth && truth <= end(1), "{name}: {truth} in {own}");
        }
        let cost = trial["cost_per_feature"].as_f64().unwrap();
        assert!(cost < 3.0, "{cost}");
    }
    (said, json)
}

#[test]
fn releases_tell_the_rod_but_not_the_drag_of_air() {
    let (said, json) = recovers("weight-release", &["air_drag_kg_per_m2"]);
    assert_eq!(json["trials"][0]["features"], 12);
    assert!(said.contains("air_drag_kg_per_m2   cannot be told from these records: "), "{said}");
}

#[test]
fn loops_tell_the_friction_of_a_tendon() {
    let (said, json) = recovers("tendon-hysteresis", &[]);
    assert!(said.contains("coarse and ") && said.contains("95 % interval"), "{said}");
    assert_eq!(json["trials"][0]["records"], 3);
    assert_eq!(json["spread"].as_array().unwrap().len(), 0);
}

#[test]
fn records_in_flow_tell_pulse_and_drag_and_trials_have_a_spread() {
    let (said, json) = recovers("pulsatile-flow", &[]);
    assert!(said.contains("over 2 trials") && said.contains("m/s, given"), "{said}");
    let [pulse, phase, drag] = [0, 1, 2].map(|k| &json["spread"][k]);
    assert_eq!([pulse, phase, drag].map(|own| own["trials"].as_u64()), [Some(2); 3]);
    assert!((drag["nominal"].as_f64().unwrap() / 1.2 - 1.0).abs() < 0.05, "{drag}");
    assert!(drag["lower"].as_f64() < drag["upper"].as_f64(), "{drag}");
}

/// The force of a flow goes by drag_coefficient times velocity².
#[test]
fn drag_and_velocity_cannot_be_told_apart_which_is_said_with_what_to_measure() {
    let folder = tempfile::tempdir().unwrap();
    let description = example("pulsatile-flow", folder.path());
    let whole = fs::read_to_string(&description).unwrap();
    let second = whole.rfind("[[trial]]").unwrap();
    let searched = whole[..second]
        .replace("velocity_m_per_s = 0.173", "velocity_m_per_s = [0.1, 0.3]")
        .replace("pulse_ratio = [0.0, 1.0]", "pulse_ratio = 0.8")
        .replace("phase_rad = [-3.1416, 3.1416]", "phase_rad = 0.6");
    fs::write(&description, searched).unwrap();
    let output = cathforce(["identify", "fit", text(&description), "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let pair = &json["trials"][0]["inseparable"][0];
    assert_eq!([&pair["first"], &pair["second"]], ["drag_coefficient", "velocity_m_per_s"]);
    assert!(pair["correlation"].as_f64().unwrap() < -0.95, "{pair}");
    assert!(pair["advice"].as_str().unwrap().contains("measure it with a flow meter"), "{pair}");
    let interval = &json["trials"][0]["parameters"][2]["interval_95"];
    let [low, high] = [0, 1].map(|k| interval[k].as_f64().unwrap());
    assert!(low <= 1.2 && 1.2 <= high && high - low > 0.2, "{interval}");
}

/// Each is refused with the file, its line or row, the cause and a fix, and nothing is written.
#[test]
fn broken_records_and_descriptions_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let description = example("weight-release", folder.path());
    let out = folder.path().join("fit.json");
    let refused = |words: &[&str]| {
        let output = cathforce(["identify", "fit", text(&description), "--out", text(&out)]);
        assert_fails(&output, 3, words);
        assert!(stderr(&output).contains("fix:") && !out.exists(), "{}", stderr(&output));
    };
    let record = description.with_file_name("release-20g.csv");
    let good = fs::read_to_string(&record).unwrap();
    let rows: Vec<&str> = good.lines().collect();
    let changed = |text: String| fs::write(&record, text).unwrap();
    // Every height in millimetres.
    let millimetres = rows.iter().map(|row| match row.split_once(',') {
        Some((t_s, height_m)) => match height_m.parse::<f64>() {
            Ok(height_m) => format!("{t_s},{}\n", 1e3 * height_m),
            Err(_) => format!("{row}\n"),
        },
        None => String::new(),
    });
    changed(millimetres.collect());
    refused(&["release-20g.csv:2: `height_m` is -", "millimetres taken for metres?"]);
    changed(good.replace("height_m", "height_mm"));
    refused(&["release-20g.csv:1:2", "did you mean `height_m`?"]);
    changed(good.replacen(rows[9], &rows[9].replacen("0.2", "0.21", 1), 1));
    refused(&["release-20g.csv:10: column `t_s`: the rows are not equally far apart"]);
    changed(good.replacen(rows[9], "0.2,NaN", 1));
    refused(&["release-20g.csv:10:2", "not finite"]);
    changed(rows[..12].join("\n"));
    refused(&["release-20g.csv: the record has 11 samples"]);
    // Nothing but the weight at rest.
    let still = (0..100).map(|k| format!("{},-0.05\n", 0.025 * f64::from(k)));
    changed("t_s,height_m\n".to_owned() + &still.collect::<String>());
    refused(&["release-20g.csv: the tip does not rise"]);
    fs::remove_file(&record).unwrap();
    refused(&["release-20g.csv", "cannot be read"]);
    let whole = fs::read_to_string(&description).unwrap();
    fs::write(&description, whole.replace("length_m = 0.135", "length_m = 135")).unwrap();
    refused(&["description.toml:10: `length_m` is 135"]);
}

#[test]
fn a_loop_that_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let description = example("tendon-hysteresis", folder.path());
    let record = description.with_file_name("loop-2.csv");
    let good = fs::read_to_string(&record).unwrap();
    // Pulled once.
    let once: Vec<&str> = good.lines().take(80).collect();
    fs::write(&record, once.join("\n")).unwrap();
    let output = cathforce(["identify", "fit", text(&description)]);
    let words = ["loop-2.csv: the tendon is not pulled, let out and pulled again", "fix:"];
    assert_fails(&output, 3, &words);
}

#[test]
fn a_folder_that_is_there_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let description = example("weight-release", folder.path());
    fs::write(&description, "mine").unwrap();
    let out = description.parent().unwrap();
    let output = cathforce(["identify", "example", "weight-release", text(out)]);
    assert_fails(&output, 2, &["exists already and stays as it is", "fix:"]);
    assert_eq!(fs::read_to_string(&description).unwrap(), "mine");
    let output = cathforce(["identify", "example", "weight", text(&folder.path().join("b"))]);
    assert_fails(&output, 2, &["weight-release"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
