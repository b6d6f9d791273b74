//! Effects of entry, contact, wall and fluid.

use crate::effect::Channel::{DriveForce, Force, Shape, Tip};
use crate::effect::{Effect, PHASES_RAD, Parameter, Plant, Role, fitted, held, scanned};

/// Channels of effects that show in the force first.
const BY_FORCE: &[crate::effect::Channel] = &[Force, DriveForce, Tip, Shape];
/// Channels of effects that show in the position first.
const BY_PLACE: &[crate::effect::Channel] = &[Tip, Force, Shape, DriveForce];

/// Frequencies of respiration and pulse, at rest and under load.
const FREQUENCIES_HZ: [f64; 5] = [0.25, 0.4, 0.55, 0.75, 1.2];

const fn place(name: &'static str, key: &'static str) -> Parameter {
    Parameter { name, key, prior_scale: 0.05, role: Role::Place, scan: &[] }
}

pub(crate) const EFFECTS: &[Effect] = &[
    Effect {
        id: "entry.drag",
        plant: Plant::Catheter,
        doc: "Friction of the introducer or direction-limiting guide along the instrument.",
        parameters: &[
            fitted("coulomb_n", "effects.entry.drag.coulomb_n", 0.05),
            fitted("viscous_n_s_per_m", "effects.entry.drag.viscous_n_s_per_m", 1.0),
            fitted("phantom_share", "effects.entry.drag.phantom_share", 0.5),
            fitted("presliding_m", "effects.entry.drag.presliding_m", 1e-4),
        ],
        start_values: &[
            &[0.03, 0.0, 0.0, 2e-5],
            &[0.1, 0.0, 0.0, 2e-5],
            &[0.0, 3.0, 0.0, 2e-5],
            &[0.05, 0.0, 1.0, 2e-5],
        ],
        channels: &[DriveForce, Force],
        excited_by: "reversals in free space, two speeds",
        confused_with: &["contact.friction", "sensor.bias"],
    },
    Effect {
        id: "entry.guide",
        plant: Plant::Catheter,
        doc: "A guide past the entry plane straightens the pre-curved tip until it clears.",
        parameters: &[
            fitted("length_m", "effects.entry.guide.length_m", 5e-3),
            fitted("straightened_m", "effects.entry.guide.straightened_m", 5e-3),
        ],
        start_values: &[&[5e-3, 0.0], &[0.015, 0.0], &[0.0, 5e-3], &[0.0, 0.02]],
        channels: BY_PLACE,
        excited_by: "the first centimetres of feed, full withdrawal",
        confused_with: &["instrument.tip_precurve", "wall.registration"],
    },
    Effect {
        id: "contact.friction",
        plant: Plant::Catheter,
        doc: "Another friction coefficient of instrument and wall.",
        parameters: &[Parameter {
            name: "friction_coefficient",
            key: "wall.friction_coefficient",
            prior_scale: 0.15,
            role: Role::TimesNominal,
            scan: &[],
        }],
        start_values: &[&[0.5], &[1.1], &[1.5], &[2.5]],
        channels: BY_FORCE,
        excited_by: "sliding along the wall, reversals, two speeds",
        confused_with: &["contact.stribeck", "contact.load_friction", "entry.drag"],
    },
    Effect {
        id: "contact.stribeck",
        plant: Plant::Catheter,
        doc: "Static above kinetic friction.",
        parameters: &[
            fitted("static_ratio", "effects.contact.stribeck.static_ratio", 0.5),
            fitted("speed_m_per_s", "effects.contact.stribeck.speed_m_per_s", 5e-3),
            held("viscous_s_per_m", "effects.contact.stribeck.viscous_s_per_m", 5.0),
        ],
        start_values: &[&[1.5, 2e-3], &[1.5, 0.01], &[2.5, 5e-3]],
        channels: BY_FORCE,
        excited_by: "two speeds, dwells and starts from rest at the wall",
        confused_with: &["contact.friction", "wall.viscoelastic"],
    },
    Effect {
        id: "contact.load_friction",
        plant: Plant::Catheter,
        doc: "Friction that depends on load or wear.",
        parameters: &[
            fitted("light_load_ratio", "effects.contact.load_friction.light_load_ratio", 1.0),
            fitted("high_load_ratio", "effects.contact.load_friction.high_load_ratio", 0.5),
            fitted("load_n_per_m", "effects.contact.load_friction.load_n_per_m", 10.0),
            fitted("worn_ratio", "effects.contact.load_friction.worn_ratio", 0.3),
            held("wear_length_m", "effects.contact.load_friction.wear_length_m", 0.5),
        ],
        start_values: &[
            &[3.0, 1.0, 5.0, 1.0],
            &[0.4, 1.0, 5.0, 1.0],
            &[1.0, 1.0, 10.0, 0.6],
            &[1.0, 1.0, 10.0, 1.6],
        ],
        channels: BY_FORCE,
        excited_by: "light and firm contact; the same path at the start and at the end",
        confused_with: &["contact.friction", "wall.hyperelastic"],
    },
    Effect {
        id: "wall.stiffness",
        plant: Plant::Catheter,
        doc: "Another stiffness of the wall.",
        parameters: &[fitted("factor", "effects.wall.stiffness.factor", 1.5)],
        start_values: &[&[0.2], &[0.5], &[2.0]],
        channels: BY_FORCE,
        excited_by: "firm contact of tip and shaft, shape points",
        confused_with: &["wall.hyperelastic", "instrument.stiffness", "wall.narrowing"],
    },
    Effect {
        id: "wall.hyperelastic",
        plant: Plant::Catheter,
        doc: "Wall that stiffens as it gives way (neo-Hookean, Mooney–Rivlin, near Ogden).",
        parameters: &[
            fitted("strain_per_m", "effects.wall.hyperelastic.strain_per_m", 2e3),
            held("mooney_share", "effects.wall.hyperelastic.mooney_share", 0.5),
        ],
        start_values: &[&[-500.0], &[500.0], &[5e3], &[3e4]],
        channels: BY_FORCE,
        excited_by: "light and firm contact at one place",
        confused_with: &["wall.stiffness", "wall.viscoelastic", "contact.load_friction"],
    },
    Effect {
        id: "wall.viscoelastic",
        plant: Plant::Catheter,
        doc: "Wall that relaxes under load (standard linear solid).",
        parameters: &[
            fitted("ratio", "effects.wall.viscoelastic.ratio", 0.5),
            fitted("time_s", "effects.wall.viscoelastic.time_s", 0.5),
        ],
        start_values: &[&[0.5, 0.1], &[0.5, 0.5], &[0.5, 2.0], &[2.0, 0.5]],
        channels: BY_FORCE,
        excited_by: "dwells of seconds in contact, two speeds",
        confused_with: &["instrument.viscoelastic", "contact.stribeck", "sensor.time_constant"],
    },
    Effect {
        id: "wall.motion",
        plant: Plant::Catheter,
        doc: "The wall moves to and fro: respiration, pulse.",
        parameters: &[
            fitted("x_m", "effects.wall.motion.x_m", 1e-3),
            fitted("y_m", "effects.wall.motion.y_m", 1e-3),
            fitted("z_m", "effects.wall.motion.z_m", 1e-3),
            scanned("frequency_hz", "effects.wall.motion.frequency_hz", 0.5, &FREQUENCIES_HZ),
            scanned("phase_rad", "effects.wall.motion.phase_rad", 2.0, &PHASES_RAD),
        ],
        start_values: &[&[1e-3, 0.0, 0.0], &[0.0, 1e-3, 0.0], &[0.0, 0.0, 1e-3]],
        channels: BY_FORCE,
        excited_by: "dwells of several periods in contact",
        confused_with: &["drive.ripple", "fluid.drag"],
    },
    Effect {
        id: "wall.registration",
        plant: Plant::Catheter,
        doc: "The phantom stands elsewhere than the rig says.",
        parameters: &[
            fitted("x_m", "effects.wall.registration.x_m", 1e-3),
            fitted("y_m", "effects.wall.registration.y_m", 1e-3),
            fitted("z_m", "effects.wall.registration.z_m", 1e-3),
            fitted("tilt_x_rad", "effects.wall.registration.tilt_x_rad", 0.02),
            fitted("tilt_y_rad", "effects.wall.registration.tilt_y_rad", 0.02),
            fitted("tilt_z_rad", "effects.wall.registration.tilt_z_rad", 0.02),
        ],
        start_values: &[
            &[1e-3, 0.0, 0.0, 0.0, 0.0, 0.0],
            &[0.0, 1e-3, 0.0, 0.0, 0.0, 0.01],
            &[0.0, 0.0, 1e-3, 0.0, 0.01, 0.0],
            &[0.0, -1e-3, -1e-3, 0.0, 0.0, 0.0],
        ],
        channels: BY_PLACE,
        excited_by: "contact on all sides: rotation at several depths",
        confused_with: &["drive.encoder_scale", "wall.narrowing", "sensor.misalignment"],
    },
    Effect {
        id: "wall.narrowing",
        plant: Plant::Catheter,
        doc: "The lumen is narrower than its model over a short length.",
        parameters: &[
            fitted("depth_m", "effects.wall.narrowing.depth_m", 1e-3),
            fitted("half_length_m", "effects.wall.narrowing.half_length_m", 5e-3),
            place("x_m", "effects.wall.narrowing.x_m"),
            place("y_m", "effects.wall.narrowing.y_m"),
            place("z_m", "effects.wall.narrowing.z_m"),
        ],
        start_values: &[&[1e-3, 8e-3], &[3e-4, 8e-3], &[-5e-4, 8e-3]],
        channels: BY_FORCE,
        excited_by: "passing the place forward and back, rotation there",
        confused_with: &["wall.registration", "wall.stiffness"],
    },
    Effect {
        id: "fluid.drag",
        plant: Plant::Catheter,
        doc: "Drag of the stream, steady and with the pulse.",
        parameters: &[
            fitted("along_n_per_m", "effects.fluid.drag.along_n_per_m", 0.05),
            fitted("x_n_per_m", "effects.fluid.drag.x_n_per_m", 0.05),
            fitted("y_n_per_m", "effects.fluid.drag.y_n_per_m", 0.05),
            fitted("z_n_per_m", "effects.fluid.drag.z_n_per_m", 0.05),
            fitted("pulse_ratio", "effects.fluid.drag.pulse_ratio", 0.5),
            held("frequency_hz", "effects.fluid.drag.frequency_hz", 0.5),
            fitted("phase_rad", "effects.fluid.drag.phase_rad", 2.0),
            held("lumen_radius_m", "effects.fluid.drag.lumen_radius_m", 5e-3),
        ],
        start_values: &[
            &[0.05, 0.0, 0.0, 0.0, 0.0, 0.0],
            &[-0.05, 0.0, 0.0, 0.0, 0.0, 0.0],
            &[0.05, 0.0, 0.0, 0.0, 1.0, 0.0],
            &[0.0, 0.05, 0.05, 0.05, 1.0, 1.57],
        ],
        channels: BY_PLACE,
        excited_by: "dwells of several pulses in free space",
        confused_with: &["wall.motion", "instrument.weight"],
    },
];
