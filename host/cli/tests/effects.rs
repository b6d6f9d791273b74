//! Effects and tips on the command line: listed, set, refused, and in the device's image.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cathforce_config::image::decode;
use serde_json::Value;

fn bundle() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

fn cathforce(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1").args(arguments).output().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = cathforce(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn assert_usage(arguments: &[&str], words: &str) {
    let output = cathforce(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains(words), "`{words}` in: {stderr}");
}

#[test]
fn what_is_set_is_in_the_image() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rig.cfim");
    let (bundle, file) = (bundle(), file.to_str().unwrap().to_owned());
    let output = cathforce(&[
        "config",
        "image",
        bundle.to_str().unwrap(),
        "--out",
        &file,
        "--tip",
        "hook",
        "--set",
        "effects.contact.stribeck.static_ratio=1.5",
        "--set",
        "wall.friction_coefficient=0.46",
        "--set",
        "force_gain=2",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = std::fs::read(&file).unwrap();
    let config = decode(&bytes).unwrap();
    let description = config.model.description();
    assert_eq!(description.effects.contact.stribeck.static_ratio, 1.5);
    assert_eq!(description.wall.friction_coefficient, 0.46);
    assert_eq!(config.settings.force_gain, 2.0);
    let [arc] = description.instrument.precurve.as_slice() else { panic!("one arc") };
    assert!((arc.curvature_per_m - 125.0).abs() < 1e-3, "{arc:?}");
}

#[test]
fn what_cannot_be_set_is_refused_at_once() {
    let bundle = bundle();
    let simulate = ["simulate", bundle.to_str().unwrap()];
    let with = |extra: [&'static str; 2]| [simulate.as_slice(), &extra].concat();
    assert_usage(
        &with(["--set", "effects.wall.viscoelastic.ratio=-1"]),
        "effects.wall.viscoelastic.ratio must be between 0 and 20",
    );
    assert_usage(
        &with(["--set", "effects.wall.nope=1"]),
        "there is no setting `effects.wall.nope`",
    );
    assert_usage(&with(["--tip", "crook"]), "cathforce tips");
}

#[test]
fn every_listed_effect_is_set_by_what_config_lists() {
    let effects = json(&["gap", "effects", "--json"]);
    let settings = json(&["config", "--json"]);
    let names: Vec<_> =
        settings.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    let effects = effects.as_array().unwrap();
    assert_eq!(effects.len(), 56);
    let of_drive = |id: &str| {
        let mut of_drive = effects.iter().filter(|effect| effect["plant"] == "drive");
        of_drive.find(|effect| effect["id"] == id).unwrap_or_else(|| panic!("{id}"))
    };
    let stribeck = &of_drive("drive.stribeck")["parameters"][0];
    assert_eq!((&stribeck["max"], &stribeck["counted_in"]), (&5.0.into(), &"f".into()));
    assert_eq!(of_drive("drive.backlash")["parameters"][0]["name"], "position_m");
    for effect in effects {
        for parameter in effect["parameters"].as_array().unwrap() {
            match parameter["setting"].as_str() {
                Some(setting) => assert!(names.contains(&setting), "{setting}"),
                None => assert_ne!(effect["plant"], "catheter", "{effect}"),
            }
        }
    }
    let tips = json(&["tips", "--json"]);
    assert!(tips.as_array().unwrap().iter().any(|tip| tip["name"] == "cobra-2"));
}

/// A drive of 20 kg, twice the same motion with whole periods in it; its command is the inertia and
/// `force` of the speed \[m/s\].
fn drive(force: impl Fn(f64) -> f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rig = "format = \"trial-bundle/1\"\nname = \"made\"\nplant = \"drive\"\n[drive]\n\
        moving_mass_kg = 20.0\n[sensor]\nposition_noise_sd_m = 1e-9\n";
    std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
    std::fs::create_dir(folder.path().join("trials")).unwrap();
    for number in 0..2 {
        let mut text = String::from("t_s,setpoint_m,position_m,drive_command_N\n");
        for i in 0..5000_u32 {
            let (t_s, rate) = (1e-3 * f64::from(i), std::f64::consts::TAU / 2.5);
            let (slow, fast) = ((rate * t_s).sin_cos(), (3.0 * rate * t_s).sin_cos());
            let position_m = 0.05 * slow.0 + 0.02 * fast.0;
            let speed_m_per_s = rate * (0.05 * slow.1 + 0.06 * fast.1);
            let inertia_n = -20.0 * rate * rate * (0.05 * slow.0 + 0.18 * fast.0);
            // Noise of a motor's current, another one in every trial.
            let noise_n = 0.05 * f64::from((i + 5000 * number).wrapping_mul(2_654_435_761) >> 8)
                / f64::from(1 << 24);
            let command_n = inertia_n + force(speed_m_per_s) + noise_n;
            text += &format!("{t_s},{position_m},{position_m},{command_n}\n");
        }
        std::fs::write(folder.path().join(format!("trials/{number:03}.csv")), text).unwrap();
    }
    folder
}

#[test]
fn an_effect_that_is_taken_out_of_the_model_is_found_again() {
    let folder = drive(|speed_m_per_s| 6.0 * speed_m_per_s.signum() + 30.0 * speed_m_per_s);
    let found = json(&["gap", "ablation", folder.path().to_str().unwrap(), "--json"]);
    for missing in ["drive.coulomb", "drive.viscous"] {
        let rows = found.as_array().unwrap();
        let row = rows.iter().find(|row| row["missing"] == missing).unwrap();
        assert_eq!((&row["found"], &row["named"][0]), (&true.into(), &missing.into()), "{found}");
        assert!(row["shrink"].as_f64().unwrap() > 0.8, "{found}");
    }
    // Where nothing is named, nothing can be taken out.
    let output = cathforce(&["gap", "ablation", drive(|_| 0.0).path().to_str().unwrap()]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("no effect is named") && said.contains("fix:"), "{said}");
}

#[test]
fn isolability_says_the_smallest_friction_that_a_drive_s_trials_show() {
    let (force_n, noise_n) = (6.0, 0.05);
    let folder = drive(|speed_m_per_s| force_n * speed_m_per_s.signum() + 30.0 * speed_m_per_s);
    let bundle = folder.path().to_str().unwrap();
    let table = folder.path().join("seen.json");
    let asked = ["gap", "isolability", bundle, "--json", "--out", table.to_str().unwrap()];
    let output = cathforce(&asked);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&std::fs::read(table).unwrap()).unwrap();
    assert_eq!((&found["rig"], &found["motion"]), (&"made".into(), &"trials".into()), "{found}");
    let effects = found["effects"].as_array().unwrap();
    let coulomb = effects.iter().find(|effect| effect["id"] == "drive.coulomb").unwrap();
    let smallest_n = coulomb["smallest"][0]["value"].as_f64().unwrap();
    // Ten thousand samples show less than the noise of one.
    assert!(0.0 < smallest_n && smallest_n < noise_n, "{coulomb}");
}

#[test]
fn coverage_goes_on_past_a_bundle_that_cannot_be_read_and_says_which() {
    let folder = drive(|_| 0.0);
    let whole = folder.path().to_str().unwrap();
    let output = cathforce(&["gap", "coverage", "nowhere", whole]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    let warned = said.contains("nowhere") && said.contains("a drive on its own has none");
    assert!(warned && said.contains("1 of 2 bundles have no row"), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("| all |"));
    // Alone it is the failure itself.
    let output = cathforce(&["gap", "coverage", "nowhere"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(3), 0));
}
