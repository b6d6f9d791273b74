//! `cathforce wall`, as people meet it.

#![cfg(feature = "wall")]

mod support;

use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{assert_fails, cathforce, command, example, stderr, text};

/// Presses on the wall of the example, 30 mm inside, with few elements, and gives the JSON.
fn pressed(law: &[&str], forces_n: &[&str]) -> Value {
    let mut run = command();
    run.args(["wall", "load", text(&example()), "--thickness-mm", "1", "--element-mm", "3"]);
    run.args(["--at", "30,4.5,0", "--json"]).args(law);
    forces_n.iter().for_each(|force| {
        run.args(["--force-n", force]);
    });
    let output = run.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn displacements_mm(json: &Value) -> Vec<f64> {
    let loads = json["laws"][0]["loads"].as_array().unwrap();
    loads.iter().map(|load| load["displacement_mm"].as_f64().unwrap()).collect()
}

#[test]
fn a_linear_wall_gives_way_in_proportion_and_a_softer_one_more() {
    let forces = ["0.1", "0.2"];
    let stiff = displacements_mm(&pressed(&["--law", "elastic:0.92"], &forces));
    assert!(stiff[0] > 0.01 && (stiff[1] / stiff[0] - 2.0).abs() < 1e-6, "{stiff:?}");
    let soft = displacements_mm(&pressed(&["--law", "elastic:0.46"], &forces));
    assert!((soft[0] / stiff[0] - 2.0).abs() < 1e-6, "{soft:?}");
    // E = 6 C10 where nothing changes its volume; at small loads the laws are one.
    let large = displacements_mm(&pressed(&["--law", "neo-hookean:0.0767"], &["0.001"]));
    assert!((large[0] / (0.01 * soft[0]) - 1.0).abs() < 0.03, "{large:?} {soft:?}");
}

#[test]
fn what_is_missing_or_wrong_is_named_with_its_fix() {
    let example = example();
    let load = |more: &[&str]| {
        command().args(["wall", "load", text(&example)]).args(more).output().unwrap()
    };
    let place = ["--at", "30,4.5,0", "--force-n", "0.1"];
    let without = load(&[&place[..], &["--law", "elastic:0.46"]].concat());
    assert_fails(&without, 2, &["it has no thickness", "fix:", "--thickness-mm"]);
    let thick = ["--thickness-mm", "1", "--element-mm", "3"];
    assert_fails(&load(&[&place[..], &thick].concat()), 2, &["no law is given", "fix:"]);
    let law = |law| load(&[&place[..], &thick, &["--law", law]].concat());
    assert_fails(&law("rubber:1"), 2, &["rubber"]);
    assert_fails(&law("elastic:-1"), 2, &["--law"]);
    let folder = tempfile::tempdir().unwrap();
    let fit = folder.path().join("fit.json");
    fs::write(&fit, "{}").unwrap();
    let fitted = load(&[&place[..], &thick, &["--fit", text(&fit)]].concat());
    assert_fails(&fitted, 3, &["fit.json", "it holds no fits", "cathforce material fit"]);
    let mesh = folder.path().join("wall.msh");
    fs::write(&mesh, "no mesh").unwrap();
    let broken = command()
        .args(["wall", "load", text(&mesh), "--law", "elastic:0.46"])
        .args(place)
        .output()
        .unwrap();
    assert_fails(&broken, 3, &["wall.msh"]);
}

/// The rig that `reduce` writes is one that the other commands take.
#[test]
fn a_reduction_is_a_rig_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let (rig, settings) = (folder.path().join("rig.toml"), folder.path().join("settings.toml"));
    let output = cathforce([
        "wall",
        "reduce",
        text(&example()),
        "--thickness-mm",
        "1",
        "--law",
        "neo-hookean:0.08",
        "--every-mm",
        "40",
        "--curves",
        "1",
        "--element-mm",
        "3",
        "--rig-out",
        text(&rig),
        "--settings-out",
        text(&settings),
        "--json",
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["wall_stiffness_n_per_m"].as_f64().unwrap() > 10.0, "{json}");
    assert!(json["error_at_fitted_loads"]["rms"].as_f64().unwrap() < 0.2, "{json}");
    copy(&example(), &folder.path().join("soft"));
    fs::copy(&rig, folder.path().join("soft/rig.toml")).unwrap();
    let info = cathforce(["info", text(&folder.path().join("soft"))]);
    assert!(info.status.success(), "{}", stderr(&info));
    let stiffening = fs::read_to_string(&settings).unwrap();
    assert!(stiffening.contains("hyperelastic"), "{stiffening}");
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let own = to.join(path.file_name().unwrap());
        match path.is_dir() {
            true => copy(&path, &own),
            false => drop(fs::copy(&path, &own).unwrap()),
        }
    }
}
