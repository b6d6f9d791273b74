//! Settings from a file to a device and back, and what is said of those that are none.

use std::fs;
use std::net::TcpListener;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command as Program, Output};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_bus::{Command, Encoder, Insertion, Rotation};
use cathforce_config::{BAND_ROWS, Band};
use cathforce_control::Mode;
use cathforce_link::{Client, Sim, Slcan, Step, serve};
use serde_json::Value;

fn bundle() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/bend-guidewire");
    path.to_str().unwrap().into()
}

fn run(arguments: &[&str]) -> Output {
    Program::new(env!("CARGO_BIN_EXE_cathforce"))
        .env("NO_COLOR", "1")
        .args(arguments)
        .output()
        .unwrap()
}

#[track_caller]
fn json(arguments: &[&str]) -> Value {
    let output = run(&[arguments, &["--json"]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Exit code and what was said on stderr.
fn fails(arguments: &[&str]) -> (Option<i32>, String) {
    let output = run(arguments);
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// A device without hardware, which lives on between connections. Its address.
fn device() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("slcan:tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut device = Sim::in_lock_step();
        for stream in listener.incoming() {
            let stream = stream.unwrap();
            stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
            let mut link = Slcan::new("test", stream.try_clone().unwrap(), stream).unwrap();
            // Ends when the other side goes.
            let _ = serve(&mut link, &mut device, &AtomicBool::new(false));
        }
    });
    address
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().into()
    }
}

const RIG: &str = "schema_version = 1\nrig = \"bend-guidewire\"\n\n[set]\n";

#[test]
fn a_file_goes_to_the_device_and_comes_back_the_same() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    let file = folder.path("s.toml");
    let file = file.to_str().unwrap();
    json(&["config", "init", &bundle, file]);
    assert_eq!(json(&["config", "diff", file]), Value::Array(Vec::new()), "it sets nothing yet");
    let changed = json(&["config", "set", file, "force_gain=2.5", "wall.friction_coefficient=0.2"]);
    let of_file = |name| json(&["config", "get", file, name])["value"].clone();
    assert_eq!((of_file("force_gain"), of_file("torque_gain")), (2.5.into(), 1.0.into()));
    assert_eq!(changed.as_array().unwrap().len(), 2);
    assert!(fs::read_to_string(file).unwrap().contains("# Force on the operator's"));

    let to_device = |arguments: &[&str]| {
        json(&[&["config"], arguments, &["--link", &device, "--cell", "2"]].concat())
    };
    let dry = to_device(&["apply", &bundle, file, "--dry-run"]);
    assert_eq!((&dry["dry_run"], &dry["verified"]), (&true.into(), &false.into()));
    let (code, said) = fails(&["config", "get", "force_gain", "--link", &device]);
    assert_eq!(code, Some(5), "still not configured: {said}");

    let applied = to_device(&["apply", &bundle, file]);
    assert_eq!((&applied["verified"], &applied["fresh"]), (&true.into(), &true.into()));
    let get = |name| json(&["config", "get", name, "--link", &device])["value"].as_f64().unwrap();
    assert_eq!(get("force_gain"), 2.5);
    assert_eq!(get("wall.friction_coefficient") as f32, 0.2);

    json(&["config", "set", file, "force_gain=3"]);
    let diff = json(&["config", "diff", &device, file]);
    let gain = diff.as_array().unwrap().iter().find(|c| c["name"] == "force_gain").unwrap();
    assert_eq!((&gain["old"], &gain["new"]), (&2.5.into(), &3.0.into()));
    let applied = to_device(&["apply", &bundle, file]);
    assert_eq!(applied["fresh"], false);
    assert_eq!(applied["changes"].as_array().unwrap().len(), 1);
    assert_eq!(applied["counts"]["changed"], 1);
    let all = json(&["config", "list"]).as_array().unwrap().len() as u64;
    assert_eq!(applied["counts"]["unchanged"], all - 1);

    let saved = folder.path("saved.toml");
    let saved = saved.to_str().unwrap();
    assert_eq!(to_device(&["save", &bundle, saved])["verified"], true);
    assert_eq!(json(&["config", "diff", file, saved]), Value::Array(Vec::new()));
    // The order of earlier versions is understood.
    let again = to_device(&["apply", saved, &bundle]);
    assert_eq!(again["counts"]["changed"], 0);
}

/// A device without a configuration gets every value; only those of the file are news.
#[test]
fn a_fresh_device_is_told_of_the_file_and_not_of_all_values() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    let file = folder.file("s.toml", &format!("{RIG}force_gain = 2\n"));
    let to_device = ["--link", &device, "--cell", "3", "--dry-run"];
    let apply = |more: &[&str]| {
        let output = run(&[&["config", "apply", &bundle, &file][..], &to_device, more].concat());
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let said = apply(&[]);
    assert!(said.contains("no configuration yet") && said.contains("force_gain = 2"), "{said}");
    assert!(said.lines().count() < 10, "{said}");
    let all = apply(&["--all"]);
    assert!(all.lines().count() > 50 && all.contains("torque_gain: none -> 1"), "{all}");
}

/// Everything that is wrong with a file is said in one run, each with its line.
#[test]
fn a_broken_file_is_refused_once_with_all_its_lines() {
    let folder = Folder::new();
    let file = folder.file(
        "s.toml",
        "schema_version = 1\nrig = \"bend-guidewire\"\n[set]\nforce_gian = 2\nforce_gain = \"x\"\n\
         force_limit_n = 3000\n[master.cathter]\nid = 1\n",
    );
    let [bundle, file] = [&bundle(), &file];
    for command in [
        &["config", "validate", file][..],
        &["config", "set", file, "force_gain=2"],
        &["config", "apply", bundle, file, "--link", "sim"],
        &["simulate", bundle, "--settings", file],
    ] {
        let (code, said) = fails(command);
        assert_eq!(code, Some(3), "{said}");
        for part in [
            "s.toml:4: there is no setting `force_gian`\n  fix: write `force_gain`",
            "s.toml:5: force_gain must be a number",
            "s.toml:6: force_limit_n must be between 0 and 10 N",
            "s.toml:7: there is no key `cathter` in `master`\n  fix: write `catheter`",
        ] {
            assert!(said.contains(part), "{command:?}: `{part}` in:\n{said}");
        }
    }
    let (code, said) = fails(&["config", "set", file, "force_gian=2", "torque_gain=1e9"]);
    assert_eq!(code, Some(3), "{said}");
    let right = folder.file("right.toml", RIG);
    let (code, said) = fails(&["config", "set", &right, "force_gian=2", "torque_gain=1e9"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("force_gian") && said.contains("torque_gain must be between"), "{said}");
}

/// What a device says of its forces comes back with the model that it is of, and with no other.
#[test]
fn a_band_is_saved_with_its_model() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    let rows = [[100; 4]; BAND_ROWS];
    let band = Band { from_m: 0.02, step_m: 2e-3, feed: rows, withdrawal: rows };
    let friction = ("wall.friction_coefficient".to_owned(), 0.2);
    let options = ImageOptions {
        parameters: vec![friction],
        band: Some(band),
        cell_m: 2e-3,
        ..ImageOptions::default()
    };
    let rig = Bundle::open(Path::new(&bundle)).unwrap();
    let (image, _) = device_image(&rig, &options).unwrap();
    {
        let mut client = Client::connect(cathforce_link::open(&device).unwrap()).unwrap();
        client.upload_image(&image, |_| ControlFlow::Continue(())).unwrap();
    }
    let saved = folder.path("saved.toml");
    let file = saved.to_str().unwrap();
    let to_device = ["--link", &device, "--cell", "2", "--quiet"];
    json(&[&["config", "save", &bundle, file][..], &to_device].concat());
    let apply = [&["config", "apply", &bundle, file][..], &to_device].concat();
    let warned = || String::from_utf8(run(&apply).stderr).unwrap();
    // That a grid of 2 mm is coarse is all that is said.
    let said = warned();
    assert!(said.contains("take a grid of about") && said.lines().count() == 1, "{said}");
    json(&["config", "set", file, "wall.friction_coefficient=0.3"]);
    let said = warned();
    assert!(said.contains("another model (set by hand: wall.friction_coefficient)"), "{said}");
}

/// P17: the host says which key cannot change before it sends anything, and what to do.
#[test]
fn p17_an_armed_device_is_left_as_it_is_and_the_host_says_why() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    let file = folder.file("s.toml", &format!("{RIG}force_gain = 2\n"));
    let to_device = ["--link", &device, "--cell", "3"];
    let apply = [&["config", "apply", &bundle, &file][..], &to_device].concat();
    json(&apply);
    {
        let mut client = Client::connect(cathforce_link::open(&device).unwrap()).unwrap();
        let at = |m| Encoder { insertion: Insertion::from_m(m), rotation: Rotation::from_rad(0.0) };
        let still = Step { encoder: Some(at(0.02)), guidewire: Some(at(0.03)), ..Step::default() };
        for (command, wanted) in [(Command::SelfTest, Mode::Ready), (Command::Arm, Mode::Armed)] {
            let steps =
                (0..20_000).map(|i| Step { command: (i % 100 == 0).then_some(command), ..still });
            let mut reached = false;
            client
                .play(steps, |tick| {
                    reached |= Mode::from_codes(tick.haptic.mode, 0) == Some(wanted);
                    if reached { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .unwrap();
            assert!(reached, "{wanted:?}");
        }
    }
    json(&["config", "set", &file, "force_gain=3"]);
    let (code, said) = fails(&apply);
    assert_eq!(code, Some(5), "{said}");
    for word in ["force_gain cannot change", "armed", "Nothing was sent", "fix: disarm"] {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
    let (code, said) = fails(&[&["run", &bundle, "--trial", "0"][..], &to_device].concat());
    assert!(code == Some(5) && said.contains("armed"), "{code:?}: {said}");
    // Nothing has changed, and asking is allowed.
    assert_eq!(json(&["config", "get", "force_gain", "--link", &device])["value"], 2.0);
    let dry = json(&[&apply[..], &["--dry-run"]].concat());
    assert_eq!(dry["counts"]["changed"], 1);
}

#[test]
fn a_device_of_another_rig_is_not_saved_over_a_file() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    let file = folder.file("s.toml", RIG);
    json(&["config", "apply", &bundle, &file, "--link", &device, "--cell", "2"]);
    let (code, said) = fails(&["config", "save", &bundle, &file, "--link", &device, "--cell", "3"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("lumen.cell_m is 0.002") && said.contains("fix:"), "{said}");
    assert_eq!(fs::read_to_string(&file).unwrap(), RIG);
}

#[test]
fn an_older_file_is_restored_and_what_does_not_carry_over_is_listed() {
    let (folder, device, bundle) = (Folder::new(), device(), bundle());
    // No version, a name that is gone, one that the rig states, a value beyond today's range.
    let file = folder.file(
        "old.toml",
        "rig = \"bend-guidewire\"\n[set]\nforce_gain = 2\nforce_gian = 3\nsolver.tick_s = 0.002\n\
         force_limit_n = 3000\n",
    );
    let (code, said) =
        fails(&["config", "apply", &bundle, &file, "--link", &device, "--cell", "2"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("old.toml:4: ") && said.contains("old.toml:6: "), "{said}");
    let restored = json(&["config", "restore", &bundle, &file, "--link", &device, "--cell", "2"]);
    assert_eq!(restored["read_only"], Value::from(vec!["solver.tick_s"]));
    let lost = restored["not_carried_over"].as_array().unwrap();
    assert_eq!(lost.iter().map(|l| l["line"].as_u64().unwrap()).collect::<Vec<_>>(), [4, 6]);
    assert!(lost[0]["why"].as_str().unwrap().contains("`force_gain`"), "{lost:?}");
    assert!(lost[1]["why"].as_str().unwrap().contains("than 3 N"), "{lost:?}");
    assert_eq!(json(&["config", "get", "force_gain", "--link", &device])["value"], 2.0);
}

#[test]
fn slips_are_said_with_their_line() {
    let folder = Folder::new();
    let file =
        folder.file("s.toml", &format!("{RIG}force_limit_n = 0.003\nforce_slew_n_per_s = 180\n"));
    let output = run(&["config", "validate", &file]);
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("s.toml:5: ") && said.contains("a thousandth of its default"), "{said}");
    assert!(!said.contains("force_slew"), "{said}");
    let (code, said) = fails(&["config", "validate", &folder.file("t.toml", "rig = 3\n")]);
    assert_eq!(code, Some(3));
    assert!(said.contains("t.toml:1: ") && said.contains("fix:"), "{said}");
}

/// Checked before a device is at hand, with the key's own line.
#[test]
fn a_rig_that_no_model_can_have_is_refused_when_it_is_looked_at() {
    let folder = Folder::new();
    let copy = folder.path("rig");
    fs::create_dir_all(&copy).unwrap();
    fs::copy(Path::new(&bundle()).join("centreline.csv"), copy.join("centreline.csv")).unwrap();
    let rig = fs::read_to_string(Path::new(&bundle()).join("rig.toml")).unwrap();
    let rig = rig.replacen("youngs_modulus_Pa = 80.0e6", "youngs_modulus_Pa = 80.0e15", 1);
    let line = 1 + rig.lines().position(|line| line.contains("80.0e15")).unwrap();
    fs::write(copy.join("rig.toml"), rig).unwrap();
    for command in [&["config", "validate"][..], &["info"]] {
        let (code, said) = fails(&[command, &[copy.to_str().unwrap()]].concat());
        assert_eq!(code, Some(3), "{said}");
        let place = format!("rig.toml:{line}:");
        for part in [&place[..], "instrument.sections[0].youngs_modulus_Pa", "fix: write about"] {
            assert!(said.contains(part), "`{part}` in: {said}");
        }
    }
}

/// The literature has a catheter of "600 GPa": 600 MPa was meant.
#[test]
fn a_catheter_of_600_gpa_is_a_warning_that_says_so() {
    let folder = Folder::new();
    let copy = folder.path("rig");
    fs::create_dir_all(copy.join("trials")).unwrap();
    for name in ["centreline.csv", "trials/000.csv"] {
        fs::copy(Path::new(&bundle()).join(name), copy.join(name)).unwrap();
    }
    let rig = fs::read_to_string(Path::new(&bundle()).join("rig.toml")).unwrap();
    let rig = rig.replacen("youngs_modulus_Pa = 80.0e6", "youngs_modulus_Pa = 600e9", 1);
    fs::write(copy.join("rig.toml"), rig).unwrap();
    let output = run(&["config", "validate", copy.to_str().unwrap()]);
    assert!(output.status.success(), "a warning, no error");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("600 GPa") && said.contains("600 MPa"), "{said}");
    assert!(said.contains("rig.toml:"), "{said}");
}

#[test]
fn every_value_says_where_it_comes_from() {
    let folder = Folder::new();
    let file = folder.file(
        "s.toml",
        &format!("{RIG}force_gain = 2\n\"wall.friction_coefficient\" = {{ value = 0.3, effect = \"contact.friction\" }}\n"),
    );
    let bundle = bundle();
    let shown = json(&[
        "config",
        "show",
        &bundle,
        "--settings",
        &file,
        "--set",
        "torque_gain=3",
        "--origin",
        "--cell",
        "3",
    ]);
    let origin = |name: &str| shown["origin"][name].as_str().unwrap().to_owned();
    assert!(origin("force_gain").ends_with("s.toml:5"));
    assert!(origin("wall.friction_coefficient").ends_with("s.toml:6, contact.friction"));
    assert_eq!(origin("torque_gain"), "--set");
    assert_eq!(origin("force_limit_n"), "default");
    assert_eq!(origin("max_insertion_m"), "bundle", "lowered to the reach of the links");
}

#[test]
fn the_schema_accepts_what_is_written_by_its_names() {
    let schema = json(&["config", "schema"]);
    let names = schema["properties"]["set"]["properties"].as_object().unwrap();
    assert_eq!(names.len(), json(&["config", "list"]).as_array().unwrap().len());
    assert_eq!(names["ramp_time_ticks"]["anyOf"][0]["type"], "integer");
    assert_eq!(names["force_limit_n"]["anyOf"][0]["maximum"], 10.0);
}

/// A master of its own, in Motorola order and millimetres and degrees, as a lab's DBC has it.
#[test]
fn a_labs_own_frames_come_from_its_dbc_and_play_and_replay_bit_by_bit() {
    let folder = Folder::new();
    let dbc = folder.file(
        "lab.dbc",
        "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Master Slave\n\n\
         BO_ 929 Handle: 8 Master\n \
         SG_ Feed : 7|16@0+ (0.01,0) [0|600] \"mm\" Slave\n \
         SG_ Turn : 23|16@0- (0.1,0) [-3000|3000] \"deg\" Slave\n\n\
         BO_ 930 Wire: 8 Master\n \
         SG_ WireFeed : 0|16@1+ (0.01,0) [0|600] \"mm\" Slave\n \
         SG_ WireTurn : 16|16@1- (0.1,0) [-3000|3000] \"deg\" Slave\n \
         SG_ Button : 32|1@1+ (1,0) [0|1] \"\" Slave\n\n\
         BO_ 931 Hand: 8 Master\n \
         SG_ WireSpin : 0|16@1- (0.1,0) [-3000|3000] \"deg\" Slave\n \
         SG_ CatheterButton : 32|1@1+ (1,0) [0|1] \"\" Slave\n \
         SG_ Grip : 40|8@1+ (1,0) [0|100] \"%\" Slave\n\n",
    );
    let listed = json(&["config", "import-dbc", &dbc, "--list"]);
    assert_eq!(listed.as_array().unwrap().len(), 8);
    let file = folder.file("s.toml", &format!("{RIG}# why\nforce_gain = 2\n"));
    let import = |feed| {
        let signals = ["--insertion", feed, "--rotation", "Handle.Turn"];
        let wire =
            ["--guidewire-insertion", "Wire.WireFeed", "--guidewire-rotation", "Hand.WireSpin"];
        let buttons = ["--guidewire-button", "Wire.Button", "--button", "Hand.CatheterButton"];
        let grip = ["--grip", "Hand.Grip"];
        let to = ["config", "import-dbc", &dbc, "--settings", &file];
        run(&[&to[..], &signals, &wire, &buttons, &grip].concat())
    };
    for (feed, says) in [
        ("Handle.Fed", "write `Handle.Feed` if you meant that"),
        ("Hand.Grip", "has the unit \"%\""),
        ("Handle.Turn", "has the unit \"deg\""),
    ] {
        let output = import(feed);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains(says), "{said}");
    }
    assert!(!fs::read_to_string(&file).unwrap().contains("master"), "nothing half done");
    assert!(import("Handle.Feed").status.success());
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains("# why") && text.contains("id = 0x3a1"), "{text}");
    // In a frame of their own, beside the drive's.
    for line in ["rotation = { id = 0x3a3, start_bit = 0,", "held = { id = 0x3a3, start_bit = 32,"]
    {
        assert!(text.contains(line), "{line} in {text}");
    }
    assert!(text.contains("[master]\ngrip = { id = 0x3a3, start_bit = 40"), "{text}");

    let recording = folder.path("run.mcap");
    let played = json(&[
        "simulate",
        &bundle(),
        "--settings",
        &file,
        "--cell",
        "3",
        "--duration",
        "0.3",
        "--out",
        recording.to_str().unwrap(),
    ]);
    assert_eq!(played["differing_bits"], 0, "{played}");
    let recording = recording.to_str().unwrap();
    assert!(run(&["replay", recording]).status.success());
    // What the drives were told is known to other tools too, and counted on the bus: three frames
    // of the master's, HAPTIC and CONTACT each tick, and a third frame in one of three.
    let checked = json(&["check", recording]);
    let load = checked["survey"]["bus_load"].as_f64().unwrap();
    assert!((load - 0.135 * (5.0 + 1.0 / 3.0)).abs() < 0.01, "{load}");
    let table = folder.path("ticks.csv");
    assert!(run(&["export", recording, "--csv", table.to_str().unwrap()]).status.success());
    let table = fs::read_to_string(&table).unwrap();
    let last = table.lines().last().unwrap().split(',').collect::<Vec<_>>();
    let column = table.lines().next().unwrap().split(',').position(|c| c == "insertion_m").unwrap();
    assert!(last[column].parse::<f64>().unwrap() > 0.0, "{last:?}");
    // As does a log of it that came from elsewhere.
    let [log, back] = ["bus.log", "back.mcap"].map(|name| folder.path(name));
    let [log, back] = [&log, &back].map(|path| path.to_str().unwrap());
    assert!(run(&["export", recording, "--candump", log]).status.success());
    let settings = ["--settings", &file, "--cell", "3", "--out", back];
    let bundle = bundle();
    let imported =
        json(&[&["import", "candump", log, "--bundle", &bundle][..], &settings].concat());
    assert_eq!((&imported["foreign"], &imported["lock_step"]), (&0.into(), &true.into()));
    assert!(run(&["replay", back]).status.success());
}
