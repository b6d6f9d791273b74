//! A rod around a bollard: a limp one pulled against friction (capstan), and an elastic one that conforms.

use std::f64::consts::{FRAC_PI_2, PI};

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, rod};
use crate::wall::{StoredWall, Vector, add, norm};

const BOLLARD_RADIUS_M: f64 = 0.02;
/// Radius of the rod. It is the arm of friction, which the plain capstan does not have, so it is almost 0.
const ROD_RADIUS_M: f64 = 2e-5;
const LEAD_M: f64 = 0.01;
const TAIL_M: f64 = 0.015;
const TIP_TENSION_N: f64 = 0.2;
const TICK_S: f64 = 1e-2;
const DRAWN_M_PER_S: f64 = 2e-4;
const NO_STRIBECK: [f64; 2] = [1.0, 5e-3];

/// A bollard along z, around which the centre line of a rod along x bends with `radius_m` after the lead. The
/// lumen is all around it.
fn bollard(radius_m: f64, rod_radius_m: f64) -> StoredWall {
    let reach = radius_m + 3e-3;
    let centre = [LEAD_M, radius_m, 0.0];
    let (low, high) = ([-reach, -reach, -4e-3], [reach, reach, 4e-3]);
    StoredWall::sampled([add(centre, low, 1.0), add(centre, high, 1.0)], 1e-3, 2e-3, |p| {
        let mut out = add(p, centre, -1.0);
        out[2] = 0.0;
        let r = norm(out).max(1e-12);
        (r - (radius_m - rod_radius_m), out.map(|x| x / r))
    })
}

/// A dead load on the tip, in the plane of the bollard.
fn pull(force_n: f64, angle_rad: f64) -> Loads<f64> {
    let along: Vector = [angle_rad.cos(), angle_rad.sin(), 0.0];
    Loads { tip_force_n: along.map(|x| force_n * x), ..FREE_TIP }
}

/// Feeds the rod straight under tension, then winds it around the bollard without friction.
fn wound(
    rod: &Description<f64>,
    wall: &StoredWall,
    drive: Drive<f64>,
    force_n: f64,
    angle_rad: f64,
) -> State<f64> {
    let mut rod = rod.clone();
    rod.wall.friction_coefficient = 0.0;
    rod.solver.tick_s = 1e-2;
    rod.solver.drag = Drag::constant(1.0);
    let model = Chain::new(rod).unwrap();
    let (lumen, mut state) = (wall.lumen(), State::new());
    while !settle_loaded(&model, &lumen, &mut state, drive, &pull(force_n, 0.0)) {}
    for turn in 0..=4000 {
        let share = f64::min(f64::from(turn) / 3000.0, 1.0);
        step_loaded(&model, &lumen, &mut state, drive, &pull(force_n, angle_rad * share));
    }
    state
}

/// Tension at the guide and sum of the normal forces, both over the tension at the tip, of a rod that is
/// pulled at [`DRAWN_M_PER_S`]. Arguments: static over kinetic friction, and the speed at which half of the
/// difference is gone.
fn drawn(
    wall: &StoredWall,
    rod_radius_m: f64,
    angle_rad: f64,
    friction: f64,
    stribeck: [f64; 2],
) -> [f64; 2] {
    let length_m = LEAD_M + BOLLARD_RADIUS_M * angle_rad + TAIL_M;
    let mut rod = rod(length_m, 63, 1e-8);
    rod.instrument.outer_radius_m = rod_radius_m;
    rod.instrument.sections[0].axial_stiffness_n = 1e3;
    rod.wall = Wall {
        line_stiffness_n_per_m2: 2e6,
        end_stiffness_n_per_m: 0.0,
        tangential_ratio: 1.0,
        friction_coefficient: friction,
        onset_m: 3e-5,
        damping_s: 0.0,
    };
    (rod.solver.tick_s, rod.solver.solves) = (TICK_S, 2);
    let law = &mut rod.effects.contact.stribeck;
    (law.static_ratio, law.speed_m_per_s) = stribeck.into();
    let mut drive = Drive { insertion_m: length_m, rotation_rad: 0.0 };
    let mut state = wound(&rod, wall, drive, TIP_TENSION_N, angle_rad);
    let model = Chain::new(rod).unwrap();
    let (lumen, loads) = (wall.lumen(), pull(TIP_TENSION_N, angle_rad));
    let (mut guide_n, mut normal_n, counted) = (0.0, 0.0, 300.0);
    for tick in 0..1500 {
        drive.insertion_m -= DRAWN_M_PER_S * TICK_S;
        let outputs = step_loaded(&model, &lumen, &mut state, drive, &loads);
        if tick >= 1200 {
            guide_n -= outputs.drive_force_n / counted;
            let contact = |node| norm(state.node_force_n(node).unwrap());
            let sum: f64 = (0..state.nodes()).map(contact).sum();
            normal_n += sum / (1.0 + friction * friction).sqrt() / counted;
        }
    }
    [guide_n / TIP_TENSION_N, normal_n / TIP_TENSION_N]
}

#[test]
fn a_rod_drawn_around_a_bollard_pulls_as_the_capstan_says() {
    let wall = bollard(BOLLARD_RADIUS_M, ROD_RADIUS_M);
    // Angle, μ, ratio of tensions, sum of normal forces over the tip's tension:
    // ../shared/references/capstan.json (exp μθ). The rod does not see itself, so a full turn
    // is one like any other.
    for (angle_deg, friction, ratio, normal) in [
        (30.0, 0.1, 1.053754897, 0.53754897),
        (60.0, 0.1, 1.110399383, 1.10399383),
        (90.0, 0.1, 1.170088787, 1.700887875),
        (180.0, 0.1, 1.369107771, 3.691077706),
        (360.0, 0.1, 1.874456088, 8.744560876),
        (30.0, 0.3, 1.170088787, 0.566962625),
        (60.0, 0.3, 1.369107771, 1.230359235),
        (90.0, 0.3, 1.601977651, 2.006592171),
        (180.0, 0.3, 2.566332395, 5.221107984),
        (360.0, 0.3, 6.586061963, 18.620206542),
        (30.0, 0.45, 1.265692558, 0.590427907),
        (60.0, 0.45, 1.601977651, 1.337728114),
        (90.0, 0.45, 2.027611191, 2.283580425),
        (180.0, 0.45, 4.111207143, 6.913793651),
        (360.0, 0.45, 16.902024172, 35.337831493),
        (30.0, 0.6, 1.369107771, 0.615179618),
        (60.0, 0.6, 1.874456088, 1.457426813),
        (90.0, 0.6, 2.566332395, 2.610553992),
        (180.0, 0.6, 6.586061963, 9.310103271),
        (360.0, 0.6, 43.376212176, 70.627020294),
        (30.0, 0.62, 1.383520366, 0.618581236),
        (60.0, 0.62, 1.914128604, 1.474400973),
        (90.0, 0.62, 2.648235906, 2.65844501),
        (180.0, 0.62, 7.013153416, 9.698634542),
        (360.0, 0.62, 49.184320833, 77.716646505),
    ] {
        let angle_rad = f64::to_radians(angle_deg);
        let [found, sum] = drawn(&wall, ROD_RADIUS_M, angle_rad, friction, NO_STRIBECK);
        let what = format!("{angle_deg}°, μ {friction}");
        println!("{what}: ratio {found:.4} ({ratio:.4}), normal forces {sum:.4} ({normal:.4})");
        assert!((found / ratio - 1.0).abs() < 0.01, "{what}: ratio {found}, not {ratio}");
        assert!((sum / normal - 1.0).abs() < 0.01, "{what}: normal forces {sum}, not {normal}");
    }
}

#[test]
fn a_thick_rod_pulls_by_less_as_friction_acts_at_its_surface() {
    // Moments about the bollard's axis: T' = μ n (R - r), and friction's couple μ n r asks for a
    // shear force, whence n R = T - μ r n'. With n as exp(a θ) both give a = μ (1 - ρ)/(1 + μ ρ a),
    // ρ = r/R: without the arm, the capstan.
    for (rod_radius_m, friction) in [(1e-3, 0.3), (2e-3, 0.3), (2e-3, 0.6)] {
        let wall = bollard(BOLLARD_RADIUS_M, rod_radius_m);
        let ratio = rod_radius_m / BOLLARD_RADIUS_M;
        let rate =
            (0..20).fold(friction, |a, _| friction * (1.0 - ratio) / (1.0 + friction * ratio * a));
        let (exact, capstan) = ((rate * PI).exp(), (friction * PI).exp());
        let [found, _] = drawn(&wall, rod_radius_m, PI, friction, NO_STRIBECK);
        let what = format!("r {rod_radius_m} m, μ {friction}");
        println!("{what}: ratio {found:.4} ({exact:.4}; of a thin rod {capstan:.4})");
        assert!((found / exact - 1.0).abs() < 0.01, "{what}: ratio {found}, not {exact}");
        assert!(exact / capstan < 0.96, "{what}: the arm is not seen");
    }
}

#[test]
fn a_rod_drawn_slowly_pulls_by_more_than_its_kinetic_friction() {
    let wall = bollard(BOLLARD_RADIUS_M, ROD_RADIUS_M);
    let friction = 0.36;
    // At rest half as much again; half of that is left at the speed of the rod, or nothing.
    for (half_gone_m_per_s, factor) in [(DRAWN_M_PER_S, 1.25), (1e-5, 1.0)] {
        let law = [1.5, half_gone_m_per_s];
        let [found, _] = drawn(&wall, ROD_RADIUS_M, FRAC_PI_2, friction, law);
        let ratio = (factor * friction * FRAC_PI_2).exp();
        println!("half gone at {half_gone_m_per_s}: ratio {found:.4} ({ratio:.4})");
        assert!((found / ratio - 1.0).abs() < 0.01, "ratio {found}, not {ratio}");
    }
}

#[test]
fn a_rod_that_conforms_to_a_bend_has_the_moment_ei_over_r_and_presses_with_force_over_radius() {
    // ../shared/references/rod_in_tube.json, `conform`: moment_to_conform_Nm = EI/R (its
    // pair_force_over_40mm_N is that over 40 mm). A stored tube has clearance, in which a rod
    // does not conform; tension around a bollard makes it. `bent_rod_in_circular_arc…`: the
    // axial force over R on the arc, here the tip's less EI/2R², which bending takes.
    for (radius_m, ei, moment_n_m) in [
        (0.02, 9.459736155740662e-6, 0.00047298680778703307),
        (0.04, 9.459736155740662e-6, 0.00023649340389351653),
        (0.06, 9.459736155740662e-6, 0.00015766226926234436),
        (0.02, 1.8191800299501273e-5, 0.0009095900149750637),
        (0.04, 1.8191800299501273e-5, 0.00045479500748753183),
        (0.06, 1.8191800299501273e-5, 0.0003031966716583546),
    ] {
        let rod_radius_m = 0.825e-3;
        let wall = bollard(radius_m, rod_radius_m);
        let angle_rad = 0.75 * core::f64::consts::PI;
        let length_m = LEAD_M + radius_m * angle_rad + radius_m;
        let mut rod = rod(length_m, 63, ei);
        rod.instrument.outer_radius_m = rod_radius_m;
        rod.wall.line_stiffness_n_per_m2 = 1e7;
        rod.wall.end_stiffness_n_per_m = 0.0;
        rod.wall.onset_m = 1e-6;
        let drive = Drive { insertion_m: length_m, rotation_rad: 0.0 };
        let force_n = 20.0 * ei / (radius_m * radius_m);
        let state = wound(&rod, &wall, drive, force_n, angle_rad);

        // Moment of all that is beyond a node in the middle of the arc, about it; and what
        // presses on the middle third of the arc.
        let at = |node| state.node_position_m(node).unwrap();
        let on_rod = |node| state.node_force_n(node).unwrap().map(|f: f64| -f);
        let about = |x: Vector, f: Vector, o: Vector| (x[0] - o[0]) * f[1] - (x[1] - o[1]) * f[0];
        let angle = |x: Vector| (x[0] - LEAD_M).atan2(radius_m - x[1]);
        let middle =
            (0..state.nodes()).find(|&n| angle(at(n)) < 0.5 * angle_rad && at(n)[0] > LEAD_M);
        let middle = middle.unwrap();
        let mut found = about(at(0), pull(force_n, angle_rad).tip_force_n, at(middle));
        for node in 0..middle {
            found += about(at(node), on_rod(node), at(middle));
        }
        let (mut pressing_n, mut arc_m) = (0.0, 0.0);
        for node in 0..state.nodes() - 1 {
            if (0.33..0.67).contains(&(angle(at(node)) / angle_rad)) {
                pressing_n += norm(on_rod(node));
                arc_m += norm(add(at(node), at(node + 1), -1.0));
            }
        }
        let line = (force_n - 0.5 * moment_n_m / radius_m) / radius_m;
        let pressing = pressing_n / arc_m;
        println!(
            "R {radius_m} m: {found:.4e} N·m ({moment_n_m:.4e}), {pressing:.4} N/m ({line:.4})"
        );
        assert!((found / moment_n_m - 1.0).abs() < 0.01, "{found} N·m, not {moment_n_m}");
        assert!((pressing / line - 1.0).abs() < 0.01, "{pressing} N/m, not {line}");
    }
}
