//! Files that a lab brings: read right, or refused with the reason.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use support::{assert_fails, cathforce, command, stderr, text};

/// A motion of 4 s at 100 Hz.
fn motion(folder: &Path) -> PathBuf {
    let path = folder.join("motion.csv");
    let row = |k: u32| format!("{:.2},{},0\n", 0.01 * f64::from(k), 0.03 + 1e-5 * f64::from(k));
    let rows = (0..=400).map(row).collect::<String>();
    fs::write(&path, format!("t_s,insertion_m,rotation_rad\n{rows}")).unwrap();
    path
}

/// The rows of an imported trial that have a force: time and x.
fn forces(path: &Path) -> Vec<(f64, f64)> {
    let table = fs::read_to_string(path).unwrap();
    let at = table.lines().next().unwrap().split(',').position(|name| name == "fx_N").unwrap();
    let row = |line: &str| {
        let fields = line.split(',').collect::<Vec<_>>();
        Some((fields[0].parse().ok()?, fields[at].parse().ok()?))
    };
    table.lines().skip(1).filter_map(row).collect()
}

/// A log as the program of the sensor's maker writes it: quoted, with a date, in pounds, with lost packets
/// and rows in error.
#[test]
fn a_force_log_is_read_by_its_own_words() {
    let folder = tempfile::tempdir().unwrap();
    let [log, out] = ["force.csv", "001.csv"].map(|name| folder.path().join(name));
    let motion = motion(folder.path());
    let date = "\"Nov 27, 2026 10:15:02 AM\"";
    let row = |status: &str, packet: u32| {
        format!(
            "\"{status}\",\"{packet}\",\"{}\",\"2000000\",\"0\",\"0\",\"0\",\"0\",\"0\",{date}\n",
            70 * packet
        )
    };
    let rows = [row("0x0", 1), row("0x0", 2), row("0x80000004", 3), row("0x0", 103)].concat();
    let log_text = format!(
        "Start Time: 11/27/26 10:15 AM\nRDT Sample Rate: 50\nForce Units: lbf\nCounts per Unit Force: 1000000.0\n\
         Status (hex), RDT Sequence, F/T Sequence, Fx, Fy, Fz, Tx, Ty, Tz, Time\n{rows}"
    );
    fs::write(&log, &log_text).unwrap();
    let import = |more: &[&str]| {
        let mut import = command();
        import.args(["import", "ati", text(&log), "--motion", text(&motion), "--out", text(&out)]);
        import.args(more).output().unwrap()
    };
    let dry = import(&["--dry-run"]);
    assert!(dry.status.success() && !out.exists(), "{}", stderr(&dry));
    let output = import(&[]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stderr(&output);
    for says in
        ["1000000 of them a lbf", "at 50 Hz", "99 packets were lost", "line 8", "broken gage"]
    {
        assert!(said.contains(says), "{says}: {said}");
    }
    let found = forces(&out);
    assert_eq!(found.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.02, 2.04]);
    assert!(found.iter().all(|(_, fx_n)| (fx_n - 8.896_443_230_52).abs() < 1e-6), "{found:?}");
    assert_fails(&import(&["--counts-per-n", "1"]), 2, &["exists already"]);
    fs::remove_file(&out).unwrap();
    assert_fails(
        &import(&["--counts-per-n", "1"]),
        3,
        &["but --counts-per-n says", "leave --counts-per-n out"],
    );
}

/// A log of another maker, in microseconds and with a flag; a matrix and a bias make newtons of its counts.
#[test]
fn the_log_of_another_force_sensor_is_read_with_its_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let [log, matrix, out] =
        ["bota.csv", "matrix.csv", "001.csv"].map(|name| folder.path().join(name));
    let motion = motion(folder.path());
    let row =
        |k: u32| format!("{},{},1000,200,-400,0,0,0\n", 5_000_000 + 1250 * k, u32::from(k == 7));
    let rows = (0..40).map(row).collect::<String>();
    fs::write(&log, format!("timestamp_us,overrange,Fx,Fy,Fz,Mx,My,Mz\n{rows}")).unwrap();
    let import = |more: &[&str]| {
        let mut import = command();
        import.args([
            "import",
            "force",
            text(&log),
            "--motion",
            text(&motion),
            "--out",
            text(&out),
        ]);
        import.args(["--calibration", text(&matrix), "--bias", "1,0,-0.5"]);
        import.args(more).output().unwrap()
    };
    fs::write(&matrix, "0.01 0 0\n0 0.01\n0 0 0.005\n").unwrap();
    assert_fails(&import(&[]), 3, &["matrix.csv:2: 2 numbers, but 3", "fix: give three rows"]);
    assert!(!out.exists());
    fs::write(&matrix, "0.01 0 0\n0 0.01 0\n0 0 0.005\n").unwrap();
    let dry = import(&["--dry-run"]);
    assert!(dry.status.success() && !out.exists(), "{}", stderr(&dry));
    let output = import(&[]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("1 rows from line 9 on have overrange set"), "{said}");
    let found = forces(&out);
    assert_eq!(found.len(), 39);
    assert!(found.iter().all(|(_, fx_n)| (fx_n - 9.0).abs() < 1e-9), "{found:?}");
    assert!((found[38].0 - 39.0 * 1.25e-3).abs() < 1e-9, "{found:?}");
}

#[test]
fn a_bag_writes_nothing_when_it_fails_or_is_only_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("001.csv");
    let bag = support::example().join("../another-robot.mcap");
    let import = |more: &[&str]| {
        let mut import = command();
        import.args(["import", "ros", text(&bag), "--out", text(&out)]).args(more).output().unwrap()
    };
    let columns = [
        "--column=insertion_m=/joint_states:feed.motor",
        "--column=rotation_rad=/joint_states:roll_joint",
    ];
    let wrong = import(&[columns[0], "--column=rotation_rad=/joint_states:role_joint"]);
    assert_fails(&wrong, 3, &["there is no `role_joint`", "did you mean `roll_joint`?"]);
    assert_fails(&import(&[columns[0]]), 3, &["there is no column `rotation_rad`", "--column"]);
    let dry = import(&[columns[0], columns[1], "--lead", "5", "--tare", "0.1", "--dry-run"]);
    assert_fails(&dry, 3, &["no force was measured in the first 0.1 s"]);
    let options = ["--lead=5", "--force=/ft_sensor/wrench", "--tare=0.1", "--clock=log"];
    let all = [&columns[..], &options].concat();
    let dry = import(&[&all[..], &["--dry-run"]].concat());
    assert!(dry.status.success(), "{}", stderr(&dry));
    assert!(stderr(&dry).contains("timed by the recorder") && !out.exists(), "{}", stderr(&dry));
    assert!(import(&all).status.success() && out.is_file());
    // The mean of the first 0.1 s is taken off.
    let first = forces(&out)[0];
    assert!(first.1.abs() < 1e-9, "{first:?}");
    assert_fails(&import(&all), 2, &["exists already"]);
    // A recorder that was killed leaves its last messages beside the database.
    let db3 = folder.path().join("bag.db3");
    let seed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/bag/rosbags.db3");
    fs::copy(seed, &db3).unwrap();
    fs::write(folder.path().join("bag.db3-wal"), "x").unwrap();
    let list = cathforce(["import", "ros", text(&db3), "--list"]);
    assert_fails(&list, 3, &["its recorder was killed", "wal_checkpoint"]);
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let list = cathforce(["import", "ros", text(&empty), "--list"]);
    assert_fails(&list, 3, &["no .mcap and no .db3"]);
}

const OTHER_BUS: &str = "(100.000000) can0 210#0102030405060708\n(100.000500) can0 290#00FF\n";

#[test]
fn the_log_of_another_bus_is_taken_only_when_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let [log, out] = ["other.log", "other.mcap"].map(|name| folder.path().join(name));
    fs::write(&log, OTHER_BUS).unwrap();
    let bundle = support::example();
    let import = ["import", "can", text(&log), "--bundle", text(&bundle), "--out", text(&out)];
    assert_fails(
        &cathforce(import),
        3,
        &["the log of another bus: 2 of its 2 frames", "--foreign"],
    );
    assert!(!out.exists());
    assert_fails(&cathforce(["play", text(&log), "--link", "sim"]), 3, &["the log of another bus"]);
    let taken = command().args(import).arg("--foreign").output().unwrap();
    assert!(taken.status.success() && out.is_file(), "{}", stderr(&taken));
}

#[test]
fn a_lab_dbc_with_a_wrong_identifier_or_a_cut_signal_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [dbc, settings] = ["lab.dbc", "S.toml"].map(|name| folder.path().join(name));
    fs::write(&settings, "rig = \"lab\"\n").unwrap();
    let import = |text_of_dbc: &str| {
        fs::write(&dbc, text_of_dbc).unwrap();
        let mut import = command();
        import.args(["config", "import-dbc", text(&dbc), "--settings", text(&settings)]);
        import.args(["--insertion", "DRIVE.FEED", "--rotation", "DRIVE.TURN"]).output().unwrap()
    };
    let lab = "VERSION \"\"\nBU_: LAB\nBO_ 801 DRIVE: 6 LAB\n SG_ FEED : 0|16@1+ (0.01,0) [0|655] \"mm\" LAB\n \
               SG_ TURN : 24|16@1- (0.001,0) [-32|32] \"rad\" LAB\n";
    for (from, to, says) in [
        ("BO_ 801", "BO_ 274923521", "0x10630001"),
        ("DRIVE: 6", "DRIVE: 4", "not within the 4 bytes"),
    ] {
        assert_fails(&import(&lab.replace(from, to)), 3, &[says, "fix:"]);
        assert_eq!(fs::read_to_string(&settings).unwrap(), "rig = \"lab\"\n");
    }
    // The list warns of it already.
    fs::write(&dbc, lab.replace("DRIVE: 6", "DRIVE: 4")).unwrap();
    let list = cathforce(["config", "import-dbc", text(&dbc), "--list"]);
    assert!(list.status.success());
    let warned = "DRIVE.TURN is not within the 4 bytes of its frame";
    assert!(stderr(&list).contains(warned) && !stderr(&list).contains("DRIVE.FEED is"), "{list:?}");
    assert!(import(lab).status.success());
}

/// A DBC as ODrive's CANSimple has it: one frame an axis, turns in single precision. It becomes the device's
/// configuration, and a run whose master sends such frames.
#[test]
fn drives_that_count_turns_in_floating_point_are_a_master() {
    let folder = tempfile::tempdir().unwrap();
    let [dbc, settings, out] =
        ["odrive.dbc", "S.toml", "run.mcap"].map(|name| folder.path().join(name));
    let axis = |k: u32| {
        let id = 32 * k + 9;
        format!(
            "BO_ {id} Axis{k}_Get_Encoder_Estimates: 8 ODrive_Axis{k}\n \
             SG_ Pos_Estimate : 0|32@1- (1,0) [0|0] \"rev\" Host\n \
             SG_ Vel_Estimate : 32|32@1- (1,0) [0|0] \"rev/s\" Host\n\n"
        )
    };
    let kinds = |k: u32| {
        let id = 32 * k + 9;
        format!("SIG_VALTYPE_ {id} Pos_Estimate : 1;\nSIG_VALTYPE_ {id} Vel_Estimate : 1;\n")
    };
    let odrive = format!(
        "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Host ODrive_Axis0 ODrive_Axis1\n\n{}{}{}{}",
        axis(0),
        axis(1),
        kinds(0),
        kinds(1)
    );
    fs::write(&dbc, odrive).unwrap();
    fs::write(&settings, "rig = \"tapered-bifurcation\"\n").unwrap();
    let signal = |k: u32, name: &str| format!("Axis{k}_Get_Encoder_Estimates.{name}_Estimate");
    let import = |insertion: &str, more: &[&str]| {
        let mut import = command();
        import.args(["config", "import-dbc", text(&dbc), "--settings", text(&settings)]);
        import.args(["--insertion", insertion, "--rotation", &signal(1, "Pos")]);
        import.args(more).output().unwrap()
    };
    // Turns are no length without a lead.
    assert_fails(&import(&signal(0, "Pos"), &[]), 3, &["has the unit \"rev\"", "fix:"]);
    assert_fails(&import(&signal(0, "Vel"), &["--lead", "5"]), 3, &["has the unit \"rev/s\""]);
    let output = import(&signal(0, "Pos"), &["--lead", "5"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let written = fs::read_to_string(&settings).unwrap();
    for says in ["id = 0x009", "float = true, scale = 0.005,", "id = 0x029", "scale = 6.283"] {
        assert!(written.contains(says), "{says}: {written}");
    }
    let example = support::example();
    let mut simulate = command();
    simulate.args(["simulate", text(&example), "--cell", "3", "--duration", "0.3"]);
    simulate.args(["--settings", text(&settings), "--out", text(&out)]);
    let run = simulate.output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let check = cathforce(["check", text(&out), "--json"]);
    assert!(check.status.success(), "{}", stderr(&check));
    let log = folder.path().join("run.log");
    let exported = cathforce(["export", text(&out), "--candump", text(&log)]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    let log = fs::read_to_string(&log).unwrap();
    let first = log.lines().filter_map(|line| line.split_once(" 009#")).map(|(_, data)| data);
    let turns = first.map(|data| {
        let byte = |k: usize| u8::from_str_radix(&data[2 * k..2 * k + 2], 16).unwrap();
        f32::from_le_bytes([0, 1, 2, 3].map(byte))
    });
    let turns = turns.collect::<Vec<_>>();
    // 5 mm in a turn.
    let first_m = 0.005 * turns[0];
    assert!(turns.len() > 300 && turns.is_sorted() && (0.0..0.5).contains(&first_m), "{turns:?}");
    let trial = fs::read_to_string(example.join("trials/000.csv")).unwrap();
    let row = trial.lines().nth(1).unwrap().split(',').collect::<Vec<_>>();
    let at =
        trial.lines().next().unwrap().split(',').position(|name| name == "insertion_m").unwrap();
    assert!((first_m - row[at].parse::<f32>().unwrap()).abs() < 1e-6, "{first_m}: {row:?}");
}

/// Feed and turn take turns in frames of one identifier, which a multiplexor tells apart.
#[test]
fn a_multiplexed_frame_is_a_master() {
    let folder = tempfile::tempdir().unwrap();
    let [dbc, settings, out] =
        ["lab.dbc", "S.toml", "run.mcap"].map(|name| folder.path().join(name));
    let lab = "VERSION \"\"\nBU_: LAB\nBO_ 801 DRIVE: 8 LAB\n SG_ WHICH M : 0|8@1+ (1,0) [0|255] \"\" LAB\n \
               SG_ FEED m0 : 8|24@1+ (0.00005,0) [0|800] \"mm\" LAB\n \
               SG_ TURN m1 : 8|24@1- (0.00001,0) [-80|80] \"rad\" LAB\n";
    fs::write(&dbc, lab).unwrap();
    fs::write(&settings, "rig = \"tapered-bifurcation\"\n").unwrap();
    let mut import = command();
    import.args(["config", "import-dbc", text(&dbc), "--settings", text(&settings)]);
    import.args(["--insertion", "DRIVE.FEED", "--rotation", "DRIVE.TURN"]);
    let output = import.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let written = fs::read_to_string(&settings).unwrap();
    let says = "selector = { start_bit = 0, bits = 8, byte_order = \"little\", value = 1 }";
    assert!(written.contains(says), "{written}");
    let example = support::example();
    let mut simulate = command();
    simulate.args(["simulate", text(&example), "--cell", "3", "--duration", "0.2"]);
    simulate.args(["--settings", text(&settings), "--out", text(&out)]);
    let run = simulate.output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let check = cathforce(["check", text(&out)]);
    assert!(check.status.success(), "{}", stderr(&check));
    let log = folder.path().join("run.log");
    assert!(cathforce(["export", text(&out), "--candump", text(&log)]).status.success());
    let log = fs::read_to_string(&log).unwrap();
    let count = |which: &str| log.matches(&format!(" 321#{which}")).count();
    assert!(count("00") > 200 && count("00") == count("01"), "{} {}", count("00"), count("01"));
}

/// A VESC sends its status with identifiers of 29 bits.
#[test]
fn a_frame_of_29_bits_is_read_by_the_device_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let [dbc, settings, out] =
        ["vesc.dbc", "S.toml", "run.mcap"].map(|name| folder.path().join(name));
    let status = 0x8000_0000_u32 + (16 << 8) + 7;
    let vesc = format!(
        "VERSION \"\"\n\nBU_: VESC\n\nBO_ {status} VESC_Status4: 8 VESC\n \
         SG_ PID_Pos : 55|16@0- (0.02,0) [0|0] \"deg\" Vector__XXX\n \
         SG_ TURN : 7|16@0- (0.02,0) [0|0] \"deg\" Vector__XXX\n"
    );
    fs::write(&dbc, vesc).unwrap();
    fs::write(&settings, "rig = \"tapered-bifurcation\"\n").unwrap();
    let mut import = command();
    import.args(["config", "import-dbc", text(&dbc), "--settings", text(&settings), "--lead", "5"]);
    import.args(["--insertion", "VESC_Status4.PID_Pos", "--rotation", "VESC_Status4.TURN"]);
    let output = import.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let written = fs::read_to_string(&settings).unwrap();
    assert!(written.contains("id = 0x00001007\nextended = true\n"), "{written}");
    let example = support::example();
    let mut simulate = command();
    simulate.args(["simulate", text(&example), "--cell", "3", "--duration", "0.2"]);
    simulate.args(["--settings", text(&settings), "--out", text(&out)]);
    let run = simulate.output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let check = cathforce(["check", text(&out)]);
    assert!(check.status.success(), "{}", stderr(&check));
    // Logs have such frames too, and are read back with the settings that describe them.
    let log = folder.path().join("run.log");
    assert!(cathforce(["export", text(&out), "--candump", text(&log)]).status.success());
    let frames = fs::read_to_string(&log).unwrap().matches(" 00001007#").count();
    assert!(frames > 200, "{frames} frames of the master");
    let again = folder.path().join("again.mcap");
    let mut import = command();
    import.args(["import", "can", text(&log), "--bundle", text(&example), "--cell", "3"]);
    import.args(["--settings", text(&settings), "--out", text(&again)]);
    let output = import.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(cathforce(["check", text(&again)]).status.success());
}

/// Identifiers that were moved to 29 bits are found where they are.
#[test]
fn a_log_of_a_bus_with_moved_identifiers_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (run, usual, moved) = (path("run.mcap"), path("usual.log"), path("moved.log"));
    let example = support::example();
    let mut simulate = command();
    simulate.args(["simulate", text(&example), "--cell", "3", "--duration", "0.2"]);
    assert!(simulate.args(["--out", text(&run)]).output().unwrap().status.success());
    assert!(cathforce(["export", text(&run), "--candump", text(&usual)]).status.success());
    let lines = fs::read_to_string(&usual).unwrap();
    let lines = lines.lines().map(|line| {
        let (before, frame) = line.rsplit_once(' ').unwrap();
        let (id, data) = frame.split_once('#').unwrap();
        let id = 0x1_2345 << 11 | u32::from_str_radix(id, 16).unwrap();
        format!("{before} {id:08X}#{data}\n")
    });
    fs::write(&moved, lines.collect::<String>()).unwrap();
    let import = |log: &Path, out: &Path, more: &[&str]| {
        let mut import = command();
        import.args(["import", "can", text(log), "--bundle", text(&example), "--cell", "3"]);
        import.args(["--out", text(out), "--json"]).args(more).output().unwrap()
    };
    let [a, b] = [path("a.mcap"), path("b.mcap")];
    let frames = |output: &std::process::Output| {
        assert!(output.status.success(), "{}", stderr(output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()["frames"].clone()
    };
    let expected = frames(&import(&usual, &a, &[]));
    assert_eq!(frames(&import(&moved, &b, &["--id-base", "0x12345"])), expected);
    let none = import(&moved, &path("c.mcap"), &[]);
    assert_fails(&none, 3, &["has an identifier of cathforce.dbc", "--id-base"]);
    let wrong = import(&moved, &path("c.mcap"), &["--id-base", "0x40000"]);
    assert_fails(&wrong, 2, &["the upper 18 of 29 bits"]);
}

/// JSON has no word for such a name; it is no reason to break off.
#[cfg(target_os = "linux")]
#[test]
fn a_path_that_is_no_utf_8_is_a_path() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join(OsStr::from_bytes(b"\xff.csv"));
    let motion = motion(folder.path());
    for json in [&[][..], &["--json"]] {
        let _ = fs::remove_file(&out);
        let mut import = command();
        import.args(["import", "csv", text(&motion), "--out"]).arg(&out).args(json);
        let output = import.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(out.is_file());
    }
    let recording = folder.path().join(OsStr::from_bytes(b"\xfe.mcap"));
    let bundle = support::example();
    let mut simulate = command();
    simulate
        .args(["simulate", text(&bundle), "--cell", "3", "--duration", "0.1", "--out"])
        .arg(&recording);
    assert!(simulate.output().unwrap().status.success());
    for command_line in [&["check", "--no-replay"][..], &["report"]] {
        let output = command().args(command_line).arg("--json").arg(&recording).output().unwrap();
        assert!(output.status.success(), "{command_line:?}: {}", stderr(&output));
    }
    let exported = folder.path().join(OsStr::from_bytes(b"\xfd.csv"));
    let output =
        command().arg("export").arg(&recording).arg("--csv").arg(&exported).arg("--json").output();
    assert!(output.unwrap().status.success() && exported.is_file());
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused_and_not_read_for_ever() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.mcap");
    let bundle = support::example();
    let import = ["import", "can", "/dev/zero", "--bundle", text(&bundle), "--out", text(&out)];
    assert_fails(&cathforce(import), 3, &["/dev/zero", "a pipe or a device", "fix:"]);
}

#[cfg(feature = "meshes")]
#[test]
fn a_surface_and_a_line_of_other_tools_become_a_vessel() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [obj, curve, line, stl] =
        ["lumen.obj", "line.mrk.json", "centreline.csv", "vessel.stl"].map(at);
    // A tube along x in centimetres, 0.3 wide and 4 long, capped at both ends.
    let mut surface = String::new();
    for ring in [0.0, 2.0, 4.0] {
        for side in 0..24 {
            let angle = std::f64::consts::TAU * f64::from(side) / 24.0;
            surface += &format!("v {ring} {:.6} {:.6}\n", 0.3 * angle.cos(), 0.3 * angle.sin());
        }
    }
    for ring in 0..2 {
        for side in 0..24 {
            let corner = |ring: u32, side: u32| 24 * ring + side % 24 + 1;
            let [a, b] = [corner(ring, side), corner(ring + 1, side)];
            surface +=
                &format!("f {a} {b} {} {}\n", corner(ring + 1, side + 1), corner(ring, side + 1));
        }
    }
    for first in [1, 49] {
        let corners = (0..24).map(|side| (first + side).to_string()).collect::<Vec<_>>();
        surface += &format!("f {}\n", corners.join(" "));
    }
    fs::write(&obj, surface).unwrap();
    let points =
        (0..=20).map(|k| format!("{{\"position\": [{}, 0, 0]}}", 2 * k)).collect::<Vec<_>>();
    let radii = vec!["3"; 21].join(", ");
    fs::write(
        &curve,
        format!(
            "{{\"markups\": [{{\"type\": \"Curve\", \"name\": \"aorta\", \"coordinateSystem\": \"LPS\", \
             \"coordinateUnits\": \"mm\", \"controlPoints\": [{}], \"measurements\": [{{\"name\": \"Radius\", \
             \"controlPointValues\": [{radii}]}}]}}]}}",
            points.join(", ")
        ),
    )
    .unwrap();
    let output = cathforce(["import", "centreline", text(&curve), "--out", text(&line)]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("coordinates are LPS"), "{}", stderr(&output));
    let csv = fs::read_to_string(&line).unwrap();
    assert_eq!(csv.lines().count(), 22);
    assert!(csv.lines().last().unwrap().starts_with("line0,0.0400000,0.0400000"), "{csv}");
    // A table of points is a line too; another table is called one.
    let points = at("points.csv");
    fs::write(&points, "X [cm],Y [cm],Z [cm],Radius [mm]\n0,0,0,3\n4,0,0,3\n").unwrap();
    let of_table = at("of_table.csv");
    let output = cathforce(["import", "centreline", text(&points), "--out", text(&of_table)]);
    assert!(output.status.success(), "{}", stderr(&output));
    let read = fs::read_to_string(&of_table).unwrap();
    assert!(read.lines().last().unwrap().starts_with("line0,0.0400000,0.0400000"), "{read}");
    let trial = motion(folder.path());
    let wrong = ["import", "centreline", text(&trial), "--out", "absent.csv"];
    assert_fails(&cathforce(wrong), 3, &["motion.csv:1: this is a table without coordinates"]);
    let wrong = ["import", "centreline", text(&curve), "--out", "absent.csv", "--unit", "cm"];
    assert_fails(&cathforce(wrong), 3, &["is in mm, which --unit contradicts"]);

    let import = |more: &[&str]| {
        let mut import = command();
        import
            .args(["import", "mesh", text(&obj), "--out", text(&stl)])
            .args(more)
            .output()
            .unwrap()
    };
    let capped = import(&["--unit", "cm", "--dry-run"]);
    assert!(capped.status.success() && !stl.exists());
    assert!(stderr(&capped).contains("capped at 2 flat ends"), "{}", stderr(&capped));
    let as_mm = import(&["--dry-run"]);
    assert!(stderr(&as_mm).contains("in centimetres? Then scale it by 10"), "{}", stderr(&as_mm));
    let opened = import(&["--unit", "cm", "--open-at", text(&line)]);
    assert!(opened.status.success(), "{}", stderr(&opened));
    assert!(stderr(&opened).contains("opened at (40.0, 0.0, 0.0) mm"), "{}", stderr(&opened));
    assert!(!stderr(&opened).contains("capped"), "{}", stderr(&opened));
    let lumen = cathforce(["lumen", text(&stl), "--json"]);
    let lumen: serde_json::Value = serde_json::from_slice(&lumen.stdout).unwrap();
    assert_eq!(lumen["openings"].as_array().map(Vec::len), Some(2), "{lumen}");
}
