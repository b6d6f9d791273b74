//! A tip that leaves the vessel by its far opening.
//!
//! The wall is stored for 4 mm past an opening (docs/explanation/lumen.md). A brick beyond is free if its
//! middle would be in the lumen, and outside otherwise. Beyond the grid, its last cell is continued.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, hang, inserted, rod};
use crate::wall::{StoredWall, tube};
use crate::{Chain, assert_near};

const TUBE_M: f64 = 4e-3;
const RADIUS_M: f64 = 0.8e-3;
const STIFFNESS: f64 = 1e-4;
const LENGTH_M: f64 = 0.06;
/// End of the stored wall, and of a brick.
const STORED_TO_M: f64 = 0.044;

/// A tube along x whose wall is stored up to [`STORED_TO_M`]. Bricks beyond it, if any, are as the host
/// makes them.
fn opened(grid_to_m: f64) -> StoredWall {
    let bounds = [[-8e-3, -8e-3, -8e-3], [grid_to_m, 8e-3, 8e-3]];
    StoredWall::sampled(bounds, 1e-3, 3e-3, |p| {
        let (d, normal) = tube(p, [p[0], 0.0, 0.0], TUBE_M);
        if p[0] > STORED_TO_M + 1e-6 { (d.signum(), normal) } else { (d, normal) }
    })
}

/// The load that deflects the tip of a free rod by this much.
fn bent_by(aside_m: f64) -> Loads<f64> {
    let force_n = 3.0 * STIFFNESS * aside_m / LENGTH_M.powi(3);
    Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP }
}

/// The rod at rest, completely inside.
fn out_of(wall: &StoredWall, loads: &Loads<f64>) -> (State<f64>, Outputs<f64>) {
    let mut rod = rod(LENGTH_M, 40, STIFFNESS);
    rod.wall.onset_m = 1e-6;
    rod.solver.drag = Drag::constant(1.0);
    rod.wall.damping_s = 5e-3;
    let (model, mut state) = (Chain::new(rod).unwrap(), State::new());
    let (lumen, drive) = (wall.lumen(), inserted(LENGTH_M));
    while !settle_loaded(&model, &lumen, &mut state, drive, loads) {}
    let mut outputs = Outputs::default();
    for _ in 0..200 {
        outputs = step_loaded(&model, &lumen, &mut state, drive, loads);
    }
    (state, outputs)
}

/// No wall is stored where the tip is, so it bends freely, although the continued vessel would press on it.
/// It is not flagged as outside, because a free brick does not tell of an opening.
#[test]
fn past_the_stored_wall_of_an_opening_a_tip_is_free() {
    let loads = bent_by(3.8e-3);
    let (state, outputs) = out_of(&opened(0.08), &loads);
    let tip = state.node_position_m(0).unwrap();
    let (free, _) = hang(rod(LENGTH_M, 40, STIFFNESS), &loads);
    println!("tip {tip:.6?}, free {free:.6?}, unresolved {}", outputs.unresolved);
    assert!(tip[2] < RADIUS_M - TUBE_M - 0.4e-3, "it would be pressed on: {tip:?}");
    let off_m = (0..3).map(|i| (tip[i] - free[i]).abs()).fold(0.0, f64::max);
    assert!(off_m < 1e-9, "{tip:?}, not {free:?}");
    assert_eq!(outputs.force_on_vessel_n, [0.0; 3]);
    assert!(!outputs.lost);
}

/// A tip that leaves the continued vessel is flagged, and no wall presses it.
#[test]
fn a_tip_beside_the_continued_vessel_is_flagged_as_outside() {
    let (state, outputs) = out_of(&opened(0.08), &bent_by(4.6e-3));
    let tip = state.node_position_m(0).unwrap();
    println!("tip {tip:.6?}, unresolved {}", outputs.unresolved);
    assert!(tip[2] < -TUBE_M, "{tip:?}");
    assert!(outputs.unresolved, "{outputs:?}");
    assert_eq!(state.node_force_n(0), Some([0.0; 3]));
}

/// If the grid ends with the stored wall, its last cross-section is continued without end.
#[test]
fn beyond_the_grid_the_last_cross_section_goes_on() {
    let loads = bent_by(3.8e-3);
    let (state, outputs) = out_of(&opened(STORED_TO_M), &loads);
    let tip = state.node_position_m(0).unwrap();
    println!(
        "tip {tip:.6?}, unresolved {}, {:.6?} N",
        outputs.unresolved, outputs.force_on_vessel_n
    );
    // 16 mm past the grid. The wall carries 3 EI/L³ times the 0.6 mm that the rod would deflect further. It
    // yields by less than 1 µm, and is stored with an error of a few.
    assert!(tip[0] > STORED_TO_M + 0.01);
    assert!((tip[2] - (RADIUS_M - TUBE_M)).abs() < 5e-6, "{tip:?}");
    let pressed_n = 3.0 * STIFFNESS * 0.6e-3 / LENGTH_M.powi(3);
    assert_near("pressed", -outputs.force_on_vessel_n[2], pressed_n, 0.03);
    assert!(!outputs.unresolved, "{outputs:?}");
}
