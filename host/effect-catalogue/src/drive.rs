//! Effects between encoder and instrument, and the friction of a drive on its own, whose parameters
//! scale with the axis (`drive/effects.rs` of `cathforce-gap`).

use crate::effect::Channel::{DriveCommand, DriveForce, Force, Shape, Tip};
use crate::effect::{Effect, PHASES_RAD, Plant, fitted, held, scanned};

/// Cycles per metre of roller ripple: periods of 5 to 22 mm, for full and half turns of rollers.
const CYCLES_PER_M: [f64; 6] = [45.0, 65.0, 85.0, 105.0, 130.0, 200.0];

pub(crate) const EFFECTS: &[Effect] = &[
    Effect {
        id: "drive.ripple",
        plant: Plant::Catheter,
        doc: "Insertion speed goes up and down with the drive's rollers.",
        parameters: &[
            fitted("ratio", "effects.drive.ripple.ratio", 0.2),
            scanned("cycles_per_m", "effects.drive.ripple.cycles_per_m", 100.0, &CYCLES_PER_M),
            held("cycles_per_s", "effects.drive.ripple.cycles_per_s", 1.0),
            scanned("phase_rad", "effects.drive.ripple.phase_rad", 2.0, &PHASES_RAD),
        ],
        start_values: &[&[0.1]],
        channels: &[Tip, Force, DriveForce, Shape],
        excited_by: "steady feed over many periods, at two speeds",
        confused_with: &["wall.motion", "drive.slip"],
    },
    Effect {
        id: "drive.slip",
        plant: Plant::Catheter,
        doc: "The rollers lose feed in proportion to the axial force.",
        parameters: &[fitted("per_n", "effects.drive.slip.per_n", 1.0)],
        start_values: &[&[0.1], &[0.5], &[2.0]],
        channels: &[Tip, Force, DriveForce, Shape],
        excited_by: "feed against load, then withdrawal to where it began",
        confused_with: &["drive.encoder_scale", "drive.backlash"],
    },
    Effect {
        id: "drive.backlash",
        plant: Plant::Catheter,
        doc: "A dead zone at reversal, crossed at once or taken up gradually.",
        parameters: &[
            fitted("insertion_m", "effects.drive.backlash.insertion_m", 1e-3),
            fitted("rotation_rad", "effects.drive.backlash.rotation_rad", 0.05),
            fitted("gradual", "effects.drive.backlash.gradual", 0.5),
        ],
        start_values: &[&[3e-4, 0.0, 0.0], &[1e-3, 0.0, 0.0], &[3e-3, 0.0, 0.0], &[0.0, 0.1, 0.0]],
        channels: &[Force, DriveForce, Tip, Shape],
        excited_by: "reversals of several strokes, of feed and of rotation",
        confused_with: &["drive.latency", "contact.friction", "instrument.torsional_windup"],
    },
    Effect {
        id: "drive.encoder_scale",
        plant: Plant::Catheter,
        doc: "Motion at the entry plane differs from the encoder's by constant factors.",
        parameters: &[
            fitted("insertion", "effects.drive.encoder_scale.insertion", 0.03),
            fitted("rotation", "effects.drive.encoder_scale.rotation", 0.03),
        ],
        start_values: &[&[0.97, 1.0], &[1.03, 1.0], &[1.0, 0.95], &[1.0, 1.05]],
        channels: &[Tip, Force, Shape, DriveForce],
        excited_by: "long feed, long rotation",
        confused_with: &["drive.slip", "wall.registration"],
    },
    Effect {
        id: "drive.latency",
        plant: Plant::Catheter,
        doc: "The instrument follows the encoder's samples late.",
        parameters: &[fitted("time_s", "effects.drive.latency.time_s", 0.02)],
        start_values: &[&[5e-3], &[0.015], &[0.04]],
        channels: &[Force, DriveForce, Tip, Shape],
        excited_by: "two speeds, starts and stops, reversals",
        confused_with: &["drive.backlash", "sensor.time_constant"],
    },
    Effect {
        id: "drive.coulomb",
        plant: Plant::Drive,
        doc: "Dry friction of the axis.",
        parameters: &[],
        start_values: &[],
        channels: &[DriveCommand],
        excited_by: "motion both ways",
        confused_with: &["drive.stribeck", "drive.viscous"],
    },
    Effect {
        id: "drive.viscous",
        plant: Plant::Drive,
        doc: "Friction in proportion to speed.",
        parameters: &[],
        start_values: &[],
        channels: &[DriveCommand],
        excited_by: "several speeds",
        confused_with: &["drive.coulomb", "drive.stribeck"],
    },
    Effect {
        id: "drive.stribeck",
        plant: Plant::Drive,
        doc: "More friction at low speed.",
        parameters: &[],
        start_values: &[],
        channels: &[DriveCommand],
        excited_by: "slow motion and starts from rest",
        confused_with: &["drive.coulomb", "drive.viscous"],
    },
    Effect {
        id: "drive.load_friction",
        plant: Plant::Drive,
        doc: "Friction that grows with the force in the axis.",
        parameters: &[],
        start_values: &[],
        channels: &[DriveCommand],
        excited_by: "strong accelerations both ways",
        confused_with: &["drive.coulomb"],
    },
    Effect {
        id: "drive.offset",
        plant: Plant::Drive,
        doc: "A constant force: friction that depends on the direction, or a tilted axis.",
        parameters: &[],
        start_values: &[],
        channels: &[DriveCommand],
        excited_by: "motion both ways",
        confused_with: &["sensor.bias"],
    },
];
