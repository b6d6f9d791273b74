//! Rods in tubes, against closed forms.

use crate::support::cantilever;
use cathforce_reference_solver::*;
use nalgebra::Vector3;

const BEND_M: f64 = 0.04;
const TUBE_M: f64 = 2e-3;
const RADIUS_M: f64 = 0.8e-3;
const PULL_N: f64 = 0.02;

/// 10 mm straight, a right angle, 30 mm straight; a limp rod, pulled out by its tip.
fn bent_tube_problem(friction: f64) -> Problem {
    let mut problem = cantilever(0.12, 240, 2e-8);
    problem.rod.sections[0].axial_n = 10.0;
    problem.lumen = Lumen::tube(
        TubePath::from(Vector3::zeros(), Vector3::x(), TUBE_M)
            .straight(0.01, TUBE_M)
            .arc(BEND_M, std::f64::consts::FRAC_PI_2, Vector3::y(), TUBE_M)
            .straight(0.03, TUBE_M)
            .tube(),
    );
    problem.wall.friction_coefficient = friction;
    problem.tip_load.force_n = Vector3::y() * PULL_N;
    problem
}

#[test]
fn a_limp_rod_pulled_round_a_bend_obeys_the_capstan_equation() {
    for friction in [0.1, 0.3, 0.6] {
        let problem = bent_tube_problem(friction);
        let schedule = Schedule::starting_at(0.1, 0.0).then(0.5, 0.1, -5e-3, 0.0);
        let (samples, _) = run(&problem, &schedule).unwrap();
        let last = &samples[samples.len() - 1];
        let pull = -last.drive_force_n;
        // The rod runs straight from the mouth to the circle that its centre line follows
        // on the inside of the bend, and on it until the load's direction is reached.
        let riding = BEND_M - (TUBE_M - RADIUS_M);
        let (along, across) = (0.01_f64, BEND_M);
        let lost = across.atan2(along) - (riding / across.hypot(along)).asin();
        let wrap = std::f64::consts::FRAC_PI_2 - lost;
        // Moments about the bend's centre: T′ = μ n (R − r), as friction acts at the surface;
        // its couple needs a shear force μ n r, whence n R = T − μ r n′. With n ∝ exp(a θ)
        // both are solved by a = μ (1 − ρ)/(1 + μ ρ a), ρ = r/R.
        let ratio = RADIUS_M / riding;
        let rate =
            (0..20).fold(friction, |a, _| friction * (1.0 - ratio) / (1.0 + friction * ratio * a));
        let exact = PULL_N * (rate * wrap).exp();
        let error = pull / exact - 1.0;
        println!("friction {friction}: {:.3} mN, error {error:.1e}", 1e3 * pull);
        assert!(error.abs() < 2e-3, "friction {friction}: {pull} {exact}");
    }
}

/// A stiffer rod fed 20 mm round the bend.
fn fed(spacing_m: f64, step_s: f64) -> Vec<Sample> {
    let mut problem = bent_tube_problem(0.3);
    problem.rod.sections[0].bending_n_m2 = 1e-5;
    problem.rod.sections[0].torsion_n_m2 = 7e-6;
    problem.rod.sections[0].axial_n = 30.0;
    problem.tip_load = TipLoad::default();
    problem.drag_n_s_per_m2 = 0.1;
    problem.numerics = Numerics { spacing_m, step_s, ..problem.numerics };
    let schedule = Schedule::starting_at(0.04, 0.0).then(1.6, 0.2, 0.0133, 0.0);
    run(&problem, &schedule).unwrap().0
}

#[test]
fn finer_meshes_and_steps_agree_ever_better() {
    let forces = |spacing_m, step_s: f64| -> Vec<f64> {
        // Samples are taken every 4 ms for any step.
        let every = (4e-3 / step_s).round() as usize;
        let samples = fed(spacing_m, step_s);
        samples.iter().skip(every - 1).step_by(every).map(|s| s.drive_force_n).collect()
    };
    let finest = forces(0.5e-3, 1e-3);
    let peak = finest.iter().fold(0.0, |peak: f64, f| peak.max(f.abs()));
    let [coarse, fine] = [(2e-3, 4e-3), (1e-3, 2e-3)].map(|(spacing_m, step_s)| {
        let squares = forces(spacing_m, step_s)
            .iter()
            .zip(&finest)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>();
        (squares / finest.len() as f64).sqrt() / peak
    });
    println!("peak {:.2} mN; off by {coarse:.1e}, {fine:.1e} of it", 1e3 * peak);
    assert!(peak > 3e-3, "{peak}");
    assert!(fine < 0.005 && fine < 0.5 * coarse, "{coarse} {fine}");
}
