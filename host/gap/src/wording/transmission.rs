//! The effects of a transmission in words; its input and output may be lengths or angles, and so they have their own units.

use super::clause::{MM, MS, OWN, SHARE, Words, shape, size};

pub(super) const WORDS: &[Words] = &[
    Words {
        id: "transmission.gain",
        name: "another gain",
        clauses: &[size("ratio", "the gain is {} [larger|smaller] than rig.toml says", SHARE)],
    },
    Words {
        id: "transmission.curvature",
        name: "a gain that changes along the travel",
        clauses: &[size("share", "the gain changes by {} along the travel", SHARE)],
    },
    Words {
        id: "transmission.dead_zone",
        name: "a dead zone",
        clauses: &[
            size("width_m", "a reversal takes up a dead zone of {}", MM),
            size("width_rad", "a reversal takes up a dead zone of {}", OWN),
            size("follows", "within it {} of the motion passes", SHARE),
        ],
    },
    Words {
        id: "transmission.bouc_wen",
        name: "hysteresis that saturates (Bouc–Wen)",
        clauses: &[
            size("height_m", "hysteresis of Bouc and Wen loses up to {} of the input", MM),
            size("height_rad", "hysteresis of Bouc and Wen loses up to {} of the input", OWN),
            shape("length_m", "it turns round over {}", MM),
            shape("length_rad", "it turns round over {}", OWN),
        ],
    },
    Words {
        id: "transmission.prandtl_ishlinskii",
        name: "hysteresis of many stops (Prandtl–Ishlinskii)",
        clauses: &[
            size(
                "height_m",
                "hysteresis of Prandtl and Ishlinskii loses up to {} of the input",
                MM,
            ),
            size(
                "height_rad",
                "hysteresis of Prandtl and Ishlinskii loses up to {} of the input",
                OWN,
            ),
            shape("radius_m", "its largest stop has a radius of {}", MM),
            shape("radius_rad", "its largest stop has a radius of {}", OWN),
        ],
    },
    Words {
        id: "transmission.sheath",
        name: "friction along the sheath",
        clauses: &[size(
            "friction_coefficient",
            "the sheath's friction coefficient is {}, not {off}",
            OWN,
        )],
    },
    Words {
        id: "transmission.compliance",
        name: "compliance under the load",
        clauses: &[
            size("m_per_n", "the output gives way by {}", (1e3, "mm/N")),
            size("rad_per_nm", "the output gives way by {}", OWN),
        ],
    },
    Words {
        id: "transmission.lag",
        name: "a lag that depends on the rate",
        clauses: &[size("time_s", "the output follows with a time constant of {}", MS)],
    },
    Words {
        id: "transmission.latency",
        name: "a late output",
        clauses: &[size("time_s", "the output is reported {} late", MS)],
    },
    Words {
        id: "transmission.offset",
        name: "another zero of the output",
        clauses: &[
            size("output_m", "the output is off by {} everywhere", MM),
            size("output_rad", "the output is off by {} everywhere", OWN),
        ],
    },
    Words {
        id: "transmission.drift",
        name: "creep of the output",
        clauses: &[
            size("output_m_per_s", "the output creeps by {}", OWN),
            size("output_rad_per_s", "the output creeps by {}", OWN),
        ],
    },
];
