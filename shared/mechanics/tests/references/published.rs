//! Material laws as published, ../shared/references/published.md.

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, inserted, rest, rod};
use crate::wall::{StoredWall, plane};

#[test]
fn a_silicone_wall_pushes_back_by_its_published_laws() {
    // Pescio 2025, table 2: neo-Hookean μ = 0.04 MPa, where C10 stands; Mooney–Rivlin C10 = 0.02,
    // C01 = 0.09 MPa. Its Cauchy stress 2(λ² − 1/λ)(C10 + C01/λ) is the nominal one times λ, of
    // slope 6(C10 + C01) at rest. Ogden's law is none of the model's wall.
    const STIFFNESS_N_PER_M: f64 = 100.0;
    const THICKNESS_M: f64 = 2e-3;
    let (length_m, at) = (0.02, [0.02, 0.0, 0.0]);
    let bounds = [[0.0, -0.01, -0.01], [0.04, 0.01, 0.01]];
    let wall = StoredWall::sampled(bounds, 1e-3, 4e-3, |p| plane(p, at, [-1.0, 0.0, 0.0]));
    for (law, [c10, c01]) in [("neo-Hookean", [0.04, 0.0]), ("Mooney–Rivlin", [0.02, 0.09])] {
        for indentation_m in [1e-4, 4e-4, 1e-3] {
            // So stiff that it only indents.
            let mut rod = rod(length_m + 2e-3, 22, 1e-2);
            rod.wall.line_stiffness_n_per_m2 = 1.0;
            rod.wall.end_stiffness_n_per_m = STIFFNESS_N_PER_M;
            rod.wall.onset_m = 1e-6;
            let law_of = &mut rod.effects.wall.hyperelastic;
            (law_of.strain_per_m, law_of.mooney_share) = (1.0 / THICKNESS_M, c01 / (c10 + c01));
            let drive = inserted(length_m + indentation_m - rod.instrument.outer_radius_m);
            let (model, mut state) = (Chain::new(rod).unwrap(), State::new());
            let force_n =
                rest(&model, &wall.lumen(), &mut state, drive, &FREE_TIP).force_on_vessel_n[0];
            let stretch = 1.0 - indentation_m / THICKNESS_M;
            let cauchy = 2.0 * (stretch * stretch - 1.0 / stretch) * (c10 + c01 / stretch);
            let nominal = -cauchy / stretch / (6.0 * (c10 + c01));
            let exact_n = STIFFNESS_N_PER_M * THICKNESS_M * nominal;
            println!("{law}, {indentation_m} m: {force_n:.5} N ({exact_n:.5} N)");
            assert!((force_n / exact_n - 1.0).abs() < 0.01, "{law}: {force_n} N, not {exact_n} N");
        }
    }
}
