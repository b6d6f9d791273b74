//! A bare wire that enters along x: the common description of tests in several crates.

use cathforce_mechanics::{
    Description, Drag, Effects, Entry, Instrument, Section, Solver, Tendon, Wall,
};

pub fn wire() -> Description<f32> {
    let section = Section {
        length_m: 1.0,
        bending_stiffness_n_m2: 1e-4,
        torsional_stiffness_n_m2: 8e-5,
        axial_stiffness_n: 500.0,
        mass_kg_per_m: 1e-3,
    };
    Description {
        instrument: Instrument {
            outer_radius_m: 6e-4,
            sections: [section].into_iter().collect(),
            precurve: Default::default(),
        },
        guidewire: None,
        tendon: Tendon::none(),
        tendons: Default::default(),
        entry: Entry { position_m: [0.0; 3], direction: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0] },
        wall: Wall {
            line_stiffness_n_per_m2: 1e5,
            end_stiffness_n_per_m: 500.0,
            tangential_ratio: 1.0,
            friction_coefficient: 0.2,
            onset_m: 5e-5,
            damping_s: 1e-3,
        },
        effects: Effects::off(),
        gravity_m_per_s2: [0.0, 0.0, -9.81],
        solver: Solver {
            link_length_m: 2e-3,
            fine_tip_m: 0.0,
            tick_s: 1e-3,
            substeps: 1,
            solves: 2,
            predictor_gain: 0.5,
            bending_damping_s: 1e-3,
            drag: Drag { at_rest_n_s_per_m2: 0.1, swift_n_s_per_m2: 0.5, swift_m_per_s: 0.08 },
        },
    }
}
