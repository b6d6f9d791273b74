//! `cathforce calibrate` on trials that were simulated with other settings than the rig states.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::support::{assert_fails, command, example, stderr, text};

const KEY: &str = "wall.friction_coefficient";
const TRUE: f64 = 0.45;

fn calibrate(folder: &Path, arguments: &[&str]) -> std::process::Output {
    command().current_dir(folder).arg("calibrate").args(arguments).output().unwrap()
}

/// Two trials with more friction than rig.toml states, and the noise that it states.
fn bundle() -> &'static Path {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, bundle) = MADE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("rough");
        let source = example().with_file_name("sticky-bend");
        let friction = format!("{KEY}={TRUE}");
        for trial in ["0", "1"] {
            let made = command()
                .args(["simulate", text(&source), "--trial", trial, "--set", &friction, "--noise"])
                .args(["--duration", "1.6", "--as-trial", text(&bundle), "--quiet"])
                .output()
                .unwrap();
            assert!(made.status.success(), "{}", stderr(&made));
        }
        (folder, bundle)
    });
    bundle
}

#[test]
fn what_the_trials_were_made_with_is_found_and_becomes_settings() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("s.toml");
    fs::write(&settings, "rig = \"sticky-bend\"\n[set]\nforce_gain = 2\n").unwrap();
    let found = calibrate(
        folder.path(),
        &[text(bundle()), "--parameters", KEY, "--budget", "40", "--settings", "s.toml", "--json"],
    );
    assert!(found.status.success(), "{}", stderr(&found));
    let found: Value = serde_json::from_slice(&found.stdout).unwrap();
    let own = &found["parameters"][0];
    let number = |value: &Value| value.as_f64().unwrap();
    let [low, high] = [0, 1].map(|k| number(&own["interval"][k]));
    assert!(low < TRUE && TRUE < high && high - low < 0.15, "{own}");
    assert_eq!((&own["at_bound"], &own["told_by_data"]), (&false.into(), &true.into()));
    let force = &found["errors"][0];
    assert_eq!(
        (&force["quantity"], &found["held_out"]),
        (&"force".into(), &"each trial in turn".into())
    );
    // Most of what lies above the sensor's noise is gone.
    let excess = |name: &str| number(&force[name]) - number(&force["floor"]);
    assert!(excess("after") < 0.3 * excess("before"), "{force}");
    assert!(excess("held_out") < 0.3 * excess("before"), "{force}");

    // The settings are those of the table, beside what was set by hand.
    let get = |name: &str| {
        let got = command().args(["config", "diff", text(&settings), "--json"]).output().unwrap();
        let got: Value = serde_json::from_slice(&got.stdout).unwrap();
        let of = |own: &&Value| own["name"] == name;
        number(&got.as_array().unwrap().iter().find(of).unwrap()["new"])
    };
    assert!((get(KEY) - number(&own["fitted"])).abs() < 1e-6);
    assert_eq!(get("force_gain"), 2.0);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no state is left");
}

#[test]
fn a_calibration_that_cannot_be_is_refused_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = text(bundle());
    let fails = |arguments: &[&str], code: i32, words: &[&str]| {
        assert_fails(&calibrate(folder.path(), arguments), code, words);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is written");
    };
    let with = |parameters: &'static str| [bundle, "--parameters", parameters];
    fails(
        &with("wall.friction_coeficient,contact.frictoin"),
        2,
        &["did you mean `wall.friction_coefficient`?", "did you mean `contact.friction`?"],
    );
    fails(&with("wall.friction_coefficient=0.5..0.2"), 2, &["reversed: 0.5 is not below 0.2"]);
    fails(&with("force_gain"), 2, &["changes no prediction"]);
    fails(&[bundle, "--parameters", KEY, "--hold-back", "7"], 2, &["no trial 007", "000, 001"]);
    fails(&[bundle, "--parameters", KEY, "--resume"], 2, &["nothing can be resumed"]);
    let source = example().with_file_name("bend-guidewire");
    fails(&[text(&source), "--parameters", KEY], 3, &["no trial measures a force", "fix: "]);
}

#[test]
fn a_setting_that_changes_nothing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    // Of a tendon that is not there.
    let refused = calibrate(folder.path(), &[text(bundle()), "--parameters", "tendon.angle_rad"]);
    assert_fails(&refused, 3, &["tendon.angle_rad changes nothing of what was measured", "fix: "]);
}
