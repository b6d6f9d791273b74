//! Quasi-static steps to the shape at rest.

use cathforce_scalar::Vector3;

use crate::catheter_solve::solve_catheter;
use crate::drive_motion::{DriveHistory, MotionRatio};
use crate::effects::state::past_mouth;
use crate::math::maximum;
use crate::scheme::Scheme;
use crate::{Drag, Drive, Drives, Loads, Lumen, Model, Real, State};

/// Time step of one quasi-static step \[s\].
const SETTLE_DT_S: f64 = 0.02;
/// Largest feed of one quasi-static step \[m\].
const SETTLE_FEED_M: f64 = 2e-4;
/// Drag that keeps quasi-static steps from overshooting \[N·s/m²\]: while they feed, and the smallest.
/// At the drives' position it falls with the square of the number of steps.
const SETTLE_DRAG: [f64; 2] = [1000.0, 100.0];
/// The shape is at rest if a quasi-static step turns no link by more than this \[rad\].
const SETTLED_TURN_RAD: f64 = 1e-4;
/// Fewest and most quasi-static steps at the drives' position. The most count where the shape never
/// comes to rest, as with an instrument balanced on an edge.
const SETTLE_STEPS: core::ops::Range<u16> = 100..500;

/// [`settle_loaded`](crate::settle_loaded), for any number type and number of links.
pub(crate) fn approach_rest<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: Drives<T>,
    loads: &Loads<T>,
) -> bool {
    state.drive_history = DriveHistory::none();
    state.effects.place(model, T::zero());
    let scheme = quasi_static(state.steps_at_rest);
    let (catheter, catheter_arrived) =
        approach(state.drives.catheter, past_mouth(model, drives.catheter));
    let (guidewire, guidewire_arrived) =
        approach(state.drives.guidewire, past_mouth(model, drives.guidewire));
    let arrived = catheter_arrived && (guidewire_arrived || model.guidewire.is_none());
    state.feed(model, Drives { catheter, guidewire, tendons_m: drives.tendons_m });
    state.pull_tendons(model, drives.tendons_m, false, scheme.dt_s);
    for link in &mut state.links {
        link.rate = Vector3::zeros();
    }
    state.predict(T::zero(), T::one());
    let totals = solve_catheter(model, lumen, state, loads, &scheme);
    let held = totals.force_on_instrument + totals.force_on_guide + totals.moment_on_guide;
    if !(held.x() + held.y() + held.z()).is_finite() {
        let lost = state.lost;
        state.reset();
        state.lost = lost;
        return false;
    }
    for link in &mut state.links {
        link.velocity = Vector3::zeros();
    }
    state.steps_at_rest = if arrived { state.steps_at_rest.saturating_add(1) } else { 0 };
    let still = T::lit(SETTLED_TURN_RAD * SETTLED_TURN_RAD);
    state.steps_at_rest >= SETTLE_STEPS.end
        || (state.steps_at_rest >= SETTLE_STEPS.start && totals.largest_turn_squared <= still)
}

/// The scheme of a quasi-static step, after a number of them at the drives' positions.
#[inline(always)]
fn quasi_static<T: Real>(steps_at_rest: u16) -> Scheme<T> {
    let [first, last] = SETTLE_DRAG;
    let steps_at_rest = T::int(i32::from(steps_at_rest) + 1);
    Scheme {
        dt_s: T::lit(SETTLE_DT_S),
        inertia: T::zero(),
        friction: T::zero(),
        sliding: MotionRatio::STEADY.sliding,
        drag: Drag::constant(maximum(
            T::lit(first) / (steps_at_rest * steps_at_rest),
            T::lit(last),
        )),
        predictor_gain: T::zero(),
        first: true,
        last: true,
    }
}

/// The next position of a drive on its way to `goal`, and whether `goal` is reached.
fn approach<T: Real>(now: Drive<T>, goal: Drive<T>) -> (Drive<T>, bool) {
    let most = T::lit(SETTLE_FEED_M);
    let missing = goal.insertion_m - now.insertion_m;
    let arrived = missing >= -most && missing <= most;
    let insertion_m = if arrived {
        goal.insertion_m
    } else if missing > T::zero() {
        now.insertion_m + most
    } else {
        now.insertion_m - most
    };
    (Drive { insertion_m, ..goal }, arrived)
}
