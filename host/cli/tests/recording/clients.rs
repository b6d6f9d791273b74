//! Independent tools read what is written: mcap with its ROS 2 decoder, cantools, python-can,
//! pandas over pyarrow, rerun's converter, the packages that Foxglove reads recordings and layouts
//! with, tshark.

use std::fmt::Display;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::{command, data, recording, stderr, text};

pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recording/clients")
}

/// Says that a client is not there to be asked, past the test runner, which shows what a test
/// prints only when it fails.
pub fn not_run(client: &str, why: impl Display) {
    let line = format!("\nNOT RUN: {client}: {why}\n");
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

/// A Python that has them; `Err` says why there is none.
pub fn python() -> Result<&'static Path, &'static str> {
    static PYTHON: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    PYTHON.get_or_init(installed).as_deref().map_err(String::as_str)
}

/// Made once for all tests, which may be processes side by side: one of them makes it, the others
/// wait, since an installation that is under way has some of the packages and not yet the others.
fn installed() -> Result<PathBuf, String> {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("clients");
    let guard = File::create(venv.with_extension("lock")).map_err(|e| e.to_string())?;
    guard.lock().map_err(|e| e.to_string())?;
    let python = venv.join("bin/python");
    let requirements = folder().join("requirements.txt");
    let wanted = std::fs::read_to_string(&requirements).map_err(|e| e.to_string())?;
    // Written last: an installation that broke off is begun anew.
    let done = venv.join("installed.txt");
    if std::fs::read_to_string(&done).is_ok_and(|text| text == wanted) {
        return Ok(python);
    }
    let run = |program: &Path, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).output();
        let output = output.map_err(|e| format!("{}: {e}", program.display()))?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() { Ok(()) } else { Err(said) }
    };
    run(Path::new("python3"), &["-m", "venv", "--clear", text(&venv)])?;
    let install = ["-m", "pip", "install", "--quiet", "--timeout", "20", "-r", text(&requirements)];
    run(&python, &install)?;
    std::fs::write(done, wanted).map_err(|e| e.to_string())?;
    Ok(python)
}

#[test]
fn independent_clients_read_what_is_written() {
    let python = match python() {
        Ok(python) => python,
        // Without Python or a package index there is no independent client to ask.
        Err(why) => return not_run("Python's readers", why),
    };
    let out = tempfile::tempdir().unwrap();
    let [log, table] = ["run.log", "run.parquet"].map(|name| out.path().join(name));
    data(["export", text(recording()), "--candump", text(&log), "--parquet", text(&table)]);
    let csv = out.path().join("run.csv");
    data(["export", text(recording()), "--csv", text(&csv)]);
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
    let csv = std::fs::read_to_string(csv).unwrap();
    let heading = csv.lines().next().unwrap().split(',').collect::<Vec<_>>();
    assert_eq!(read["table"]["columns"], serde_json::json!(heading), "CSV and Parquet agree");
    assert!(read["table"]["peak_n"].as_f64().unwrap() > 0.05);
}

/// Bags of rosbags in every packing, with messages of both orders of bytes, become the same trial.
#[test]
fn a_bag_of_another_robot_becomes_a_trial() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return not_run("rosbags", why),
    };
    let out = tempfile::tempdir().unwrap();
    succeeded(Command::new(python).arg(folder().join("ros.py")).arg(out.path()));
    let names = ["sqlite", "mcap", "packed", "storage", "file"];
    let trials = names.map(|name| {
        let [bag, trial] = ["", ".csv"].map(|end| out.path().join(format!("{name}{end}")));
        let import = ["import", "ros", text(&bag), "--out", text(&trial)];
        let columns = [
            "--column=insertion_m=/joint_states:feed.motor*1+0.02",
            "--column=rotation_rad=/joint_states:roll_joint",
            "--column=drive_fx_N=/joint_states:feed.motor.effort",
            "--force=/ft_sensor/wrench",
            "--tip=/tf:catheter_tip",
            "--lead=5",
            "--axes=+y,-x,+z",
        ];
        let output = command().args(import).args(columns).output().unwrap();
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        let said = stderr(&output);
        assert!(said.contains("801 messages over 4.000 s, 200.0 Hz, in ft_link"), "{said}");
        assert!(said.contains("timed by its stamps, 3.0 ms before the recorder"), "{said}");
        std::fs::read_to_string(trial).unwrap()
    });
    assert!(trials.iter().all(|trial| *trial == trials[0]));
    // What the script says that the robot did.
    let mut lines = trials[0].lines();
    let heading = "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,drive_fx_N,tip_x_m,tip_y_m,tip_z_m";
    assert_eq!(lines.next(), Some(heading));
    let mut counts = [0; 3];
    for line in lines {
        let fields = line.split(',').map(|field| field.parse().ok()).collect::<Vec<Option<f64>>>();
        let t_s = fields[0].unwrap();
        let near = |at: usize, expected: f64| {
            if let Some(found) = fields[at] {
                assert!((found - expected).abs() < 1e-9, "{heading}: {line}");
            }
            usize::from(fields[at].is_some())
        };
        assert_eq!(near(1, 0.02 + 0.005 * t_s) + near(2, 0.5 * t_s), 2, "{line}");
        let force = near(3, -0.2) + near(4, -0.1) + near(5, 0.3 + 0.2 * (t_s - 0.002));
        let tip = near(7, 0.025 * t_s) + near(8, 0.002) + near(9, -0.003);
        for (count, own) in counts.iter_mut().zip([force / 3, near(6, 1.5), tip / 3]) {
            *count += own;
        }
    }
    // The last of the 801 forces is measured after the drives' last message.
    assert_eq!(counts, [800, 401, 101]);
}

pub fn succeeded(command: &mut Command) -> String {
    let output = command.env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

#[test]
fn rerun_converts_every_topic() {
    let rerun = match python() {
        Ok(python) => python.with_file_name("rerun"),
        Err(why) => return not_run("rerun", why),
    };
    let out = tempfile::tempdir().unwrap();
    let converted = out.path().join("run.rrd");
    let convert = ["mcap", "convert", text(recording()), "-o", text(&converted)];
    succeeded(Command::new(&rerun).args(convert));
    succeeded(Command::new(&rerun).args(["rrd", "verify", text(&converted)]));
    let printed = succeeded(Command::new(&rerun).args(["rrd", "print", text(&converted)]));
    for topic in [
        "/cathforce/from_can_bus",
        "/cathforce/measured",
        "/cathforce/status",
        "/cathforce/to_can_bus",
        "/catheter/estimated/measured_js",
        "/catheter/estimated/shape",
        "/catheter/estimated/spatial/measured_cf",
        "/catheter/measured_js",
        "/catheter/operating_state",
        "/operator/servo_cf",
        "/phantom/spatial/measured_cf",
        "/tf_static",
    ] {
        assert!(printed.contains(topic), "{topic} in {printed}");
    }
}

/// Its panels' settings are those that Foxglove's own SDK knows, its paths lead to numbers.
#[test]
fn foxgloves_own_sdk_knows_the_layout() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return not_run("Foxglove's SDK", why),
    };
    let slips =
        [("\"showLegend\"", "\"legend\""), ("\"floating\"", "\"flying\""), ("force.x", "force.w")];
    let found = checked_layout(python, "layout.py", "foxglove.json", &slips);
    assert!(found["paths"].as_u64().unwrap() >= 10, "{found}");
}

/// Its elements are those that PlotJuggler's loader takes, and every curve is a series of the
/// recording under the name that PlotJuggler's ROS parser gives it.
#[test]
fn plotjugglers_layout_is_one_that_its_loader_takes() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return not_run("PlotJuggler's layout", why),
    };
    let slips = [
        ("</plot>", ""),
        ("sizes=\"0.1667;", "sizes=\""),
        ("style=\"Lines\"", "style=\"Line\""),
        ("<DockArea", "<Dock"),
        ("index=\"0\"", "index=\"1\""),
        ("insertion/effort", "insertion/velocity"),
        ("force/x", "force/w"),
    ];
    let found = checked_layout(python, "plotjuggler.py", "plotjuggler.xml", &slips);
    assert_eq!(found, serde_json::json!({ "plots": 6, "curves": 11 }));
}

/// What `script` finds in a layout that is shipped and the recording; `slips` are words of the
/// layout with others that it must refuse.
fn checked_layout(
    python: &Path,
    script: &str,
    layout: &str,
    slips: &[(&str, &str)],
) -> serde_json::Value {
    let layouts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/layouts");
    let text = std::fs::read_to_string(layouts.join(layout)).unwrap();
    let place = tempfile::tempdir().unwrap();
    let check = |text: &str| {
        let path = place.path().join(layout);
        std::fs::write(&path, text).unwrap();
        let mut check = Command::new(python);
        check.arg(folder().join(script)).args([&path, recording()]);
        check.env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap()
    };
    let checked = check(&text);
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    // It would have seen a slip.
    for (right, wrong) in slips {
        assert!(text.contains(right), "{right}");
        assert!(!check(&text.replacen(right, wrong, 1)).status.success(), "{wrong}");
    }
    serde_json::from_slice(&checked.stdout).unwrap()
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
        Err(why) => return not_run("Foxglove's reader", why),
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
    let read = match tshark.output() {
        Ok(read) => read,
        Err(why) => return not_run("tshark", why),
    };
    assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
    let read = String::from_utf8(read.stdout).unwrap();
    let survey = &data(["check", text(recording()), "--no-replay"])["survey"];
    assert_eq!(Some(read.lines().count() as u64), survey["frames"].as_u64());
    let haptic = read.lines().filter(|line| *line == "384\t8").count() as u64;
    assert_eq!(Some(haptic), survey["ticks"].as_u64());
}
