//! Parameters are recovered from simulated, noisy records; what cannot be told is said.

use std::sync::atomic::AtomicBool;

use cathforce_identification::*;
use cathforce_reference_solver::Problem;

const LENGTH_M: f64 = 0.135;
const DIAMETER_M: f64 = 0.82e-3;
const NOISE_M: f64 = 0.2e-3;
static NEVER: AtomicBool = AtomicBool::new(false);

/// The nominal values of table I.
const NOMINAL: RodValues = RodValues {
    density_kg_per_m3: 6169.0,
    youngs_pa: 30.2e9,
    air_drag_kg_per_m2: 2.65e-6,
    damping_n_m2_s: 4.93e-6,
    tip_mass_kg: 3.5e-3,
};
/// Its lower and upper bounds.
const LOWER: RodValues = RodValues {
    density_kg_per_m3: 4208.0,
    youngs_pa: 26.8e9,
    air_drag_kg_per_m2: 3.15e-7,
    damping_n_m2_s: 3.78e-6,
    tip_mass_kg: 1.78e-3,
};
const UPPER: RodValues = RodValues {
    density_kg_per_m3: 7881.0,
    youngs_pa: 37.8e9,
    air_drag_kg_per_m2: 5.06e-6,
    damping_n_m2_s: 6.0e-6,
    tip_mass_kg: 5.7e-3,
};

/// Its standard deviations.
const SPREAD: RodValues = RodValues {
    density_kg_per_m3: 3223.0,
    youngs_pa: 2.9e9,
    air_drag_kg_per_m2: 1.42e-6,
    damping_n_m2_s: 0.53e-6,
    tip_mass_kg: 0.82e-3,
};

fn problem(edges: usize, step_s: f64) -> Problem {
    let catheter = ClampedCatheter {
        length_m: LENGTH_M,
        outer_radius_m: 2e-3,
        bending_diameter_m: DIAMETER_M,
        poisson: 0.2,
    };
    catheter.in_air(&NOMINAL, Mesh { edges, step_s })
}

fn setup() -> ReleaseSetup {
    ReleaseSetup {
        diameter_m: DIAMETER_M,
        poisson: 0.2,
        length_m: LENGTH_M,
        weights_kg: vec![5e-3, 20e-3],
        duration_s: 4.0,
        sample_s: 0.025,
    }
}

/// A rod of other values in its bounds, searched over twice their width.
#[test]
fn a_rod_is_recovered_within_the_published_spread() {
    let setup = setup();
    let problems = [(16, 5e-3), (24, 3.125e-3), (6, 12.5e-3)].map(|(n, dt)| problem(n, dt));
    let rests = problems.each_ref().map(|own| setup.rest(own).unwrap());
    let truth = RodValues { youngs_pa: 33e9, tip_mass_kg: 3.0e-3, ..NOMINAL };
    let mut records = setup.releases(&truth, &problems[0], &rests[0]).unwrap();
    let mut noise = Noise::of_seed(7);
    records.iter_mut().for_each(|own| own.position_m = noise.on(&own.position_m, NOISE_M));
    let measured = measured_releases(&records, NOISE_M, 7).unwrap();
    let experiment = Releases {
        setup: &setup,
        fine: (&problems[1], &rests[1]),
        coarse: (&problems[2], &rests[2]),
    };
    let wide = |own: RodValues, by: f64| RodValues::of_array(own.to_array().map(|x| by * x));
    let parameters = RodValues::parameters(wide(LOWER, 0.5), wide(UPPER, 1.5));
    let effort = Effort { global: 60, local: 40, seed: 3 };
    let found = identify(&parameters, &experiment, &measured, effort, &NEVER, &|_| ()).unwrap();
    println!("{found:?}");
    // The printed drag moves nothing that could be measured.
    assert_eq!(found.told, [true, true, false, true, true]);
    for k in [0, 1, 3, 4] {
        let error = (found.values[k] - truth.to_array()[k]).abs();
        assert!(error < SPREAD.to_array()[k], "{}: {found:?}", RodValues::NAMES[k]);
    }
    // A heavier rod and a lighter tip swing nearly alike, so that the density is known worst by far.
    assert!(found.sd[0] > 0.1 * truth.density_kg_per_m3 && found.sd[1] < 0.01 * truth.youngs_pa);
}

/// The same from the rest of another catheter.
#[test]
fn a_release_from_a_known_rest_is_the_release() {
    let setup = setup();
    let nominal = problem(8, 5e-3);
    let rest = setup.rest(&nominal).unwrap();
    let other = RodValues { youngs_pa: 40e9, ..NOMINAL }.problem(DIAMETER_M, 0.2, &nominal);
    let suspended = Suspended { problem: &other, length_m: LENGTH_M, weight_kg: 10e-3 };
    let (a, b) = (suspended.release(0.5).unwrap(), suspended.release_from(&rest, 0.5).unwrap());
    for (a, b) in a.position_m.iter().zip(&b.position_m) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    assert_eq!(b.every(4).position_m.len(), 26);
    assert!((b.every(4).step_s - 0.02).abs() < 1e-12);
}

#[test]
fn a_record_that_does_not_swing_is_named() {
    let swing = |k: u32| 1.0 - (-0.1 * f64::from(k)).exp() * (0.5 * f64::from(k)).cos();
    let good = Release { position_m: (0..200).map(swing).collect(), step_s: 0.025 };
    assert!(measured_releases(std::slice::from_ref(&good), 1e-3, 1).is_ok());
    let bad = Release { position_m: vec![0.0; 10], step_s: 0.025 };
    let found = measured_releases(&[good, bad], 1e-3, 1);
    assert_eq!(found, Err((1, ReleaseError::TooShort(10))));
}
