//! What drives the axis of a trial, from its columns and what `rig.toml` states.

use crate::axis::{Axis, CommandKind};
use crate::rig::{DriveRig, GRAVITY_M_PER_S2, RigCarried};
use crate::trial::DriveTrial;

/// A trial's command and what is known of the axis in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// Force or torque of the drive at the axis.
    pub command: Vec<f64>,
    pub inertia: f64,
    /// Force or torque that it takes to hold the axis against what is known, by row.
    pub load: Option<Vec<f64>>,
    /// Force or torque for each m/s or rad/s, by which induced voltage brakes.
    pub induced: f64,
}

impl DriveRig {
    /// What drives a trial, in the unit of the axis.
    pub fn driven(&self, number: u32, data: &DriveTrial) -> Driven {
        let motor = self.motor.as_ref();
        let (scale, induced) = match (data.kind, motor) {
            (CommandKind::Current, Some(motor)) => (motor.force_per_ampere, 0.0),
            (CommandKind::Voltage, Some(motor)) => {
                let per_volt =
                    motor.force_per_ampere / motor.resistance_ohm.unwrap_or(f64::INFINITY);
                (per_volt, per_volt * motor.induced_v_per_speed)
            }
            _ => (1.0, 0.0),
        };
        let carried = self.carried.iter().find(|own| own.trial == number);
        let lever = |own: &RigCarried| match self.axis {
            Axis::Linear => 1.0,
            Axis::Rotary => own.length_m.powi(2),
        };
        let inertia = self.inertia + carried.map_or(0.0, |own| own.mass_kg * lever(own));
        let constant = carried.map_or(0.0, |own| own.load);
        let hanging = self.pendulum.map(|pendulum| {
            let more = carried.map_or(0.0, |own| own.mass_kg * own.length_m * GRAVITY_M_PER_S2);
            (pendulum.torque_nm + more, pendulum.hangs_at_rad)
        });
        let is_loaded = data.load.is_some() || constant != 0.0 || hanging.is_some();
        let load = is_loaded.then(|| {
            let of_row = |(row, position): (usize, &f64)| {
                let measured = data.load.as_ref().map_or(0.0, |load| load[row]);
                let weight = hanging.map_or(0.0, |(torque, at)| torque * (position - at).sin());
                measured + constant + weight
            };
            data.position.iter().enumerate().map(of_row).collect()
        });
        let command = data.command.iter().map(|x| scale * x).collect();
        Driven { command, inertia, load, induced }
    }
}
