//! A simulated release of a weight answers to the parameters that are identified from it.

use cathforce_identification::{
    ClampedCatheter, Mesh, ReleaseFeatures, RodValues, Suspended, release_features,
};
use cathforce_reference_solver::{Beyond, Problem, Section};

const LENGTH_M: f64 = 0.135;
const EDGES: usize = 12;

/// An 8 F catheter with the effective modulus and density that were published for it.
fn catheter(youngs_pa: f64, density_kg_per_m3: f64, beyond: Beyond) -> Problem {
    let own = ClampedCatheter {
        length_m: LENGTH_M,
        outer_radius_m: 1.35e-3,
        bending_diameter_m: 2.7e-3,
        poisson: 0.2,
    };
    let values = RodValues {
        density_kg_per_m3,
        youngs_pa,
        air_drag_kg_per_m2: 0.0,
        damping_n_m2_s: 0.0,
        tip_mass_kg: 0.0,
    };
    let mut problem = own.in_air(&values, Mesh { edges: EDGES, step_s: 4e-3 });
    // Hollow, unlike the rod of an identification.
    problem.rod.sections =
        vec![Section::tube(1.0, 2.7e-3, 2.5e-3, youngs_pa, 0.2, density_kg_per_m3)];
    problem.beyond = beyond;
    problem
}

fn features(problem: &Problem) -> ReleaseFeatures {
    let suspended = Suspended { problem, length_m: LENGTH_M, weight_kg: 5e-3 };
    let record = suspended.release(3.0).unwrap();
    release_features(&record.position_m, record.step_s).unwrap()
}

#[test]
fn features_move_as_the_parameters_say() {
    let beyond = Beyond { bending_viscosity_s: 4e-3, tip_mass_kg: 3.5e-3, ..Beyond::default() };
    let (youngs_pa, density) = (30.2e9 / 10.0, 6169.0);
    let nominal = features(&catheter(youngs_pa, density, beyond));
    println!("{nominal:?}");
    // The weight bends the catheter down, and it overshoots its rest.
    assert!(nominal.initial_m < 0.0 && nominal.peak_m > nominal.rest_m && nominal.rest_m > 0.0);
    let stiffer = features(&catheter(1.3 * youngs_pa, density, beyond));
    println!("{stiffer:?}");
    assert!(stiffer.rest_m < 0.85 * nominal.rest_m && stiffer.rise_s < nominal.rise_s);
    let heavier = Beyond { tip_mass_kg: 7e-3, ..beyond };
    let heavier = features(&catheter(youngs_pa, density, heavier));
    assert!(heavier.peak_width_s > 1.1 * nominal.peak_width_s, "{heavier:?}");
    let viscous = Beyond { bending_viscosity_s: 8e-3, ..beyond };
    let viscous = features(&catheter(youngs_pa, density, viscous));
    assert!(viscous.peak_m < nominal.peak_m, "{viscous:?}");
    assert!((viscous.rest_m / nominal.rest_m - 1.0).abs() < 0.02, "{viscous:?}");
    let windy = Beyond { air_drag_kg_per_m2: 0.2, ..beyond };
    let windy = features(&catheter(youngs_pa, density, windy));
    assert!(windy.peak_m < nominal.peak_m, "{windy:?}");
    assert!(stiffer.cost(nominal, [1.0; 6]) > 0.0);
}
