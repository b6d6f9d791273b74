//! Drives on their own: linear and rotary axes, motors, loads, and what is refused of them.

use std::fs;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Driven, Plant, TrialData};
use tempfile::TempDir;

const ROWS: &str = "0,0.0,1.0\n0.001,0.1,2.0\n0.002,0.2,3.0\n";

fn folder(drive: &str, heading: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rig = format!("format = \"trial-bundle/1\"\nname = \"axis\"\nplant = \"drive\"\n\n{drive}");
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::create_dir(folder.path().join("trials")).unwrap();
    fs::write(folder.path().join("trials/003.csv"), format!("{heading}\n{ROWS}")).unwrap();
    folder
}

fn driven(folder: &Path) -> Driven {
    let bundle = Bundle::open(folder).unwrap();
    let (Plant::Drive(rig), TrialData::Drive(data)) = (&bundle.rig.plant, &bundle.trials[0].data)
    else {
        panic!("a drive")
    };
    rig.driven(3, data)
}

#[test]
fn a_motor_gives_its_torque_at_the_axis() {
    const ROTARY: &str = "[drive]\nmoving_inertia_kg_m2 = 0.01\n[drive.motor]\n\
                          torque_constant_Nm_per_A = 0.05\ngear_ratio = 10.0\n\
                          rotor_inertia_kg_m2 = 1e-5\nresistance_ohm = 2.0\n";
    let own = driven(folder(ROTARY, "t_s,position_rad,motor_current_A").path());
    assert_eq!((own.command, own.load, own.induced), (vec![0.5, 1.0, 1.5], None, 0.0));
    assert!((own.inertia - 0.011).abs() < 1e-12, "{}", own.inertia);
    // 1 V drives 0.5 A through 2 Ω; 1 rad/s of the axis induces 0.05 · 10 V.
    let own = driven(folder(ROTARY, "t_s,position_rad,motor_voltage_V").path());
    assert_eq!(own.command, [0.25, 0.5, 0.75]);
    assert!((own.induced - 0.125).abs() < 1e-12, "{}", own.induced);
    let stated = ROTARY.to_owned() + "back_emf_V_s_per_rad = 0.1\n";
    let own = driven(folder(&stated, "t_s,position_rad,motor_voltage_V").path());
    assert!((own.induced - 0.25).abs() < 1e-12, "{}", own.induced);
    // A screw of 2π mm turns 1000 rad a metre.
    const SCREW: &str = "[drive]\nmoving_mass_kg = 2.0\n[drive.motor]\n\
                         torque_constant_Nm_per_A = 0.05\nlead_m_per_turn = 6.283185307179586e-3\n\
                         rotor_inertia_kg_m2 = 1e-6\n";
    let own = driven(folder(SCREW, "t_s,position_m,motor_current_A").path());
    assert!((own.command[0] - 50.0).abs() < 1e-9 && (own.inertia - 3.0).abs() < 1e-9, "{own:?}");
    const LINEAR: &str =
        "[drive]\nmoving_mass_kg = 2.0\n[drive.motor]\nforce_constant_N_per_A = 40.0\n";
    let own = driven(folder(LINEAR, "t_s,position_m,motor_current_A").path());
    assert_eq!((own.command[0], own.inertia), (40.0, 2.0));
}

#[test]
fn loads_of_a_column_a_pendulum_and_a_payload_add_up() {
    const RIG: &str = "[drive]\nmoving_inertia_kg_m2 = 0.01\n\
                       [drive.pendulum]\nmass_kg = 0.5\nlength_m = 0.1\nhangs_at_rad = 0.1\n\
                       [[drive.carried]]\ntrial = 3\nmass_kg = 0.2\nlength_m = 0.2\nload_Nm = 0.3\n";
    let own = driven(folder(RIG, "t_s,position_rad,drive_command_Nm").path());
    assert!((own.inertia - 0.018).abs() < 1e-12, "{}", own.inertia);
    let weight = 9.806_65 * (0.5 * 0.1 + 0.2 * 0.2);
    let load = own.load.unwrap();
    for (load, angle) in load.iter().zip([0.0_f64, 0.1, 0.2]) {
        assert!((load - 0.3 - weight * (angle - 0.1).sin()).abs() < 1e-12, "{load} at {angle}");
    }
    const SLIDE: &str =
        "[drive]\nmoving_mass_kg = 2.0\n[[drive.carried]]\ntrial = 3\nmass_kg = 0.5\n";
    let folder = folder(SLIDE, "t_s,position_m,drive_command_N");
    let own = driven(folder.path());
    assert_eq!((own.inertia, own.load), (2.5, None));
    let rows = "t_s,position_m,drive_command_N,load_N\n0,0,1,4\n0.001,0.1,1,5\n";
    fs::write(folder.path().join("trials/003.csv"), rows).unwrap();
    assert_eq!(driven(folder.path()).load, Some(vec![4.0, 5.0]));
}

#[test]
fn what_contradicts_itself_is_refused_by_name_and_line() {
    const LINEAR: &str = "t_s,position_m,drive_command_N";
    const ROTARY: &str = "t_s,position_rad,drive_command_Nm";
    const TURNS: &str = "[drive]\nmoving_inertia_kg_m2 = 0.01\n";
    const SLIDES: &str = "[drive]\nmoving_mass_kg = 2.0\n";
    let of = |drive: &str, more: &str| format!("{drive}{more}");
    for (rig, heading, says) in [
        ("[drive]\n".to_owned(), LINEAR, ["rig.toml:5", "`drive.moving_mass_kg` is missing"]),
        (of(TURNS, "moving_mass_kg = 1.0\n"), ROTARY, ["rig.toml:7", "either linear or rotary"]),
        (
            of(TURNS, "[drive.motor]\n"),
            ROTARY,
            ["rig.toml:7", "`drive.motor.torque_constant_Nm_per_A` is missing"],
        ),
        (
            of(SLIDES, "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\n"),
            LINEAR,
            ["rig.toml:7", "`drive.motor.lead_m_per_turn` is missing"],
        ),
        (
            of(SLIDES, "[drive.motor]\nforce_constant_N_per_A = 0.1\ngear_ratio = 2.0\n"),
            LINEAR,
            ["rig.toml:9", "`drive.motor.gear_ratio` stands beside `force_constant_N_per_A`"],
        ),
        (
            of(TURNS, "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\nlead_m_per_turn = 0.01\n"),
            ROTARY,
            ["rig.toml:9", "`drive.motor.lead_m_per_turn` is of a linear axis"],
        ),
        (
            of(
                TURNS,
                "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\nback_emf_V_s_per_rad = 0.1\n",
            ),
            ROTARY,
            ["rig.toml:9", "without `resistance_ohm`"],
        ),
        (
            of(SLIDES, "[drive.pendulum]\nmass_kg = 1.0\nlength_m = 0.1\n"),
            LINEAR,
            ["rig.toml:7", "`drive.pendulum` is of a rotary axis"],
        ),
        (
            of(TURNS, "[[drive.carried]]\ntrial = 3\nmass_kg = 1.0\nlength_m = 0.1\n"),
            ROTARY,
            ["rig.toml:9", "no [drive.pendulum] says where down is"],
        ),
        (
            of(SLIDES, "[[drive.carried]]\ntrial = 3\nload_Nm = 1.0\n"),
            LINEAR,
            ["rig.toml:9", "is of the other kind of axis"],
        ),
        (
            of(SLIDES, "[[drive.carried]]\ntrial = 3\n[[drive.carried]]\ntrial = 3\n"),
            LINEAR,
            ["rig.toml:10", "another table names too"],
        ),
        (
            of(TURNS, "[sensor]\nposition_noise_sd_m = 1e-6\n"),
            ROTARY,
            ["rig.toml:8", "`sensor.position_noise_sd_m` is in a unit of a linear axis"],
        ),
        (
            of(SLIDES, "[priors]\ntorque_bias_sd_Nm = 1e-6\n"),
            LINEAR,
            ["rig.toml:8", "`priors.torque_bias_sd_Nm` is in a unit of a rotary axis"],
        ),
        (TURNS.to_owned(), LINEAR, ["003.csv:1:2", "`position_m` is of a linear axis"]),
        (SLIDES.to_owned(), ROTARY, ["003.csv:1:2", "`position_rad` is of a rotary axis"]),
        (
            SLIDES.to_owned(),
            "t_s,position_m,drive_command_Nm",
            ["003.csv:1:3", "not in the unit of `position_m`"],
        ),
        (SLIDES.to_owned(), "t_s,position_m,motor_current_A", ["003.csv:1:3", "no [drive.motor]"]),
        (
            of(TURNS, "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\n"),
            "t_s,position_rad,motor_voltage_V",
            ["003.csv:1:3", "no resistance_ohm"],
        ),
        (
            of(TURNS, "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\n"),
            "motor_current_A,position_rad,motor_voltage_V",
            ["003.csv:1", "column `t_s` is missing"],
        ),
        (SLIDES.to_owned(), "t_s,position_m,load_N", ["003.csv:1", "`drive_command_N` is missing"]),
    ] {
        let refused = Bundle::open(folder(&rig, heading).path()).unwrap_err().to_string();
        for part in says {
            assert!(refused.contains(part), "{rig}\n{heading}\n{part}\n{refused}");
        }
        assert!(refused.contains("fix: "), "{refused}");
    }
    let two = folder(&of(TURNS, "[drive.motor]\ntorque_constant_Nm_per_A = 0.1\n"), "t_s");
    let rows = "t_s,position_rad,motor_current_A,drive_command_Nm\n0,0,1,1\n";
    fs::write(two.path().join("trials/003.csv"), rows).unwrap();
    let refused = Bundle::open(two.path()).unwrap_err().to_string();
    assert!(refused.contains("both say what drives the axis"), "{refused}");
}
