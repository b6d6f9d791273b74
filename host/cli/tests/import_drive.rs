//! Logs of drives on the command line: a bundle is made, added to, or nothing is written.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn cathforce(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.current_dir(folder).env("NO_COLOR", "1").args(arguments).output().unwrap()
}

#[track_caller]
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = cathforce(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    String::from_utf8_lossy(&output.stdout).into_owned() + &said
}

#[track_caller]
fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = cathforce(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|own| own.unwrap().file_name());
    let mut names: Vec<String> = entries.map(|own| own.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Position, speed and acceleration of two swings.
fn swing(t_s: f64) -> [f64; 3] {
    let wave = |size: f64, hz: f64| {
        let w = std::f64::consts::TAU * hz;
        let (sin, cos) = (w * t_s).sin_cos();
        [size * sin, size * w * cos, -size * w * w * sin]
    };
    let (a, b) = (wave(1.0, 0.4), wave(0.2, 1.3));
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// A linear axis of 2 kg with 3 N and 10 N·s/m: metres over 20, in millimetres and decimal commas.
fn lab() -> String {
    let mut text = String::from("Zeit;Pos [mm];Kraft\n");
    for k in 0..3000 {
        let t_s = f64::from(k) * 0.004;
        let [x, v, a] = swing(t_s).map(|own| own / 20.0);
        let force = 2.0 * a + 3.0 * (v / 1e-3).tanh() + 10.0 * v;
        writeln!(
            text,
            "{}",
            format!("{:.1};{:.6};{force:.4}", 1e3 * t_s, 1e3 * x).replace('.', ",")
        )
        .unwrap();
    }
    text
}

#[test]
fn a_table_becomes_a_bundle_that_is_diagnosed_and_a_second_one_is_added() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("lab.csv"), lab()).unwrap();
    let columns = ["--time", "Zeit:ms", "--position", "Pos [mm]", "--command", "Kraft:N"];
    let import = |more: &[&'static str]| {
        [&["import", "drive", "lab.csv", "--bundle", "axis"][..], &columns, more].concat()
    };
    let said = done(path, &import(&["--mass", "2", "--dry-run"]));
    for word in [
        "position from `Pos [mm]` in mm",
        "3000 rows over 11.996 s, 250 a second",
        "moving_mass_kg = 2.0",
        "nothing is written",
    ] {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
    assert_eq!(files(path), ["lab.csv"]);
    refused(path, &import(&[]), &["--mass"]);
    refused(
        path,
        &[
            "import",
            "drive",
            "lab.csv",
            "--bundle",
            "axis",
            "--mass",
            "2",
            "--time",
            "Zeit:ms",
            "--position",
            "Pos:mm",
            "--command",
            "Kraft:N",
        ],
        &["lab.csv:1", "--position \"Pos [mm]\""],
    );
    refused(
        path,
        &[
            "import",
            "drive",
            "lab.csv",
            "--bundle",
            "axis",
            "--mass",
            "2",
            "--time",
            "Zeit:mm",
            "--position",
            "Pos [mm]",
            "--command",
            "Kraft:N",
        ],
        &["mm is the unit of a position"],
    );
    refused(
        path,
        &[
            "import",
            "drive",
            "lab.csv",
            "--bundle",
            "axis",
            "--inertia",
            "2",
            "--time",
            "Zeit:ms",
            "--position",
            "Pos [mm]:deg",
            "--command",
            "Kraft:N",
        ],
        &["of a linear axis"],
    );
    assert_eq!(files(path), ["lab.csv"]);
    done(path, &import(&["--mass", "2"]));
    let answer = done(path, &["gap", "diagnose", "axis", "--quiet"]);
    assert!(answer.contains("drive.coulomb") && answer.contains("drive.viscous"), "{answer}");
    // A bundle that is there states its own rig.
    refused(path, &import(&["--mass", "3"]), &["leave out --mass"]);
    done(path, &import(&[]));
    assert_eq!(files(&path.join("axis/trials")), ["000.csv", "001.csv"]);
    let cable = "format = \"trial-bundle/1\"\nname = \"x\"\nplant = \"transmission\"\n[transmission]\ngain_m_per_m = 1.0\n";
    fs::create_dir(path.join("cable")).unwrap();
    fs::write(path.join("cable/rig.toml"), cable).unwrap();
    let into = |bundle: &'static str| {
        [&["import", "drive", "lab.csv", "--bundle", bundle][..], &columns].concat()
    };
    refused(path, &into("cable"), &["no bundle of a drive"]);
}

#[test]
fn logs_of_servos_and_controllers_become_bundles_with_one_command_each() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (mut bam, mut odrive, mut moteus, mut bus) = (
        Vec::new(),
        String::from("time,axis0.pos_estimate,axis0.motor.foc.Iq_measured\n"),
        String::new(),
        String::new(),
    );
    for k in 0..2000 {
        let t_s = f64::from(k) * 0.005;
        let [q, v, a] = swing(t_s);
        // A pendulum of 0.5 kg at 0.1 m with an armature of 0.005 kg·m², 1.6 N·m/A and 2 Ω; dry friction of 0.15 N·m.
        let torque = 0.01 * a + 0.5 * 9.80665 * 0.1 * q.sin() + 0.15 * (v / 0.02).tanh();
        let volts = torque * 2.0 / 1.6 + 1.6 * v;
        bam.push(format!(
            "{{\"position\": {q:.6}, \"speed\": {v}, \"load\": {}, \"input_volts\": 12.0, \"temp\": 40, \"timestamp\": {t_s}, \
             \"goal_position\": {q}, \"torque_enable\": true}}",
            volts / 12.0 * 1000.0
        ));
        let amperes = (0.002 * a + 0.02 * (v / 0.02).tanh()) / 0.04;
        let turns = q / std::f64::consts::TAU;
        writeln!(odrive, "{t_s},{turns:.8},{amperes:.5}").unwrap();
        writeln!(
            moteus,
            "{{\"time\": {t_s}, \"position\": {turns:.8}, \"velocity\": 0.0, \"torque\": {:.6}}}",
            amperes * 0.04
        )
        .unwrap();
        let bytes = |x: f64| {
            (x as f32).to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect::<String>()
        };
        writeln!(bus, "({:.6}) can0 009#{}00000000", 1.7e9 + t_s, bytes(turns)).unwrap();
        writeln!(bus, "({:.6}) can0 014#00000000{}", 1.7e9 + t_s + 0.0001, bytes(amperes)).unwrap();
    }
    let bam = format!(
        "{{\"mass\": 0.5, \"length\": 0.1, \"kp\": 32, \"vin\": 12.0, \"motor\": \"mx106\", \"entries\": [{}]}}",
        bam.join(",")
    );
    for (name, text) in [
        ("servo.json", &bam),
        ("odrive.csv", &odrive),
        ("moteus.jsonl", &moteus),
        ("bus.log", &bus),
    ] {
        fs::write(path.join(name), text).unwrap();
    }
    done(
        path,
        &[
            "import",
            "dynamixel",
            "servo.json",
            "--bundle",
            "servo",
            "--torque-constant",
            "1.6",
            "--resistance",
            "2",
            "--armature",
            "0.005",
        ],
    );
    let rig = fs::read_to_string(path.join("servo/rig.toml")).unwrap();
    assert!(rig.contains("mass_kg = 0.5") && rig.contains("resistance_ohm = 2.0"), "{rig}");
    refused(
        path,
        &["import", "dynamixel", "servo.json", "--bundle", "other", "--torque-constant", "1.6"],
        &["--resistance"],
    );
    let own = ["--inertia", "0.002", "--torque-constant", "0.04"];
    done(path, &[&["import", "odrive", "odrive.csv", "--bundle", "odrive"][..], &own].concat());
    done(path, &[&["import", "odrive", "bus.log", "--bundle", "bus"][..], &own].concat());
    done(path, &["import", "moteus", "moteus.jsonl", "--bundle", "moteus", "--inertia", "0.002"]);
    refused(
        path,
        &["import", "moteus", "servo.json", "--bundle", "other", "--inertia", "1"],
        &["servo.json"],
    );
    assert!(!path.join("other").exists(), "nothing is written when an import fails");
    for bundle in ["servo", "odrive", "bus", "moteus"] {
        let answer = done(path, &["gap", "diagnose", bundle, "--quiet"]);
        assert!(answer.contains("drive.coulomb"), "{bundle}: {answer}");
    }
}

/// The table that is written compensates for the template's slack, and nothing else is inverted.
#[test]
fn a_transmission_is_made_diagnosed_and_compensated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    done(path, &["bundle", "init", "cable", "--plant", "transmission"]);
    let answer = done(path, &["gap", "diagnose", "cable", "--quiet", "--out", "answer.json"]);
    assert!(
        answer.contains("transmission.gain") && answer.contains("transmission.dead_zone"),
        "{answer}"
    );
    let said = done(
        path,
        &[
            "gap",
            "compensate",
            "cable",
            "--diagnosis",
            "answer.json",
            "--rows",
            "11",
            "--csv",
            "table.csv",
        ],
    );
    assert!(said.contains("compensates transmission.dead_zone"), "{said}");
    let table = fs::read_to_string(path.join("table.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("output_m,input_rising_m,input_falling_m"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 11);
    for row in &rows {
        // 0.97 times the input, less or more half of 0.4 mm.
        assert!((row[1] - (row[0] / 0.97 + 2e-4)).abs() < 2e-5, "{row:?}");
        assert!((row[2] - (row[0] / 0.97 - 2e-4)).abs() < 2e-5, "{row:?}");
    }
    fs::write(path.join("path.csv"), "t_s,output_m\n0,0\n0.1,0.001\n0.2,0.0\n").unwrap();
    let rows = done(
        path,
        &["gap", "compensate", "cable", "--diagnosis", "answer.json", "--along", "path.csv"],
    );
    assert!(rows.starts_with("t_s,output_m,input_m\n0,0,0.00019"), "{rows}");
    fs::write(path.join("far.csv"), "t_s,output_m\n0,0\n0.1,1.0\n").unwrap();
    refused(
        path,
        &["gap", "compensate", "cable", "--diagnosis", "answer.json", "--along", "far.csv"],
        &["row 2", "keep it between"],
    );
    done(path, &["bundle", "init", "axis", "--plant", "drive"]);
    refused(path, &["gap", "compensate", "axis"], &["only a transmission is inverted"]);
    refused(
        path,
        &["gap", "apply", "cable", "--diagnosis", "answer.json", "--dry-run"],
        &["is of a transmission", "gap compensate"],
    );
}

/// Bags of both storages hold the same joint.
#[test]
fn a_joint_of_a_bag_becomes_a_trial() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let bag = |storage: &str| {
        format!("{}/../../fuzz/seeds/bag/rosbags.{storage}", env!("CARGO_MANIFEST_DIR"))
    };
    let joint = |storage: &str, name: &str| {
        let words = ["import", "joint", &bag(storage), "--joint", name, "--bundle", storage];
        words.map(str::to_owned)
    };
    for storage in ["db3", "mcap"] {
        let words = joint(storage, "feed.motor");
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        refused(here, &words, &["the inertia is not known", "--inertia"]);
        let other = joint(storage, "feed.moto");
        let other: Vec<&str> = other.iter().map(String::as_str).collect();
        let inertia = ["--inertia", "0.01"];
        let missing = ["there is no `feed.moto.position`", "feed.motor"];
        refused(here, &[&other[..], &inertia].concat(), &missing);
        assert!(!here.join(storage).exists(), "nothing is written");
        let said = done(here, &[&words[..], &inertia].concat());
        assert!(said.contains("13 messages over 0.120 s"), "{said}");
    }
    let trial = |storage| fs::read_to_string(here.join(storage).join("trials/000.csv")).unwrap();
    assert_eq!(trial("db3"), trial("mcap"));
    assert!(trial("db3").starts_with("t_s,position_rad,drive_command_Nm\n0,0,1.5\n"));
    // A joint that slides has a mass, and what is added to its bundle slides too.
    let bag = bag("mcap");
    let slides = ["import", "joint", &bag, "--joint", "feed.motor", "--bundle", "slide"];
    done(here, &[&slides[..], &["--mass", "2.5"]].concat());
    done(here, &slides);
    let rig = fs::read_to_string(here.join("slide/rig.toml")).unwrap();
    assert!(rig.contains("moving_mass_kg = 2.5"), "{rig}");
    for number in ["000", "001"] {
        let trial = fs::read_to_string(here.join(format!("slide/trials/{number}.csv"))).unwrap();
        assert!(trial.starts_with("t_s,position_m,drive_command_N\n0,0,1.5\n"), "{trial}");
    }
}

#[test]
fn a_mass_of_a_rotary_axis_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let rows = (0..200).map(|n| format!("{},{},1\n", n as f64 * 1e-3, n as f64 * 1e-2));
    fs::write(folder.path().join("log.csv"), "t_s,q,u\n".to_owned() + &rows.collect::<String>())
        .unwrap();
    let words =
        ["import", "drive", "log.csv", "--time", "t_s", "--position", "q:rad", "--command", "u:Nm"];
    let into = ["--bundle", "axis", "--mass", "2.0"];
    refused(
        folder.path(),
        &[&words[..], &into].concat(),
        &["--mass is of a linear axis", "--inertia"],
    );
    assert!(!folder.path().join("axis").exists(), "nothing is written");
}
