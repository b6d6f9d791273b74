//! Effects of the instrument and its tendon.

use crate::effect::Channel::{DriveForce, Force, Shape, Tip};
use crate::effect::{Effect, Plant, fitted, held};

const BY_FORCE: &[crate::effect::Channel] = &[Force, DriveForce, Tip, Shape];
const BY_PLACE: &[crate::effect::Channel] = &[Tip, Shape, Force, DriveForce];

pub(crate) const EFFECTS: &[Effect] = &[
    Effect {
        id: "instrument.stiffness",
        plant: Plant::Catheter,
        doc: "Other elastic moduli of shaft and tip.",
        parameters: &[
            fitted("shaft_factor", "effects.instrument.stiffness.shaft_factor", 0.3),
            fitted("tip_factor", "effects.instrument.stiffness.tip_factor", 0.3),
        ],
        start_values: &[&[0.7, 0.7], &[1.4, 1.4], &[1.4, 1.0], &[1.0, 1.4]],
        channels: BY_FORCE,
        excited_by: "bends of the shaft and of the tip, shape points",
        confused_with: &[
            "sensor.gain",
            "wall.stiffness",
            "instrument.softening",
            "contact.friction",
        ],
    },
    Effect {
        id: "instrument.stored_curvature",
        plant: Plant::Catheter,
        doc: "The shaft keeps a curvature from its packaging.",
        parameters: &[
            fitted("curvature_per_m", "effects.instrument.stored_curvature.curvature_per_m", 4.0),
            fitted(
                "lateral_curvature_per_m",
                "effects.instrument.stored_curvature.lateral_curvature_per_m",
                4.0,
            ),
        ],
        start_values: &[&[2.0, 0.0], &[-2.0, 0.0], &[0.0, 2.0], &[0.0, -2.0]],
        channels: BY_PLACE,
        excited_by: "rotation at several depths, and once in free air",
        confused_with: &["instrument.tip_precurve", "wall.registration", "instrument.weight"],
    },
    Effect {
        id: "instrument.tip_precurve",
        plant: Plant::Catheter,
        doc: "The tip is bent more or less than nominal.",
        parameters: &[fitted("factor", "effects.instrument.tip_precurve.factor", 0.15)],
        start_values: &[&[0.7], &[0.85], &[1.15], &[1.3]],
        channels: BY_PLACE,
        excited_by: "rotation in free air, tip contact",
        confused_with: &["instrument.stiffness", "instrument.stored_curvature", "entry.guide"],
    },
    Effect {
        id: "instrument.torsional_windup",
        plant: Plant::Catheter,
        doc: "The shaft between the drive's clamp and the entry plane twists.",
        parameters: &[fitted(
            "free_length_m",
            "effects.instrument.torsional_windup.free_length_m",
            0.2,
        )],
        start_values: &[&[0.05], &[0.2], &[0.6]],
        channels: BY_PLACE,
        excited_by: "rotation with the tip in contact, both ways",
        confused_with: &["drive.backlash", "contact.friction"],
    },
    Effect {
        id: "instrument.viscoelastic",
        plant: Plant::Catheter,
        doc: "Bending moment follows the rate of bending (Kelvin–Voigt), or relaxes (standard linear solid).",
        parameters: &[
            fitted("time_s", "effects.instrument.viscoelastic.time_s", 0.05),
            fitted("ratio", "effects.instrument.viscoelastic.ratio", 0.5),
            fitted("relaxation_s", "effects.instrument.viscoelastic.relaxation_s", 0.5),
            fitted("packed_share", "effects.instrument.viscoelastic.packed_share", 1.0),
        ],
        start_values: &[
            &[0.02, 0.0, 0.5, 0.0],
            &[0.1, 0.0, 0.5, 0.0],
            &[0.5, 0.0, 0.5, 0.0],
            &[0.0, 0.5, 0.2, 0.0],
            &[0.0, 0.5, 1.0, 0.0],
            &[0.0, 2.0, 0.5, 0.0],
            &[0.0, 0.5, 5.0, 1.0],
        ],
        channels: BY_FORCE,
        excited_by: "two speeds, starts and stops, snaps",
        confused_with: &["wall.viscoelastic", "sensor.time_constant"],
    },
    Effect {
        id: "instrument.softening",
        plant: Plant::Catheter,
        doc: "The instrument grows softer in the warm vessel.",
        parameters: &[
            fitted("share", "effects.instrument.softening.share", 0.2),
            fitted("time_s", "effects.instrument.softening.time_s", 20.0),
        ],
        start_values: &[&[0.2, 5.0], &[0.2, 30.0], &[0.5, 30.0], &[0.5, 5.0]],
        channels: BY_FORCE,
        excited_by: "the same path early and late",
        confused_with: &["instrument.stiffness", "sensor.drift", "contact.load_friction"],
    },
    Effect {
        id: "instrument.weight",
        plant: Plant::Catheter,
        doc: "Other weight or buoyancy.",
        parameters: &[fitted("factor", "effects.instrument.weight.factor", 2.0)],
        start_values: &[&[0.0], &[2.0], &[5.0]],
        channels: BY_FORCE,
        excited_by: "slow feed in free space, dwells",
        confused_with: &["sensor.bias", "instrument.stored_curvature", "fluid.drag"],
    },
    Effect {
        id: "tendon.friction",
        plant: Plant::Catheter,
        doc: "Friction along the tendon of a steerable instrument.",
        parameters: &[
            fitted("coefficient", "effects.tendon.friction.coefficient", 0.2),
            held("pull_m", "tendon.pull_m", 1e-3),
            held("stiffness_n_per_m", "tendon.stiffness_n_per_m", 1e3),
            held("offset_m", "tendon.offset_m", 2e-4),
            held("length_m", "tendon.length_m", 0.02),
            held("angle_rad", "tendon.angle_rad", 1.0),
        ],
        start_values: &[&[0.1], &[0.3], &[0.8]],
        channels: BY_PLACE,
        excited_by: "a pulled tendon (rigs without one cannot show it), bends of the tip",
        confused_with: &["tendon.slack", "instrument.stiffness"],
    },
    Effect {
        id: "tendon.slack",
        plant: Plant::Catheter,
        doc: "The tendon has to be taken up before it pulls.",
        parameters: &[
            fitted("length_m", "effects.tendon.slack.length_m", 5e-4),
            held("pull_m", "tendon.pull_m", 1e-3),
            held("stiffness_n_per_m", "tendon.stiffness_n_per_m", 1e3),
            held("offset_m", "tendon.offset_m", 2e-4),
            held("bent_length_m", "tendon.length_m", 0.02),
            held("angle_rad", "tendon.angle_rad", 1.0),
        ],
        start_values: &[&[2e-4], &[1e-3], &[3e-3]],
        channels: BY_PLACE,
        excited_by: "a pulled tendon (rigs without one cannot show it)",
        confused_with: &["tendon.friction", "instrument.tip_precurve"],
    },
];
