//! Transmissions: what rig.toml states of them, their trials, and what is refused.

use std::fs;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Axis, Plant, TrialData};
use tempfile::TempDir;

fn folder(transmission: &str, heading: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rig = format!(
        "format = \"trial-bundle/1\"\nname = \"cable\"\nplant = \"transmission\"\n\n{transmission}"
    );
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::create_dir(folder.path().join("trials")).unwrap();
    let fields = heading.split(',').count();
    let row = |t: u32| {
        let others =
            (1..fields).map(|k| format!(",{}", f64::from(t) * k as f64)).collect::<String>();
        format!("0.0{t}{others}\n")
    };
    let rows: String = (0..5).map(row).collect();
    fs::write(folder.path().join("trials/000.csv"), format!("{heading}\n{rows}")).unwrap();
    folder
}

#[test]
fn a_transmission_is_read_with_all_that_it_may_state() {
    const ALL: &str = "[transmission]\ngain_rad_per_m = -40.0\ndead_zone_m = 1e-4\n\
                       dead_zone_follows = 0.2\ncompliance_rad_per_Nm = 0.1\ntime_constant_s = 0.02\n\
                       [transmission.sheath]\nbend_rad = 3.0\nfriction_coefficient = 0.1\npull_N = 5.0\n\
                       tendon_N_per_m = 2e4\n[transmission.bouc_wen]\nheight_m = 1e-4\nlength_m = 1e-3\n\
                       [sensor]\noutput_noise_sd_rad = 1e-3\n[priors]\noutput_zero_sd_rad = 0.01\n";
    let bundle =
        Bundle::open(folder(ALL, "t_s,input_m,output_rad,load_Nm,bend_rad").path()).unwrap();
    assert_eq!(bundle.warnings, []);
    let Plant::Transmission(rig) = &bundle.rig.plant else { panic!("a transmission") };
    assert_eq!((rig.input, rig.output, rig.gain), (Axis::Linear, Axis::Rotary, -40.0));
    assert_eq!((rig.dead_zone, rig.dead_zone_follows, rig.compliance), (1e-4, 0.2, 0.1));
    assert_eq!(rig.sheath.unwrap().return_n_per_m, 0.0);
    assert_eq!(rig.bouc_wen.unwrap().sharpness, 1.0);
    assert_eq!(bundle.rig.sensor.output_noise_sd, Some(1e-3));
    assert_eq!(bundle.rig.priors.output_zero_sd, Some(0.01));
    let TrialData::Transmission(data) = &bundle.trials[0].data else { panic!("its trial") };
    assert_eq!((data.input[2], data.output[2]), (2.0, 4.0));
    assert_eq!((data.load.as_ref().unwrap()[2], data.bend_rad.as_ref().unwrap()[2]), (6.0, 8.0));
    assert!(bundle.catheter().is_none());
}

#[track_caller]
fn refused(transmission: &str, heading: &str, words: &[&str]) {
    let says = Bundle::open(folder(transmission, heading).path()).unwrap_err().to_string();
    for word in words {
        assert!(says.contains(word), "`{word}` is not in: {says}");
    }
}

const PLAIN: &str = "[transmission]\ngain_m_per_m = 1.0\n";
const COLUMNS: &str = "t_s,input_m,output_m";

#[test]
fn what_contradicts_itself_is_refused_with_its_place() {
    let with = |more: &str| PLAIN.to_owned() + more;
    refused("[transmission]\n", COLUMNS, &["`transmission.gain_m_per_m` is missing"]);
    refused("[transmission]\ngain_m_per_m = 0.0\n", COLUMNS, &["has to be not 0"]);
    refused(&with("gain_rad_per_m = 2.0\n"), COLUMNS, &["another gain"]);
    refused(&with("dead_zone_rad = 0.1\n"), COLUMNS, &["rig.toml:7", "unit of the input"]);
    refused(&with("compliance_rad_per_Nm = 0.1\n"), COLUMNS, &["unit of the output"]);
    refused(&with("dead_zone_m = -1.0\n"), COLUMNS, &["at least 0"]);
    refused(&with("dead_zone = 1.0\n"), COLUMNS, &["did you mean `dead_zone_m`"]);
    let steep = "[transmission.bouc_wen]\nheight_m = 2e-3\nlength_m = 1e-3\n";
    refused(&with(steep), COLUMNS, &["height is above its length"]);
    let steep = "[transmission.prandtl_ishlinskii]\nheight_m = 2e-3\nradius_m = 3e-3\n";
    refused(&with(steep), COLUMNS, &["above its radius"]);
    let angle = "[transmission]\ngain_m_per_rad = 1.0\n[transmission.sheath]\nbend_rad = 1.0\n\
                 friction_coefficient = 0.1\npull_N = 1.0\ntendon_N_per_m = 1.0\n";
    refused(angle, "t_s,input_rad,output_m", &["whose input is a length"]);
    refused(&with("[drive]\nmoving_mass_kg = 1.0\n"), COLUMNS, &["belongs to a drive"]);
    refused(&with("[sensor]\noutput_noise_sd_rad = 1.0\n"), COLUMNS, &["unit of the output"]);
}

#[test]
fn trials_have_the_columns_of_the_gain() {
    refused(PLAIN, "t_s,input_m,output_rad", &["000.csv:1:3", "not in m", "gain_rad_per_m"]);
    refused(PLAIN, "t_s,input_m,position_m", &["position_m"]);
    refused(PLAIN, "t_s,input_m", &["output_m"]);
    refused(PLAIN, "t_s,input_m,input_rad,output_m", &["same position in two units"]);
    refused(PLAIN, "t_s,input_m,output_m,load_Nm", &["which is `load_N`"]);
    refused(PLAIN, "t_s,input_m,output_m,bend_rad", &["no [transmission.sheath]"]);
}
