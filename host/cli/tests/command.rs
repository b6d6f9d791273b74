//! The command as people and scripts meet it: exit codes, messages, files.

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use cathforce_bus::{Frame, Id};
use cathforce_recording::{Attachments, Direction, Recorder, Recording};
use cathforce_test_fixture::once;
use support::{assert_fails, cathforce, command, example, stderr, text};

/// Long enough for contact and for 3 mm of feed, short enough for a test.
const SECONDS: &str = "0.8";

fn simulate(extra: &[&str]) -> Output {
    let mut command = command();
    command
        .arg("simulate")
        .arg(example())
        .args(["--trial", "0", "--duration", SECONDS])
        .args(extra);
    command.output().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

/// A recording of the beginning of the example, made once.
fn recording() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = once("command-recording", |folder| {
            let output = simulate(&["--out", folder.join("run.mcap").to_str().unwrap()]);
            assert!(output.status.success(), "{}", stderr(&output));
        });
        folder.join("run.mcap")
    })
}

/// Writes the recording again with its frames changed.
fn altered(path: &Path, alter: impl FnOnce(&mut Recording)) {
    let mut recording = Recording::open(recording()).unwrap();
    alter(&mut recording);
    let attachments = Attachments {
        image: &recording.image,
        rig_toml: &recording.rig_toml,
        dbc: &recording.dbc,
        vessel: &[],
    };
    let mut recorder = Recorder::create(path, &recording.info, attachments).unwrap();
    for frame in &recording.frames {
        recorder.frame(frame, frame.at_ns).unwrap();
    }
    recorder.finish(recording.result.as_ref()).unwrap();
}

#[test]
fn wrong_arguments_are_exit_code_2() {
    assert_fails(&cathforce([]), 2, &["Usage"]);
    assert_fails(&cathforce(["run"]), 2, &["--link"]);
    assert_fails(&cathforce(["info"]), 2, &["--link"]);
    assert_fails(&simulate(&["--set", "force_gain"]), 2, &["NAME=VALUE"]);
    let slip = ["no setting `force_gian`", "write `force_gain`", "cathforce config list"];
    assert_fails(&simulate(&["--set", "force_gian=2"]), 2, &slip);
    let effect = ["gap", "diagnose", "b", "--effect", "wall.stifness"];
    assert_fails(
        &cathforce(effect),
        2,
        &["no effect `wall.stifness`", "did you mean `wall.stiffness`?"],
    );
    assert_fails(&cathforce(["info", "--link", "can0"]), 2, &["did you mean `socketcan:can0`?"]);
    assert_fails(&cathforce(["confg"]), 2, &["a similar subcommand exists: 'config'"]);
    assert_fails(
        &simulate(&["--set", "force_gain=1e9"]),
        2,
        &["force_gain must be between 0 and 20"],
    );
    assert_fails(&cathforce(["info", "--link", "carrier-pigeon"]), 2, &["socketcan:can0"]);
}

#[test]
fn help_lists_the_exit_codes() {
    let help = cathforce(["--help"]);
    assert!(help.status.success());
    assert!(stdout(&help).contains("Exit codes:") && stdout(&help).contains("simulate"));
}

#[test]
fn wrong_files_are_exit_code_3_with_place_and_cause() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.mcap");
    fs::write(&file, "solid vessel").unwrap();
    let html = folder.path().join("page.html");
    let no_mcap = ["wrong.mcap: byte 0: not an MCAP file", "cathforce run"];
    assert_fails(&cathforce(["replay", text(&file)]), 3, &no_mcap);
    assert_fails(&cathforce(["report", text(&file), "--out", text(&html)]), 3, &no_mcap);
    assert!(!html.exists(), "nothing half done");
    assert_fails(&cathforce(["replay", "absent.mcap"]), 3, &["absent.mcap"]);
    assert_fails(&cathforce(["info", "absent"]), 3, &["absent"]);
    assert_fails(&cathforce(["simulate", text(folder.path())]), 3, &["rig.toml", "fix:"]);
    let no_folder = ["wrong.mcap", "fix: check the path; a bundle is a folder"];
    assert_fails(&cathforce(["simulate", text(&file)]), 3, &no_folder);

    fs::write(&file, b"CFIM but nothing else, really nothing").unwrap();
    assert_fails(&cathforce(["info", text(&file)]), 3, &["refused as a device image"]);

    let output = command().arg("simulate").arg(example()).args(["--trial", "77"]).output().unwrap();
    assert_fails(&output, 3, &["no trial 077", "fix: give --trial one of 000"]);
    let output = simulate(&["--out", "/no/such/folder/run.mcap"]);
    assert_fails(&output, 1, &["/no/such/folder/run.mcap", "No such file"]);
    assert!(!stderr(&output).contains("recording:"), "{}", stderr(&output));
    assert!(!stderr(&output).contains("building"), "said before anything is done");

    let mut damaged = fs::read(recording()).unwrap();
    let middle = damaged.len() * 3 / 4;
    damaged[middle] ^= 1;
    fs::write(&file, damaged).unwrap();
    assert_fails(&cathforce(["replay", text(&file)]), 3, &["byte ", "is damaged"]);
}

#[test]
fn a_diagnosis_whose_answer_cannot_be_written_does_not_begin() {
    let diagnose = |extra: &[&str]| {
        command().args(["gap", "diagnose"]).arg(example()).args(extra).output().unwrap()
    };
    for extra in [["--out", "/no/such/folder/D.json"], ["--report", "/no/such/folder/D.html"]] {
        let output = diagnose(&extra);
        assert_fails(&output, 1, &[extra[1], "No such file"]);
        assert!(!stderr(&output).contains("compared"), "{}", stderr(&output));
    }
    assert_fails(&diagnose(&["--report", "-"]), 2, &["a page goes into a file", "`--json`"]);
}

#[test]
fn holding_every_trial_back_leaves_nothing_to_fit() {
    let held_back = ["0", "1", "2", "3"].into_iter().flat_map(|trial| ["--hold-back", trial]);
    let output = command().args(["gap", "diagnose"]).arg(example()).args(held_back).output();
    let says = ["every trial is held back", "fix: hold fewer trials"];
    assert_fails(&output.unwrap(), 3, &says);
}

#[test]
fn a_link_that_does_not_answer_is_exit_code_4() {
    // Nobody listens on the port that was free a moment ago.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let link = format!("slcan:tcp:127.0.0.1:{port}");
    let bundle = example();
    let output = cathforce(["run", "--link", &link, text(&bundle)]);
    assert_fails(&output, 4, &[&link, "Check"]);
}

#[test]
fn a_recording_that_is_there_is_replaced_only_when_asked_and_never_before_the_new_one_begins() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kept.mcap");
    fs::copy(recording(), &file).unwrap();
    let kept = fs::read(&file).unwrap();
    let out = text(&file);
    let is_kept = || fs::read(&file).unwrap() == kept;
    let there = ["kept.mcap", "exists already", "fix:", "--overwrite"];
    // Nobody listens: whoever opens the link first ends with 4.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let link = format!("slcan:tcp:127.0.0.1:{port}");
    let bundle = example();
    let run = ["run", "--link", &link, text(&bundle), "--cell", "3", "--out", out];
    let refused = cathforce(run);
    assert_fails(&refused, 2, &there);
    assert!(!stderr(&refused).contains("building"), "said before anything is done");
    let wall = "effects.wall.stiffness.factor=0.5";
    let verify = ["gap", "verify", text(&bundle), "--link", &link, "--set", wall, "--out", out];
    assert_fails(&cathforce(verify), 2, &there);
    let protocol = ["gap", "protocol", text(&bundle), "--link", &link, "--out", out];
    assert_fails(&cathforce(protocol), 2, &there);
    assert!(is_kept());
    // What is replaced stays until there is a device to record.
    let overwrite = [&run[..], &["--overwrite"]].concat();
    assert_fails(&command().args(&overwrite).output().unwrap(), 4, &[&link]);
    assert!(is_kept());
    // Nothing else takes a recording's place.
    let stays = ["kept.mcap is a recording", "fix: give another name"];
    assert_fails(&simulate(&["--summary", out]), 2, &stays);
    assert_fails(&cathforce(["report", out, "--out", out]), 2, &stays);
    assert_fails(&cathforce(["export", out, "--csv", out, "--overwrite"]), 2, &stays);
    assert_fails(&cathforce(["config", "image", text(&bundle), "--out", out]), 2, &stays);
    assert!(is_kept());
    let output = simulate(&["--out", out, "--overwrite", "--set", "force_gain=3"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(!is_kept());
    assert!(cathforce(["replay", out]).status.success());
    assert_fails(&simulate(&["--overwrite"]), 2, &["--out"]);
}

#[test]
fn a_fault_of_the_device_is_exit_code_5_and_the_recording_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("fault.mcap");
    // Every sample of a normal feed is faster than this.
    let slow = "max_insertion_speed_m_per_s=0.001";
    let output = simulate(&["--set", slow, "--out", text(&file)]);
    assert_fails(&output, 5, &["stopped in tick", "encoder samples"]);
    assert_eq!(Recording::open(&file).unwrap().cut, None);
    assert!(cathforce(["replay", text(&file)]).status.success());
}

#[test]
fn a_missed_threshold_is_exit_code_6_after_the_data() {
    let output = simulate(&["--max-error", "0.001"]);
    assert_fails(&output, 6, &["force error", "--max-error"]);
    assert!(stdout(&output).contains("force error"));
}

/// What nobody has looked at is not within a limit.
#[test]
fn a_threshold_of_what_was_not_compared_is_missed() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("rig");
    fs::create_dir_all(bundle.join("trials")).unwrap();
    for name in ["rig.toml", "centreline.csv"] {
        fs::copy(example().join(name), bundle.join(name)).unwrap();
    }
    let rows = |force: [&str; 2]| {
        let row = |i: i32| format!("{0},{1},0{2}\n", f64::from(i) * 0.01, 0.028, force[1]);
        format!(
            "t_s,insertion_m,rotation_rad{}\n{}",
            force[0],
            (0..20).map(row).collect::<String>()
        )
    };
    for (force, says) in [
        (["", ""], "no measured force"),
        ([",fx_N,fy_N,fz_N", ",0,0,0"], "every measured force is 0"),
        ([",fx_N,fy_N,fz_N", ",0.1,0,0"], "after the first 3 mm of feed"),
    ] {
        fs::write(bundle.join("trials/000.csv"), rows(force)).unwrap();
        let output = cathforce(["simulate", text(&bundle), "--cell", "3", "--max-error", "50"]);
        assert_fails(&output, 6, &["no force was compared", says, "fix:"]);
        assert!(cathforce(["simulate", text(&bundle), "--cell", "3"]).status.success());
    }
}

/// A file in the place of another is told from it, and the right one is named.
#[test]
fn files_that_are_mixed_up_are_named_for_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let [settings, table, trial] =
        ["S.toml", "robot.csv", "000.csv"].map(|name| folder.path().join(name));
    fs::write(&settings, "rig = \"tapered-bifurcation\"\n[set]\nforce_gain = 2\n").unwrap();
    fs::write(&table, "time;feed\n0;1\n").unwrap();
    fs::write(&trial, "t_s,insertion_m,rotation_rad\n0,0.1,0\n").unwrap();
    let bundle = example();
    let (rig, bundle) = (bundle.join("rig.toml"), text(&bundle));
    let validated = cathforce(["config", "validate", text(&rig)]);
    assert_fails(&validated, 3, &["rig.toml of a bundle", "the bundle's folder"]);
    let folder_for_file = cathforce(["config", "diff", bundle, text(&settings)]);
    assert_fails(&folder_for_file, 3, &["is a folder", "config init"]);
    let shown = cathforce(["info", text(&settings)]);
    assert_fails(&shown, 3, &["a settings file", "config validate"]);
    for of_recording in [["gap", "diagnose"], ["info", "--quiet"], ["replay", "--quiet"]] {
        let output = |file: &Path| command().args(of_recording).arg(file).output().unwrap();
        assert_fails(&output(&table), 3, &["robot.csv: byte 0: not an MCAP", "import csv"]);
        assert_fails(&output(&trial), 3, &["this is a trial: give the folder of its bundle"]);
        assert_fails(&output(&rig), 3, &["the rig.toml of a bundle: give its folder"]);
    }
}

/// P22: what was recorded replays with zero bits of difference.
#[test]
fn p22_a_run_replays_bit_by_bit() {
    let output = cathforce(["replay", text(recording()), "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(report["differing_bits"], 0);
    assert!(report["ticks"].as_u64().unwrap() > 500);
    assert_eq!(report["frames_compared"].as_u64(), report["ticks"].as_u64().map(|n| 3 * n));
    assert_eq!(report["digest"], report["device_digest"]);
}

#[test]
fn one_flipped_bit_is_found_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flipped.mcap");
    altered(&file, |recording| {
        let contact = |id: u32| Id::from_raw(id) == Some(Id::Contact);
        let mut contacts = recording.frames.iter_mut().filter(|f| contact(f.frame.id()));
        let frame = contacts.nth(400).unwrap();
        let mut data = frame.frame.data().to_vec();
        data[2] ^= 0x10;
        frame.frame = Frame::new(frame.frame.id(), &data).unwrap();
    });
    let output = cathforce(["replay", text(&file)]);
    assert_fails(&output, 1, &["1 bits", "tick 400", "Contact byte 2"]);
}

/// A lost link leaves ticks under way whose answers nobody has heard.
#[test]
fn a_run_that_lost_its_link_replays_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let [path, broken_off] = ["lost.mcap", "off.mcap"].map(|name| folder.path().join(name));
    let lose_the_last_answers = |recording: &mut Recording| {
        let tail = recording.frames.split_off(recording.frames.len() - 200);
        recording.frames.extend(tail.into_iter().filter(|f| f.direction == Direction::ToDevice));
    };
    altered(&path, lose_the_last_answers);
    assert_fails(&cathforce(["replay", text(&path)]), 1, &["only on the host"]);
    altered(&broken_off, |recording| {
        lose_the_last_answers(recording);
        recording.result = None;
    });
    let output = cathforce(["replay", text(&broken_off)]);
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn a_frame_that_did_not_reach_the_device_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("missing.mcap");
    altered(&file, |recording| {
        let encoder = |id: u32| Id::from_raw(id) == Some(Id::Encoder);
        let moving = recording.frames.len() - 300;
        let place = recording.frames[moving..].iter().position(|f| encoder(f.frame.id())).unwrap();
        assert_eq!(recording.frames[moving + place].direction, Direction::ToDevice);
        recording.frames.remove(moving + place);
    });
    assert_fails(&cathforce(["replay", text(&file)]), 1, &["differ"]);
}

/// Without SYNC frames nobody knows which tick took which frame; what crossed the bus is shown.
#[test]
fn a_free_running_recording_is_shown_but_not_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let [file, html] = ["free.mcap", "free.html"].map(|name| folder.path().join(name));
    altered(&file, |recording| recording.info.lock_step = false);
    assert_fails(&cathforce(["replay", text(&file)]), 3, &["without lock step"]);
    let report = cathforce(["report", text(&file), "--out", text(&html)]);
    assert!(report.status.success(), "{}", stderr(&report));
    let page = fs::read_to_string(html).unwrap();
    assert!(page.contains("peak contact force") && !page.contains("bits differ"));
}

#[test]
fn data_is_on_stdout_and_remarks_are_on_stderr() {
    let folder = tempfile::tempdir().unwrap();
    let summary = folder.path().join("summary.json");
    let output = simulate(&["--json", "--quiet", "--summary", text(&summary)]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    let json: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    let file: serde_json::Value = serde_json::from_slice(&fs::read(summary).unwrap()).unwrap();
    assert_eq!(json, file);
    for key in ["ticks", "differing_bits", "force_rms_error_N", "measured_force_peak_N", "wall_s"] {
        assert!(json[key].is_number(), "{key}");
    }
    // Three axes of what rig.toml states.
    let noise_n = json["force_noise_rms_N"].as_f64().unwrap();
    assert!((noise_n - 0.01 * 3.0_f64.sqrt()).abs() < 1e-9, "{noise_n}");

    let output = simulate(&[]);
    assert!(stdout(&output).contains(", sensor noise 17.3 mN"), "{}", stdout(&output));
    assert!(stderr(&output).contains("upload: 100 %"), "{}", stderr(&output));
    assert!(stdout(&output).contains("Simulated, not measured"), "{}", stdout(&output));
    assert!(!stdout(&output).contains('\x1b') && !stderr(&output).contains('\x1b'));
}

#[test]
fn a_recording_becomes_a_page_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let [html, csv, nodes] = ["page.html", "ticks.csv", "nodes.csv"].map(|f| folder.path().join(f));
    let recording = text(recording());
    assert!(cathforce(["report", recording, "--out", text(&html)]).status.success());
    let arguments = ["export", recording, "--csv", text(&csv), "--nodes", text(&nodes)];
    assert!(cathforce(arguments).status.success());

    let page = fs::read_to_string(html).unwrap();
    assert!(page.contains("Simulated, not measured") && !page.contains("{{"));
    let data = page.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert!(data["vessel"]["indices"].as_str().unwrap().len() > 10_000);

    let rows = fs::read_to_string(csv).unwrap();
    let trial_starts = rows.lines().filter(|row| row.contains(",0.000000,armed,")).count();
    assert_eq!(trial_starts, 1, "time 0 is the first tick of the trial");
    let last = rows.lines().last().unwrap();
    assert_eq!(last.split(',').count(), rows.lines().next().unwrap().split(',').count());
    assert!(fs::read_to_string(nodes).unwrap().lines().count() > 100);
}

#[test]
fn info_tells_bundle_recording_image_and_device_apart() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("rig.cfim");
    let bundle = example();
    let config = cathforce(["config", "image", text(&bundle), "--out", text(&image)]);
    assert!(config.status.success(), "{}", stderr(&config));
    let kind = |output: Output| {
        assert!(output.status.success(), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
        json["kind"].as_str().unwrap().to_owned()
    };
    assert_eq!(kind(cathforce(["info", "--json", text(&bundle)])), "trial bundle");
    assert_eq!(kind(cathforce(["info", "--json", text(recording())])), "recording");
    assert_eq!(kind(cathforce(["info", "--json", text(&image)])), "device image");
    assert_eq!(kind(cathforce(["info", "--json", "--link", "sim"])), "device");
}

#[test]
fn every_setting_is_listed_with_range_and_text() {
    let output = cathforce(["config", "list", "--json"]);
    let list: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    let list = list.as_array().unwrap();
    let parameters = cathforce_mechanics::parameters().count();
    assert_eq!(list.len(), cathforce_config::SETTINGS.len() + parameters);
    let filtered = cathforce(["config", "list", "slew", "--json"]);
    let filtered: serde_json::Value = serde_json::from_str(stdout(&filtered)).unwrap();
    let names = filtered.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap());
    assert!(names.clone().count() > 0 && names.into_iter().all(|name| name.contains("slew")));
    assert_eq!(cathforce(["config"]).stdout, cathforce(["config", "list"]).stdout);
    assert!(list.iter().all(|s| s["doc"].as_str().is_some_and(|doc| !doc.is_empty())));
    let bundle = example();
    let shown = cathforce(["config", "show", text(&bundle), "--set", "force_gain=2", "--json"]);
    let shown: serde_json::Value = serde_json::from_str(stdout(&shown)).unwrap();
    assert_eq!(shown["settings"]["force_gain"], 2.0);
}

/// Numbers are numbers, and nothing has to be taken out of a sentence.
#[test]
fn json_has_numbers_as_numbers() {
    let parsed = |output: Output| -> serde_json::Value {
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_str(stdout(&output)).unwrap()
    };
    let bundle = parsed(cathforce(["info", "--json", text(&example())]));
    assert_eq!(bundle["trials"][0]["number"], 0);
    assert!(bundle["trials"][0]["rows"].as_u64() > Some(100), "{bundle}");
    assert!(bundle["mesh_triangles"].as_u64() > Some(1000), "{bundle}");
    let device = parsed(cathforce(["info", "--json", "--link", "sim"]));
    assert!(device["frames"].as_object().unwrap().values().all(serde_json::Value::is_u64));
    let made = parsed(cathforce(["info", "--json", text(recording())]));
    assert_eq!(made["complete"], true);
    assert!(made["bus_load"].is_number(), "{made}");
}

/// A page needs no name, and takes the place of an older one only if cathforce made it.
#[test]
fn a_report_goes_beside_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let [file, page] = ["run.mcap", "run.html"].map(|name| folder.path().join(name));
    fs::copy(recording(), &file).unwrap();
    for _ in 0..2 {
        let output = cathforce(["report", text(&file)]);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).contains(text(&page)), "{}", stdout(&output));
    }
    let foreign = "<!doctype html><p>notes</p>";
    fs::write(&page, foreign).unwrap();
    assert_fails(&cathforce(["report", text(&file)]), 2, &["did not make", "--out", "--overwrite"]);
    assert_eq!(fs::read_to_string(&page).unwrap(), foreign);
    assert!(cathforce(["report", text(&file), "--overwrite"]).status.success());
    assert!(fs::read_to_string(&page).unwrap().contains("Simulated, not measured"));
}

/// `--out` keeps the result; stdout has the text, or nothing with `--json`.
#[test]
fn a_result_is_kept_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("answer.json");
    for (switch, has_text) in [(&[][..], true), (&["--json"][..], false)] {
        let mut replay = command();
        replay.args(["replay", text(recording()), "--out", text(&file)]).args(switch);
        let output = replay.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(stdout(&output).contains("differing bits"), has_text);
        let kept: serde_json::Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
        assert_eq!(kept["differing_bits"], 0);
    }
    let notes = folder.path().join("notes.md");
    fs::write(&notes, "# Notes").unwrap();
    let refused = cathforce(["check", text(recording()), "--out", text(&notes)]);
    assert_fails(&refused, 2, &["notes.md", "stays as it is"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_disarms_and_finishes_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("interrupted.mcap");
    // A trial of an hour, so that the signal comes in time on any computer.
    let hour = folder.path().join("hour");
    fs::create_dir_all(hour.join("trials")).unwrap();
    for name in ["rig.toml", "vessel.stl"] {
        fs::copy(example().join(name), hour.join(name)).unwrap();
    }
    let row =
        |k: u32| format!("{},{},0\n", 0.25 * f64::from(k), 0.028 + 0.01 * f64::from(k) / 14_400.0);
    let rows =
        "t_s,insertion_m,rotation_rad\n".to_owned() + &(0..=14_400).map(row).collect::<String>();
    fs::write(hour.join("trials/000.csv"), rows).unwrap();
    let mut run = command();
    run.arg("simulate").arg(&hour).args(["--out", text(&file)]);
    let mut run = run.stderr(std::process::Stdio::piped()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    // An empty one is there for a moment, to see whether it can be written.
    while fs::metadata(&file).map_or(0, |file| file.len()) == 0 {
        assert!(Instant::now() < deadline, "no recording was begun");
        std::thread::sleep(Duration::from_millis(2));
    }
    let signal = Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    assert!(signal.success());
    let status = run.wait().unwrap();
    assert_eq!(status.code(), Some(1));
    let recording = Recording::open(&file).unwrap();
    assert_eq!(recording.cut, None, "the file is finished");
    assert!(recording.trial.rows.len() < 14_400, "it was not played to its end");
    assert!(cathforce(["replay", text(&file)]).status.success());
}

#[test]
fn a_lumen_says_what_it_costs_and_coarsens_only_by_choice() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lumen.bin");
    let mesh = example().join("vessel.stl");
    let lumen = |extra: &[&str]| {
        let output = command().arg("lumen").arg(&mesh).args(extra).arg("--json").output().unwrap();
        let value: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
        (output.status.code(), value)
    };
    let (code, value) = lumen(&["--cell", "2", "--out", text(&file)]);
    assert_eq!((code, value["fits"].as_bool()), (Some(0), Some(true)));
    assert_eq!(
        (value["openings"].as_array().unwrap().len(), value["gaps_closed"].as_u64()),
        (3, Some(0))
    );
    assert_eq!(fs::metadata(&file).unwrap().len(), value["bytes"].as_u64().unwrap());
    assert!(value["error_to_surface"]["max_m"].as_f64() > Some(0.0));
    assert!(value["error_to_facets"]["max_m"].as_f64() > Some(0.0));
}

/// A binary STL of a tube along x, in millimetres.
fn tube_stl(radius: f32, length: f32) -> Vec<u8> {
    const SIDES: usize = 24;
    let corner = |ring: usize, side: usize| {
        let angle = std::f32::consts::TAU * (side % SIDES) as f32 / SIDES as f32;
        [ring as f32 * length, radius * angle.cos(), radius * angle.sin()]
    };
    let mut stl = vec![0; 80];
    stl.extend((2 * SIDES as u32).to_le_bytes());
    for side in 0..SIDES {
        let [a, b] = [corner(0, side), corner(1, side)];
        let [c, d] = [corner(1, side + 1), corner(0, side + 1)];
        for triangle in [[a, b, c], [a, c, d]] {
            let numbers = triangle.iter().flatten().flat_map(|x| x.to_le_bytes());
            stl.extend([0; 12].into_iter().chain(numbers).chain([0; 2]));
        }
    }
    stl
}

/// However far it is from fitting, the code is the same and no file is left.
#[test]
fn a_lumen_without_room_is_exit_code_6_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, out] = ["wide.stl", "lumen.bin"].map(|name| folder.path().join(name));
    fs::write(&mesh, tube_stl(12.0, 40.0)).unwrap();
    for (cell, says) in [("0.5", "has room for 2097152"), ("0.1", "too many bricks")] {
        let arguments =
            ["lumen", text(&mesh), "--surface", "flat", "--cell", cell, "--out", text(&out)];
        assert_fails(&cathforce(arguments), 6, &["wide.stl", says, "fix: choose a grid of"]);
        assert!(!out.exists(), "{cell}");
    }
}

#[test]
fn what_was_not_measured_is_no_zero() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("centimetres.stl");
    fs::write(&mesh, tube_stl(0.4, 4.0)).unwrap();
    let output = cathforce(["lumen", text(&mesh), "--json"]);
    let value: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!((value["points"].as_u64(), output.status.code()), (Some(0), Some(0)));
    for key in ["error_to_surface", "error_deeper", "error_to_facets", "normal_max_rad"] {
        assert!(value[key].is_null(), "{key}: {value}");
    }
    let warnings = value["warnings"].as_array().unwrap();
    let said = |says: &str| warnings.iter().any(|w| w.as_str().unwrap().contains(says));
    assert!(said("nowhere is room") && said("centimetres? Then scale it by 10"), "{value}");
    let output = cathforce(["lumen", text(&mesh)]);
    assert!(stdout(&output).contains("not measured to the surface"), "{}", stdout(&output));
}

/// What looks wrong with a vessel is said wherever an image is made of it, once.
#[test]
fn a_hole_in_the_vessel_is_said_with_its_image() {
    let folder = tempfile::tempdir().unwrap();
    let [rig, trials, mesh] = ["rig.toml", "trials", "vessel.stl"].map(|name| example().join(name));
    fs::copy(rig, folder.path().join("rig.toml")).unwrap();
    fs::create_dir(folder.path().join("trials")).unwrap();
    let trial = trials.join("000.csv");
    fs::copy(trial, folder.path().join("trials/000.csv")).unwrap();
    let whole = fs::read(mesh).unwrap();
    let middle = |facet: &[u8]| {
        let number = |k: usize| f32::from_le_bytes(facet[12 + 4 * k..][..4].try_into().unwrap());
        [0, 1, 2].map(|axis| (number(axis) + number(axis + 3) + number(axis + 6)) / 3.0)
    };
    let facets = || whole[84..].chunks(50);
    let at = facets().map(middle).min_by(|a, b| {
        let from_30_mm = |p: &[f32; 3]| (p[0] - 30.0).abs();
        from_30_mm(a).total_cmp(&from_30_mm(b))
    });
    let at = at.unwrap();
    let is_left = |facet: &&[u8]| {
        let from: f32 = middle(facet).iter().zip(at).map(|(x, at)| (x - at).powi(2)).sum();
        from.sqrt() > 1.6
    };
    let left: Vec<&[u8]> = facets().filter(is_left).collect();
    let mut pierced = whole[..80].to_vec();
    pierced.extend((left.len() as u32).to_le_bytes());
    pierced.extend(left.concat());
    fs::write(folder.path().join("vessel.stl"), pierced).unwrap();
    let image = folder.path().join("device.cfim");
    let output = cathforce(["config", "image", text(folder.path()), "--out", text(&image)]);
    assert!(output.status.success() && image.exists(), "{}", stderr(&output));
    assert_eq!(stderr(&output).matches("lies in the wall").count(), 1, "{}", stderr(&output));
}

#[test]
fn a_broken_mesh_is_exit_code_3_with_file_place_and_fix() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broken.stl");
    let whole = fs::read(example().join("vessel.stl")).unwrap();
    let mut nan = whole.clone();
    nan[84 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let ascii = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2 x\n";
    let cases: [(&[u8], &str); 5] = [
        (b"", "84"),
        (&whole[..1000], "at byte 1000"),
        (&nan, "at byte 96"),
        (ascii.as_bytes(), "broken.stl:4: `x` is not a number"),
        (b"solid a\nendsolid a\n", "no triangles"),
    ];
    for (bytes, says) in cases {
        fs::write(&file, bytes).unwrap();
        assert_fails(&cathforce(["lumen", text(&file)]), 3, &["broken.stl", says, "fix:"]);
    }
    assert_fails(&cathforce(["lumen", "absent.stl"]), 3, &["absent.stl"]);
    assert_fails(&cathforce(["lumen", "absent.stl", "--cell", "0"]), 2, &["--cell"]);
}
