//! `cathforce filter` on tables, bundles and recordings.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{assert_fails, command, example, stderr, text};

fn filter(arguments: &[&str]) -> std::process::Output {
    command().arg("filter").args(arguments).output().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = filter(&[arguments, &["--json", "--quiet"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A trial of 1 s at 250 Hz with a spike in fx_N and a tip in every tenth row.
fn table(folder: &Path) -> std::path::PathBuf {
    let row = |i: usize| {
        let spike = if i == 100 { 2.0 } else { 0.0 };
        let noise = 0.002 * (((i * i * 7919 + i * 104_729) % 1009) as f64 / 504.0 - 1.0);
        let tip =
            if i.is_multiple_of(10) { format!("{:.5}", 1e-4 * i as f64) } else { String::new() };
        format!("{:.3},0.030,0.0,{:.6},{tip}\n", 0.004 * i as f64, 0.2 + noise + spike)
    };
    let rows: String = (0..250).map(row).collect();
    let path = folder.join("measured.csv");
    fs::write(&path, "t_s,insertion_m,rotation_rad,fx_N,tip_x_m\n".to_owned() + &rows).unwrap();
    path
}

#[test]
fn a_table_is_written_beside_with_what_was_done() {
    let folder = tempfile::tempdir().unwrap();
    let path = table(folder.path());
    let dry = json(&[text(&path), "--dry-run"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a dry run writes nothing");
    let done = json(&[text(&path)]);
    assert_eq!(dry["tables"], done["tables"]);
    let columns = done["tables"][0]["columns"].as_array().unwrap();
    let [force, tip] = &columns[..] else { panic!("encoders are not filtered: {done}") };
    assert_eq!(force["name"], "fx_N");
    // The spike, and where the noise of a few neighbours happens to be small, one of them.
    assert!((1..=5).contains(&force["outliers_replaced"].as_u64().unwrap()), "{force}");
    let noise = |name: &str| force[name].as_f64().unwrap();
    assert!(noise("noise_after") < 0.5 * noise("noise_before"), "{force}");
    assert_eq!((&tip["values"], &tip["delay_s"]), (&25.into(), &0.0.into()));

    let out = folder.path().join("measured-filtered.csv");
    let filtered = fs::read_to_string(&out).unwrap();
    let row = filtered.lines().nth(101).unwrap().split(',').collect::<Vec<_>>();
    assert_eq!(row[..3], ["0.400", "0.030", "0.0"]);
    assert!((row[3].parse::<f64>().unwrap() - 0.2).abs() < 1e-3, "{row:?}");
    let said: Value = serde_json::from_slice(
        &fs::read(folder.path().join("measured-filtered.filter.json")).unwrap(),
    )
    .unwrap();
    assert_eq!(said, done);
    assert_fails(&filter(&[text(&path)]), 2, &["exists already", "fix: "]);

    let late = json(&[text(&path), "--causal", "--dry-run"]);
    let delay = |name: &str| late["tables"][0]["columns"][0][name].as_f64().unwrap();
    assert!((delay("delay_s") - 0.008).abs() < 1e-9 && delay("delay_at_most_s") > 0.02, "{late}");
}

#[test]
fn what_is_wrong_with_a_table_is_said_with_its_line_and_its_fix() {
    let folder = tempfile::tempdir().unwrap();
    let path = table(folder.path());
    let good = fs::read_to_string(&path).unwrap();
    let fails = |arguments: &[&str], code: i32, words: &[&str]| {
        assert_fails(&filter(&[&[text(&path)][..], arguments].concat()), code, words);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is half written");
    };
    fails(&["--column", "fx_n"], 3, &["measured.csv:1: there is no column `fx_n`", "`fx_N`"]);
    fails(&["--time", "time_s"], 3, &["no column `time_s`", "fix: "]);
    fs::write(&path, good.replacen("0.012,0.030", "0.0135,0.030", 1)).unwrap();
    fails(&[], 3, &["measured.csv:5: ", "not equally far apart", "resample"]);
    let gap: String = good
        .lines()
        .enumerate()
        .filter(|(i, _)| !(50..80).contains(i))
        .map(|(_, line)| line.to_owned() + "\n")
        .collect();
    fs::write(&path, &gap).unwrap();
    fails(&[], 3, &["measured.csv:51: ", "no value for 0.1240 s", "--split-at-gaps"]);
    let apart = json(&[text(&path), "--split-at-gaps", "--dry-run", "--column", "fx_N"]);
    assert_eq!(apart["tables"][0]["columns"][0]["stretches"], 2);
    fs::write(&path, good.replacen("0.012,0.030,0.0,0.", "0.012,0.030,0.0,nan0.", 1)).unwrap();
    fails(&[], 3, &["measured.csv:5: ", "in column `fx_N` is not a number"]);
    fs::write(&path, "t_s,force\n0,1\n").unwrap();
    fails(&[], 2, &["no column has the name of a measured one", "there are t_s, force"]);
}

#[test]
fn a_bundle_is_filtered_into_one_that_opens() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("smooth");
    let source = example().with_file_name("sticky-bend");
    let done = json(&[text(&source), "--out", text(&out)]);
    assert_eq!(done["tables"].as_array().unwrap().len(), 3);
    let names = |k: usize| done["tables"][0]["columns"][k]["name"].as_str().unwrap();
    assert_eq!([names(0), names(3), names(6)], ["fx_N", "drive_fx_N", "tip_z_m"]);
    let info = command().args(["info", text(&out), "--json"]).output().unwrap();
    assert!(info.status.success(), "{}", stderr(&info));
    assert!(fs::read_to_string(out.join("README.md")).unwrap().contains("**Filtered**"));
    assert!(out.join("filter.json").is_file());
    assert_fails(&filter(&[text(&source), "--out", text(&out)]), 2, &["not empty"]);
    let wrong = filter(&[text(&source), "--column", "fx", "--dry-run"]);
    assert_fails(&wrong, 3, &["no trial has a column `fx`", "did you mean `fx_N`?"]);
}
