//! Effects of the force sensor under the vessel.

use crate::effect::Channel::Force;
use crate::effect::{Effect, Plant, fitted};

pub(crate) const EFFECTS: &[Effect] = &[
    Effect {
        id: "sensor.bias",
        plant: Plant::Catheter,
        doc: "The sensor reads a constant force in addition.",
        parameters: &[
            fitted("x_n", "effects.sensor.bias.x_n", 0.02),
            fitted("y_n", "effects.sensor.bias.y_n", 0.02),
            fitted("z_n", "effects.sensor.bias.z_n", 0.02),
        ],
        start_values: &[&[0.03, 0.0, 0.0], &[0.0, 0.03, 0.0], &[0.0, 0.0, 0.03]],
        channels: &[Force],
        excited_by: "static zero before and after",
        confused_with: &["sensor.drift", "entry.drag", "instrument.weight"],
    },
    Effect {
        id: "sensor.drift",
        plant: Plant::Catheter,
        doc: "The sensor's zero moves with time.",
        parameters: &[
            fitted("x_n_per_s", "effects.sensor.drift.x_n_per_s", 5e-3),
            fitted("y_n_per_s", "effects.sensor.drift.y_n_per_s", 5e-3),
            fitted("z_n_per_s", "effects.sensor.drift.z_n_per_s", 5e-3),
        ],
        start_values: &[&[5e-3, 0.0, 0.0], &[0.0, 5e-3, 0.0], &[0.0, 0.0, 5e-3]],
        channels: &[Force],
        excited_by: "static zero before and after, long dwells",
        confused_with: &["sensor.bias", "instrument.softening"],
    },
    Effect {
        id: "sensor.gain",
        plant: Plant::Catheter,
        doc: "The sensor reads too much or too little of every force.",
        parameters: &[fitted("factor", "effects.sensor.gain.factor", 0.2)],
        start_values: &[&[0.8], &[1.2], &[1.5]],
        channels: &[Force],
        excited_by: "a known weight on the sensor",
        confused_with: &["instrument.stiffness", "contact.friction"],
    },
    Effect {
        id: "sensor.misalignment",
        plant: Plant::Catheter,
        doc: "The sensor's axes are turned against the vessel's (cross-talk).",
        parameters: &[
            fitted("x_rad", "effects.sensor.misalignment.x_rad", 0.1),
            fitted("y_rad", "effects.sensor.misalignment.y_rad", 0.1),
            fitted("z_rad", "effects.sensor.misalignment.z_rad", 0.1),
        ],
        start_values: &[&[0.1, 0.0, 0.0], &[0.0, 0.1, 0.0], &[0.0, 0.0, 0.1]],
        channels: &[Force],
        excited_by: "forces along all three axes; a known weight",
        confused_with: &["wall.registration"],
    },
    Effect {
        id: "sensor.time_constant",
        plant: Plant::Catheter,
        doc: "The sensor follows the force late.",
        parameters: &[fitted("time_s", "effects.sensor.time_constant.time_s", 0.05)],
        start_values: &[&[5e-3], &[0.02], &[0.1]],
        channels: &[Force],
        excited_by: "snaps, starts and stops, reversals",
        confused_with: &["drive.latency", "instrument.viscoelastic"],
    },
];
