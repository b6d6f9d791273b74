//! Capstan: a limp rod drawn around a bollard against friction.

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, rod};
use crate::wall::{StoredWall, Vector, add, norm};

const BOLLARD_RADIUS_M: f64 = 0.02;
/// The rod's own radius is the arm of friction, which the capstan has not: close to none.
const ROD_RADIUS_M: f64 = 2e-5;
const LEAD_M: f64 = 0.01;
const TAIL_M: f64 = 0.015;
const TIP_TENSION_N: f64 = 0.2;

/// A bollard across z that a rod along x touches after the lead; all around it is lumen.
fn bollard() -> StoredWall {
    let reach = BOLLARD_RADIUS_M + 3e-3;
    let centre = [LEAD_M, BOLLARD_RADIUS_M + ROD_RADIUS_M, 0.0];
    let (low, high) = ([-reach, -reach, -4e-3], [reach, reach, 4e-3]);
    StoredWall::sampled([add(centre, low, 1.0), add(centre, high, 1.0)], 1e-3, 2e-3, |p| {
        let mut out = add(p, centre, -1.0);
        out[2] = 0.0;
        let r = norm(out).max(1e-12);
        (r - BOLLARD_RADIUS_M, out.map(|x| x / r))
    })
}

/// Tension at the guide and sum of normal forces, both over the tension at the tip.
fn drawn(wall: &StoredWall, angle_rad: f64, friction: f64) -> [f64; 2] {
    let length_m = LEAD_M + BOLLARD_RADIUS_M * angle_rad + TAIL_M;
    let mut rod = rod(length_m, 63, 1e-8);
    rod.instrument.outer_radius_m = ROD_RADIUS_M;
    rod.instrument.sections[0].axial_stiffness_n = 1e3;
    rod.wall = Wall {
        line_stiffness_n_per_m2: 1e7,
        end_stiffness_n_per_m: 0.0,
        tangential_ratio: 1.0,
        friction_coefficient: friction,
        onset_m: 1e-6,
        damping_s: 0.0,
    };
    rod.solver.tick_s = 1e-3;
    let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
    let mut drive = Drive { insertion_m: length_m, rotation_rad: 0.0 };
    let pulled = |angle: f64| {
        let along: Vector = [angle.cos(), angle.sin(), 0.0];
        Loads { tip_force_n: along.map(|x| TIP_TENSION_N * x), ..FREE_TIP }
    };
    // Fed out straight, then wound around the bollard without friction.
    while !settle_loaded(&model, &lumen, &mut state, drive, &pulled(0.0)) {}
    for turn in 0..=2000 {
        let share = f64::min(f64::from(turn) / 1500.0, 1.0);
        settle_loaded(&model, &lumen, &mut state, drive, &pulled(angle_rad * share));
    }
    let (mut guide_n, mut normal_n, counted) = (0.0, 0.0, 300.0);
    for tick in 0..900 {
        drive.insertion_m -= 5e-6;
        let outputs = step_loaded(&model, &lumen, &mut state, drive, &pulled(angle_rad));
        if tick >= 600 {
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
    let wall = bollard();
    // Angle, μ, ratio of tensions, sum of normal forces over the tip's tension:
    // ../shared/references/capstan.json (exp μθ).
    for (angle_deg, friction, ratio, normal) in [
        (30.0, 0.1, 1.053754897, 0.53754897),
        (30.0, 0.6, 1.369107771, 0.615179618),
        (60.0, 0.3, 1.369107771, 1.230359235),
        (60.0, 0.62, 1.914128604, 1.474400973),
        (90.0, 0.1, 1.170088787, 1.700887875),
        (90.0, 0.45, 2.027611191, 2.283580425),
        (180.0, 0.3, 2.566332395, 5.221107984),
        (180.0, 0.62, 7.013153416, 9.698634542),
    ] {
        let [found, sum] = drawn(&wall, f64::to_radians(angle_deg), friction);
        let what = format!("{angle_deg}°, μ {friction}");
        println!("{what}: ratio {found:.4} ({ratio:.4}), normal forces {sum:.4} ({normal:.4})");
        assert!((found / ratio - 1.0).abs() < 0.01, "{what}: ratio {found}, not {ratio}");
        assert!((sum / normal - 1.0).abs() < 0.01, "{what}: normal forces {sum}, not {normal}");
    }
}
