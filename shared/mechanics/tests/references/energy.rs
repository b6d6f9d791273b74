//! Energies of states with known energies.

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, free_space, inserted, rest, rod};

#[test]
fn bending_twist_and_stretch_store_what_their_loads_have_done() {
    let (length_m, ei) = (0.1, 1e-4);
    let mut rod = rod(length_m, 32, ei);
    rod.instrument.sections[0].axial_stiffness_n = 50.0;
    let (moment, torque, force) = (1e-3, 4e-4, 0.2);
    // M²L/2EI, T²L/2GJ, F²L/2EA; the outer half of the link at the tip neither bends nor twists.
    let jointed_m = length_m * (1.0 - 0.5 / 32.0);
    for (loads, expected_j) in [
        (
            Loads { tip_moment_n_m: [0.0, moment, 0.0], ..FREE_TIP },
            0.5 * moment * moment * jointed_m / ei,
        ),
        (
            Loads { tip_moment_n_m: [torque, 0.0, 0.0], ..FREE_TIP },
            0.5 * torque * torque * jointed_m / (0.7 * ei),
        ),
        (
            Loads { tip_force_n: [force, 0.0, 0.0], ..FREE_TIP },
            0.5 * force * force * length_m / 50.0,
        ),
    ] {
        let (model, wall, mut state) =
            (Chain::new(rod.clone()).unwrap(), free_space(), State::new());
        rest(&model, &wall.lumen(), &mut state, inserted(length_m), &loads);
        let found = state.elastic_energy_j(&model);
        assert!(
            (found / expected_j - 1.0).abs() < 1e-3,
            "{loads:?}: {found} J, not {expected_j} J"
        );
        assert!(state.kinetic_energy_j(&model) < 1e-9 * expected_j);
    }
}

#[test]
fn a_rod_that_is_fed_has_the_kinetic_energy_of_its_speed() {
    let (speed_m_per_s, mut insertion_m) = (0.05, 0.05);
    let (model, wall, mut state) =
        (Chain::new(rod(0.1, 32, 1e-4)).unwrap(), free_space(), State::new());
    let lumen = wall.lumen();
    rest(&model, &lumen, &mut state, inserted(insertion_m), &FREE_TIP);
    for _ in 0..60 {
        insertion_m += speed_m_per_s * 1e-2;
        step(&model, &lumen, &mut state, inserted(insertion_m));
    }
    // The half of the base link that moves with the guide is not a node's.
    let mass_kg = 1e-3 * (insertion_m - 0.5 * insertion_m.rem_euclid(0.1 / 32.0));
    let expected_j = 0.5 * mass_kg * speed_m_per_s * speed_m_per_s;
    let found = state.kinetic_energy_j(&model);
    assert!((found / expected_j - 1.0).abs() < 0.01, "{found} J, not {expected_j} J");
}
