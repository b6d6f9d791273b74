//! Reading of well-formed bundles.

mod support;

use std::fs;

use cathforce_bundle::bundle::{Plant, TrialData};
use cathforce_bundle::geometry::read_stl;
use cathforce_bundle::{Bundle, Place};
use proptest::prelude::*;
use support::{RIG, TRIAL, example, write_bundle};

#[test]
fn the_example_opens_without_a_warning() {
    let bundle = Bundle::open(example()).unwrap();
    assert_eq!(bundle.warnings, []);
    assert_eq!(bundle.rig.name, "tapered-bifurcation");
    assert_eq!(bundle.rig.sensor.force_rate_hz, Some(250.0));
    let rig = bundle.catheter().unwrap();
    assert_eq!(rig.instrument.sections[1].youngs_modulus_pa, 50e6);
    assert_eq!(rig.instrument.tip_precurve[1].curvature_per_m, 100.0);
    assert_eq!(bundle.trials.iter().map(|trial| trial.number).collect::<Vec<_>>(), [0, 1, 2, 3]);
    let trial = bundle.trial(2).unwrap();
    let data = trial.catheter().unwrap();
    assert_eq!(data.shape_m.len(), 8);
    assert_eq!(data.insertion_m[0], 0.028);
    assert!(trial.duration_s() > 9.0);
    let tips = data.tip_m.as_ref().unwrap().iter().flatten().count();
    assert!(tips > 50 && tips < trial.len() / 2, "a slow channel with gaps: {tips}");
}

#[test]
fn encoders_are_interpolated_between_rows_and_held_outside_them() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let bundle = Bundle::open(folder.path()).unwrap();
    let at = |t_s| {
        let reading = bundle.trials[0].encoder_at(t_s).unwrap();
        (reading.insertion_m, reading.rotation_rad)
    };
    let near = |a: (f64, f64), b: (f64, f64)| {
        assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
    };
    near(at(-1.0), (0.010, 0.0));
    near(at(0.0), (0.010, 0.0));
    near(at(0.1), (0.011, 0.05));
    near(at(0.2), (0.012, 0.1));
    near(at(0.3), (0.014, 0.2));
    near(at(0.4), (0.016, 0.3));
    near(at(9.0), (0.016, 0.3));
}

/// Opens a small bundle with this trial; returns it with its warnings.
fn with_trial(rows: &str) -> (Bundle, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("trials/000.csv"), rows).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let said = bundle.warnings.iter().map(ToString::to_string).collect();
    (bundle, said)
}

#[test]
fn rows_of_one_time_are_one() {
    // The clock is too coarse to tell a row of the camera from one of the force sensor.
    let (bundle, said) = with_trial(
        "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,tip_x_m,tip_y_m,tip_z_m\n\
         0.00,0.010,0.0,0.1,0.0,0.0,,,\n0.00,0.010,0.0,,,,0.01,0.0,0.0\n\
         0.01,0.012,0.1,0.2,0.0,0.0,,,\n0.010,0.014,0.1,0.4,0.0,0.0,,,\n0.02,0.016,0.2,,,,,,\n",
    );
    let trial = &bundle.trials[0];
    let data = trial.catheter().unwrap();
    assert_eq!(trial.t_s, [0.0, 0.01, 0.02]);
    let near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-12;
    assert!(data.insertion_m.iter().zip([0.010, 0.013, 0.016]).all(near), "{data:?}");
    let [first, second, third] = &data.force_n.as_ref().unwrap()[..] else { panic!("{data:?}") };
    assert_eq!((first, third), (&Some([0.1, 0.0, 0.0]), &None));
    assert!((second.unwrap()[0] - 0.3).abs() < 1e-15);
    assert_eq!(data.tip_m.as_ref().unwrap()[..2], [Some([0.01, 0.0, 0.0]), None]);
    let [said] = &said[..] else { panic!("{said:?}") };
    assert!(said.contains("2 rows have the time of the row before") && said.contains("000.csv"));
}

#[test]
fn encoders_of_fewer_rows_are_read_between_them() {
    let (bundle, said) = with_trial(
        "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N\n0.00,,0.0,0.1,0.0,0.0\n\
         0.05,0.010,,0.2,0.0,0.0\n0.10,,,0.3,0.0,0.0\n0.20,0.013,0.4,0.4,0.0,0.0\n\
         0.25,,0.4,0.4,0.0,0.0\n",
    );
    let data = bundle.trials[0].catheter().unwrap();
    let near = |found: &[f64], exact: [f64; 5]| {
        assert!(found.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    };
    near(&data.insertion_m, [0.010, 0.010, 0.011, 0.013, 0.013]);
    near(&data.rotation_rad, [0.0, 0.1, 0.2, 0.4, 0.4]);
    let [insertion, rotation] = &said[..] else { panic!("{said:?}") };
    assert!(insertion.contains("insertion_m has no value in 3 of 5 rows"), "{insertion}");
    assert!(rotation.contains("rotation_rad has no value in 2 of 5 rows"), "{rotation}");
}

#[test]
fn a_drive_is_a_bundle_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("trials")).unwrap();
    let rig = "format = \"trial-bundle/1\"\nname = \"axis\"\nplant = \"drive\"\n[drive]\n\
               moving_mass_kg = 95.1\n[sensor]\nposition_noise_sd_m = 1.0e-6\n";
    fs::write(path.join("rig.toml"), rig).unwrap();
    let rows = "t_s,setpoint_m,position_m,drive_command_N\n0,0.1,0.0,89.2\n0.001,,0.1,92.0\n\
                0.002,0.1,,92.0\n0.003,,,\n0.004,0.1,0.1,\n";
    fs::write(path.join("trials/000.csv"), rows).unwrap();
    let bundle = Bundle::open(path).unwrap();
    assert!(matches!(bundle.rig.plant, Plant::Drive(drive) if drive.inertia == 95.1));
    let TrialData::Drive(data) = &bundle.trials[0].data else { panic!("a drive's trial") };
    assert_eq!(data.setpoint, Some(vec![Some(0.1), None]));
    assert_eq!(bundle.trials[0].encoder_at(0.0), None);

    // A catheter's tables are unknown here.
    fs::write(path.join("rig.toml"), format!("{rig}[vessel]\n")).unwrap();
    let error = Bundle::open(path).unwrap_err();
    assert_eq!(error.place, Place::LineColumn(8, 2));
    assert!(error.to_string().contains("`vessel`"), "{error}");
}

proptest! {
    /// Files with any content are read or refused; nothing panics.
    #[test]
    fn any_change_of_a_file_is_read_or_refused(
        file in 0..2_usize,
        at in any::<prop::sample::Index>(),
        length in 0..12_usize,
        insert in "[-0-9a-z\\[\\]{}\"=,.\n#]{0,8}",
    ) {
        let (name, text) = [("rig.toml", RIG), ("trials/000.csv", TRIAL)][file];
        let start = at.index(text.len());
        let end = (start + length).min(text.len());
        let mut changed = text.as_bytes().to_vec();
        changed.splice(start..end, insert.bytes());
        let folder = tempfile::tempdir().unwrap();
        write_bundle(folder.path());
        fs::write(folder.path().join(name), changed).unwrap();
        if let Err(error) = Bundle::open(folder.path()) {
            prop_assert!(error.file.ends_with(name));
            prop_assert!(error.to_string().contains("fix: "));
        }
    }

    #[test]
    fn any_bytes_are_an_stl_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_stl(&bytes);
        let _ = read_stl(&[b"solid ", &bytes[..]].concat());
    }
}
