//! Files that other programs write are read as they meant them: python-can, meshio, rosbags.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::clients::{folder, not_run, python, succeeded};
use crate::{command, data, example, recording, stderr, text};

/// What the script says or writes; `None` where it cannot run.
fn script(arguments: &[&str]) -> Option<String> {
    match python() {
        Ok(python) => {
            let script = folder().join("formats.py");
            Some(succeeded(Command::new(python).arg(script).args(arguments)))
        }
        // Without Python or a package index there is no other program to ask.
        Err(why) => {
            not_run("the writers of Python", why);
            None
        }
    }
}

/// The frames of a candump log, without their times, which some formats round.
fn frames(log: &Path) -> Vec<String> {
    let log = std::fs::read_to_string(log).unwrap();
    log.lines().map(|line| line.rsplit(' ').next().unwrap().to_owned()).collect()
}

#[test]
fn logs_of_python_can_are_the_run_that_they_were_made_of() {
    let out = tempfile::tempdir().unwrap();
    let log = out.path().join("run.log");
    data(["export", text(recording()), "--candump", text(&log)]);
    if script(&["logs", text(&log), text(out.path())]).is_none() {
        return;
    }
    let (bundle, whole) = (example(), frames(&log));
    assert!(whole.len() > 1000);
    for ending in ["asc", "blf", "trc", "csv", "log"] {
        let file = out.path().join(format!("of.{ending}"));
        let [imported, again] =
            ["mcap", "again"].map(|end| file.with_extension(format!("{ending}.{end}")));
        let import = ["import", "can", text(&file), "--bundle", text(&bundle), "--cell", "3"];
        let mut import = command().args(import).args(["--out", text(&imported), "--json"]).output();
        let output = import.as_mut().unwrap();
        assert!(output.status.success(), "{ending}: {}", stderr(output));
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&said["foreign"], &said["broken"]), (&0.into(), &0.into()), "{ending}: {said}");
        data(["export", text(&imported), "--candump", text(&again)]);
        assert!(frames(&again) == whole, "{ending}: other frames than those of the run");
    }
}

#[cfg(feature = "meshes")]
#[test]
fn surfaces_of_meshio_are_the_tube_that_was_written() {
    let out = tempfile::tempdir().unwrap();
    let Some(said) = script(&["meshes", text(out.path())]) else { return };
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let names = [
        "ascii.stl",
        "binary.stl",
        "ascii.ply",
        "binary.ply",
        "ascii.vtu",
        "zlib.vtu",
        "surface.obj",
    ];
    for name in names {
        assert_tube(&out.path().join(name), &said["triangles"]);
    }
}

/// VTK writes VTP and VTU in three modes, packed by nothing, zlib or LZ4, in both orders of bytes.
#[cfg(feature = "meshes")]
#[test]
#[ignore = "VTK takes 400 MB: CATHFORCE_VTK_PYTHON names a Python that has it, and numpy"]
fn surfaces_of_vtk_are_the_tube_that_was_written() {
    let out = tempfile::tempdir().unwrap();
    let python = std::env::var_os("CATHFORCE_VTK_PYTHON").expect("CATHFORCE_VTK_PYTHON");
    let script = folder().join("formats.py");
    let said = succeeded(Command::new(python).arg(script).args(["vtk", text(out.path())]));
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let names = said["names"].as_array().unwrap();
    assert_eq!(names.len(), 48);
    for name in names {
        assert_tube(&out.path().join(name.as_str().unwrap()), &said["triangles"]);
    }
}

/// What is imported of a file is the tube of `formats.py`, as meshio reads it.
#[cfg(feature = "meshes")]
#[track_caller]
fn assert_tube(file: &Path, triangles: &serde_json::Value) {
    let name = text(file);
    let stl = PathBuf::from(format!("{name}.out.stl"));
    let output = command().args(["import", "mesh", name, "--out", text(&stl)]).output().unwrap();
    assert!(output.status.success(), "{name}: {}", stderr(&output));
    assert!(!stderr(&output).contains("warning"), "{name}: {}", stderr(&output));
    let read = script(&["read", text(&stl)]).expect("meshio reads it");
    let read: serde_json::Value = serde_json::from_str(&read).unwrap();
    assert_eq!(&read["triangles"], triangles, "{name}");
    let near =
        |found: &serde_json::Value, wanted: f64| (found.as_f64().unwrap() - wanted).abs() < 1e-3;
    assert!(near(&read["high"][0], 40.0) && near(&read["low"][2], -3.0), "{name}: {read}");
    // 24 flat sides between two rims of a polygon.
    let side = 2.0 * 3.0 * (std::f64::consts::PI / 24.0).sin();
    assert!(near(&read["area"], 24.0 * 40.0 * side), "{name}: {read}");
}
