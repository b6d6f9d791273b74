//! Cantilevers without a wall, against the exact elastica.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, assert_second_order, hang, rod};

const LENGTH_M: f64 = 0.1;
const EI_N_M2: f64 = 1e-4;

/// Distance of the tip from where it should be, both over the length.
fn tip_error(tip_m: [f64; 3], exact_over_length: [f64; 3]) -> f64 {
    let squares = (0..3).map(|i| (tip_m[i] / LENGTH_M - exact_over_length[i]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Second order, and at 32 links the tip is no farther off than `tolerance` (over the length).
fn assert_exact(what: &str, exact: [f64; 3], tolerance: f64, tip_m: impl Fn(usize) -> [f64; 3]) {
    let errors = [8, 16, 32].map(|links| tip_error(tip_m(links), exact));
    assert_second_order(errors, what);
    assert!(errors[2] < tolerance, "{what}: {errors:.6?}, tolerance {tolerance:.6}");
}

#[test]
fn a_dead_tip_load_gives_the_exact_elastica() {
    // PL²/EI, w/L, u/L: ../shared/references/elastica_cantilever_tip_load.csv
    // (Bisshopp & Drucker 1945; Mattiasson 1981 tabulates the same).
    for (load, drop, shortening) in [
        (0.2, 0.066364482, 0.002646548),
        (1.0, 0.301720774, 0.056433236),
        (2.0, 0.49345748, 0.160641721),
        (3.0, 0.603253441, 0.254420185),
        (5.0, 0.713791524, 0.387628361),
        (7.0, 0.7673691, 0.472927428),
        (10.0, 0.810609025, 0.554995598),
    ] {
        let force_n = load * EI_N_M2 / (LENGTH_M * LENGTH_M);
        let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
        let exact = [1.0 - shortening, 0.0, -drop];
        assert_exact(&format!("PL²/EI = {load}"), exact, 5e-4, |links| {
            hang(rod(LENGTH_M, links, EI_N_M2), &loads).0
        });
    }
}

#[test]
fn the_moment_at_the_root_is_that_of_the_elastica() {
    // ML/EI: ../shared/references/elastica_cantilever_tip_load.csv. The load is across the
    // guide, so all that the drive feels is the mouth's −M²/2EI (docs/model.md (18)).
    for (load, moment) in [(1.0, 0.943566764), (5.0, 3.061858196), (10.0, 4.450044022)] {
        let force_n = load * EI_N_M2 / (LENGTH_M * LENGTH_M);
        let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
        let drive_force_n = hang(rod(LENGTH_M, 32, EI_N_M2), &loads).1.drive_force_n;
        let found = (-drive_force_n * 2.0 / EI_N_M2).sqrt() * LENGTH_M;
        println!("PL²/EI = {load}: ML/EI = {found:.5}, exact {moment:.5}");
        assert!((found / moment - 1.0).abs() < 0.01, "{found}, not {moment}");
    }
}

#[test]
fn self_weight_gives_the_exact_elastica() {
    // qL³/EI, w/L, u/L: ../shared/references/elastica_cantilever_self_weight.json.
    for (load, drop, shortening) in [
        (0.5, 0.062305768, 0.002221),
        (1.0, 0.123471402, 0.008753605),
        (2.0, 0.238506583, 0.033107053),
        (4.0, 0.425159284, 0.109889253),
        (8.0, 0.640630717, 0.275575266),
        (16.0, 0.797019638, 0.49000508),
    ] {
        let weight_n_per_m = load * EI_N_M2 / (LENGTH_M * LENGTH_M * LENGTH_M);
        let exact = [1.0 - shortening, 0.0, -drop];
        assert_exact(&format!("qL³/EI = {load}"), exact, 0.01 * drop, |links| {
            let mut rod = rod(LENGTH_M, links, EI_N_M2);
            rod.instrument.sections[0].mass_kg_per_m = weight_n_per_m / 9.81;
            rod.gravity_m_per_s2 = [0.0, 0.0, -9.81];
            hang(rod, &FREE_TIP).0
        });
    }
}

#[test]
fn an_end_moment_rolls_the_rod_up() {
    // ML/EI: ../shared/references/end_moment_roll_up.json; κ = M/EI is exact.
    let rolled = |load: f64, links| {
        let loads = Loads { tip_moment_n_m: [0.0, -load * EI_N_M2 / LENGTH_M, 0.0], ..FREE_TIP };
        hang(rod(LENGTH_M, links, EI_N_M2), &loads).0
    };
    for half_turns in [0.2, 0.25, 0.5, 1.0, 1.5] {
        let load = core::f64::consts::PI * half_turns;
        let exact = [load.sin() / load, 0.0, (1.0 - load.cos()) / load];
        assert_exact(&format!("ML/EI = {load:.5}"), exact, 0.01, |links| rolled(load, links));
    }
    // A full circle closes whatever the number of links: no order to see.
    let closed = tip_error(rolled(core::f64::consts::TAU, 8), [0.0; 3]);
    assert!(closed < 1e-6, "the circle is open by {closed} of the length");
}

/// The solid catheter of ../shared/references/catheter_dimensioned_cases.json (radius
/// 0.825 mm) of 32 links; `youngs_modulus_pa` is 26 or 50 MPa.
fn catheter(youngs_modulus_pa: f64, length_m: f64) -> Description<f64> {
    let radius_m: f64 = 0.825e-3;
    let second_moment_m4 = core::f64::consts::PI * radius_m.powi(4) / 4.0;
    rod(length_m, 32, youngs_modulus_pa * second_moment_m4)
}

#[test]
fn a_catheter_hangs_as_its_dimensions_say() {
    // E \[Pa\], L \[m\], tip drop and retraction \[mm\]: `self_weight`, q = 0.02289 N/m.
    for (youngs_modulus_pa, length_m, drop_mm, retract_mm) in [
        (26e6, 0.05, 1.8883, 0.0408),
        (26e6, 0.1, 28.2828, 4.6916),
        (26e6, 0.15, 96.9691, 42.2525),
        (50e6, 0.05, 0.9827, 0.011),
        (50e6, 0.1, 15.4275, 1.3704),
        (50e6, 0.15, 66.5866, 18.0806),
    ] {
        let mut rod = catheter(youngs_modulus_pa, length_m);
        rod.instrument.sections[0].mass_kg_per_m = 0.02289 / 9.81;
        rod.gravity_m_per_s2 = [0.0, 0.0, -9.81];
        assert_hangs(hang(rod, &FREE_TIP).0, length_m, drop_mm, retract_mm);
    }
    // E \[Pa\], L \[m\], P \[N\], deflection and shortening \[mm\]: `tip_load`.
    for (youngs_modulus_pa, length_m, force_n, drop_mm, retract_mm) in [
        (26e6, 0.05, 0.002, 8.54365, 0.88487),
        (26e6, 0.05, 0.005, 18.76685, 4.45117),
        (26e6, 0.05, 0.01, 28.52657, 11.15849),
        (50e6, 0.03, 0.005, 2.45657, 0.12097),
        (50e6, 0.03, 0.02, 8.9727, 1.66262),
        (50e6, 0.05, 0.02, 29.04228, 11.63432),
    ] {
        let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
        let tip = hang(catheter(youngs_modulus_pa, length_m), &loads).0;
        assert_hangs(tip, length_m, drop_mm, retract_mm);
    }
}

fn assert_hangs(tip_m: [f64; 3], length_m: f64, drop_mm: f64, retract_mm: f64) {
    let found = [-tip_m[2] * 1e3, (length_m - tip_m[0]) * 1e3];
    let off = (found[0] - drop_mm).hypot(found[1] - retract_mm) / drop_mm.hypot(retract_mm);
    println!("drop {drop_mm} mm, retraction {retract_mm} mm: {found:.4?}, off by {off:.5}");
    assert!(off < 0.01, "drop {drop_mm} mm, retraction {retract_mm} mm: {found:?}");
}

#[test]
fn without_shear_it_is_the_limit_of_shear_flexible_beams() {
    // The model's sections stay normal to the centre line, so of
    // ../shared/references/reissner_shear_cantilever.json only GA → ∞ applies (row GA = 1e9 at
    // PL²/EI = 1: u, w over L); the other rows need shear.
    let force_n = EI_N_M2 / (LENGTH_M * LENGTH_M);
    let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
    let tip = hang(rod(LENGTH_M, 32, EI_N_M2), &loads).0;
    assert!(tip_error(tip, [1.0 - 0.056433237, 0.0, -0.301720775]) < 5e-4);
    // What is left out, from the row GA = 500 P: the shear of a solid catheter of 26 MPa and
    // radius 0.825 mm, 50 mm long under the same PL²/EI = 1.
    let area_m2 = core::f64::consts::PI * 0.825e-3 * 0.825e-3;
    let (ga_n, p_n) = (26e6 / 3.0 * area_m2, 9.46e-6 / (0.05 * 0.05));
    let left_out = tip_error(tip, [1.0 - 0.056923489, 0.0, -0.30332717]) * 500.0 * p_n / ga_n;
    println!("shear would move the tip of a catheter by {left_out:.6} of its length");
    assert!(left_out < 5e-4, "{left_out}");

    // `tip_euler_bernoulli` over L of ../shared/references/timoshenko_cantilever.json, with
    // PL²/EI of each row (E, radius, L, F); `tip_timoshenko` needs shear.
    for (e_pa, radius, length, force, tip) in [
        (1e6, 0.25, 3.0, 15.0, -0.044003158666047225),
        (1e6, 0.05, 1.0, 0.01, -0.0006790610905254201),
        (1e6, 0.1, 1.0, 0.01, -4.2441318157838754e-5),
    ] {
        let ei = e_pa * core::f64::consts::PI * f64::powi(radius, 4) / 4.0;
        let load = force * length * length / ei;
        let force_n = load * EI_N_M2 / (LENGTH_M * LENGTH_M);
        let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
        let found = hang(rod(LENGTH_M, 32, EI_N_M2), &loads).0[2] / LENGTH_M;
        assert!((found / (tip / length) - 1.0).abs() < 0.01, "{found}, not {}", tip / length);
    }
}
