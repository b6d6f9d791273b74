//! Columns: free, clamped, pinned, under their own weight.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, assert_second_order, free_space, hung, inserted, rest, rod};
use crate::wall::{StoredWall, plane};

/// EI of the solid catheter (radius 0.825 mm), 26 and 50 MPa.
const EI_N_M2: [f64; 2] = [9.459736155740662e-6, 1.8191800299501273e-5];

/// EI, free length, and Euler's loads clamped and free, clamped and pinned, clamped and clamped:
/// ../shared/references/buckling.json, `catheter_numbers`, all rows.
const COLUMNS: [(f64, f64, [f64; 3]); 8] = [
    (EI_N_M2[0], 0.02, [0.058352, 0.477497, 0.933639]),
    (EI_N_M2[0], 0.03, [0.025934, 0.212221, 0.41495]),
    (EI_N_M2[0], 0.05, [0.009336, 0.076399, 0.149382]),
    (EI_N_M2[0], 0.1, [0.002334, 0.0191, 0.037346]),
    (EI_N_M2[1], 0.02, [0.112216, 0.918263, 1.795459]),
    (EI_N_M2[1], 0.03, [0.049874, 0.408117, 0.797982]),
    (EI_N_M2[1], 0.05, [0.017955, 0.146922, 0.287273]),
    (EI_N_M2[1], 0.1, [0.004489, 0.036731, 0.071818]),
];

/// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
fn elliptic_k(modulus: f64) -> f64 {
    let (mut a, mut g) = (1.0, (1.0 - modulus * modulus).sqrt());
    for _ in 0..8 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    PI / (2.0 * a)
}

/// Critical load of a free column, from its bend under `force_n` along its axis.
fn load_of_free_column(length_m: f64, links: usize, ei: f64, force_n: f64) -> f64 {
    let model = Chain::new(rod(length_m, links, ei)).unwrap();
    let (wall, mut state) = (free_space(), State::new());
    let lumen = wall.lumen();
    // Pushed aside, then only along its axis.
    let push = |aside_n| Loads { tip_force_n: [-force_n, 0.0, aside_n], ..FREE_TIP };
    for _ in 0..200 {
        let loads = push(0.3 * force_n);
        step_loaded(&model, &lumen, &mut state, inserted(length_m), &loads);
    }
    rest(&model, &lumen, &mut state, inserted(length_m), &push(0.0));
    // Tip deflection 2 sin(α/2) √(EI/P); L √(P/EI) = K(sin(α/2)): what load would have
    // bent the column so far, and with it Euler's.
    let aside_m = state.node_position_m(0).unwrap()[2].abs();
    let modulus = 0.5 * aside_m * (force_n / ei).sqrt();
    force_n / (2.0 * elliptic_k(modulus) / PI).powi(2)
}

fn assert_near(what: &str, found: f64, exact: f64) {
    println!("{what}: {found:.6} ({exact:.6})");
    assert!((found / exact - 1.0).abs() < 0.01, "{what}: {found}, not {exact}");
}

#[test]
fn a_free_column_buckles_at_eulers_load() {
    for (ei, length_m, [free_n, _, clamped_n]) in COLUMNS {
        for over in [1.02, 1.1, 1.4] {
            let found = load_of_free_column(length_m, 64, ei, over * free_n);
            assert_near(&format!("L {length_m} m, {over} of Euler's load"), found, free_n);
        }
        // The tip is free. A column clamped at both ends is four of them end to end, the second
        // and the fourth reversed.
        let found = load_of_free_column(0.25 * length_m, 24, ei, 1.1 * clamped_n);
        assert_near(&format!("clamped at both ends, L {length_m} m"), found, clamped_n);
    }
}

#[test]
fn eulers_load_is_met_with_second_order() {
    let (ei, length_m, [free_n, ..]) = COLUMNS[2];
    let error = |links| load_of_free_column(length_m, links, ei, 1.1 * free_n) / free_n - 1.0;
    assert_second_order([8, 16, 32].map(error), "Euler's load of a free column");
}

/// Force of a column against a wall to which its tip is pinned, fed until it is 0.1 % too long for its gap,
/// compression included. `euler_n`: expected force.
///
/// `hinged`: at the guide the column is as soft as an instrument may be, so it rotates like on a pin.
fn pinned_force_n(ei: f64, free_m: f64, euler_n: f64, hinged: bool) -> f64 {
    const EA_N: f64 = 1e3;
    let normal = [-1.0, 0.0, 0.0];
    let at = [free_m, 0.0, 0.0];
    let bounds = [[0.5 * free_m, -0.01, -0.01], [free_m + 0.01, 0.01, 0.01]];
    let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| plane(p, at, normal));
    // The base link is nearly whole, and with it the hinge.
    let (whole, links) = (60.0, 60.9);
    let mut rod = rod(free_m, 1, ei);
    rod.solver.link_length_m = free_m / links;
    // So thin that the tip turns about the point that it touches.
    rod.instrument.outer_radius_m = 1e-5;
    // Compression of the column would lower the load by its strain.
    rod.instrument.sections[0].axial_stiffness_n = EA_N;
    if hinged {
        let firm = rod.instrument.sections[0];
        // Up to the cell of the joint at the guide.
        let firm_m = (whole + 0.5) * rod.solver.link_length_m;
        let hinge = Section { bending_stiffness_n_m2: 1e-9, ..firm };
        rod.instrument.sections =
            [Section { length_m: firm_m, ..firm }, hinge].into_iter().collect();
    }
    rod.wall = Wall {
        line_stiffness_n_per_m2: 1.0,
        end_stiffness_n_per_m: 1e5,
        tangential_ratio: 10.0,
        friction_coefficient: 2.0,
        onset_m: 1e-7,
        damping_s: 0.0,
    };
    // A breath of imperfection.
    rod.gravity_m_per_s2 = [0.0, 0.0, 1e-4];
    let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
    let mut insertion_m = 0.999 * free_m;
    while !settle(&model, &lumen, &mut state, inserted(insertion_m)) {}
    let last_m = free_m * (1.001 + euler_n / EA_N);
    let feed_m = (last_m - insertion_m) / 4000.0;
    for _ in 0..4000 {
        insertion_m += feed_m;
        step(&model, &lumen, &mut state, inserted(insertion_m));
    }
    rest(&model, &lumen, &mut state, inserted(last_m), &FREE_TIP).force_on_vessel_n[0]
}

#[test]
fn a_column_pushed_against_a_wall_buckles_at_the_load_of_clamped_and_pinned() {
    for (ei, free_m, [_, euler_n, _]) in COLUMNS {
        let found = pinned_force_n(ei, free_m, euler_n, false);
        assert_near(&format!("L {free_m} m"), found, euler_n);
    }
}

#[test]
fn a_column_pinned_at_both_ends_buckles_at_eulers_load() {
    // `euler`, pinned: π² EI/L².
    for (ei, free_m, _) in COLUMNS {
        let euler_n = PI * PI * ei / (free_m * free_m);
        let found = pinned_force_n(ei, free_m, euler_n, true);
        assert_near(&format!("L {free_m} m"), found, euler_n);
    }
}

#[test]
fn an_upright_column_buckles_under_greenhills_weight() {
    // Greenhill 1881: qL³/EI = 7.8373, from J₋₁/₃ = 0.
    const CRITICAL: f64 = 7.837_347;
    let (length_m, ei) = (0.1, EI_N_M2[0]);
    let aside_at = |load: f64| {
        let mut rod = rod(length_m, 64, ei);
        rod.instrument.sections[0].mass_kg_per_m = load * ei / length_m.powi(3) / 10.0;
        // A breath of it across.
        rod.gravity_m_per_s2 = [-10.0, 0.0, 1e-3];
        hung(rod, &FREE_TIP).0.node_position_m(0).unwrap()[2]
    };
    // Southwell's line: w/q grows as 1/(critical − q).
    let loads = [0.9 * CRITICAL, 0.95 * CRITICAL];
    let [low, high] = loads.map(|load| aside_at(load) / load);
    let found = (loads[1] * high - loads[0] * low) / (high - low);
    assert_near("qL³/EI", found, CRITICAL);
}
