//! Cantilevers without a wall, against the exact elastica.

use cathforce_mechanics::*;

/// A lumen with nothing in reach: one brick far away, everything else free.
fn free_space() -> (LumenHeader, Vec<u8>) {
    let header = LumenHeader {
        origin_m: [-1.0; 3],
        cell_m: 1e-2,
        distance_unit_m: 1e-6,
        bricks: [50; 3],
        stored: 0,
    };
    (header, vec![0xFF; header.byte_len()])
}

fn cantilever(length_m: f64, links: usize, ei: f64, weight_n_per_m: f64) -> Description<f64> {
    let section = Section {
        length_m,
        bending_stiffness_n_m2: ei,
        torsional_stiffness_n_m2: ei * 0.7,
        axial_stiffness_n: 1e6,
        mass_kg_per_m: weight_n_per_m / 9.81,
    };
    Description {
        instrument: Instrument {
            outer_radius_m: 0.8e-3,
            sections: [section].into_iter().collect(),
            precurve: [].into_iter().collect(),
        },
        entry: Entry { position_m: [0.0; 3], direction: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0] },
        wall: Wall {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.3,
            onset_m: 1e-5,
            damping_s: 0.0,
        },
        gravity_m_per_s2: [0.0, 0.0, -9.81],
        solver: Solver {
            link_length_m: length_m / links as f64,
            tick_s: 1e-2,
            substeps: 1,
            solves: 1,
            predictor_gain: 0.25,
            bending_damping_s: 0.0,
            drag_n_s_per_m2: 0.0,
        },
    }
}

#[test]
fn self_weight_sag_converges_with_second_order() {
    // qL³/EI = 2, 8: w/L and u/L of ../shared/references/elastica_cantilever_self_weight.json.
    for (load, drop, shortening) in [
        (0.5, 0.062305768, 0.002221),
        (2.0, 0.238506583, 0.033107053),
        (8.0, 0.640630717, 0.275575266),
    ] {
        let mut errors = Vec::new();
        for links in [8, 16, 32] {
            let (length, ei) = (0.1, 1e-3);
            let model: Model<_> =
                Model::new(cantilever(length, links, ei, load * ei / (length * length * length)))
                    .unwrap();
            let (header, bytes) = free_space();
            let lumen = Lumen::new(header, &bytes).unwrap();
            let mut state = State::new();
            let drive = Drive { insertion_m: length, rotation_rad: 0.0 };
            while !settle(&model, &lumen, &mut state, drive) {}
            // Settling stops where a run may begin; the exact shape takes time.
            for _ in 0..3000 {
                step(&model, &lumen, &mut state, drive);
            }
            let tip = state.node_position_m(0).unwrap();
            let error = (tip[2] / length + drop).hypot(tip[0] / length - (1.0 - shortening));
            errors.push(error);
        }
        println!("load {load}: {errors:?}");
        assert!(errors[2] < 1e-3, "{errors:?}");
        let order = (errors[1] / errors[2]).log2();
        assert!(order > 1.9, "order {order} {errors:?}");
    }
}

#[test]
fn end_loads_bend_a_chain_of_any_number_of_links() {
    let (length, ei) = (0.1, 1e-3);
    // PL²/EI = 2: w/L and u/L of ../shared/references/elastica_cantilever_tip_load.csv.
    let weight =
        Loads { tip_force_n: [0.0, 0.0, -2.0 * ei / (length * length)], ..Loads::default() };
    // ML/EI = π/2: a quarter of a circle.
    let quarter = core::f64::consts::FRAC_PI_2;
    let couple = Loads { tip_moment_n_m: [0.0, quarter * ei / length, 0.0], ..Loads::default() };
    for (loads, drop, shortening) in
        [(weight, 0.49345748, 0.160641721), (couple, 1.0 / quarter, 1.0 - 1.0 / quarter)]
    {
        let coarse = tip_error::<16>(length, ei, &loads, [1.0 - shortening, 0.0, -drop]);
        let fine = tip_error::<96>(length, ei, &loads, [1.0 - shortening, 0.0, -drop]);
        assert!(coarse < 3e-3 && fine < 1e-4, "{loads:?}: {coarse} {fine}");
    }
}

/// How far the tip of a chain of `LINKS` links is from where it should be, both over its length.
fn tip_error<const LINKS: usize>(length: f64, ei: f64, loads: &Loads<f64>, tip: [f64; 3]) -> f64 {
    let description =
        Description { gravity_m_per_s2: [0.0; 3], ..cantilever(length, LINKS, ei, 1.0) };
    let model = Model::<f64, LINKS>::new(description).unwrap();
    let (header, bytes) = free_space();
    let lumen = Lumen::new(header, &bytes).unwrap();
    let mut state = State::new();
    let drive = Drive { insertion_m: length, rotation_rad: 0.0 };
    while !settle_loaded(&model, &lumen, &mut state, drive, loads) {}
    for _ in 0..3000 {
        step_loaded(&model, &lumen, &mut state, drive, loads);
    }
    let reached = state.node_position_m(0).unwrap();
    let squares = (0..3).map(|i| (reached[i] / length - tip[i]).powi(2));
    squares.sum::<f64>().sqrt()
}
