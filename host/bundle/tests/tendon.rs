//! The tendon of a steerable instrument: `[tendon]` of `rig.toml`.

mod support;

use std::fs;

use cathforce_bundle::{Bundle, SolverDefaults, to_description};
use cathforce_mechanics::{Description, Tendon, parameters};
use support::{RIG, assert_refused, write_bundle};

const TENDON: &str = "\
[tendon]
pull_m = 0.002
stiffness_N_per_m = 2000.0
offset_m = 0.0005
length_m = 0.03
";

fn with(tendon: &str) -> String {
    format!("{RIG}\n{tendon}")
}

#[test]
fn a_rigs_tendon_is_the_models() {
    let described = |rig: &str| {
        let folder = tempfile::tempdir().unwrap();
        write_bundle(folder.path());
        fs::write(folder.path().join("rig.toml"), rig).unwrap();
        let bundle = Bundle::open(folder.path()).unwrap();
        let description: Description<f64> =
            to_description(&bundle, &SolverDefaults::default()).unwrap();
        description.tendon
    };
    assert_eq!(described(RIG), Tendon::none());
    let straight_up = Tendon {
        pull_m: 0.002,
        stiffness_n_per_m: 2000.0,
        offset_m: 0.0005,
        length_m: 0.03,
        angle_rad: 0.0,
    };
    assert_eq!(described(&with(TENDON)), straight_up);
    let turned = format!("{TENDON}angle_rad = 1.5\n");
    assert_eq!(described(&with(&turned)), Tendon { angle_rad: 1.5, ..straight_up });
}

#[test]
fn a_rig_may_have_what_the_devices_settings_may() {
    let most = |key: &str| parameters().find(|parameter| parameter.key == key).unwrap().max;
    let [pull_m, stiffness] = ["tendon.pull_m", "tendon.stiffness_n_per_m"].map(most);
    let open = |pull_m: f64, stiffness: f64| {
        let folder = tempfile::tempdir().unwrap();
        write_bundle(folder.path());
        let tendon = TENDON.replacen("0.002", &format!("{pull_m:?}"), 1);
        let tendon = tendon.replacen("2000.0", &format!("{stiffness:?}"), 1);
        fs::write(folder.path().join("rig.toml"), with(&tendon)).unwrap();
        Bundle::open(folder.path()).map(|_| ())
    };
    assert!(open(pull_m, stiffness).is_ok());
    assert!(open(1.01 * pull_m, stiffness).is_err());
    assert!(open(pull_m, 1.01 * stiffness).is_err());
}

#[test]
fn a_tendon_that_nothing_can_have_is_refused_with_its_place() {
    let refused = |good: &str, bad: &str, key: &str, at: &str, says: &str| {
        assert!(TENDON.contains(good), "the test replaces nothing");
        assert_refused(&with(&TENDON.replacen(good, bad, 1)), key, at, says);
    };
    refused("pull_m = 0.002", "pull_m = 2.0", "pull_m", "2.0", "between 0 and 0.05 m");
    refused("= 2000.0", "= 0.0", "stiffness_N_per_m = 0.0", "0.0", "above 0 and at most 100000");
    refused(
        "offset_m = 0.0005",
        "offset_m = 0.5",
        "offset_m",
        "0.5",
        "the instrument's outer radius",
    );
    refused("length_m = 0.03", "length_m = 30.0", "length_m = 30.0", "30.0", "instrument's length");
    refused("pull_m", "pul_m", "pul_m", "pul_m", "mean `pull_m`?");
    refused("offset_m = 0.0005\n", "", "[tendon]", "[tendon]", "offset_m` is missing");
}
