//! The effects of a drive in words; its axis may be a linear or a rotary one, and so they have its own units.

use super::clause::{MS, OWN, SHARE, Words, shape, size};

pub(super) const WORDS: &[Words] = &[
    Words {
        id: "drive.coulomb",
        name: "dry friction",
        clauses: &[
            size("force_n", "dry friction is {}", OWN),
            size("torque_nm", "dry friction is {}", OWN),
            size("presliding_m", "it sets in over {}", OWN),
            size("presliding_rad", "it sets in over {}", OWN),
        ],
    },
    Words {
        id: "drive.viscous",
        name: "viscous friction",
        clauses: &[
            size("n_s_per_m", "friction grows with the speed by {}", OWN),
            size("nm_s_per_rad", "friction grows with the speed by {}", OWN),
        ],
    },
    Words {
        id: "drive.offset",
        name: "a constant force",
        clauses: &[
            size("force_n", "a constant force of {} acts on the axis", OWN),
            size("torque_nm", "a constant torque of {} acts on the axis", OWN),
        ],
    },
    Words {
        id: "drive.stribeck",
        name: "friction that falls with the speed",
        clauses: &[
            size("force_n", "friction is larger by {} as motion sets in", OWN),
            size("torque_nm", "friction is larger by {} as motion sets in", OWN),
            shape("speed_m_per_s", "most of that is gone at {}", OWN),
            shape("speed_rad_per_s", "most of that is gone at {}", OWN),
        ],
    },
    Words {
        id: "drive.load_friction",
        name: "load-dependent friction",
        clauses: &[size("per_force", "friction grows by {} of the force in the axis", SHARE)],
    },
    Words {
        id: "drive.backlash",
        name: "backlash",
        clauses: &[
            size("position_m", "the axis has a backlash of {}", OWN),
            size("position_rad", "the axis has a backlash of {}", OWN),
        ],
    },
    Words {
        id: "drive.ripple",
        name: "a force that repeats with the position",
        clauses: &[
            size("cosine_n", "the force repeats with the position, with a cosine of {}", OWN),
            size("cosine_nm", "the torque repeats with the position, with a cosine of {}", OWN),
            size("sine_n", "the force repeats with the position, with a sine of {}", OWN),
            size("sine_nm", "the torque repeats with the position, with a sine of {}", OWN),
            shape("wavelength_m", "its period is {}", OWN),
            shape("wavelength_rad", "its period is {}", OWN),
        ],
    },
    Words {
        id: "drive.friction_drift",
        name: "dry friction that changes with the time",
        clauses: &[
            size(
                "force_n",
                "dry friction changes by {} from the middle to the end of a trial",
                OWN,
            ),
            size(
                "torque_nm",
                "dry friction changes by {} from the middle to the end of a trial",
                OWN,
            ),
        ],
    },
    Words {
        id: "drive.encoder_scale",
        name: "another scale of the encoder",
        clauses: &[size("ratio", "the encoder counts {} [more|less] than was travelled", SHARE)],
    },
    Words {
        id: "drive.latency",
        name: "a late encoder",
        clauses: &[size("time_s", "the encoder is late by {}", MS)],
    },
    Words {
        id: "sensor.bias",
        name: "an offset of the command's measurement",
        clauses: &[
            size("force_n", "the command's measurement is off by {}", OWN),
            size("torque_nm", "the command's measurement is off by {}", OWN),
        ],
    },
    Words {
        id: "sensor.drift",
        name: "drift of the command's measurement",
        clauses: &[
            size("force_n_per_s", "the command's measurement drifts by {}", OWN),
            size("torque_nm_per_s", "the command's measurement drifts by {}", OWN),
        ],
    },
    Words {
        id: "sensor.gain",
        name: "another gain of the command's measurement",
        clauses: &[size("ratio", "the command is measured {} too [large|small]", SHARE)],
    },
    Words {
        id: "sensor.time_constant",
        name: "a slow measurement of the command",
        clauses: &[size(
            "time_s",
            "the command's measurement follows with a time constant of {}",
            MS,
        )],
    },
];
