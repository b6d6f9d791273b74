//! The loop: diagnose, apply, verify, on a rig whose wall has another friction than its rig.toml
//! says, made by the solver that shares nothing with the device's model.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use cathforce_blind_test::{Change, Stand, play, rigs};
use cathforce_config::image::decode;
use cathforce_test_fixture::once;
use serde_json::Value;

const FACTOR: f64 = 2.0;
/// Rows of a trial that are kept: 2.6 s, enough to slide along the wall.
const ROWS: usize = 650;

fn cathforce(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1").args(arguments).output().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = cathforce(&[arguments, &["--json", "--quiet"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn assert_fails(arguments: &[&str], code: i32, words: &[&str]) {
    let output = cathforce(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for word in words {
        assert!(stderr.contains(word), "`{word}` in: {stderr}");
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A bundle of three trials with more friction than it states, and the diagnosis of two of them.
fn diagnosed() -> (&'static Path, &'static Path) {
    static MADE: OnceLock<(PathBuf, PathBuf)> = OnceLock::new();
    let made = MADE.get_or_init(|| {
        let folder = once("sticky-diagnosed", make_diagnosed);
        (folder.join("bundle"), folder.join("diagnosis.json"))
    });
    (&made.0, &made.1)
}

fn make_diagnosed(folder: &Path) {
    let bundle = folder.join("bundle");
    let rig = &rigs()[0];
    let friction = [Change::Friction { factor: FACTOR }];
    let trial = |trial| {
        let mut rows = play(rig, &friction, trial).unwrap();
        rows.truncate(ROWS);
        rows
    };
    let trials = [trial(0), trial(2), trial(0)];
    Stand::own(rig).write(&bundle, "sticky", &trials, 1).unwrap();
    let diagnosis = folder.join("diagnosis.json");
    let output = cathforce(&[
        "gap",
        "diagnose",
        text(&bundle),
        "--hold-back",
        "2",
        "--effect",
        "contact.friction",
        "--quiet",
        "--json",
        text(&diagnosis),
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The diagnosis with something else in it.
fn changed(folder: &Path, change: impl FnOnce(&mut Value)) -> PathBuf {
    let (_, diagnosis) = diagnosed();
    let mut value = serde_json::from_slice(&std::fs::read(diagnosis).unwrap()).unwrap();
    change(&mut value);
    let path = folder.join("changed.json");
    std::fs::write(&path, value.to_string()).unwrap();
    path
}

#[test]
fn what_was_diagnosed_is_applied_and_the_gap_is_smaller_on_the_device() {
    let (bundle, diagnosis) = diagnosed();
    let (bundle, diagnosis) = (text(bundle), text(diagnosis));
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("sticky.toml");
    std::fs::write(&settings, "rig = \"sticky\"\n[set]\nforce_gain = 2\n").unwrap();
    let apply = ["gap", "apply", bundle, "--diagnosis", diagnosis, "--settings", text(&settings)];

    let before = std::fs::read(&settings).unwrap();
    let shown = json(&[&apply[..], &["--dry-run", "--link", "qemu:/no/such.elf"]].concat());
    assert_eq!(std::fs::read(&settings).unwrap(), before, "a dry run changes nothing");
    let done = json(&[&apply[..], &["--link", "sim"]].concat());
    assert_eq!(shown["changes"], done["changes"]);
    let [change] = done["changes"].as_array().unwrap().as_slice() else { panic!("{done}") };
    assert_eq!(change["key"], "wall.friction_coefficient");
    let (old, new) = (change["old"].as_f64().unwrap(), change["new"].as_f64().unwrap());
    assert!((new / old / FACTOR - 1.0).abs() < 0.15, "{old} to {new}");
    assert!(change["origin"].as_str().unwrap().starts_with("contact.friction, 90 %"), "{change}");
    assert_eq!(done["device"]["image_crc32"].as_str().unwrap().len(), 8);

    // The same settings reach a device image, beside what was set by hand.
    let image = folder.path().join("sticky.cfim");
    let arguments =
        ["config", "image", bundle, "--settings", text(&settings), "--out", text(&image)];
    assert!(cathforce(&arguments).status.success());
    let bytes = std::fs::read(&image).unwrap();
    let config = decode(&bytes).unwrap();
    assert_eq!(config.model.description().wall.friction_coefficient, new as f32);
    assert_eq!(config.settings.force_gain, 2.0);
    assert!(config.band.is_some(), "the device is told how far its forces may be off");

    // Once more: nothing changes.
    assert!(done["band_change"]["old_widest_N"].is_null(), "{done}");
    assert!(done["band_change"]["new_widest_N"].as_f64() > Some(0.0), "{done}");
    let again = json(&apply);
    assert_eq!((&again["changes"], &again["band_change"]), (&Value::Array(vec![]), &Value::Null));

    let verify = ["gap", "verify", bundle, "--link", "sim", "--settings", text(&settings)];
    let verified = json(&[&verify[..], &["--diagnosis", diagnosis]].concat());
    assert_eq!((&verified["trial"], &verified["fresh"]), (&2.into(), &true.into()), "{verified}");
    assert_eq!(verified["differing_bits"], 0);
    let force = |name: &str| verified["force_rms_N"][name].as_f64().unwrap();
    assert!(force("before") > 1.5 * force("floor"), "{verified}");
    assert!(force("achieved") < 0.8 * force("before"), "{verified}");
    let shrink = |name: &str| verified["shrink"][name].as_f64().unwrap();
    assert!((shrink("predicted") - shrink("achieved")).abs() < 0.1, "{verified}");
    assert!((shrink("finer_model") - shrink("achieved")).abs() < 0.01, "{verified}");
    assert_eq!(verified["outcome"], "as_promised");
    assert_eq!(verified["differences"], Value::Array(Vec::new()));
    assert!(verified["promised_force_rms_N"]["before"].is_number());
    // What the device said of itself while it played the trial.
    let drive = &verified["coverage"]["channels"][3];
    let count = |name: &str| drive[name].as_f64().unwrap();
    assert!(count("stated") > 4.0 * count("unknown"), "{drive}");
    assert!(count("within") > 0.7 * count("stated"), "{drive}");

    // And in a recording's table.
    let [recording, table] = ["run.mcap", "ticks.csv"].map(|name| folder.path().join(name));
    let play = ["simulate", bundle, "--settings", text(&settings), "--duration", "1.5", "--out"];
    assert!(cathforce(&[&play[..], &[text(&recording)]].concat()).status.success());
    assert!(cathforce(&["export", text(&recording), "--csv", text(&table)]).status.success());
    let table = std::fs::read_to_string(table).unwrap();
    let header = table.lines().next().unwrap();
    let column = header.split(',').position(|name| name == "drive_fx_half_width_N").unwrap();
    let widths = table.lines().skip(1).map(|line| line.split(',').nth(column).unwrap());
    let widths: Vec<f64> = widths.filter_map(|n| n.parse().ok()).collect();
    assert!(widths.len() > 50 && widths.iter().all(|n| (0.0..2.0).contains(n)), "{widths:?}");

    // The page of it has the band, too.
    let page = folder.path().join("run.html");
    assert!(cathforce(&["report", text(&recording), "--html", text(&page)]).status.success());
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("\"band\":{") && page.contains("Measured within the band"));

    let limit = ["--duration", "1.5", "--fail-above", "rms_N=1e-4"];
    assert_fails(&[&verify[..], &limit].concat(), 6, &["on the device", "rms_N=0.0001"]);
}

/// Whether a device that plays a trial with these arguments says how far its forces may be off, and
/// what the command said.
fn states_a_band(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let [recording, table] = ["b.mcap", "b.csv"].map(|name| folder.join(name));
    let play = ["--duration", "1.5", "--quiet", "--overwrite", "--out", text(&recording)];
    let played = cathforce(&[&["simulate"], arguments, &play].concat());
    let said = String::from_utf8(played.stderr).unwrap();
    assert!(played.status.success(), "{said}");
    let export = ["export", text(&recording), "--csv", text(&table), "--overwrite"];
    assert!(cathforce(&export).status.success());
    let table = std::fs::read_to_string(table).unwrap();
    let mut rows = table.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let is_width = |name: &&str| name.ends_with("half_width_N");
    let column = rows.next().unwrap().iter().position(is_width).expect("a column of the band");
    (rows.any(|row| !row[column].is_empty()), said)
}

#[test]
fn a_band_is_stated_of_the_model_that_it_was_made_for_and_of_no_other() {
    let (bundle, diagnosis) = diagnosed();
    let (bundle, diagnosis) = (text(bundle), text(diagnosis));
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("s.toml");
    let apply = ["gap", "apply", bundle, "--diagnosis", diagnosis, "--settings", text(&settings)];
    json(&apply);
    let own = [bundle, "--settings", text(&settings)];
    let with = |more: &[&str]| states_a_band(folder.path(), &[&own[..], more].concat());
    let of_control = ["--set", "force_gain=2", "--set", "solver.solves=2", "--cell", "1.5"];
    for more in [&[][..], &of_control] {
        assert_eq!(with(more), (true, String::new()), "{more:?}");
    }
    for more in [["--set", "effects.wall.stiffness.factor=0.5"], ["--tip", "j"]] {
        let (stated, said) = with(&more);
        let name = more[1].split('=').next().unwrap();
        assert!(!stated && said.contains("to another model") && said.contains("fix:"), "{said}");
        assert!(said.contains(if more[0] == "--tip" { "--tip" } else { name }), "{said}");
    }

    // A file from before the hash was written; settings that somebody has made since.
    let written = std::fs::read_to_string(&settings).unwrap();
    let old: Vec<&str> = written.lines().filter(|l| !l.starts_with("model_sha256")).collect();
    std::fs::write(&settings, old.join("\n")).unwrap();
    let (stated, said) = with(&[]);
    assert!(!stated && said.contains("which model") && said.contains("gap apply"), "{said}");
    let by_hand = "[set]\n\"effects.wall.stiffness.factor\" = 0.5\n";
    std::fs::write(&settings, written.replacen("[set]\n", by_hand, 1)).unwrap();
    let (stated, said) = with(&[]);
    assert!(!stated && said.contains("effects.wall.stiffness.factor"), "{said}");
    let again = json(&apply);
    assert_eq!((&again["band"], &again["band_change"]), (&Value::Null, &Value::Null), "{again}");
    assert!(again["notes"].to_string().contains("states no error band"), "{again}");
}

#[test]
fn what_is_verified_is_said_in_words_and_what_is_not_diagnosed_is_listed() {
    let (bundle, diagnosis) = diagnosed();
    let verify = ["gap", "verify", text(bundle), "--diagnosis", text(diagnosis), "--link", "sim"];
    let stiff = ["--set", "effects.wall.stiffness.factor=2"];
    let smooth = ["--set", "wall.friction_coefficient=0", "--quiet"];
    let output = cathforce(&[&verify[..], &stiff, &smooth].concat());
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{err}");
    assert!(out.starts_with("Worse than before: "), "{out}");
    assert!(out.contains("the error of the force is larger than before"), "{out}");
    for listed in ["wall.friction_coefficient = 0, diagnosed 0.", "factor = 2 is not among it"] {
        assert!(out.contains(listed) && err.contains(listed), "{out}{err}");
    }
    let other = json(&[&verify[..], &stiff].concat());
    let missing = &other["differences"][0];
    assert_eq!(missing["kind"], "missing", "{other}");
    assert_eq!(missing["key"], "wall.friction_coefficient");
}

/// What a diagnosis would conclude nothing from closes no gap on a device either.
#[test]
fn a_mirrored_force_is_not_scored() {
    let (bundle, diagnosis) = diagnosed();
    let folder = tempfile::tempdir().unwrap();
    let mirrored = folder.path().join("mirrored");
    std::fs::create_dir_all(mirrored.join("trials")).unwrap();
    for name in ["rig.toml", "centreline.csv"] {
        std::fs::copy(bundle.join(name), mirrored.join(name)).unwrap();
    }
    let trial = std::fs::read_to_string(bundle.join("trials/002.csv")).unwrap();
    let mut lines = trial.lines();
    let header = lines.next().unwrap();
    let axes = ["fx_N", "fy_N", "fz_N"];
    let turned = |line: &str| {
        let fields = header.split(',').zip(line.split(','));
        let field = |(name, value): (&str, &str)| match value.parse::<f64>() {
            Ok(force) if axes.contains(&name) => (-force).to_string(),
            _ => value.to_owned(),
        };
        fields.map(field).collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = std::iter::once(header.to_owned()).chain(lines.map(turned)).collect();
    std::fs::write(mirrored.join("trials/002.csv"), rows.join("\n") + "\n").unwrap();
    let verify =
        ["gap", "verify", text(&mirrored), "--diagnosis", text(diagnosis), "--link", "sim"];
    let said = json(&verify);
    assert_eq!(
        (&said["outcome"], &said["shrink"]),
        (&"inconclusive".into(), &Value::Null),
        "{said}"
    );
    assert!(said["objections"][0].as_str().unwrap().contains("along −x, −y,"), "{said}");
    let limit = [&verify[..], &["--fail-above", "rms_N=9"]].concat();
    assert_fails(&limit, 6, &["along −x, −y,", "nothing can be compared"]);
}

#[test]
fn an_earlier_diagnosis_is_replaced_and_what_was_set_by_hand_stays() {
    let (bundle, diagnosis) = diagnosed();
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("s.toml");
    let earlier = "rig = \"sticky\"\n[set]\nforce_gain = 2\n\
        \"effects.wall.stiffness.factor\" = { value = 0.5, effect = \"wall.stiffness\" }\n";
    std::fs::write(&settings, earlier).unwrap();
    let (bundle, diagnosis) = (text(bundle), text(diagnosis));
    let apply = ["gap", "apply", bundle, "--diagnosis", diagnosis, "--settings", text(&settings)];
    let changes = json(&apply)["changes"].clone();
    let stiffness = changes.as_array().unwrap().iter().find(|c| c["new"] == 1.0).unwrap();
    assert_eq!(stiffness["key"], "effects.wall.stiffness.factor");
    let written = std::fs::read_to_string(&settings).unwrap();
    assert!(written.contains("force_gain") && !written.contains("wall.stiffness"), "{written}");
}

#[test]
fn what_cannot_be_applied_is_refused_and_changes_nothing() {
    let (bundle, diagnosis) = diagnosed();
    let bundle = text(bundle);
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("s.toml");
    let refused = |file: &Path, code: i32, words: &[&str]| {
        let apply = ["gap", "apply", bundle, "--settings", text(&settings), "--link", "sim"];
        assert_fails(&[&apply[..], &["--diagnosis", text(file)]].concat(), code, words);
        assert!(!settings.exists());
    };
    let with = |change: &dyn Fn(&mut Value)| changed(folder.path(), change);
    refused(&with(&|d| d["verdict"] = "unknown".into()), 1, &["`unknown`", "fix:", "--effect"]);
    refused(&with(&|d| d["verdict"] = "no_gap".into()), 1, &["`no_gap`", "to the floor"]);
    refused(&with(&|d| d["bundle"] = "other".into()), 3, &["`other`", "`sticky`", "fix:"]);
    let sha = "0".repeat(64);
    let other_files = with(&|d| d["reproduce"]["bundle_sha256"] = sha.clone().into());
    refused(&other_files, 3, &["not those that were diagnosed", "fix:"]);
    refused(&with(&|d| d["format"] = "gap-diagnosis/9".into()), 3, &["gap-diagnosis/9", "fix:"]);
    let other = |id: &str, name: &str, value: f64| {
        let parameters = format!(
            r#"{{"{name}": {{"value": {value}, "low": {value}, "high": {value}, "unit": "1"}}}}"#
        );
        let (id, parameters): (String, Value) =
            (id.into(), serde_json::from_str(&parameters).unwrap());
        changed(folder.path(), move |d| {
            d["effects"][0]["id"] = id.into();
            d["effects"][0]["parameters"] = parameters;
        })
    };
    refused(
        &other("sensor.gain", "factor", 1.2),
        1,
        &["force sensor", "--set effects.sensor.gain"],
    );
    refused(&other("drive.coulomb", "force_n", 3.0), 1, &["axis without an instrument", "fix:"]);
    refused(&other("wall.nope", "factor", 1.2), 3, &["wall.nope"]);
    refused(&other("wall.stiffness", "nope", 1.2), 3, &["nope"]);
    refused(&other("wall.stiffness", "factor", 1e9), 3, &["between 0.01 and 100"]);

    let nothing = ["gap", "apply", bundle, "--diagnosis", text(diagnosis)];
    assert_fails(&nothing, 2, &["--settings", "--dry-run"]);
    // A device that does not answer: the file stays as it was.
    let away = ["--settings", text(&settings), "--link", "qemu:/no/such.elf"];
    assert_fails(&[&nothing[..], &away].concat(), 4, &["/no/such.elf"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "only changed.json");
    assert_fails(&["gap", "verify", bundle, "--link", "sim"], 2, &["nothing to verify", "--set"]);
    std::fs::write(&settings, "rig = \"other\"\n").unwrap();
    let other = ["simulate", bundle, "--settings", text(&settings)];
    assert_fails(&other, 3, &["for the rig `other`", "fix:"]);
}

/// Where no effect is named, the band is that of the rig as it is described.
#[test]
fn a_band_alone_is_applied_only_where_no_effect_is_named() {
    let (bundle, diagnosis) = diagnosed();
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("s.toml");
    let apply = ["gap", "apply", text(bundle), "--settings", text(&settings), "--band-only"];
    let named = [&apply[..], &["--diagnosis", text(diagnosis)]].concat();
    assert_fails(&named, 2, &["apply the effects too"]);
    let unknown = changed(folder.path(), |d| d["verdict"] = "unknown".into());
    let told = json(&[&apply[..], &["--diagnosis", text(&unknown)]].concat());
    assert_eq!(told["changes"], Value::Array(Vec::new()));
    assert!(told["band"]["channels"][0]["within"].as_u64() > Some(50), "{told}");
    let written = std::fs::read_to_string(&settings).unwrap();
    assert!(written.contains("[band]") && !written.contains("effect ="), "{written}");
    let again = json(&["simulate", text(bundle), "--settings", text(&settings)]);
    assert!(again["ticks"].is_number(), "a device takes it: {again}");
}

#[test]
fn recordings_of_one_rig_are_trials_of_one_diagnosis() {
    let (bundle, _) = diagnosed();
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (a, b, c) = (file("a.mcap"), file("b.mcap"), file("c.mcap"));
    let record = |bundle: &str, trial: &str, out: &str| {
        let arguments = ["simulate", bundle, "--trial", trial, "--out", out, "--quiet"];
        assert!(cathforce(&arguments).status.success());
    };
    record(text(bundle), "0", &a);
    record(text(bundle), "1", &b);
    let diagnose = ["gap", "diagnose", &a, &b, "--effect", "contact.friction"];
    let found = json(&diagnose);
    let value = &found["effects"][0]["parameters"]["friction_coefficient"]["value"];
    assert!(value.as_f64() > Some(0.45), "{found}");
    let command = found["reproduce"]["command"].as_str().unwrap();
    assert!(command.contains("a.mcap") && command.contains("b.mcap"), "{command}");
    assert!(!found["remarks"].to_string().contains("one trial only"), "{found}");
    let left_n = found["gap"]["force_rms_N"]["after"].as_f64().unwrap();
    for (share, code) in [(0.9, 6), (1.1, 0)] {
        let limit = format!("rms_N={}", share * left_n);
        let limited = [&diagnose[..], &["--json", "-", "--quiet", "--fail-above", &limit]].concat();
        let output = cathforce(&limited);
        assert_eq!(output.status.code(), Some(code), "{limit}");
        // Whatever is left, the verdict is printed.
        let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(printed["verdict"], found["verdict"]);
    }

    assert_fails(&["gap", "diagnose", text(bundle), &a], 2, &["no recording", "fix:"]);
    let other = folder.path().join("other");
    std::fs::create_dir_all(other.join("trials")).unwrap();
    for name in ["rig.toml", "centreline.csv", "trials/000.csv"] {
        std::fs::copy(bundle.join(name), other.join(name)).unwrap();
    }
    let rig = std::fs::read_to_string(other.join("rig.toml")).unwrap();
    std::fs::write(other.join("rig.toml"), rig.replace("0.3\n", "0.25\n")).unwrap();
    record(text(&other), "0", &c);
    let words = ["a.mcap", "c.mcap", "differ in their rig.toml", "SHA-256", "fix:"];
    assert_fails(&["gap", "diagnose", &a, &c], 3, &words);
}

/// A recording holds the rig, what was measured, and the vessel in its device image.
#[test]
fn a_recording_is_diagnosed_and_applied_like_a_bundle() {
    let (bundle, _) = diagnosed();
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (run, diagnosis, settings) = (file("run.mcap"), file("d.json"), file("s.toml"));
    let bundle = text(bundle);
    let simulate =
        ["simulate", bundle, "--trial", "1", "--out", &run, "--set", "force_gain=3", "--quiet"];
    assert!(cathforce(&simulate).status.success());
    let effect = ["--effect", "contact.friction"];
    let fitted = json(&[&["gap", "apply", &run, "--settings", &settings], &effect[..]].concat());
    let [change] = fitted["changes"].as_array().unwrap().as_slice() else { panic!("{fitted}") };
    let (old, new) = (change["old"].as_f64().unwrap(), change["new"].as_f64().unwrap());
    assert!((new / old / FACTOR - 1.0).abs() < 0.25, "{old} to {new}");

    let page = folder.path().join("page.html");
    let files = ["--json", &diagnosis, "--report", text(&page)];
    let diagnose = [&["gap", "diagnose", &run, "--quiet"][..], &files].concat();
    assert!(cathforce(&[&diagnose[..], &effect].concat()).status.success());
    // The recording holds no mesh: its vessel is that of the device's image.
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.contains("<path class=vessel") && page.contains("on the vessel, where the tip"));
    let again = ["gap", "apply", &run, "--diagnosis", &diagnosis, "--settings", &settings];
    let again = json(&[&again[..], &["--link", "sim"]].concat());
    assert_eq!(again["changes"], Value::Array(Vec::new()), "the same fit");
    assert_eq!(again["device"]["link"], "sim");
}

#[test]
fn a_blind_test_without_cases_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("made");
    fn blind_test<'a>(action: &'a str, made: &'a Path, extra: &[&'a str]) -> Vec<&'a str> {
        [&["gap", "blind-test", action, text(made)], extra].concat()
    }
    assert_fails(
        &blind_test("make", &made, &["--seed", "1", "--cases", "0"]),
        2,
        &["tests nothing", "fix:"],
    );
    assert_fails(
        &blind_test("seal", &made, &[]),
        3,
        &["no blind test is there", "blind-test make"],
    );

    let drive = folder.path().join("axis");
    std::fs::create_dir(&drive).unwrap();
    std::fs::write(drive.join("rig.toml"), "format = \"trial-bundle/1\"\nplant = \"drive\"\n")
        .unwrap();
    let of_a_drive = ["--seed", "1", "--cases", "1", "--bundle", text(&drive)];
    let why = ["rig.toml", "a drive on its own", "bundle of a catheter"];
    assert_fails(&blind_test("make", &made, &of_a_drive), 3, &why);
    // Strangers have rigs of their own.
    let both = ["--strangers", "tuning", "--bundle", text(&drive)];
    assert_fails(&blind_test("make", &made, &both), 2, &["--strangers", "--bundle"]);
    assert!(!made.exists(), "a refused blind test leaves nothing behind");
}

#[test]
fn the_protocol_is_printed_row_by_row_with_its_segments() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
    let listed = json(&["gap", "protocol", text(&example)]);
    let segments = listed["segments"].as_array().unwrap();
    let end_s = listed["duration_s"].as_f64().unwrap();
    assert_eq!(segments.last().unwrap()["end_s"], end_s);
    let output = cathforce(&["gap", "protocol", text(&example), "--rate", "20", "--to-m", "0.07"]);
    let csv = String::from_utf8(output.stdout).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("t_s,insertion_m,rotation_rad,segment"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let insertion = |row: &Vec<&str>| row[1].parse::<f64>().unwrap();
    let deepest = rows.iter().map(insertion).fold(0.0, f64::max);
    assert_eq!((deepest, rows[0][1]), (0.07, "0.0280000"));
    // Every segment of the list is there; the way is too short for one.
    let named = |name: &str| rows.iter().any(|row| row[3] == name);
    for segment in segments {
        let name = segment["name"].as_str().unwrap();
        assert_eq!(named(name), name != "reversal-60mm", "{name}");
    }
    assert!(String::from_utf8_lossy(&output.stderr).contains("reversal-60mm is left out"));
    assert_fails(&["gap", "protocol", text(&example), "--to-m", "0.02"], 2, &["cannot go", "fix:"]);
    // A negative number is a value, not an option.
    let negative = ["gap", "protocol", text(&example), "--from-m", "0.03", "--to-m", "-0.01"];
    assert_fails(&negative, 2, &["from 0.03 m to -0.01 m", "cannot go", "fix:"]);
    assert_fails(&["gap", "protocol", text(&example), "--rate", "-3"], 2, &["1 to 1000 Hz"]);
    let too_deep = ["gap", "protocol", text(&example), "--to-m", "3"];
    assert_fails(&too_deep, 2, &["farther than the instrument", "m long", "fix:"]);

    // A rig without trials does not say how deep it goes.
    let folder = tempfile::tempdir().unwrap();
    for name in ["rig.toml", "centreline.csv", "vessel.stl"] {
        std::fs::copy(example.join(name), folder.path().join(name)).unwrap();
    }
    let bare = text(folder.path());
    assert_fails(&["gap", "protocol", bare], 3, &["no trials", "--from-m"]);
    let way = ["gap", "protocol", bare, "--from-m", "0.03", "--to-m", "0.06"];
    assert_eq!(json(&way)["segments"][0]["name"], "static-zero");
}
