//! Unloaded shapes: direction and size of the deflection.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, free_space, rest, rod};
use crate::{Chain, assert_near, curved, with};

const LENGTH_M: f64 = 0.1;
const LINKS: usize = 50;
const STIFFNESS: f64 = 1e-5;
/// Tolerance over the length. Links of length h are chords of the curve, with an error of h² κ/24 L = 2·10⁻⁵
/// at 12 1/m. Where the curvature rises from the mouth on, the half cell at the guide adds
/// h² κ/8ℓ = 1.3·10⁻⁴ rad, reduced by its arm.
const ERROR: f64 = 1e-4;

/// Tip and outputs at rest, far from any wall.
fn hang(description: Description<f64>, rotation_rad: f64) -> ([f64; 3], Outputs<f64>) {
    let (model, wall, mut state) = (Chain::new(description).unwrap(), free_space(), State::new());
    let drive = Drive { insertion_m: LENGTH_M, rotation_rad };
    let outputs = rest(&model, &wall.lumen(), &mut state, drive, &FREE_TIP);
    (state.node_position_m(0).unwrap(), outputs)
}

/// Tip of a plane curve along the direction and across it, integrated by the midpoint rule from its
/// curvature at each arc from the mouth.
fn planar(curvature_per_m: impl Fn(f64) -> f64) -> [f64; 2] {
    let steps = 20_000;
    let ds = LENGTH_M / f64::from(steps);
    let (mut angle, mut tip) = (0.0_f64, [0.0; 2]);
    for i in 0..steps {
        let turn = curvature_per_m((f64::from(i) + 0.5) * ds) * ds;
        let (sin, cos) = (angle + 0.5 * turn).sin_cos();
        tip = [tip[0] + cos * ds, tip[1] + sin * ds];
        angle += turn;
    }
    tip
}

/// Position of a tip with deflections towards `up` (z) and `direction × up` (x × z = −y), rotated with the
/// drive, right-handed about x.
fn placed(along_m: f64, [up_m, side_m]: [f64; 2], rotation_rad: f64) -> [f64; 3] {
    let (sin, cos) = rotation_rad.sin_cos();
    let (y, z) = (-side_m, up_m);
    [along_m, y * cos - z * sin, y * sin + z * cos]
}

fn assert_there(what: &str, tip: [f64; 3], exact: [f64; 3]) {
    let off = (0..3).map(|i| (tip[i] - exact[i]).powi(2)).sum::<f64>().sqrt() / LENGTH_M;
    println!("{what}: tip {tip:.6?} ({exact:.6?}), off by {off:.1e} of the length");
    assert!(off < ERROR, "{what}: tip {tip:?}, not {exact:?}");
}

/// Rotations of the drive: none, ± a quarter turn, any.
const TURNS_RAD: [f64; 4] = [0.0, core::f64::consts::FRAC_PI_2, -core::f64::consts::FRAC_PI_2, 0.4];

/// docs/explanation/model.md (31)
///
/// A rod of uniform curvature κ is an arc with a deflection of (1 − cos κL)/κ, about κL²/2. The guide stores
/// ½ EI κ² per length of the straightened rod, which pulls at the drive, docs/explanation/model.md (23).
#[test]
fn stored_curvature_bends_a_free_rod_up_and_aside_and_turns_with_the_drive() {
    for (up, side) in [(2.0_f64, 0.0_f64), (0.0, 2.0), (-3.0, 5.0)] {
        let bent = with(
            rod(LENGTH_M, LINKS, STIFFNESS),
            &[
                ("effects.instrument.stored_curvature.curvature_per_m", up),
                ("effects.instrument.stored_curvature.lateral_curvature_per_m", side),
            ],
        );
        let curvature = up.hypot(side);
        let [along_m, aside_m] = planar(|_| curvature);
        assert_near("the arc", aside_m, 0.5 * curvature * LENGTH_M.powi(2), 0.03);
        let aside = [up, side].map(|x| aside_m * x / curvature);
        for rotation_rad in TURNS_RAD {
            let (tip, outputs) = hang(bent.clone(), rotation_rad);
            let what = format!("up {up}, side {side}, turned {rotation_rad}");
            assert_there(&what, tip, placed(along_m, aside, rotation_rad));
            let mouth_n = -0.5 * STIFFNESS * curvature * curvature;
            assert_near(&what, outputs.drive_force_n, mouth_n, 1e-3);
        }
    }
}

/// docs/explanation/model.md (31): it acts behind the pre-curved tip, without the tip's factor.
#[test]
fn stored_curvature_begins_behind_the_tip_and_is_not_the_tips() {
    let (tip_m, tip_per_m, factor, stored_per_m) = (0.03, -10.0, 1.5, 4.0);
    let mut rod = rod(LENGTH_M, LINKS, STIFFNESS);
    rod.instrument.precurve.push(curved(tip_m, tip_per_m, 0.0)).unwrap();
    let bent = with(
        rod,
        &[
            ("effects.instrument.stored_curvature.curvature_per_m", stored_per_m),
            ("effects.instrument.tip_precurve.factor", factor),
        ],
    );
    let in_tip = |s: f64| s > LENGTH_M - tip_m;
    let [along_m, up_m] = planar(|s| if in_tip(s) { factor * tip_per_m } else { stored_per_m });
    let (tip, _) = hang(bent, 0.0);
    assert_there("tip and shaft", tip, placed(along_m, [up_m, 0.0], 0.0));
}

/// A pre-curve towards `up` and one towards `direction × up`, at any rotation.
#[test]
fn a_lateral_pre_curve_bends_towards_direction_times_up_and_turns_with_the_drive() {
    let (tip_m, curvature) = (0.04, 12.0);
    let [along_m, aside_m] = planar(|s| if s > LENGTH_M - tip_m { curvature } else { 0.0 });
    for (up, side) in [(1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.6, -0.8)] {
        let mut rod = rod(LENGTH_M, LINKS, STIFFNESS);
        let piece = curved(tip_m, up * curvature, side * curvature);
        rod.instrument.precurve.push(piece).unwrap();
        for rotation_rad in TURNS_RAD {
            let (tip, _) = hang(rod.clone(), rotation_rad);
            let what = format!("up {up}, side {side}, turned {rotation_rad}");
            assert_there(&what, tip, placed(along_m, [up * aside_m, side * aside_m], rotation_rad));
        }
    }
}

/// docs/explanation/model.md (43)
///
/// At arc s past the mouth the share s/ℓ of a pre-curvature has come back, and all of it from ℓ on. The rod
/// leaves the mouth straight, so a free rod exerts no force on the drive. Without the guide, ½ EI κ² pulls
/// it in.
#[test]
fn a_straightened_pre_curve_comes_back_with_the_arc_past_the_mouth() {
    let curvature = 8.0;
    let mut rod = rod(LENGTH_M, LINKS, STIFFNESS);
    rod.instrument.precurve.push(curved(0.5, curvature, 0.0)).unwrap();
    let (_, outputs) = hang(rod.clone(), 0.0);
    assert_near("not straightened", outputs.drive_force_n, -320e-6, 1e-3);
    // ℓ shorter than, equal to and longer than the arc past the mouth.
    for straightened_m in [0.03, 0.06, LENGTH_M, 0.2] {
        let key = "effects.entry.guide.straightened_m";
        let (tip, outputs) = hang(with(rod.clone(), &[(key, straightened_m)]), 0.0);
        let back = |s: f64| curvature * f64::min(s / straightened_m, 1.0);
        let [along_m, up_m] = planar(back);
        assert_there(&format!("{straightened_m} m"), tip, placed(along_m, [up_m, 0.0], 0.0));
        assert!(outputs.drive_force_n.abs() < 1e-8, "{outputs:?}");
    }
    // Counted from the mouth of a guide that reaches into the vessel, and not from the entry plane.
    let guided = with(
        rod,
        &[("effects.entry.guide.length_m", 0.02), ("effects.entry.guide.straightened_m", 0.04)],
    );
    let (tip, _) = hang(guided, 0.0);
    let past = |s: f64| f64::max(s - 0.02, 0.0);
    let [along_m, up_m] =
        planar(|s| if s < 0.02 { 0.0 } else { curvature * f64::min(past(s) / 0.04, 1.0) });
    assert_there("with a guide", tip, placed(along_m, [up_m, 0.0], 0.0));
}
