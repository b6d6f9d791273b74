//! The effects of a catheter in words.

use super::clause::{
    ANGLE, LONG, MILLI, MM, MN, MS, MUCH, OWN, RIG, SHARE, STIFF, Words, ratio, shape, size,
};

pub(super) const WORDS: &[Words] = &[
    Words {
        id: "drive.ripple",
        name: "a ripple of the feed",
        clauses: &[
            size("ratio", "the feed goes up and down by {} of its speed", SHARE),
            shape("cycles_per_m", "its ripple has {} periods a metre", (1.0, "1")),
        ],
    },
    Words {
        id: "drive.slip",
        name: "slip of the drive",
        clauses: &[size("per_n", "the drive loses {} of the feed for each newton", SHARE)],
    },
    Words {
        id: "drive.backlash",
        name: "backlash of the drive",
        clauses: &[
            size("insertion_m", "the feed has a backlash of {}", MM),
            size("rotation_rad", "the rotation has a backlash of {}", ANGLE),
            size("gradual", "{} of the motion is taken up gradually", SHARE),
        ],
    },
    Words {
        id: "drive.encoder_scale",
        name: "another scale of the encoders",
        clauses: &[
            ratio("insertion", "the insertion at the entry is", LONG, "the encoder says"),
            ratio("rotation", "the rotation at the entry is", LONG, "the encoder says"),
        ],
    },
    Words {
        id: "drive.latency",
        name: "a delay of the drive",
        clauses: &[size("time_s", "the motion is {} behind the encoder", MS)],
    },
    Words {
        id: "entry.drag",
        name: "friction at the entry",
        clauses: &[
            size("coulomb_n", "friction at the entry is {}", MN),
            size("viscous_n_s_per_m", "friction at the entry grows with the speed by {}", OWN),
            size("phantom_share", "the phantom's sensor feels {} of it", SHARE),
        ],
    },
    Words {
        id: "entry.guide",
        name: "a guide past the entry",
        clauses: &[
            size("length_m", "the guide reaches {} past the entry", MM),
            size("straightened_m", "the tip takes {} behind it to bend again", MM),
        ],
    },
    Words {
        id: "contact.friction",
        name: "the wall's friction",
        clauses: &[size(
            "friction_coefficient",
            "the wall's friction coefficient is {}, not {off}",
            OWN,
        )],
    },
    Words {
        id: "contact.stribeck",
        name: "speed-dependent friction",
        clauses: &[
            size("static_ratio", "static friction is {} times the sliding friction", OWN),
            shape("speed_m_per_s", "half of the difference is gone at {}", (MILLI, "mm/s")),
        ],
    },
    Words {
        id: "contact.load_friction",
        name: "load-dependent friction",
        clauses: &[
            size(
                "light_load_ratio",
                "friction under a light load is {} times the nominal one",
                OWN,
            ),
            size("high_load_ratio", "friction under a high load is {} times the nominal one", OWN),
            size("worn_ratio", "friction after long sliding is {} times that at first", OWN),
        ],
    },
    Words {
        id: "wall.stiffness",
        name: "the wall's stiffness",
        clauses: &[ratio("factor", "the wall is", STIFF, RIG)],
    },
    Words {
        id: "wall.hyperelastic",
        name: "a wall that stiffens as it yields",
        clauses: &[size(
            "strain_per_m",
            "each millimetre that the wall yields compresses its material by {}",
            (0.1, "%"),
        )],
    },
    Words {
        id: "wall.viscoelastic",
        name: "a wall that relaxes",
        clauses: &[
            size("ratio", "the wall's stiffness that relaxes is {} times the lasting one", OWN),
            shape("time_s", "it relaxes within {}", OWN),
        ],
    },
    Words {
        id: "wall.motion",
        name: "motion of the wall",
        clauses: &[
            size("x_m", "the wall moves to and fro by {} along x", MM),
            size("y_m", "the wall moves to and fro by {} along y", MM),
            size("z_m", "the wall moves to and fro by {} along z", MM),
            shape("frequency_hz", "it does so at {}", OWN),
        ],
    },
    Words {
        id: "wall.registration",
        name: "another place of the phantom",
        clauses: &[
            size("x_m", "the phantom is off by {} along x", MM),
            size("y_m", "the phantom is off by {} along y", MM),
            size("z_m", "the phantom is off by {} along z", MM),
            size("tilt_x_rad", "it is tilted by {} about x", ANGLE),
            size("tilt_y_rad", "it is tilted by {} about y", ANGLE),
            size("tilt_z_rad", "it is tilted by {} about z", ANGLE),
        ],
    },
    Words {
        id: "wall.narrowing",
        name: "a narrowing of the lumen",
        clauses: &[
            size("depth_m", "the lumen's radius is smaller by {} at one place", MM),
            shape("half_length_m", "over {} to either side", MM),
        ],
    },
    Words {
        id: "fluid.drag",
        name: "drag of the stream",
        clauses: &[
            size("along_n_per_m", "the stream pulls along the instrument with {}", OWN),
            size("x_n_per_m", "the stream pulls along x with {}", OWN),
            size("y_n_per_m", "the stream pulls along y with {}", OWN),
            size("z_n_per_m", "the stream pulls along z with {}", OWN),
            size("pulse_ratio", "its pulse is {} of that", SHARE),
        ],
    },
    Words {
        id: "instrument.stiffness",
        name: "the instrument's stiffness",
        clauses: &[
            ratio("shaft_factor", "the instrument's shaft is", STIFF, RIG),
            ratio("tip_factor", "its tip is", STIFF, RIG),
        ],
    },
    Words {
        id: "instrument.stored_curvature",
        name: "a curvature that the shaft keeps",
        clauses: &[
            size("curvature_per_m", "the shaft keeps a curvature of {} upwards", OWN),
            size("lateral_curvature_per_m", "the shaft keeps a curvature of {} sideways", OWN),
        ],
    },
    Words {
        id: "instrument.tip_precurve",
        name: "another bend of the tip",
        clauses: &[ratio("factor", "the tip is bent", MUCH, RIG)],
    },
    Words {
        id: "instrument.torsional_windup",
        name: "twist of the shaft",
        clauses: &[size(
            "free_length_m",
            "{} of the shaft twist between the drive and the entry",
            MM,
        )],
    },
    Words {
        id: "instrument.viscoelastic",
        name: "an instrument that resists quick bending",
        clauses: &[
            size("time_s", "the instrument resists quick bending, with a time constant of {}", MS),
            size("ratio", "the bending stiffness that relaxes is {} times the lasting one", OWN),
            size("relaxation_s", "it relaxes within {}", OWN),
            size(
                "packed_share",
                "{} of it has crept away from the tip's bend in the package",
                SHARE,
            ),
        ],
    },
    Words {
        id: "instrument.softening",
        name: "an instrument that softens with time",
        clauses: &[
            size("share", "the instrument loses {} of its stiffness in the vessel", SHARE),
            shape("time_s", "most of that within {}", OWN),
        ],
    },
    Words {
        id: "instrument.weight",
        name: "the instrument's weight",
        clauses: &[ratio("factor", "the instrument weighs", MUCH, RIG)],
    },
    Words {
        id: "tendon.friction",
        name: "friction of the tendon",
        clauses: &[size("coefficient", "the tendon's friction coefficient is {}", OWN)],
    },
    Words {
        id: "tendon.slack",
        name: "slack of the tendon",
        clauses: &[size("length_m", "the first {} of the tendon's pull do nothing", MM)],
    },
    Words {
        id: "sensor.bias",
        name: "an offset of the sensor",
        clauses: &[
            size("x_n", "the sensor's zero is off by {} along x", MN),
            size("y_n", "the sensor's zero is off by {} along y", MN),
            size("z_n", "the sensor's zero is off by {} along z", MN),
        ],
    },
    Words {
        id: "sensor.drift",
        name: "drift of the sensor",
        clauses: &[
            size("x_n_per_s", "the sensor drifts by {} along x", (MILLI, "mN/s")),
            size("y_n_per_s", "the sensor drifts by {} along y", (MILLI, "mN/s")),
            size("z_n_per_s", "the sensor drifts by {} along z", (MILLI, "mN/s")),
        ],
    },
    Words {
        id: "sensor.gain",
        name: "another gain of the sensor",
        clauses: &[ratio("factor", "the sensor reads", MUCH, "the force is")],
    },
    Words {
        id: "sensor.misalignment",
        name: "turned axes of the sensor",
        clauses: &[
            size("x_rad", "the sensor is turned by {} about x", ANGLE),
            size("y_rad", "the sensor is turned by {} about y", ANGLE),
            size("z_rad", "the sensor is turned by {} about z", ANGLE),
        ],
    },
    Words {
        id: "sensor.time_constant",
        name: "a slow sensor",
        clauses: &[size("time_s", "the sensor follows with a time constant of {}", MS)],
    },
];
