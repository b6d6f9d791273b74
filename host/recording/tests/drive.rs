//! Trials of a drive on its own read back exactly.

use std::fs;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Axis, CommandKind, DriveTrial, TrialData};
use cathforce_recording::write_drive;

const RIG: &str = "format = \"trial-bundle/1\"\nname = \"axis\"\nplant = \"drive\"\n\n[drive]\n\
                   moving_mass_kg = 95.1\n";

#[test]
fn a_drives_trial_is_read_back_as_it_was_written() {
    let t_s = [0.0, 1.00002e-3, 2.0 / 9.0];
    let with = |setpoint| DriveTrial {
        axis: Axis::Linear,
        kind: CommandKind::Force,
        position: vec![1e-7, -0.1, 1.0 / 3.0],
        command: vec![0.0, -12.25, 1e3 / 7.0],
        setpoint,
        load: None,
    };
    for data in [with(None), with(Some(vec![Some(0.1), None, Some(1.0 / 7.0)]))] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("rig.toml"), RIG).unwrap();
        fs::create_dir(folder.path().join("trials")).unwrap();
        let file = fs::File::create(folder.path().join("trials/000.csv")).unwrap();
        write_drive(&t_s, &data, file).unwrap();
        let bundle = Bundle::open(folder.path()).unwrap();
        assert_eq!(bundle.trials[0].t_s, t_s);
        assert_eq!(bundle.trials[0].data, TrialData::Drive(data));
    }
}
