//! Reading of `[priors]` of `rig.toml`.

mod support;

use std::fs;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::RigPriors;
use support::{RIG, assert_refused, write_bundle};

const PRIORS: &str = "\
[priors]
force_bias_sd_N = 0.001
registration_sd_rad = 0.01
wall_sd_m = 0.0002
wall_at_junctions_sd_m = 0.0005
";

const DRIVE: &str = "\
format = \"trial-bundle/1\"
name = \"axis\"
plant = \"drive\"

[drive]
moving_mass_kg = 95.0

[priors]
force_bias_sd_N = 40.0
";

fn open(rig: &str) -> Bundle {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    Bundle::open(folder.path()).unwrap()
}

fn with(priors: &str) -> String {
    format!("{RIG}\n{priors}")
}

#[test]
fn what_is_stated_is_read_and_the_rest_is_left_open() {
    assert_eq!(open(RIG).rig.priors, RigPriors::default());
    let stated = RigPriors {
        force_bias_sd_n: Some(0.001),
        registration_sd_rad: Some(0.01),
        wall_sd_m: Some(0.0002),
        wall_at_junctions_sd_m: Some(0.0005),
        ..RigPriors::default()
    };
    assert_eq!(open(&with(PRIORS)).rig.priors, stated);
}

#[test]
fn a_prior_in_another_unit_is_warned_of() {
    let said = |priors: &str| -> Vec<String> {
        open(&with(priors)).warnings.iter().map(ToString::to_string).collect()
    };
    let usual = said(PRIORS);
    let degrees = said(&PRIORS.replace("registration_sd_rad = 0.01", "registration_sd_rad = 0.5"));
    assert_eq!(degrees.len(), usual.len() + 1, "{degrees:?}");
    assert!(degrees.iter().any(|text| text.contains("degrees?")), "{degrees:?}");
}

#[test]
fn a_prior_that_nothing_can_have_is_refused_with_its_place() {
    assert_refused(
        &with(&PRIORS.replacen("wall_sd_m = 0.0002", "wall_sd_m = 0.0", 1)),
        "wall_sd_m",
        "0.0",
        "above 0",
    );
    // A drive on its own has no wall.
    let touching = format!("{DRIVE}wall_sd_m = 0.0002\n");
    assert_refused(&touching, "wall_sd_m", "wall_sd_m", "unknown key");
}
