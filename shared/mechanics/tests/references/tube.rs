//! A rod that is bent by a wall: held at three points, or too long for a bend.

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, inserted, rest, rod};
use crate::wall::{StoredWall, Vector, add, norm, plane, tube};

/// EI of the solid catheter of ../shared/references/rod_in_tube.json, of 26 and of 50 MPa.
const EI_N_M2: [f64; 2] = [9.459736155740662e-6, 1.8191800299501273e-5];
const ROD_RADIUS_M: f64 = 0.825e-3;

/// A nearly rigid wall.
fn hard() -> Wall<f64> {
    Wall {
        line_stiffness_n_per_m2: 1e6,
        end_stiffness_n_per_m: 1e5,
        tangential_ratio: 0.0,
        friction_coefficient: 0.0,
        onset_m: 1e-6,
        damping_s: 0.0,
    }
}

#[test]
fn three_points_hold_a_bent_rod_with_the_force_of_beam_theory() {
    // `three_point`: half span, deflection, force in the middle 48 EI d/(2a)³, for small
    // deflections. By symmetry the middle is a clamp, and the end is pressed on a wall that
    // only the tip touches; a tenth of the deflection stays small.
    for (half_span_m, deflection_m, ei, middle_n) in [
        (0.02, 0.001, EI_N_M2[0], 0.007094802116805497),
        (0.02, 0.002, EI_N_M2[0], 0.014189604233610993),
        (0.03, 0.002, EI_N_M2[0], 0.004204327180329185),
        (0.03, 0.002, EI_N_M2[1], 0.008085244577556123),
    ] {
        let d = 0.1 * deflection_m;
        let slope = f64::atan(2.0 * d / half_span_m);
        let normal = [-slope.sin(), slope.cos(), 0.0];
        let at = add([half_span_m, d, 0.0], normal, -ROD_RADIUS_M);
        let bounds = [[-0.01, -0.01, -4e-3], [0.05, 0.01, 4e-3]];
        let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| plane(p, at, normal));
        let mut rod = rod(half_span_m, 64, ei);
        rod.instrument.outer_radius_m = ROD_RADIUS_M;
        rod.wall = hard();
        let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
        let outputs = rest(&model, &lumen, &mut state, inserted(half_span_m), &FREE_TIP);
        let found = 2.0 * norm(outputs.force_on_vessel_n) * deflection_m / d;
        println!("a {half_span_m} m, d {deflection_m} m: {found:.6} N ({middle_n:.6} N)");
        assert!((found / middle_n - 1.0).abs() < 0.01, "{found} N, not {middle_n} N");
    }
}

#[test]
fn a_stiff_straight_rod_fits_a_bend_up_to_its_sagitta() {
    // `sagitta`: a straight rod fits where its sagitta on the outer radius R stays below the
    // clearance 2c: R, c, longest rod \[m\].
    for (r, c, longest_m) in [
        (0.02, 0.004175, 0.032513),
        (0.02, 0.002175, 0.024906),
        (0.04, 0.004175, 0.048919),
        (0.04, 0.002175, 0.036281),
        (0.06, 0.004175, 0.061066),
        (0.06, 0.002175, 0.044859),
    ] {
        // The rod enters on the outer side, along the tangent to the inner side.
        let ring = |p: Vector| {
            let scale = (r - c) / f64::hypot(p[0], p[1]).max(1e-9);
            tube(p, [p[0] * scale, p[1] * scale, 0.0], c + ROD_RADIUS_M)
        };
        let start: f64 = 0.4;
        let half = f64::acos((r - 2.0 * c) / r);
        let bounds = [[-0.02, -0.07, -8e-3], [0.07, 0.07, 8e-3]];
        let wall = StoredWall::sampled(bounds, 1e-3, 2e-3, ring);
        let mut rod = rod(1.2 * longest_m, 60, 1e-3);
        rod.instrument.outer_radius_m = ROD_RADIUS_M;
        rod.entry.position_m = [r * start.sin(), -r * start.cos(), 0.0];
        rod.entry.direction = [(start + half).cos(), (start + half).sin(), 0.0];
        rod.wall = hard();
        let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
        let mut insertion_m = 0.5 * longest_m;
        while !settle(&model, &lumen, &mut state, inserted(insertion_m)) {}
        let onset = loop {
            insertion_m += 2e-5;
            step(&model, &lumen, &mut state, inserted(insertion_m));
            if norm(state.node_force_n(0).unwrap()) > 2e-3 || insertion_m > 1.2 * longest_m {
                break insertion_m;
            }
        };
        println!("R {r} m, c {c} m: bears from {onset:.6} m on ({longest_m:.6} m)");
        assert!((onset / longest_m - 1.0).abs() < 0.01, "{onset} m, not {longest_m} m");
    }
}
