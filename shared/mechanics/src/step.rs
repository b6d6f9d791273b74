//! One step of the model: feed, predict, solve, collect the outputs.

use crate::catheter_solve::solve_catheter;
use crate::drive_motion::{DriveHistory, MotionRatio};
use crate::effects::state::past_mouth;
use crate::math::maximum;
use crate::outputs::{Peaks, collect_outputs, is_finite, lost_outputs};
use crate::scheme::Scheme;
use crate::settle::approach_rest;
use crate::solve::Totals;
use crate::{Drive, Drives, Loads, Lumen, MAX_TENDONS, Model, Outputs, Real, State};

/// Ticks that are flagged from an unresolved one on, because the motion that an impact sets off is as
/// uncertain as the impact.
const FLAGGED_TICKS: u8 = 8;
/// Rotation of a link in one solve up to which all momentum is carried over \[rad\]. Above it, the
/// linear and the actual displacement differ by 10 %, and carried-over velocity would add energy.
const MOMENTUM_TURN_RAD: f64 = 0.2;

/// [`step_loaded`](crate::step_loaded), for any number type and number of links.
pub(crate) fn advance<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: Drives<T>,
    loads: &Loads<T>,
) -> Outputs<T> {
    if state.lost {
        let links = state.count as u16;
        state.lost = !approach_rest(model, lumen, state, drives, loads);
        return Outputs { links, ..lost_outputs() };
    }
    let substeps = model.description().solver.substeps.max(1);
    let mut tick = Tick::begin(model, state, drives);
    let mut outputs = Outputs::default();
    for part in 1..=substeps {
        tick.feed(model, state, part);
        state.predict(tick.scheme.dt_s * state.momentum_share, tick.ratio.link_rates);
        let totals = solve_substep(model, lumen, state, loads, &mut tick.scheme);
        if part >= substeps {
            let peaks = Peaks::of(&state.links[..state.count.min(LINKS)], state.count);
            outputs = collect_outputs(model, state, &totals, &peaks);
        }
    }
    tick.finish(model, state, outputs)
}

/// A tick under way.
pub(crate) struct Tick<T: Real> {
    pub scheme: Scheme<T>,
    pub ratio: MotionRatio<T>,
    /// Where the drives were.
    start: Drives<T>,
    /// Where they are, before and after they were clamped to the reach of the links.
    asked: Drives<T>,
    drives: Drives<T>,
}

impl<T: Real> Tick<T> {
    #[inline(always)]
    pub fn begin<const LINKS: usize>(
        model: &Model<T, LINKS>,
        state: &mut State<T, LINKS>,
        drives: Drives<T>,
    ) -> Self {
        let solver = &model.description().solver;
        let parts = T::int(i32::from(solver.substeps.max(1)));
        let scheme = Scheme {
            dt_s: solver.tick_s / parts,
            inertia: T::one(),
            friction: model.wall.friction_coefficient,
            sliding: MotionRatio::STEADY.sliding,
            drag: solver.drag,
            predictor_gain: solver.predictor_gain,
            first: true,
            last: true,
        };
        let start = state.drives;
        let asked = Drives {
            catheter: state.effects.follow(model, drives.catheter),
            guidewire: past_mouth(model, drives.guidewire),
            tendons_m: drives.tendons_m,
        };
        let drives = Drives {
            catheter: model.within_reach(asked.catheter),
            guidewire: model.within_reach(asked.guidewire),
            tendons_m: asked.tendons_m,
        };
        if state.count == 0 {
            // The links whose rates follow from the drives' motion are gone.
            state.drive_history = DriveHistory::none();
        }
        let ratio = state.drive_history.observe(model, &state.drives, &drives);
        Self { scheme, ratio, start, asked, drives }
    }

    /// Feeds the chain in a part of the tick, counted from 1.
    #[inline(always)]
    pub fn feed<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        state: &mut State<T, LINKS>,
        part: u8,
    ) {
        let Self { scheme, ratio, start, drives, .. } = self;
        let solver = &model.description().solver;
        let share = T::int(i32::from(part)) / T::int(i32::from(solver.substeps.max(1)));
        let target = Drives {
            catheter: between(start.catheter, drives.catheter, share),
            guidewire: between(start.guidewire, drives.guidewire, share),
            tendons_m: if model.tendons.is_empty() {
                [T::zero(); MAX_TENDONS]
            } else {
                tendons_between(&start.tendons_m, &drives.tendons_m, share)
            },
        };
        let before = state.drives;
        if part > 1 {
            ratio.next_substep(solver.predictor_gain);
        }
        scheme.sliding = ratio.sliding;
        state.effects.place(model, scheme.dt_s);
        state.feed(model, target);
        state.effects.advance(model, &before, &state.drives, state.fed_m, scheme.dt_s);
        state.pull_tendons(model, target.tendons_m, true, scheme.dt_s);
    }

    /// `outputs`: of the last part.
    #[inline(always)]
    pub fn finish<const LINKS: usize>(
        &self,
        model: &Model<T, LINKS>,
        state: &mut State<T, LINKS>,
        mut outputs: Outputs<T>,
    ) -> Outputs<T> {
        // While nothing is past the mouth, no output depends on the rotations: they are checked apart.
        let turned = state.drives.catheter.rotation_rad + state.drives.guidewire.rotation_rad;
        if !(is_finite(&outputs) && turned.is_finite()) {
            state.reset();
            state.lost = true;
            return lost_outputs();
        }
        flag(model, state, &self.asked, &mut outputs);
        state.effects.report(model, &mut outputs);
        outputs
    }
}

/// Position of a drive at a share of a tick.
#[inline(always)]
fn between<T: Real>(start: Drive<T>, end: Drive<T>, share: T) -> Drive<T> {
    Drive {
        insertion_m: start.insertion_m + (end.insertion_m - start.insertion_m) * share,
        rotation_rad: start.rotation_rad + (end.rotation_rad - start.rotation_rad) * share,
    }
}

/// Displacements of the tendons at a share of a tick.
#[inline(always)]
fn tendons_between<T: Real>(
    start_m: &[T; MAX_TENDONS],
    end_m: &[T; MAX_TENDONS],
    share: T,
) -> [T; MAX_TENDONS] {
    core::array::from_fn(|i| start_m[i] + (end_m[i] - start_m[i]) * share)
}

/// The solves of one substep; returns the totals of the last one.
#[inline(always)]
fn solve_substep<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &mut Scheme<T>,
) -> Totals<T> {
    let solves = model.description().solver.solves;
    let mut farthest_squared = T::zero();
    let mut solve = 1;
    loop {
        (scheme.first, scheme.last) = (solve == 1, solve >= solves);
        let totals = solve_catheter(model, lumen, state, loads, scheme);
        farthest_squared = maximum(farthest_squared, totals.largest_turn_squared);
        if scheme.last {
            state.momentum_share = momentum_share(farthest_squared);
            return totals;
        }
        solve += 1;
    }
}

/// Flags the outputs as unresolved if this tick or a recent one is. `asked`: positions of the drives
/// before they were clamped to the reach of the links.
#[inline(always)]
fn flag<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    asked: &Drives<T>,
    outputs: &mut Outputs<T>,
) {
    // The part of an instrument beyond the reach of the links is not modelled.
    let is_wire_beyond = model.guidewire.is_some() && asked.guidewire.insertion_m > model.reach_m();
    outputs.unresolved |= is_wire_beyond || asked.catheter.insertion_m > model.reach_m();
    let ticks_left = state.flagged_ticks.saturating_sub(1);
    state.flagged_ticks = if outputs.unresolved { FLAGGED_TICKS } else { ticks_left };
    outputs.unresolved = state.flagged_ticks > 0;
}

/// Share of the velocities that the next step takes over.     docs/explanation/model.md (21)
pub(crate) fn momentum_share<T: Real>(farthest_squared: T) -> T {
    let most = T::lit(MOMENTUM_TURN_RAD);
    most / maximum(farthest_squared.root(), most)
}
