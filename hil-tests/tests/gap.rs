//! Switching an effect on makes the gap smaller on the emulated board.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use cathforce_bundle::bundle::TrialData;
use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_hil_tests::{EXAMPLE, bundle, estimates, program};

const FRICTION: (&str, f32) = ("wall.friction_coefficient", 0.45);
/// Time of the trial that is played: into contact and along the wall \[s\].
const PLAYED_S: f64 = 3.0;

/// The example's rig with the forces of a device whose wall has another friction.
fn sticky(folder: &Path) {
    let mut trial = bundle().trial(0).expect("a first trial").clone();
    let rows = trial.t_s.partition_point(|&t| t - trial.t_s[0] <= PLAYED_S);
    trial.t_s.truncate(rows);
    let TrialData::Catheter(data) = &mut trial.data else { unreachable!("a catheter") };
    // The deepest insertion decides the length of the links.
    data.insertion_m.truncate(rows);
    let rig = Bundle { trials: vec![trial.clone()], ..bundle().clone() };
    let parameters = vec![(FRICTION.0.to_owned(), FRICTION.1)];
    let options = ImageOptions { parameters, ..ImageOptions::default() };
    let (image, _) = device_image(&rig, &options).unwrap_or_else(|error| panic!("{error}"));
    let felt = estimates(&image, &trial);
    let mut csv = String::from("t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N\n");
    for &t_s in &trial.t_s {
        let at = trial.encoder_at(t_s).expect("a catheter");
        let tick = ((t_s - trial.t_s[0]) * 1e3).round() as usize;
        let [x, y, z] = felt[tick].force_n;
        let (insertion, rotation) = (at.insertion_m, at.rotation_rad);
        writeln!(csv, "{t_s},{insertion},{rotation},{x},{y},{z}").expect("a string");
    }
    fs::create_dir_all(folder.join("trials")).expect("a folder");
    fs::write(folder.join("trials/000.csv"), csv).expect("written");
    for name in ["rig.toml", "vessel.stl", "centreline.csv"] {
        fs::copy(Path::new(EXAMPLE).join(name), folder.join(name)).expect("the example");
    }
}

#[test]
fn an_applied_effect_closes_the_gap_on_the_emulated_board() {
    let folder = tempfile::tempdir().expect("a folder");
    let bundle = folder.path().join("sticky");
    sticky(&bundle);
    let settings = folder.path().join("settings.toml");
    let (key, value) = FRICTION;
    let text = format!("rig = \"tapered-bifurcation\"\n[set]\n\"{key}\" = {value}\n");
    fs::write(&settings, text).expect("written");
    let mut verify = Command::new(program());
    verify.args(["gap", "verify", "--json", "--quiet", "--link", "qemu", "--settings"]);
    let output = verify.arg(&settings).arg(&bundle).output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&said["differing_bits"], &said["link"]), (&0.into(), &"qemu".into()));
    let force = |name: &str| said["force_rms_N"][name].as_f64().expect("a force");
    assert!(force("before") > 1.3 * force("floor"), "{said}");
    // This is the device that was measured, except for quantisation on the bus.
    assert!(force("achieved") < 2e-4, "{said}");
    assert!(said["shrink"]["achieved"].as_f64() > Some(0.99), "{said}");
}
