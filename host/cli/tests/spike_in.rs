//! Known effects put into the data of a small bundle: what changes, what is found, what is refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use serde_json::Value;

/// Rows of a trial that are kept: 2 s, in which the tip comes to slide along the wall.
const ROWS: usize = 500;

fn cathforce(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1").args(arguments).output().unwrap()
}

/// Two short trials of the example.
fn bundle() -> &'static str {
    static MADE: OnceLock<(tempfile::TempDir, String)> = OnceLock::new();
    let (_, path) = MADE.get_or_init(|| {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let folder = tempfile::tempdir().unwrap();
        for file in ["rig.toml", "vessel.stl"] {
            fs::copy(example.join(file), folder.path().join(file)).unwrap();
        }
        fs::create_dir(folder.path().join("trials")).unwrap();
        for file in ["trials/000.csv", "trials/001.csv"] {
            let whole = fs::read_to_string(example.join(file)).unwrap();
            let rows: Vec<&str> = whole.lines().take(ROWS + 1).collect();
            fs::write(folder.path().join(file), rows.join("\n") + "\n").unwrap();
        }
        let path = folder.path().to_str().unwrap().to_owned();
        (folder, path)
    });
    path
}

/// Header and rows of a trial, empty fields as `None`.
fn table(bundle: &Path) -> (Vec<String>, Vec<Vec<Option<f64>>>) {
    let text = fs::read_to_string(bundle.join("trials/001.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let field = |text: &str| (!text.is_empty()).then(|| text.parse().unwrap());
    (header, lines.map(|line| line.split(',').map(field).collect()).collect())
}

/// What an effect changes: the largest change of every column.
fn changes(effect: &str) -> Vec<(String, f64)> {
    let folder = tempfile::tempdir().unwrap();
    let out: PathBuf = folder.path().join("out");
    let output = cathforce(&[
        "gap",
        "spike-in",
        bundle(),
        "--effect",
        effect,
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(out.join("vessel.stl").is_file() && out.join("rig.toml").is_file());
    let ((names, before), (written, after)) = (table(Path::new(bundle())), table(&out));
    assert_eq!(before.len(), after.len());
    let change = |name: &String| {
        let at = |names: &[String]| names.iter().position(|other| other == name).unwrap();
        let (a, b) = (at(&names), at(&written));
        let rows = before.iter().zip(&after);
        let apart = rows.map(|(before, after)| match (before[a], after[b]) {
            (Some(before), Some(after)) => (after - before).abs(),
            (before, after) => {
                assert_eq!(before, after, "{name}: what is not measured stays so");
                0.0
            }
        });
        (name.clone(), apart.fold(0.0, f64::max))
    };
    names.iter().map(change).collect()
}

#[test]
fn an_effect_changes_the_channels_on_which_it_acts_and_no_other() {
    for (name, change) in changes("sensor.bias:x_n=0.25,y_n=0,z_n=-0.5") {
        let wanted = match name.as_str() {
            "fx_N" => 0.25,
            "fz_N" => 0.5,
            _ => 0.0,
        };
        assert!((change - wanted).abs() < 1e-9, "{name}: {change}");
    }
    // The friction that rig.toml states is no effect.
    for (name, change) in changes("contact.friction:friction_coefficient=0.3") {
        assert_eq!(change, 0.0, "{name}");
    }
    for (name, change) in changes("contact.friction:friction_coefficient=0.35") {
        match name.as_str() {
            "t_s" | "insertion_m" | "rotation_rad" => assert_eq!(change, 0.0, "{name}"),
            "fx_N" | "drive_fx_N" => assert!(change > 0.002, "{name}: {change}"),
            // Positions \[m\]: it stays in the vessel.
            _ if name.ends_with("_m") => assert!(change < 0.02, "{name}: {change}"),
            _ => {}
        }
    }
}

#[test]
fn what_is_put_in_is_found() {
    let effect = ["--effect", "sensor.bias:x_n=0.1,y_n=0,z_n=0", "--json", "--quiet"];
    let output = cathforce(&[&["gap", "spike-in", bundle()][..], &effect].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    let row = &rows[0];
    assert_eq!(row["put_in"][0]["value"], 0.1, "{row}");
    let estimate = row["put_in"][0]["estimate"]["value"].as_f64().unwrap();
    assert!((estimate - 0.1).abs() < 0.01, "{row}");
    let change = row["changes"]["force_N"].as_f64().unwrap();
    assert!((change - 0.1).abs() < 1e-9, "{row}");
    let answer = &row["answer"];
    assert_eq!((&answer["found"], &answer["named"][0]), (&true.into(), &"sensor.bias".into()));
    assert!(answer["shrink"].as_f64().unwrap() > 0.8, "{row}");
}

#[track_caller]
fn assert_refused(extra: &[&str], code: i32, words: &[&str]) {
    let output = cathforce(&[&["gap", "spike-in"][..], extra].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for word in words {
        assert!(stderr.contains(word), "`{word}` in: {stderr}");
    }
}

#[test]
fn what_cannot_be_put_in_is_refused_with_what_can() {
    let with = |effect| [bundle(), "--effect", effect];
    let both = ["did you mean `contact.friction`?", "did you mean `sensor.gain`?"];
    let both = [&both[..], &["`cathforce gap effects`"]].concat();
    assert_refused(&with("contact.fiction+sensor.gian"), 2, &both);
    let near = ["`facter`", "did you mean `factor`?"];
    assert_refused(&with("sensor.gain:facter=1.1"), 2, &near);
    assert_refused(&with("contact.friction:0.5"), 2, &["parameter=value"]);
    assert_refused(&with("contact.friction:mu=0.5"), 2, &["`mu`", "friction_coefficient"]);
    assert_refused(&with("contact.friction:friction_coefficient=x"), 2, &["no number"]);
    assert_refused(&with("contact.friction:friction_coefficient=NaN"), 2, &["from 0 to 2"]);
    assert_refused(&with("sensor.gain:factor=1+tendon.slack"), 2, &["cannot have tendon.slack"]);
    let twice = "sensor.gain:factor=1.1+sensor.gain:factor=1.2";
    assert_refused(&with(twice), 2, &["sensor.gain is put in twice"]);
    assert_refused(&[bundle(), "--out", "out"], 2, &["one --effect", "fix:"]);
}
