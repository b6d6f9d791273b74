//! Cantilevers without a wall, against the exact elastica.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, assert_second_order, hang, hung, rod};

const LENGTH_M: f64 = 0.1;
const EI_N_M2: f64 = 1e-4;

/// Distance of the tip from the exact position, over the length.
fn tip_error(tip_m: [f64; 3], exact_over_length: [f64; 3]) -> f64 {
    let squares = (0..3).map(|i| (tip_m[i] / LENGTH_M - exact_over_length[i]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Asserts second order, and an error of the tip of at most `tolerance` (over the length) with 32 links.
fn assert_exact(what: &str, exact: [f64; 3], tolerance: f64, tip_m: impl Fn(usize) -> [f64; 3]) {
    let errors = [8, 16, 32].map(|links| tip_error(tip_m(links), exact));
    assert_second_order(errors, what);
    assert!(errors[2] < tolerance, "{what}: {errors:.6?}, tolerance {tolerance:.6}");
}

/// PL²/EI, w/L, u/L, tip angle \[rad\], ML/EI at the root:
/// ../shared/references/elastica_cantilever_tip_load.csv, all rows (Bisshopp & Drucker 1945;
/// Mattiasson 1981 prints the rows 1, 2, 3, 4, 5 and 10 to five digits, the same).
const TIP_LOAD: [[f64; 5]; 23] = [
    [0.2, 0.066364482, 0.002646548, 0.099636163, 0.19947069],
    [0.25, 0.082745915, 0.004117818, 0.124292442, 0.248970545],
    [0.4, 0.130975242, 0.010353922, 0.197154624, 0.395858431],
    [0.5, 0.162143576, 0.015918962, 0.244533647, 0.492040519],
    [0.6, 0.19235028, 0.022487668, 0.290737767, 0.586507399],
    [0.75, 0.235615231, 0.033966315, 0.357526167, 0.724525264],
    [0.8, 0.249451542, 0.038165613, 0.379063008, 0.769467509],
    [1.0, 0.301720774, 0.056433236, 0.46135195, 0.943566764],
    [1.25, 0.360066696, 0.081566159, 0.555302593, 1.148042301],
    [1.5, 0.410978211, 0.107941501, 0.639539826, 1.338087749],
    [1.75, 0.455161127, 0.134528192, 0.714727024, 1.514575665],
    [2.0, 0.49345748, 0.160641721, 0.781749832, 1.678716558],
    [2.5, 0.555659463, 0.209958457, 0.894996751, 1.975103857],
    [3.0, 0.603253441, 0.254420185, 0.986016947, 2.236739446],
    [3.5, 0.640391686, 0.293939442, 1.060116938, 2.471211952],
    [4.0, 0.669964181, 0.328941242, 1.121239347, 2.684235031],
    [4.5, 0.693966999, 0.359987172, 1.172277923, 2.880057724],
    [5.0, 0.713791524, 0.387628361, 1.215368118, 3.061858196],
    [6.0, 0.744571149, 0.434588829, 1.283697286, 3.392467028],
    [7.0, 0.7673691, 0.472927428, 1.334959857, 3.689508001],
    [8.0, 0.784982375, 0.504827732, 1.374431507, 3.961378143],
    [9.0, 0.799055527, 0.531820563, 1.405465334, 4.213614936],
    [10.0, 0.810609025, 0.554995598, 1.430285539, 4.450044022],
];

fn tip_load(load: f64) -> Loads<f64> {
    let force_n = load * EI_N_M2 / (LENGTH_M * LENGTH_M);
    Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP }
}

/// The angle of the link at the tip, downwards \[rad\].
fn tip_angle_rad(state: &State<f64>) -> f64 {
    let [tip, behind] = [0, 1].map(|node| state.node_position_m(node).unwrap());
    (behind[2] - tip[2]).atan2(tip[0] - behind[0])
}

/// ML/EI at the root, under a load across the guide. The force at the drive is then only the
/// configurational force −M²/2EI, docs/explanation/model.md (23).
fn root_moment(outputs: &Outputs<f64>) -> f64 {
    (-outputs.drive_force_n * 2.0 / EI_N_M2).sqrt() * LENGTH_M
}

/// A cantilever's tip angle \[rad\] and moment at the root, ML/EI, are within 1 %.
fn assert_bent(what: &str, (state, outputs): &(State<f64>, Outputs<f64>), exact: [f64; 2]) {
    let found = [tip_angle_rad(state), root_moment(outputs)];
    println!("{what}: tip angle and ML/EI {found:.5?}, exact {exact:.5?}");
    for (found, exact) in found.into_iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 0.01, "{what}: {found}, not {exact}");
    }
}

#[test]
fn a_dead_tip_load_gives_the_exact_elastica() {
    for [load, drop, shortening, ..] in TIP_LOAD {
        let exact = [1.0 - shortening, 0.0, -drop];
        assert_exact(&format!("PL²/EI = {load}"), exact, 5e-4, |links| {
            hang(rod(LENGTH_M, links, EI_N_M2), &tip_load(load)).0
        });
    }
}

/// A rod of a number of links, of which a quarter at the tip is half as long as the others.
fn finer_at_the_tip(links: usize) -> Description<f64> {
    let halves = links / 4;
    let mut description = rod(LENGTH_M, links, EI_N_M2);
    let solver = &mut description.solver;
    solver.link_length_m = LENGTH_M / (links as f64 - 0.5 * halves as f64);
    solver.fine_tip_m = 0.5 * solver.link_length_m * (halves as f64 + 0.25);
    let reach_m = solver.reach_m(links);
    assert!((reach_m - LENGTH_M).abs() < 1e-12, "{links} links reach {reach_m} m");
    description
}

#[test]
fn shorter_links_at_the_tip_give_the_exact_elastica() {
    for [load, drop, shortening, ..] in TIP_LOAD {
        let exact = [1.0 - shortening, 0.0, -drop];
        assert_exact(&format!("PL²/EI = {load}, finer at the tip"), exact, 7e-4, |links| {
            hang(finer_at_the_tip(links), &tip_load(load)).0
        });
        let error = tip_error(hang(finer_at_the_tip(64), &tip_load(load)).0, exact);
        assert!(error < 2e-4, "64 links, PL²/EI = {load}: {error:.6}");
    }
}

#[test]
fn the_angle_at_the_tip_and_the_moment_at_the_root_are_those_of_the_elastica() {
    for [load, _, _, angle_rad, moment] in TIP_LOAD {
        let found = hung(rod(LENGTH_M, 32, EI_N_M2), &tip_load(load));
        assert_bent(&format!("PL²/EI = {load}"), &found, [angle_rad, moment]);
    }
}

fn heavy(load: f64, links: usize) -> Description<f64> {
    let weight_n_per_m = load * EI_N_M2 / (LENGTH_M * LENGTH_M * LENGTH_M);
    let mut rod = rod(LENGTH_M, links, EI_N_M2);
    rod.instrument.sections[0].mass_kg_per_m = weight_n_per_m / 9.81;
    rod.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    rod
}

#[test]
fn self_weight_gives_the_exact_elastica() {
    // qL³/EI, w/L, u/L, tip angle [rad], ML/EI at the root:
    // ../shared/references/elastica_cantilever_self_weight.json.
    for [load, drop, shortening, angle_rad, moment] in [
        [0.5, 0.062305768, 0.002221, 0.083136587, 0.249611234],
        [1.0, 0.123471402, 0.008753605, 0.165115561, 0.4969334],
        [2.0, 0.238506583, 0.033107053, 0.321593798, 0.976742715],
        [4.0, 0.425159284, 0.109889253, 0.588592372, 1.844254395],
        [8.0, 0.640630717, 0.275575266, 0.940121535, 3.201576405],
        [16.0, 0.797019638, 0.49000508, 1.260253108, 5.050210729],
    ] {
        let (what, exact) = (format!("qL³/EI = {load}"), [1.0 - shortening, 0.0, -drop]);
        assert_exact(&what, exact, 0.01 * drop, |links| hang(heavy(load, links), &FREE_TIP).0);
        assert_bent(&what, &hung(heavy(load, 32), &FREE_TIP), [angle_rad, moment]);
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
    // E [Pa], L [m], tip drop and retraction [mm], angle [°]: `self_weight`, q = 0.02289 N/m.
    for (youngs_modulus_pa, length_m, exact) in [
        (26e6, 0.05, [1.8883, 0.0408, 2.8858]),
        (26e6, 0.1, [28.2828, 4.6916, 21.9531]),
        (26e6, 0.15, [96.9691, 42.2525, 54.4732]),
        (50e6, 0.05, [0.9827, 0.011, 1.5016]),
        (50e6, 0.1, [15.4275, 1.3704, 11.8404]),
        (50e6, 0.15, [66.5866, 18.0806, 35.3416]),
    ] {
        let mut rod = catheter(youngs_modulus_pa, length_m);
        rod.instrument.sections[0].mass_kg_per_m = 0.02289 / 9.81;
        rod.gravity_m_per_s2 = [0.0, 0.0, -9.81];
        assert_hangs(&hung(rod, &FREE_TIP).0, length_m, exact);
    }
    // E [Pa], L [m], P [N], deflection and shortening [mm], angle [°]: `tip_load`.
    for (youngs_modulus_pa, length_m, force_n, exact) in [
        (26e6, 0.05, 0.002, [8.54365, 0.88487, 14.77398]),
        (26e6, 0.05, 0.005, [18.76685, 4.45117, 33.25022]),
        (26e6, 0.05, 0.01, [28.52657, 11.15849, 52.88375]),
        (50e6, 0.03, 0.005, [2.45657, 0.12097, 7.04718]),
        (50e6, 0.03, 0.02, [8.9727, 1.66262, 26.19399]),
        (50e6, 0.05, 0.02, [29.04228, 11.63432, 54.00954]),
    ] {
        let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
        let found = hung(catheter(youngs_modulus_pa, length_m), &loads).0;
        assert_hangs(&found, length_m, exact);
    }
}

fn assert_hangs(found: &State<f64>, length_m: f64, [drop_mm, retract_mm, angle_deg]: [f64; 3]) {
    let (tip_m, angle) = (found.node_position_m(0).unwrap(), tip_angle_rad(found).to_degrees());
    let found = [-tip_m[2] * 1e3, (length_m - tip_m[0]) * 1e3];
    let off = (found[0] - drop_mm).hypot(found[1] - retract_mm) / drop_mm.hypot(retract_mm);
    println!(
        "drop {drop_mm} mm, retraction {retract_mm} mm: {found:.4?}, off by {off:.5}; {angle:.3}° \
         ({angle_deg}°)"
    );
    assert!(off < 0.01, "drop {drop_mm} mm, retraction {retract_mm} mm: {found:?}");
    assert!((angle / angle_deg - 1.0).abs() < 0.01, "{angle}°, not {angle_deg}°");
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
