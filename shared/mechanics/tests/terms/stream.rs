//! Drag of the flow on a straight rod.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, hang, inserted, rest, rod};
use crate::{Chain, assert_near, floor, with};

const LENGTH_M: f64 = 0.1;
const LINKS: usize = 50;
const STIFFNESS: f64 = 1e-3;
/// Half of the link at the mouth is carried by the guide.
const FREE_M: f64 = LENGTH_M * (1.0 - 0.5 / LINKS as f64);

/// docs/explanation/model.md (45)
///
/// Flow towards the tip pulls the rod in by its force per length, and the drive holds it back. The sum over
/// the nodes is exact. Flow along the rod has no part across it.
#[test]
fn a_stream_along_a_rod_draws_it_in() {
    for along_n_per_m in [0.2, -0.3] {
        let streaming = with(
            rod(LENGTH_M, LINKS, STIFFNESS),
            &[
                ("effects.fluid.drag.along_n_per_m", along_n_per_m),
                ("effects.fluid.drag.x_n_per_m", 1.0),
            ],
        );
        let (tip, outputs) = hang(streaming.clone(), &FREE_TIP);
        assert_near("along", outputs.drive_force_n, -along_n_per_m * FREE_M, 1e-6);
        assert!(tip[1].abs() + tip[2].abs() < 1e-12, "{tip:?}");
        assert!(outputs.force_on_vessel_n == [0.0; 3], "the wall does not feel it: {outputs:?}");
        // At the peak of the pulse.
        let pulse = [
            ("effects.fluid.drag.pulse_ratio", 0.5),
            ("effects.fluid.drag.frequency_hz", 0.0),
            ("effects.fluid.drag.phase_rad", core::f64::consts::FRAC_PI_2),
        ];
        let (_, outputs) = hang(with(streaming, &pulse), &FREE_TIP);
        assert_near("pulse", outputs.drive_force_n, -1.5 * along_n_per_m * FREE_M, 1e-6);
    }
}

/// docs/explanation/model.md (45)
///
/// A cantilever under a uniform load deflects by q L⁴/8EI. Here it is at most 2 % of the length, which makes
/// the formula exact to (0.02)². Lumping at the nodes of 50 links adds an error of h²/L².
#[test]
fn a_stream_across_a_rod_bends_it_downstream() {
    for (axis, key) in [(1, "effects.fluid.drag.y_n_per_m"), (2, "effects.fluid.drag.z_n_per_m")] {
        for across_n_per_m in [0.1, -0.1] {
            let streaming = with(rod(LENGTH_M, LINKS, STIFFNESS), &[(key, across_n_per_m)]);
            let (tip, outputs) = hang(streaming, &FREE_TIP);
            let exact_m = across_n_per_m * LENGTH_M.powi(4) / (8.0 * STIFFNESS);
            assert_near(key, tip[axis], exact_m, 2e-3);
            assert!(tip[3 - axis].abs() < 1e-12, "{tip:?}");
            // The slope at the end is too small for a noticeable force along the rod.
            assert!(outputs.drive_force_n.abs() < 0.02 * 0.1 * LENGTH_M, "{outputs:?}");
        }
    }
}

/// docs/explanation/model.md (45): at distance d from the wall the factor is x (2 − x), x = d/R.
#[test]
fn a_stream_is_slower_beside_the_wall() {
    let (along_n_per_m, wall_m, fastest_m) = (0.2, 2e-3, 5e-3);
    let streaming = with(
        rod(LENGTH_M, LINKS, STIFFNESS),
        &[
            ("effects.fluid.drag.along_n_per_m", along_n_per_m),
            ("effects.fluid.drag.lumen_radius_m", fastest_m),
        ],
    );
    let (model, wall, mut state) = (Chain::new(streaming).unwrap(), floor(-wall_m), State::new());
    let outputs = rest(&model, &wall.lumen(), &mut state, inserted(LENGTH_M), &FREE_TIP);
    let x = wall_m / fastest_m;
    // Tolerance: the resolution of the stored distance, 0.5 µm of 2 mm.
    let exact_n = -along_n_per_m * FREE_M * x * (2.0 - x);
    assert_near("beside the wall", outputs.drive_force_n, exact_n, 1e-3);
}
