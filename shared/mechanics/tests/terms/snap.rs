//! A provoked snap is flagged in the tick in which it happens.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::rod::rod;
use crate::wall::norm;
use crate::{Chain, StoredWall, both, curved, floor, pair, with};

const LENGTH_M: f64 = 0.08;
const STIFFNESS: f64 = 5e-5;
/// Ticks of steady feeding at 13 mm/s before it.
const FED: i32 = 200;
const FEED_M: f64 = 13e-6;
const FLOOR_M: f64 = -1e-3;

/// A model as on the device.
fn device(mut description: Description<f64>) -> Description<f64> {
    description.instrument.sections[0].mass_kg_per_m = 1.5e-3;
    description.wall.friction_coefficient = 0.3;
    description.wall.damping_s = 8e-4;
    let solver = &mut description.solver;
    (solver.tick_s, solver.predictor_gain) = (1e-3, 0.15);
    solver.drag = Drag { at_rest_n_s_per_m2: 0.155, swift_n_s_per_m2: 8.0, swift_m_per_s: 0.16 };
    description
}

/// A catheter with its tip bent down.
fn bent_down() -> Description<f64> {
    let mut catheter = device(rod(LENGTH_M, 40, STIFFNESS));
    catheter.instrument.precurve.push(curved(0.02, -60.0, 0.0)).unwrap();
    catheter
}

/// A bent tip slides on a floor that vanishes from one tick to the next, so that its force is lost at once.
/// Conversely, a floor appears 1.5 mm above the lowest point of a freely hanging tip. The tick in which half
/// of the force goes or comes must be flagged. Ticks of steady feeding must be resolved, which shows that
/// the flag is not stuck. Sample points take turns, so one more tick before the change lets the others see
/// it first.
///
/// In the tick of the release the end of the tip moves by 0.2 to 0.3 mm, mostly by rotation of its last links
/// of 2 mm. This is tens of milliradians, while 5 are already unresolved.
fn let_go_and_caught(description: Description<f64>, guidewire_m: f64) {
    let model = Chain::new(description).unwrap();
    let (high, low) = (floor(FLOOR_M), floor(-18e-3));
    for more in [0, 1] {
        let mut pressed = Fed::new(&model, guidewire_m, &high);
        let pressed_n = pressed.steadily(FED + more, &high);
        assert!(pressed_n > 3e-3, "it presses by {pressed_n} N only");
        let lost = pressed.changed(&low, |force_n| force_n < 0.5 * pressed_n);
        assert!(lost.unresolved, "let go: {lost:?}");
        let mut free = Fed::new(&model, guidewire_m, &low);
        assert_eq!(free.steadily(FED + more, &low), 0.0);
        let caught =
            free.changed(&floor(free.lying_on_m() + 1.5e-3), |force_n| force_n > 0.5 * pressed_n);
        assert!(caught.unresolved, "caught: {caught:?}");
    }
}

/// A run with a constant feed.
struct Fed<'a> {
    model: &'a Chain,
    state: State<f64>,
    guidewire_m: f64,
    ticks: i32,
}

impl<'a> Fed<'a> {
    fn new(model: &'a Chain, guidewire_m: f64, wall: &StoredWall) -> Self {
        let mut run = Self { model, state: State::new(), guidewire_m, ticks: 0 };
        let start = run.next();
        while !settle(model, &wall.lumen(), &mut run.state, start) {}
        run
    }

    fn next(&mut self) -> Drives<f64> {
        self.ticks += 1;
        let fed_m = FEED_M * f64::from(self.ticks);
        both(LENGTH_M - 0.01 + fed_m, self.guidewire_m + fed_m)
    }

    /// Force after a number of ticks, of which only the first may be flagged \[N\].
    fn steadily(&mut self, ticks: i32, wall: &StoredWall) -> f64 {
        let mut force_n = 0.0;
        for tick in 0..ticks {
            let drives = self.next();
            let found = step(self.model, &wall.lumen(), &mut self.state, drives);
            assert!(tick < 50 || !found.unresolved, "tick {tick}: {found:?}");
            force_n = norm(found.force_on_vessel_n);
        }
        force_n
    }

    /// The tick in which the changed wall changes the force: the same one, or the next one if the points next
    /// to the tip are sampled then.
    fn changed(&mut self, wall: &StoredWall, has_changed: impl Fn(f64) -> bool) -> Outputs<f64> {
        for _ in 0..2 {
            let drives = self.next();
            let found = step(self.model, &wall.lumen(), &mut self.state, drives);
            let force_n = norm(found.force_on_vessel_n);
            if has_changed(force_n) {
                println!("then {force_n:.4} N");
                return found;
            }
        }
        panic!("the force does not change");
    }

    /// Height of a floor that the tip would touch \[m\].
    fn lying_on_m(&self) -> f64 {
        self.state.node_position_m(0).map_or(0.0, |[_, _, z]| z) - 0.8e-3
    }
}

#[test]
fn a_snap_is_flagged_in_its_tick() {
    let_go_and_caught(bent_down(), 0.0);
}

#[test]
fn a_snap_with_a_guidewire_is_flagged_in_its_tick() {
    let mut pair = device(pair(LENGTH_M, 40, [STIFFNESS, 2e-5]));
    pair.instrument.precurve.push(curved(0.02, -60.0, 0.0)).unwrap();
    pair.guidewire.as_mut().unwrap().outer_radius_m = 0.4e-3;
    // Its tip behind the catheter's, and before it.
    for guidewire_m in [LENGTH_M - 0.03, LENGTH_M - 0.005] {
        let_go_and_caught(pair.clone(), guidewire_m);
    }
}

#[test]
fn a_snap_of_a_tip_that_a_tendon_bends_is_flagged_in_its_tick() {
    let tendon = [
        ("tendon.pull_m", 1.8e-3),
        ("tendon.stiffness_n_per_m", 5e3),
        ("tendon.offset_m", 0.6e-3),
        ("tendon.length_m", 0.02),
        ("tendon.angle_rad", PI),
        ("effects.tendon.friction.coefficient", 0.2),
    ];
    let_go_and_caught(with(device(rod(LENGTH_M, 40, STIFFNESS)), &tendon), 0.0);
}

#[test]
fn a_snap_with_effects_is_flagged_in_its_tick() {
    let effects = [
        ("effects.wall.viscoelastic.ratio", 0.5),
        ("effects.wall.hyperelastic.strain_per_m", 200.0),
        ("effects.wall.registration.z_m", 1e-4),
        ("effects.wall.motion.y_m", 1e-4),
        ("effects.contact.stribeck.static_ratio", 1.4),
        ("effects.contact.load_friction.high_load_ratio", 0.7),
        ("effects.instrument.softening.share", 0.2),
        ("effects.instrument.torsional_windup.free_length_m", 0.3),
        ("effects.fluid.drag.along_n_per_m", 0.01),
    ];
    let_go_and_caught(with(bent_down(), &effects), 0.0);
}
