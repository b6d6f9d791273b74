//! A simulated release of a weight answers to the parameters that are identified from it.

use cathforce_identification::{ReleaseFeatures, Suspended, release_features};
use cathforce_reference_solver::{
    Beyond, Entry, Integrator, Lumen, Numerics, Problem, Rod, Section, TipLoad, WallLaw,
};
use nalgebra::Vector3;

const LENGTH_M: f64 = 0.135;
const EDGES: usize = 12;

/// An 8 F catheter with the effective modulus and density that were published for it.
fn catheter(youngs_pa: f64, density_kg_per_m3: f64, beyond: Beyond) -> Problem {
    let section = Section::tube(1.0, 2.7e-3, 2.5e-3, youngs_pa, 0.2, density_kg_per_m3);
    Problem {
        rod: Rod { radius_m: 1.35e-3, sections: vec![section], curves: Vec::new() },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::y() },
        lumen: Lumen::open(),
        beyond,
        wall: WallLaw {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.3,
        },
        gravity_m_per_s2: Vector3::z() * -9.81,
        drag_n_s_per_m2: 0.0,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            spacing_m: LENGTH_M / EDGES as f64,
            step_s: 4e-3,
            integrator: Integrator::BdfAlpha { alpha: -0.3 },
            tolerance_n: 1e-8,
        },
    }
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
