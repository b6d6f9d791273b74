//! A uniform instrument, and its state of rest.

use cathforce_mechanics::*;

use crate::wall::StoredWall;

/// A straight, uniform, weightless instrument that enters along x, with `up` along z; `links` links reach
/// `length_m`. Tests change the properties that they need.
pub fn rod(length_m: f64, links: usize, bending_stiffness_n_m2: f64) -> Description<f64> {
    let section = Section {
        length_m,
        bending_stiffness_n_m2,
        torsional_stiffness_n_m2: bending_stiffness_n_m2 * 0.7,
        axial_stiffness_n: 1e6,
        mass_kg_per_m: 1e-3,
    };
    Description {
        instrument: Instrument {
            outer_radius_m: 0.8e-3,
            sections: [section].into_iter().collect(),
            precurve: [].into_iter().collect(),
        },
        guidewire: None,
        tendon: Tendon::none(),
        tendons: [].into_iter().collect(),
        entry: Entry { position_m: [0.0; 3], direction: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0] },
        wall: Wall {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.0,
            onset_m: 1e-5,
            damping_s: 0.0,
        },
        effects: Effects::off(),
        gravity_m_per_s2: [0.0; 3],
        solver: Solver {
            link_length_m: length_m / links as f64,
            fine_tip_m: 0.0,
            tick_s: 1e-2,
            substeps: 1,
            solves: 1,
            predictor_gain: 0.0,
            bending_damping_s: 0.0,
            drag: Drag::constant(0.0),
        },
    }
}

/// Insertion without rotation.
pub fn inserted(insertion_m: f64) -> Drive<f64> {
    Drive { insertion_m, rotation_rad: 0.0 }
}

/// No external loads.
pub const FREE_TIP: Loads<f64> = Loads { tip_force_n: [0.0; 3], tip_moment_n_m: [0.0; 3] };

/// Steps until the tip moves by less than 10⁻⁹ of the insertion in each of 50 consecutive steps. Panics if it
/// never does.
pub fn rest(
    model: &Model<f64>,
    lumen: &Lumen<'_>,
    state: &mut State<f64>,
    drives: impl Into<Drives<f64>>,
    loads: &Loads<f64>,
) -> Outputs<f64> {
    let drives = drives.into();
    let insertion_m = drives.catheter.insertion_m.max(drives.guidewire.insertion_m);
    let mut quiet = 0;
    for _ in 0..100_000 {
        let before = state.node_position_m(0);
        let outputs = step_loaded(model, lumen, state, drives, loads);
        let after = state.node_position_m(0);
        let moved = before
            .zip(after)
            .map_or(f64::MAX, |(a, b)| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max));
        quiet = if moved < 1e-9 * insertion_m { quiet + 1 } else { 0 };
        if quiet == 50 {
            return outputs;
        }
    }
    panic!("no rest at {drives:?}: tip {:?}", state.node_position_m(0));
}

/// A vessel without a wall.
pub fn free_space() -> StoredWall {
    StoredWall::sampled([[-1.0; 3], [1.0; 3]], 1e-2, 1e-3, |_| (1.0, [1.0, 0.0, 0.0]))
}

/// A rod of full length at rest without a wall, and the outputs.
#[allow(dead_code)] // not every test that shares this file has one instrument
pub fn hung(description: Description<f64>, loads: &Loads<f64>) -> (State<f64>, Outputs<f64>) {
    let insertion_m = description.instrument.sections[0].length_m;
    let model = Model::new(description).unwrap();
    let (wall, mut state) = (free_space(), State::new());
    let outputs = rest(&model, &wall.lumen(), &mut state, inserted(insertion_m), loads);
    (state, outputs)
}

/// Position of the tip of [`hung`], and the load on the drive.
#[allow(dead_code)] // not every test that shares this file has one instrument
pub fn hang(description: Description<f64>, loads: &Loads<f64>) -> ([f64; 3], Outputs<f64>) {
    let (state, outputs) = hung(description, loads);
    (state.node_position_m(0).unwrap(), outputs)
}

/// Asserts that errors at 8, 16 and 32 links fall with second order (≥ 1.9).
#[allow(dead_code)] // not every test that shares this file refines a mesh
pub fn assert_second_order(errors: [f64; 3], what: &str) {
    let order = (errors[1] / errors[2]).log2();
    println!("{what}: errors {errors:.6?} at 8, 16, 32 links, order {order:.2}");
    assert!(order >= 1.9, "{what}: order {order:.2}, {errors:.6?}");
}
