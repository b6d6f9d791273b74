//! Bundles that the program writes itself: one to begin with, and measurements that it makes.

use std::fs;
use std::path::Path;

use cathforce_bundle::Bundle;

use crate::{assert_fails, cathforce, command, data, stderr, text};

/// A bundle as `bundle init` writes it.
fn begun(folder: &Path) -> std::path::PathBuf {
    let bundle = folder.join("my-rig");
    data(["bundle", "init", text(&bundle)]);
    bundle
}

#[test]
fn a_bundle_to_begin_with_validates_and_simulates() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = begun(folder.path());
    let info = data(["info", text(&bundle)]);
    assert_eq!((&info["name"], &info["warnings"]), (&"my-rig".into(), &0.into()), "{info}");
    let summary = data(["simulate", text(&bundle)]);
    assert_eq!((&summary["unresolved_ticks"], &summary["differing_bits"]), (&0.into(), &0.into()));
    // It touches the wall in the bend.
    assert!(summary["peak_contact_force_N"].as_f64().unwrap() > 0.005, "{summary}");
}

#[test]
fn a_folder_with_something_in_it_is_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("thesis.tex"), "years").unwrap();
    let output = cathforce(["bundle", "init", text(folder.path())]);
    assert_fails(&output, 2, &["is not empty", "fix:"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    // An empty one is filled, also where the command stands.
    let empty = folder.path().join("drive one");
    fs::create_dir(&empty).unwrap();
    let mut init = command();
    init.args(["bundle", "init", ".", "--plant", "drive"]).current_dir(&empty);
    let output = init.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let info = data(["info", text(&empty)]);
    assert_eq!((&info["name"], &info["warnings"]), (&"drive-one".into(), &0.into()), "{info}");
    assert_eq!(fs::read_dir(&empty).unwrap().count(), 3, "rig.toml, README.md, trials");
    let nowhere = folder.path().join("a/b");
    assert_fails(&cathforce(["bundle", "init", text(&nowhere)]), 1, &["cannot write"]);
}

/// What is made reads back as a bundle, and differs from the model by the noise that was stated.
#[test]
fn made_measurements_are_the_model_and_its_noise() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = begun(folder.path());
    let made = folder.path().join("made");
    let simulate = |more: &[&str]| {
        let mut command = command();
        let short = ["simulate", text(&bundle), "--duration", "4", "--cell", "2"];
        command.args(short).args(["--as-trial", text(&made)]).args(more);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output).to_owned()
    };
    let said = simulate(&[]);
    assert!(said.contains("trials/000.csv, 1001 rows, without noise"), "{said}");
    let said = simulate(&["--noise"]);
    assert!(said.contains("trials/001.csv, 1001 rows, with the noise of seed 1"), "{said}");
    simulate(&["--noise", "--seed", "2"]);
    simulate(&["--set", "wall.friction_coefficient=0.2"]);

    let opened = Bundle::open(&made).unwrap();
    assert!(opened.warnings.is_empty(), "{:?}", opened.warnings);
    let sensor = opened.rig.sensor;
    let column = |number: u32| {
        let data = opened.trial(number).unwrap().catheter().unwrap();
        let force = data.force_n.as_ref().unwrap().iter().map(|x| x.unwrap());
        let drive = data.drive_force_n.as_ref().unwrap().iter().map(|x| x.unwrap());
        let tip: Vec<_> = data.tip_m.as_ref().unwrap().iter().flatten().copied().collect();
        (force.flatten().collect::<Vec<_>>(), drive.collect::<Vec<_>>(), tip)
    };
    let spread = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        (squares / a.len() as f64).sqrt()
    };
    let (force, drive, tip) = column(0);
    assert_eq!((force.len(), drive.len(), tip.len()), (3003, 1001, 101));
    for number in [1, 2] {
        let (noisy, noisy_drive, noisy_tip) = column(number);
        let ratio = [
            spread(&noisy, &force) / sensor.force_noise_sd_n.unwrap(),
            spread(&noisy_drive, &drive) / sensor.drive_noise_sd_n.unwrap(),
            spread(noisy_tip.as_flattened(), tip.as_flattened()) / sensor.tip_noise_sd_m.unwrap(),
        ];
        assert!(ratio.iter().all(|ratio| (0.9..1.1).contains(ratio)), "{ratio:?}");
    }
    assert!(spread(&column(1).0, &column(2).0) > sensor.force_noise_sd_n.unwrap(), "other noise");
    // An effect that is put in is in the data, and nowhere else.
    let changed_n = spread(&column(3).0, &force);
    assert!(changed_n > 1e-3, "{changed_n}");
    let own =
        |name: &str| fs::read(bundle.join(name)).unwrap() == fs::read(made.join(name)).unwrap();
    assert!(own("rig.toml") && own("centreline.csv"));
    let readme = fs::read_to_string(made.join("README.md")).unwrap();
    assert!(
        readme.contains("not measured") && readme.contains("friction_coefficient = 0.2"),
        "{readme}"
    );

    // The nominal model, played along what was made without an effect, agrees with it.
    let again = ["simulate", text(&made), "--cell", "2", "--json"];
    let error = |trial: &str| {
        let output = command().args(again).args(["--trial", trial]).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        summary["force_rms_error_N"].as_f64().unwrap()
    };
    let (clean, noisy, other) = (error("0"), error("1"), error("3"));
    let stated = 3.0_f64.sqrt() * sensor.force_noise_sd_n.unwrap();
    assert!(clean < 0.1 * stated, "{clean}");
    assert!((0.9..1.1).contains(&(noisy / stated)), "{noisy}");
    assert!(other > 10.0 * clean, "{other} {clean}");
}

#[test]
fn made_trials_do_not_stand_beside_measured_ones() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = begun(folder.path());
    let other = folder.path().join("other");
    data(["bundle", "init", text(&other)]);
    let into = |place: &Path| {
        let simulate = ["simulate", text(&bundle), "--as-trial", text(place)];
        command().args(simulate).output().unwrap()
    };
    assert_fails(&into(&bundle), 2, &["this is the bundle that is simulated"]);
    assert_fails(&into(&other), 2, &["its rig.toml is not that of"]);
    fs::copy(bundle.join("rig.toml"), other.join("rig.toml")).unwrap();
    assert_fails(&into(&other), 2, &["may have been measured"]);
    assert_fails(&into(folder.path()), 2, &["is not empty"]);
    assert_eq!(fs::read_dir(other.join("trials")).unwrap().count(), 1);
}
