//! Table `[drive]`: an axis on its own, its motor, and what it carries.

use std::f64::consts::TAU;

use super::cause::RigCause;
use super::toml_reader::{NOT_NEGATIVE, POSITIVE, TableReader};
use crate::axis::Axis;

/// Acceleration of free fall \[m/s²\].
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// One axis on its own. Quantities of a rotary axis are in rad, N·m and kg·m², of a linear one in m, N and kg.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveRig {
    pub axis: Axis,
    /// Of all that moves, the motor's rotor included, as seen at the axis.
    pub inertia: f64,
    pub motor: Option<RigMotor>,
    pub pendulum: Option<RigPendulum>,
    pub carried: Vec<RigCarried>,
}

/// Table `[drive.motor]`, as seen at the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigMotor {
    /// Force or torque of the axis for each ampere.
    pub force_per_ampere: f64,
    /// Voltage that the moving axis induces, for each m/s or rad/s.
    pub induced_v_per_speed: f64,
    pub resistance_ohm: Option<f64>,
}

/// Table `[drive.pendulum]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigPendulum {
    /// Torque that holds it level \[N·m\].
    pub torque_nm: f64,
    /// Position at which it hangs straight down.
    pub hangs_at_rad: f64,
}

/// One table of `[[drive.carried]]`: what one trial carries beside what always moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigCarried {
    pub trial: u32,
    /// Payload \[kg\], and its distance from a rotary axis.
    pub mass_kg: f64,
    pub length_m: f64,
    /// Constant force or torque.
    pub load: f64,
}

pub(super) const DRIVE_KEYS: [&str; 5] =
    ["moving_mass_kg", "moving_inertia_kg_m2", "motor", "pendulum", "carried"];
const MOTOR_KEYS: [&str; 8] = [
    "torque_constant_Nm_per_A",
    "force_constant_N_per_A",
    "gear_ratio",
    "lead_m_per_turn",
    "rotor_inertia_kg_m2",
    "resistance_ohm",
    "back_emf_V_s_per_rad",
    "back_emf_V_s_per_m",
];
const PENDULUM_KEYS: [&str; 3] = ["mass_kg", "length_m", "hangs_at_rad"];
const CARRIED_KEYS: [&str; 5] = ["trial", "mass_kg", "length_m", "load_N", "load_Nm"];

/// Reports a key that contradicts the rest of its table.
fn refuse(table: &TableReader<'_>, key: &str, why: &'static str, fix: &'static str) {
    if table.has(key) {
        table.report(
            table.place_of(key),
            RigCause::Contradiction { key: table.path(key), why, fix },
        );
    }
}

/// Reports keys in the unit of an axis of the other kind; anything but a rotary axis has metres and newtons.
pub(super) fn refuse_other_axis(
    table: &TableReader<'_>,
    axis: Option<Axis>,
    linear: &[&str],
    rotary: &[&str],
) {
    match axis {
        Some(Axis::Rotary) => {
            for key in linear {
                refuse(
                    table,
                    key,
                    "is in a unit of a linear axis, but [drive] has moving_inertia_kg_m2",
                    "write the key whose name ends in rad or Nm",
                );
            }
        }
        _ => {
            for key in rotary {
                refuse(
                    table,
                    key,
                    "is in a unit of a rotary axis, but rig.toml has no moving_inertia_kg_m2 in [drive]",
                    "write the key whose name ends in m or N",
                );
            }
        }
    }
}

pub(super) fn read_drive(root: &TableReader<'_>) -> DriveRig {
    let table = root.table("drive", &DRIVE_KEYS);
    let axis = match table.has("moving_inertia_kg_m2") {
        true => Axis::Rotary,
        false => Axis::Linear,
    };
    let own = match axis {
        Axis::Linear => table.number_in("moving_mass_kg", POSITIVE, "above 0"),
        Axis::Rotary => {
            refuse(
                &table,
                "moving_mass_kg",
                "stands beside `moving_inertia_kg_m2`: an axis is either linear or rotary",
                "keep moving_mass_kg of a linear axis, or moving_inertia_kg_m2 of a rotary one",
            );
            table.number_in("moving_inertia_kg_m2", POSITIVE, "above 0")
        }
    };
    let (motor, rotor) =
        read_motor(&table, axis).map_or((None, 0.0), |(m, rotor)| (Some(m), rotor));
    let pendulum = read_pendulum(&table, axis);
    let carried = read_carried(&table, axis, pendulum.is_some());
    DriveRig { axis, inertia: own + rotor, motor, pendulum, carried }
}

/// The motor, and its rotor's inertia as seen at the axis.
fn read_motor(drive: &TableReader<'_>, axis: Axis) -> Option<(RigMotor, f64)> {
    const OF_LINEAR: &str = "is of a linear motor, which turns nothing";
    let table = drive.optional_table("motor", &MOTOR_KEYS)?;
    let number = |key| table.optional_number_in(key, POSITIVE, "above 0");
    let is_linear_motor = axis == Axis::Linear && table.has("force_constant_N_per_A");
    if axis == Axis::Rotary {
        let fix = "a rotary axis has torque_constant_Nm_per_A, gear_ratio and back_emf_V_s_per_rad";
        for key in ["force_constant_N_per_A", "lead_m_per_turn", "back_emf_V_s_per_m"] {
            refuse(&table, key, "is of a linear axis, but [drive] has moving_inertia_kg_m2", fix);
        }
    }
    if is_linear_motor {
        let fix = "a linear motor has force_constant_N_per_A and back_emf_V_s_per_m; one that turns a \
                   screw or a belt has torque_constant_Nm_per_A and lead_m_per_turn";
        for key in [
            "torque_constant_Nm_per_A",
            "gear_ratio",
            "lead_m_per_turn",
            "rotor_inertia_kg_m2",
            "back_emf_V_s_per_rad",
        ] {
            refuse(
                &table,
                key,
                "stands beside `force_constant_N_per_A`, which is of a linear motor",
                fix,
            );
        }
    } else if axis == Axis::Linear {
        let fix = "write back_emf_V_s_per_rad: a motor that turns has its constant for each rad/s";
        refuse(&table, "back_emf_V_s_per_m", OF_LINEAR, fix);
    }
    let gear = number("gear_ratio").unwrap_or(1.0);
    // Angle of the motor for each unit of the axis.
    let (constant, turned, emf) = match (axis, is_linear_motor) {
        (_, true) => (
            table.number_in("force_constant_N_per_A", POSITIVE, "above 0"),
            1.0,
            "back_emf_V_s_per_m",
        ),
        (Axis::Rotary, _) => {
            let torque = table.number_in("torque_constant_Nm_per_A", POSITIVE, "above 0");
            (torque, gear, "back_emf_V_s_per_rad")
        }
        (Axis::Linear, _) => {
            let torque = table.number_in("torque_constant_Nm_per_A", POSITIVE, "above 0");
            let lead = table.number_in("lead_m_per_turn", POSITIVE, "above 0");
            (torque, gear * TAU / lead, "back_emf_V_s_per_rad")
        }
    };
    let resistance_ohm = number("resistance_ohm");
    if resistance_ohm.is_none() {
        refuse(
            &table,
            emf,
            "is given without `resistance_ohm`, and volts need both",
            "add resistance_ohm, or take the key out where amperes are recorded",
        );
    }
    // In SI units, volts for each rad/s are newton metres for each ampere.
    let induced = number(emf).unwrap_or(constant);
    let rotor =
        table.optional_number_in("rotor_inertia_kg_m2", NOT_NEGATIVE, "at least 0").unwrap_or(0.0);
    let motor = RigMotor {
        force_per_ampere: constant * turned,
        induced_v_per_speed: induced * turned,
        resistance_ohm,
    };
    Some((motor, rotor * turned * turned))
}

fn read_pendulum(drive: &TableReader<'_>, axis: Axis) -> Option<RigPendulum> {
    if axis == Axis::Linear {
        let fix = "give moving_inertia_kg_m2 and angles of a rotary axis; the weight on a linear one is a \
                   load_N in [[drive.carried]] or in the trials";
        refuse(
            drive,
            "pendulum",
            "is of a rotary axis, but [drive] has no moving_inertia_kg_m2",
            fix,
        );
        return None;
    }
    let table = drive.optional_table("pendulum", &PENDULUM_KEYS)?;
    let mass_kg = table.number_in("mass_kg", POSITIVE, "above 0");
    let length_m = table.number_in("length_m", POSITIVE, "above 0");
    let hangs_at_rad = table.optional_number("hangs_at_rad").map_or(0.0, |own| own.value);
    Some(RigPendulum { torque_nm: mass_kg * length_m * GRAVITY_M_PER_S2, hangs_at_rad })
}

fn read_carried(drive: &TableReader<'_>, axis: Axis, hangs: bool) -> Vec<RigCarried> {
    const TRIALS: std::ops::RangeInclusive<f64> = 0.0..=4_294_967_295.0;
    let tables = drive.tables("carried", &CARRIED_KEYS);
    let mut numbers = Vec::new();
    let read = |table: &TableReader<'_>| {
        let trial = table.number_in("trial", TRIALS, "the number of a trial");
        if trial.fract() != 0.0 {
            let meaning = "a whole number, that of a trial's file";
            let cause = RigCause::Range { key: table.path("trial"), value: trial, meaning };
            table.report(table.place_of("trial"), cause);
        }
        if numbers.contains(&trial) {
            let (why, fix) =
                ("names a trial that another table names too", "write one table a trial");
            refuse(table, "trial", why, fix);
        }
        numbers.push(trial);
        let mass_kg = table.optional_number_in("mass_kg", NOT_NEGATIVE, "at least 0");
        let length_m = table.optional_number_in("length_m", NOT_NEGATIVE, "at least 0");
        let (load, other) = match axis {
            Axis::Linear => ("load_N", "load_Nm"),
            Axis::Rotary => ("load_Nm", "load_N"),
        };
        refuse(
            table,
            other,
            "is of the other kind of axis",
            "write load_N of a linear axis, load_Nm of a rotary one",
        );
        match axis {
            Axis::Linear => refuse(
                table,
                "length_m",
                "is a distance from a rotary axis, but [drive] has no moving_inertia_kg_m2",
                "take it out",
            ),
            Axis::Rotary if mass_kg.is_some() && !hangs => refuse(
                table,
                "mass_kg",
                "hangs on a rotary axis of which no [drive.pendulum] says where down is",
                "add [drive.pendulum], or give the weight as load_Nm and the inertia in \
                 moving_inertia_kg_m2",
            ),
            Axis::Rotary if mass_kg.is_some() && length_m.is_none() => {
                let key = table.path("length_m");
                table.report(table.place(), RigCause::MissingKey { key, kind: "a number" });
            }
            Axis::Rotary => {}
        }
        RigCarried {
            trial: trial as u32,
            mass_kg: mass_kg.unwrap_or(0.0),
            length_m: length_m.unwrap_or(0.0),
            load: table.optional_number(load).map_or(0.0, |own| own.value),
        }
    };
    tables.iter().map(read).collect()
}
