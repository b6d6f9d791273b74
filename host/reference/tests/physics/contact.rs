//! Rods in tubes, against closed forms.

use crate::support::cantilever;
use cathforce_reference::*;
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
