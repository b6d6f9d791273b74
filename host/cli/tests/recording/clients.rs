//! Independent tools read what is written: mcap with its ROS 2 decoder, cantools, python-can,
//! pandas over pyarrow, the packages that Foxglove reads recordings with, tshark.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{data, recording, text};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recording/clients")
}

/// A Python that has them, made once; `Err` says why there is none.
fn python() -> Result<PathBuf, String> {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("clients");
    let python = venv.join("bin/python");
    let has_all = "import can, cantools, mcap_ros2, pandas, pyarrow";
    let run = |program: &Path, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).output();
        let output = output.map_err(|e| format!("{}: {e}", program.display()))?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() { Ok(()) } else { Err(said) }
    };
    if run(&python, &["-c", has_all]).is_ok() {
        return Ok(python);
    }
    run(Path::new("python3"), &["-m", "venv", "--clear", text(&venv)])?;
    let requirements = folder().join("requirements.txt");
    let install = ["-m", "pip", "install", "--quiet", "--timeout", "20", "-r", text(&requirements)];
    run(&python, &install)?;
    Ok(python)
}

#[test]
fn independent_clients_read_what_is_written() {
    let python = match python() {
        Ok(python) => python,
        // Without Python or a package index there is no independent client to ask.
        Err(why) => return eprintln!("not run, the clients cannot be installed: {why}"),
    };
    let out = tempfile::tempdir().unwrap();
    let [log, table] = ["run.log", "run.parquet"].map(|name| out.path().join(name));
    data(["export", text(recording()), "--candump", text(&log), "--parquet", text(&table)]);
    let read = Command::new(python)
        .arg(folder().join("read.py"))
        .args([recording(), &log, &table])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
    let read: serde_json::Value = serde_json::from_slice(&read.stdout).unwrap();
    let ours = data(["check", text(recording()), "--no-replay"]);
    let survey = &ours["survey"];
    let (ticks, frames) = (&survey["ticks"], &survey["frames"]);

    let found = &read["recording"];
    assert_eq!(found["profile"], "ros2");
    for topic in ["/catheter/measured_js", "/operator/servo_cf", "/cathforce/status"] {
        assert_eq!(&found["topics"][topic], ticks, "{topic}");
    }
    assert_eq!(found["topics"]["/cathforce/measured"], survey["measured_rows"]);
    for id in survey["ids"].as_array().unwrap() {
        let name = id["name"].as_str().unwrap();
        if let Some(count) = found["frames"].get(name) {
            assert_eq!(count, &id["frames"], "{name}");
        }
    }
    assert_eq!(&found["frames"]["HAPTIC"], ticks);
    assert!(found["forces_compared"].as_u64().unwrap() > 3000);
    // What the topics say in single precision is what the attached DBC says.
    assert!(found["worst_force_difference_n"].as_f64().unwrap() < 1e-6, "{found}");
    let fields = serde_json::json!(["x", "y", "z", "intensity", "fx", "fy", "fz"]);
    assert_eq!(found["cloud"][0], fields);
    assert_eq!(found["cloud"][2].as_u64(), found["cloud"][1].as_u64().map(|points| 28 * points));
    for name in ["device.cfim", "lumen.bin", "rig.toml", "cathforce.dbc", "vessel.stl"] {
        assert!(found["attachments"][name].as_u64().unwrap() > 0, "{name}");
    }
    assert_eq!(found["firmware_sha256"].as_str().unwrap().len(), 64);
    assert_eq!(&read["log"]["frames"], frames);
    assert_eq!(&read["table"]["rows"], ticks);
    assert!(read["table"]["peak_n"].as_f64().unwrap() > 0.05);
}

/// A folder with what Foxglove reads recordings with, made once; `Err` says why there is none.
fn node() -> Result<PathBuf, String> {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("node");
    std::fs::create_dir_all(&place).map_err(|e| e.to_string())?;
    for name in ["package.json", "read.js"] {
        let from = folder().join("node").join(name);
        std::fs::copy(from, place.join(name)).map_err(|e| e.to_string())?;
    }
    if !place.join("node_modules/@mcap/core").is_dir() {
        let mut npm = Command::new("npm");
        npm.args(["install", "--no-audit", "--no-fund", "--silent"]).current_dir(&place);
        let output = npm.output().map_err(|e| format!("npm: {e}"))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
    }
    Ok(place)
}

#[test]
fn foxgloves_own_reader_reads_every_message() {
    let place = match node() {
        Ok(place) => place,
        // Without Node or a package index there is no independent client to ask.
        Err(why) => return eprintln!("not run, the client cannot be installed: {why}"),
    };
    let mut read = Command::new("node");
    let read = read.arg("read.js").arg(recording()).current_dir(place).output().unwrap();
    assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
    let read: serde_json::Value = serde_json::from_slice(&read.stdout).unwrap();
    let survey = &data(["check", text(recording()), "--no-replay"])["survey"];
    for topic in ["/catheter/measured_js", "/operator/servo_cf", "/cathforce/status"] {
        assert_eq!(read[topic], survey["ticks"], "{topic}: {read}");
    }
    let frames = |topic: &str| read[topic].as_u64().unwrap();
    let both = frames("/cathforce/to_can_bus") + frames("/cathforce/from_can_bus");
    assert_eq!(Some(both), survey["frames"].as_u64());
    assert!(frames("/catheter/estimated/shape") > 5, "{read}");
}

#[test]
fn tshark_reads_every_frame_of_a_log() {
    let out = tempfile::tempdir().unwrap();
    let log = out.path().join("run.log");
    data(["export", text(recording()), "--candump", text(&log)]);
    let mut tshark = Command::new("tshark");
    tshark.arg("-r").arg(&log).args(["-T", "fields", "-e", "can.id", "-e", "data.len"]);
    let Ok(read) = tshark.output() else { return eprintln!("not run, there is no tshark") };
    assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
    let read = String::from_utf8(read.stdout).unwrap();
    let survey = &data(["check", text(recording()), "--no-replay"])["survey"];
    assert_eq!(Some(read.lines().count() as u64), survey["frames"].as_u64());
    let haptic = read.lines().filter(|line| *line == "384\t8").count() as u64;
    assert_eq!(Some(haptic), survey["ticks"].as_u64());
}
