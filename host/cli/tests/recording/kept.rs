//! What somebody measured is not lost to a slip of a name.

use std::fs;
use std::path::Path;

use cathforce_bundle::Bundle;

use crate::{assert_fails, cathforce, command, data, example, recording, stderr, text};

const ROBOT: &str =
    "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N\n0,0.03,0,0.1,0,0\n0.2,0.04,0,0.2,0,0\n";

#[test]
fn no_output_takes_the_place_of_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let measured = [
        ("robot.csv", ROBOT),
        ("rig.toml", "format = \"trial-bundle/1\"\nname = \"a\"\n"),
        ("S.toml", "rig = \"tapered-bifurcation\"\n[set]\nforce_gain = 2\n"),
        ("notes.md", "# What was done\n"),
    ];
    for (name, contents) in measured {
        fs::write(at(name), contents).unwrap();
    }
    let (bundle, recording) = (example(), recording());
    let (bundle, recording) = (text(&bundle), text(recording));
    for (name, contents) in measured {
        let path = at(name);
        let out = text(&path);
        let mut commands = vec![
            vec!["gap", "diagnose", bundle, "--json", out],
            vec!["gap", "diagnose", bundle, "--report", out],
            vec!["report", recording, "--out", out],
            vec!["simulate", bundle, "--summary", out],
            vec!["simulate", bundle, "--out", out, "--overwrite"],
            vec!["config", "image", bundle, "--out", out],
            vec!["lumen", bundle, "--cell", "3", "--out", out],
            vec!["gap", "protocol", bundle, "--csv", out],
            vec!["export", recording, "--csv", out, "--overwrite"],
            vec!["export", recording, "--nodes", out, "--overwrite"],
            vec!["export", recording, "--parquet", out, "--overwrite"],
            vec!["export", recording, "--candump", out, "--overwrite"],
        ];
        if name != "S.toml" {
            commands.push(vec!["gap", "apply", bundle, "--diagnosis", "D.json", "--settings", out]);
        }
        for arguments in commands {
            let output = command().args(&arguments).output().unwrap();
            assert_fails(&output, 2, &[name, "stays as it is", "fix:"]);
            assert_eq!(fs::read_to_string(&path).unwrap(), contents, "{arguments:?}");
        }
    }
}

#[test]
fn what_can_be_made_again_takes_its_own_place_and_an_empty_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [page, table] = ["run.html", "ticks.csv"].map(at);
    fs::write(&page, "").unwrap();
    for _ in 0..2 {
        data(["report", text(recording()), "--out", text(&page)]);
        data(["export", text(recording()), "--csv", text(&table), "--overwrite"]);
    }
    let from = fs::read(example().join("vessel.stl")).unwrap();
    let [mesh, lumen] = ["vessel.stl", "lumen.bin"].map(at);
    fs::write(&mesh, &from).unwrap();
    for _ in 0..2 {
        data(["lumen", text(&mesh), "--cell", "3", "--out", text(&lumen)]);
    }
    let onto_itself = cathforce(["lumen", text(&mesh), "--cell", "3", "--out", text(&mesh)]);
    assert_fails(&onto_itself, 2, &["vessel.stl is not a lumen and stays"]);
    assert!(fs::read(&mesh).unwrap() == from);
}

#[test]
fn two_outputs_of_one_name_are_refused_however_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = example();
    let (bundle, recording) = (text(&bundle), text(recording()));
    for arguments in [
        vec!["simulate", bundle, "--out", "a", "--summary", "./a"],
        vec!["gap", "diagnose", bundle, "--json", "a", "--report", "a"],
        vec!["export", recording, "--csv", "a", "--nodes", "./a"],
        vec!["export", recording, "--csv", "-", "--candump", "-"],
        vec!["export", recording, "--csv", "a", "--bundle", "a"],
    ] {
        let output = command().args(&arguments).current_dir(&folder).output().unwrap();
        assert_fails(&output, 2, &["is named twice", "fix:"]);
        assert_eq!(output.stdout, b"", "{arguments:?}");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0, "{arguments:?}");
    }
}

#[test]
fn an_export_that_cannot_be_whole_does_not_begin() {
    let folder = tempfile::tempdir().unwrap();
    let [csv, nodes, bundle] =
        ["a.csv", "no/x.csv", "no/bundle"].map(|name| folder.path().join(name));
    for other in [["--nodes", text(&nodes)], ["--bundle", text(&bundle)]] {
        let export = ["export", text(recording()), "--csv", text(&csv), other[0], other[1]];
        assert_fails(&cathforce(export), 1, &["no/", "No such file", "check the folder"]);
        assert!(!csv.exists(), "{other:?}");
    }
}

/// Of an imported log nobody knows what the sensors said.
#[test]
fn a_recording_without_a_trial_is_a_bundle_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [log, imported, out] = ["run.log", "run.mcap", "bundle"].map(at);
    data(["export", text(recording()), "--candump", text(&log)]);
    let bundle = example();
    let from = ["import", "candump", text(&log), "--bundle", text(&bundle), "--out"];
    assert!(command().args(from).arg(&imported).output().unwrap().status.success());
    let exported = cathforce(["export", text(&imported), "--bundle", text(&out)]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    assert!(stderr(&exported).contains("no trial was measured"), "{}", stderr(&exported));
    let back = Bundle::open(Path::new(&out)).unwrap();
    assert!(back.trials.is_empty() && back.mesh.is_some());
}
