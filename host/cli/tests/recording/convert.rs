//! Out of a recording and into one.

use std::fs;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_recording::{Measured, Recording};

use crate::{assert_fails, cathforce, command, data, example, recording, text};

#[test]
fn a_bundle_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    data(["export", text(recording()), "--bundle", text(&out)]);
    let (before, after) = (Bundle::open(example()).unwrap(), Bundle::open(&out).unwrap());
    for name in ["rig.toml", "vessel.stl", "centreline.csv"] {
        let [a, b] = [example().join(name), out.join(name)].map(|path| fs::read(path).unwrap());
        assert!(a == b, "{name}");
    }
    let [trial] = &after.trials[..] else { panic!("one trial") };
    assert!(Some(trial) == before.trial(0), "every number and every gap");
    let again = cathforce(["export", text(recording()), "--bundle", text(&out)]);
    assert_fails(&again, 2, &["bundle exists already", "fix:"]);
}

#[test]
fn frames_survive_a_candump_log() {
    let folder = tempfile::tempdir().unwrap();
    let [log, out] = ["run.log", "run.mcap"].map(|name| folder.path().join(name));
    data(["export", text(recording()), "--candump", text(&log)]);
    let example = example();
    let import = ["import", "candump", text(&log), "--bundle", text(&example), "--out", text(&out)];
    let imported = data(import);
    let sort = |path: &Path| {
        let mut recording = Recording::open(path).unwrap();
        recording.frames.sort_by_key(|frame| frame.at_ns);
        recording.frames
    };
    let [before, after] = [recording(), &out].map(sort);
    assert_eq!(imported["frames"], before.len());
    assert!(before == after);
    assert_fails(&cathforce(import), 2, &["run.mcap exists already", "fix:"]);

    // The image is of other settings than the device had: that is no matter of its firmware.
    let other = folder.path().join("other.mcap");
    let import = [&import[..5], &["--set", "wall.friction_coefficient=0.9"]].concat();
    assert!(command().args(import).arg("--out").arg(&other).output().unwrap().status.success());
    let replayed = cathforce(["replay", text(&other)]);
    assert_fails(
        &replayed,
        1,
        &["device and host differ", "when the log was imported", "--settings"],
    );
    assert!(!crate::stderr(&replayed).contains("firmware"), "{}", crate::stderr(&replayed));
}

/// Two sessions in one log: the command that takes them apart is the one that is named.
#[test]
fn two_runs_in_a_log_are_refused_with_their_line_and_taken_apart() {
    let folder = tempfile::tempdir().unwrap();
    let [one, log, first, second, out] =
        ["one.log", "two.log", "first.log", "second.log", "run.mcap"]
            .map(|name| folder.path().join(name));
    data(["export", text(recording()), "--candump", text(&one)]);
    let once = fs::read_to_string(&one).unwrap();
    // The same again, ten seconds later.
    let later = once.lines().map(|line| {
        let (seconds, rest) = line.split_once('.').unwrap();
        format!("({}.{rest}\n", seconds[1..].parse::<u64>().unwrap() + 10)
    });
    fs::write(&log, once.clone() + &later.collect::<String>()).unwrap();
    let example = example();
    let import = |log: &Path| {
        let from = ["import", "candump", text(log), "--bundle", text(&example)];
        command().args(from).args(["--out", text(&out)]).output().unwrap()
    };
    let refused = import(&log);
    assert_fails(&refused, 3, &["two.log:", "the device starts again", "is followed by tick 0"]);
    assert!(!out.exists(), "nothing half written");
    let said = crate::stderr(&refused);
    let fix = said.split_once("fix: take the runs apart: `").unwrap().1;
    let (head, tail) = fix.trim_end().trim_end_matches('`').split_once("`, `").unwrap();
    for part in [head, tail] {
        let mut shell = std::process::Command::new("sh");
        let status = shell.args(["-c", part]).current_dir(folder.path()).status().unwrap();
        assert!(status.success(), "{part}");
    }
    // What the host asked at the end is where the next run may begin.
    let first_run = fs::read_to_string(&first).unwrap();
    let rest = once.strip_prefix(&first_run).expect("its beginning");
    let is_service = |line: &str| line.contains(" 600#") || line.contains(" 580#");
    assert!(rest.lines().all(is_service), "{rest}");
    for part in [&first, &second] {
        let output = import(part);
        assert!(output.status.success(), "{}", crate::stderr(&output));
        assert!(cathforce(["replay", text(&out)]).status.success());
        fs::remove_file(&out).unwrap();
    }
}

/// Hosts in lock step count alike: a part of another run, or frames that were lost.
#[test]
fn a_log_in_lock_step_with_a_hole_is_named_and_not_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, log, out] =
        ["whole.log", "hole.log", "run.mcap"].map(|name| folder.path().join(name));
    data(["export", text(recording()), "--candump", text(&whole)]);
    let whole = fs::read_to_string(&whole).unwrap();
    let lines = whole.lines().collect::<Vec<_>>();
    let third = lines.len() / 3;
    let kept = [&lines[..third], &lines[2 * third..]].concat();
    fs::write(&log, kept.join("\n")).unwrap();
    let example = example();
    let import = ["import", "candump", text(&log), "--bundle", text(&example), "--out", text(&out)];
    let output = cathforce(import);
    let said = crate::stderr(&output);
    assert!(output.status.success(), "{said}");
    let number = |after: &str| after.split(':').next()?.parse::<usize>().ok();
    let line = said.split("hole.log:").find_map(number).unwrap();
    assert!((third..third + 50).contains(&line), "{line}, joined at {third}");
    for words in ["frames were lost", "another run", "cannot be replayed", "fix:", "head -n"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_fails(&cathforce(["replay", text(&out)]), 3, &["without lock step"]);
    let checked = cathforce(["check", text(&out), "--json"]);
    assert_fails(&checked, 6, &["ticks are missing"]);
    let found: serde_json::Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert!(found["survey"]["ticks_missing"].as_u64() > Some(1000), "{found}");
}

#[test]
fn an_output_that_cannot_be_written_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("no/such/folder.csv");
    let output = cathforce(["export", text(recording()), "--parquet", text(&out)]);
    assert_fails(&output, 1, &["folder.csv", "No such file", "check the folder"]);
    let damaged = folder.path().join("damaged.mcap");
    fs::write(&damaged, &fs::read(recording()).unwrap()[..5000]).unwrap();
    let table = folder.path().join("ticks.parquet");
    let output = cathforce(["export", text(&damaged), "--parquet", text(&table)]);
    assert_fails(&output, 3, &["damaged.mcap: breaks off at byte"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "the damaged file only");
    assert_fails(&cathforce(["export", text(recording())]), 2, &["--csv"]);
}

#[test]
fn an_export_replaces_what_is_there_only_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let [csv, log] = ["ticks.csv", "run.log"].map(|name| folder.path().join(name));
    let older = "tick,t_s,mode,of an older version\n";
    fs::write(&csv, older).unwrap();
    let export = ["export", text(recording()), "--candump", text(&log), "--csv", text(&csv)];
    let there = ["ticks.csv exists already", "fix:", "--overwrite"];
    assert_fails(&cathforce(export), 2, &there);
    assert_eq!(fs::read_to_string(&csv).unwrap(), older);
    assert!(!log.exists(), "nothing is done by halves");
    let overwrite = [&export[..], &["--overwrite"]].concat();
    assert!(command().args(overwrite).output().unwrap().status.success());
    assert!(log.exists() && fs::read_to_string(&csv).unwrap().contains("insertion_m"));
    let twice = ["export", text(recording()), "--csv", "a.csv", "--nodes", "a.csv"];
    assert_fails(&cathforce(twice), 2, &["a.csv is named twice", "fix:"]);
}

/// Into a pipe goes the table and nothing else, and a reader who has seen enough is no error.
#[test]
fn a_table_goes_to_standard_output_as_into_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ticks.csv");
    data(["export", text(recording()), "--csv", text(&path)]);
    let mut export = command();
    let export = export.args(["export", text(recording()), "--csv", "-"]).current_dir(&folder);
    let piped = export.output().unwrap();
    assert!(piped.status.success());
    assert!(piped.stdout == fs::read(&path).unwrap());
    assert!(crate::stderr(&piped).contains("ticks: -"));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "no file of that name");
    let mut child = export.stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_sensors_log_and_a_recordings_motion_make_a_trial() {
    let folder = tempfile::tempdir().unwrap();
    let [log, out] = ["netft.csv", "004.csv"].map(|name| folder.path().join(name));
    let rows = (0..1000)
        .map(|i| format!("0,{i},{},0,-2000000,0,0,0,{}", 1000 * i, 5.0 + 0.002 * f64::from(i)));
    let heading = "Status (hex),RDT Sequence,Fx,Fy,Fz,Tx,Ty,Tz,Time".to_owned();
    let lines = std::iter::once(heading).chain(rows).collect::<Vec<_>>();
    fs::write(&log, lines.join("\n")).unwrap();
    let end = *Recording::open(recording()).unwrap().trial.rows.last().unwrap();
    // A row falls on each side of the motion's end.
    let offset = (end.t_s - 1.501).to_string();
    let import = |axes: &str, log: &Path| {
        let mut command = command();
        command.args(["import", "ati", text(log), "--motion", text(recording())]);
        command.args(["--counts-per-n", "1e6", "--axes", axes, "--offset", &offset]);
        command.args(["--out", text(&out)]).output().unwrap()
    };
    let output = import("-y,+x,+z", &log);
    assert!(output.status.success(), "{}", crate::stderr(&output));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("751 rows, 249 outside the motion left out"), "{said}");
    let written = fs::read_to_string(&out).unwrap();
    let mut lines = written.lines();
    let heading = lines.next().unwrap();
    let begins =
        "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,drive_fx_N,tip_x_m,tip_y_m,tip_z_m,p00_x_m";
    assert!(heading.starts_with(begins), "what else the motion has comes along: {heading}");
    let numbers =
        |line: &str| line.split(',').map(|x| x.parse().ok()).collect::<Vec<Option<f64>>>();
    let last = lines.clone().map(numbers).rfind(|row| row[3].is_some()).unwrap();
    assert!((last[1].unwrap() - end.insertion_m).abs() < 1e-4, "{last:?}");
    assert!((last[4].unwrap() - 0.75).abs() < 1e-12 && last[5] == Some(-2.0), "{last:?}");
    let drive = |row: &Measured| row.drive_force_n.is_some();
    let loads =
        Recording::open(recording()).unwrap().trial.rows.iter().filter(|row| drive(row)).count();
    assert!(loads > 100 && lines.filter(|line| numbers(line)[6].is_some()).count() == loads);
    let said = crate::stderr(&output);
    assert!(said.contains("249 of its 1000 rows are outside the time of"), "{said}");
    assert!(said.contains("a force of its own, which that of"), "{said}");

    fs::remove_file(&out).unwrap();
    fs::write(&log, lines_with_fault(&fs::read_to_string(&log).unwrap())).unwrap();
    assert_fails(&import("+x,+y,+z", &log), 3, &["netft.csv:8: `12O` is no number", "\n  fix: "]);
    assert!(!out.exists(), "nothing half written");
    assert_fails(&import("+x,+y", &log), 2, &["--axes", "+y,-x,+z"]);
    assert_fails(&import("x,y,z", Path::new("absent.txt")), 3, &["absent.txt"]);
}

fn lines_with_fault(log: &str) -> String {
    let fault = |(i, line): (usize, &str)| match i {
        7 => line.replacen(",6000,", ",12O,", 1),
        _ => line.to_owned(),
    };
    log.lines().enumerate().map(fault).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_table_of_other_columns_becomes_a_trial_of_a_bundle() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("bundle");
    data(["export", text(recording()), "--bundle", text(&bundle)]);
    let table = folder.path().join("theirs.csv");
    fs::write(&table, "ms,feed,turn,fx_N,fy_N,fz_N\n0,28,0,0.1,0,0\n10,29,90,,,\n").unwrap();
    let out = bundle.join("trials/001.csv");
    let mut import = command();
    import.args(["import", "csv", text(&table), "--out", text(&out)]);
    for column in ["t_s=ms*1e-3", "insertion_m=feed*1e-3", "rotation_rad=turn*0.017453292519943295"]
    {
        import.args(["--column", column]);
    }
    assert!(import.output().unwrap().status.success());
    let bundle = Bundle::open(&bundle).unwrap();
    let trial = bundle.trial(1).unwrap().catheter().unwrap();
    assert_eq!(trial.insertion_m, [0.028, 0.029]);
    assert_eq!(trial.force_n.as_ref().unwrap()[1], None);
    let output = cathforce(["import", "csv", text(&table), "--out", "absent.csv"]);
    assert_fails(&output, 3, &["theirs.csv:1: there is no column `t_s`", "--column t_s=THEIRS"]);
}

#[test]
fn a_table_is_imported_with_what_looks_wrong_and_what_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let [table, out, motion, log] =
        ["robot.csv", "001.csv", "motion.csv", "ati.csv"].map(|name| folder.path().join(name));
    let rows = (0..20).map(|i| format!("{},0.1,0,1,x\n", 0.2 * f64::from(i))).collect::<String>();
    fs::write(&table, format!("t_s,insertion_m,rotation_rad,Fx (N),note\n{rows}")).unwrap();
    let output = cathforce(["import", "csv", text(&table), "--out", text(&out)]);
    assert!(output.status.success(), "{}", crate::stderr(&output));
    for says in
        ["robot.csv: ", "0.2 s apart by t_s: milliseconds?", "--column \"fx_N=Fx (N)\"", "`note`"]
    {
        assert!(crate::stderr(&output).contains(says), "{says}: {}", crate::stderr(&output));
    }
    // A hole of a second in the motion, and a rate that nobody needs.
    let rows = (0..200).filter(|i| !(50..150).contains(i));
    let rows = rows.map(|i| format!("{},0.1,0\n", 0.01 * f64::from(i))).collect::<String>();
    fs::write(&motion, format!("t_s,insertion_m,rotation_rad\n{rows}")).unwrap();
    let rows = (0..190).map(|i| format!("1,2,3,{}\n", 0.01 * f64::from(i))).collect::<String>();
    fs::write(&log, format!("Fx (N),Fy (N),Fz (N),Time (s)\n{rows}")).unwrap();
    let import = |log: &Path, out: &str| {
        let out = folder.path().join(out);
        let mut import = command();
        import.args(["import", "ati", text(log), "--motion", text(&motion), "--rate", "100"]);
        import.arg("--out").arg(out).output().unwrap()
    };
    let output = import(&log, "002.csv");
    let says = ["--rate 100 is not used", "motion.csv: has gaps of more than 0.25 s"];
    assert_fails(&output, 3, &says);
    assert_fails(&output, 3, &["no row from 0.49 s to 1.5 s", "fix: cut the motion in two"]);
    assert!(!folder.path().join("002.csv").exists());
    let rows = (0..200).map(|i| format!("{},0.1,0\n", 0.01 * f64::from(i))).collect::<String>();
    fs::write(&motion, format!("t_s,insertion_m,rotation_rad\n{rows}")).unwrap();
    let text = fs::read_to_string(&log).unwrap().replace("(N)", "(lbf)");
    fs::write(&log, text).unwrap();
    let output = import(&log, "003.csv");
    assert!(output.status.success(), "{}", crate::stderr(&output));
    assert!(crate::stderr(&output).contains("the rows are in lbf"), "{}", crate::stderr(&output));
    let pounds = fs::read_to_string(folder.path().join("003.csv")).unwrap();
    let fx_n = pounds.lines().nth(1).unwrap().split(',').nth(3).unwrap().parse::<f64>().unwrap();
    assert!((fx_n - 4.448_221_615_26).abs() < 1e-6, "{fx_n}");
}
