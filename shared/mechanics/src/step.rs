//! One step of the model: feed, predict, solve, collect the outputs.

use cathforce_scalar::{Catheters, Kernel, Number, PlainPack, Vector3};

use crate::chain::{Body, Chain, base_cells};
use crate::coaxial::Coaxial;
use crate::drive_motion::{DriveHistory, MotionRatio};
use crate::effects::active::{Law, Nominal};
use crate::effects::driven_tendons::DrivenTendons;
use crate::effects::state::past_mouth;
use crate::load_sharing::DriveLoad;
use crate::math::maximum;
use crate::scheme::Scheme;
use crate::solve::{STRAINS, Totals, solve};
use crate::state::LinkState;
use crate::wall_sampling::{OUTSIDE_M, Stored, sample_wall};
use crate::{Drag, Drive, Drives, Loads, Lumen, MAX_TENDONS, Model, Outputs, Real, State};

/// A step whose last solve turned a link by more than this is flagged as unresolved \[rad\].
///
/// The linear model misplaces the tip by about ½ length × turn². That is 1 µm on 90 mm, and a wall
/// of 600 N/m at a sample changes its force by less than 1 mN. Snaps turn links by tenths of a
/// radian.
const RESOLVED_TURN_RAD: f64 = 5e-3;
/// Ticks that are flagged from an unresolved one on, because the motion that an impact sets off is as
/// uncertain as the impact.
const FLAGGED_TICKS: u8 = 8;
/// Rotation of a link in one solve up to which all momentum is carried over \[rad\]. Above it, the
/// linear and the actual displacement differ by 10 %, and carried-over velocity would add energy.
const MOMENTUM_TURN_RAD: f64 = 0.2;
/// Time step of one quasi-static step of [`approach_rest`] \[s\].
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

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Moves the drives of the tendons in a step of `dt_s`.
    #[inline(always)]
    fn pull_tendons(
        &mut self,
        model: &Model<T, LINKS>,
        target_m: [T; MAX_TENDONS],
        friction: bool,
        dt_s: T,
    ) {
        if !model.tendons.is_empty() {
            self.drives.tendons_m = target_m;
            self.tendons.advance(&model.tendons, &target_m, friction, dt_s);
        }
    }
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
        let totals = solve_acting(model, lumen, state, loads, scheme);
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
    let totals = solve_acting(model, lumen, state, loads, &scheme);
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

/// One solve, with the effects and the guidewire if there are any.
fn solve_acting<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
) -> Totals<T> {
    let entry = state.count.saturating_sub(1);
    let guide_cell_m = state.guide_cell_m(model);
    match state.effects.active(
        model,
        state.insertion_m,
        &state.overlap,
        entry,
        guide_cell_m,
        scheme.dt_s,
    ) {
        None => solve_coaxial(model, lumen, state, loads, scheme, &mut Nominal),
        Some(mut active) => {
            active.tendons = DrivenTendons::new(
                &model.tendons,
                &model.grid,
                &state.overlap,
                &state.tendons,
                scheme.inertia > T::zero(),
            );
            let totals = solve_coaxial(model, lumen, state, loads, scheme, &mut active);
            let torque_n_m = totals.moment_on_guide.dot(&model.guide.tangent());
            state.effects.finish(&active, torque_n_m);
            if let Some(tendons) = &mut active.tendons {
                let State { links, guide, count, tendons: pulled, .. } = state;
                let links = &links[..(*count).min(LINKS)];
                let rotation =
                    |j: usize| links.get(j).map_or(&guide.rotation, |link| &link.rotation);
                tendons.finish(links.len(), rotation, pulled);
            }
            totals
        }
    }
}

fn solve_coaxial<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
    effects: &mut L,
) -> Totals<T> {
    let overlap = state.overlap;
    match Coaxial::new(model, &overlap, scheme, effects) {
        Some(mut both) => {
            T::run_vectorised(SolveKernel { model, lumen, state, loads, scheme, law: &mut both })
        }
        None => T::run_vectorised(SolveKernel { model, lumen, state, loads, scheme, law: effects }),
    }
}

/// One solve, and before the first one of a step the samples of the wall: the part of a step that is
/// computed for several links at a time, one in each lane.
struct SolveKernel<'a, 'l, T: Real, L, const LINKS: usize> {
    model: &'a Model<T, LINKS>,
    lumen: &'a Lumen<'l>,
    state: &'a mut State<T, LINKS>,
    loads: &'a Loads<T>,
    scheme: &'a Scheme<T>,
    law: &'a mut L,
}

impl<T: Real, L: Law<T>, const LINKS: usize> Kernel<T> for SolveKernel<'_, '_, T, L, LINKS> {
    type Output = Totals<T>;

    #[inline(always)]
    fn run<N: PlainPack<T>>(self) -> Totals<T> {
        let Self { model, lumen, state, loads, scheme, law } = self;
        state.nodes_sampled ^= scheme.first;
        let of_nodes = state.nodes_sampled;
        let cells = base_cells(model, state, scheme);
        let (mut chain, coaxial_tables) = Chain::of(state, cells);
        let body = Body::of(model, if L::COAXIAL { coaxial_tables } else { &model.tables });
        let lowest_m = scheme.first.then(|| {
            let lumen = Stored::<T>::new(lumen);
            sample_wall::<T, N, LINKS>(&mut chain, of_nodes, body.radius_m, &lumen, law)
        });
        let totals = solve::<T, N, L, LINKS>(&body, &mut chain, loads, scheme, law);
        if let Some(lowest_m) = lowest_m {
            state.outside = lowest_m < T::lit(OUTSIDE_M);
        }
        totals
    }
}

/// Share of the velocities that the next step takes over.     docs/explanation/model.md (21)
pub(crate) fn momentum_share<T: Real>(farthest_squared: T) -> T {
    let most = T::lit(MOMENTUM_TURN_RAD);
    most / maximum(farthest_squared.root(), most)
}

/// The largest of all links.
pub(crate) struct Peaks<S, I> {
    /// Square of the contact force \[N²\], and the node with it.
    pub force_squared: S,
    pub node: I,
    /// Square of the strain less the middle of its range \[1\].
    pub stretched_squared: S,
}

impl<S: Catheters> Peaks<S, S::Index> {
    #[inline(always)]
    pub fn of(links: &[LinkState<S>], counts: S::Count) -> Self {
        let (mut peak, mut node) = (S::lit(0.0), S::index(0));
        let (middle, _) = strain_range::<S>();
        let mut stretched_squared = S::lit(0.0);
        for (j, link) in links.iter().enumerate() {
            let present = S::present(counts, j);
            let squared = link.force.dot(&link.force);
            let counted = S::either(present, || squared, || peak);
            (peak, node) =
                S::either(peak.below(counted), || (counted, S::index(j)), || (peak, node));
            let strain = link.strain - middle;
            let stretched = S::either(present, || strain * strain, || stretched_squared);
            let is_larger = stretched.reaches(stretched_squared);
            stretched_squared = S::either(is_larger, || stretched, || stretched_squared);
        }
        Self { force_squared: peak, node, stretched_squared }
    }
}

/// docs/explanation/model.md (22)
#[inline(always)]
pub(crate) fn collect_outputs<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    totals: &Totals<T>,
    peaks: &Peaks<T, u16>,
) -> Outputs<T> {
    let direction = model.guide.tangent();
    let moment = &totals.moment_on_guide;
    let twist = moment.dot(&direction);
    let mouth = if state.count == 0 {
        T::zero()
    } else {
        configurational_force_n(model, state, moment, twist)
    };
    let Peaks { force_squared, node, stretched_squared } = *peaks;
    let (_, half_range) = strain_range::<T>();
    let overstretched = stretched_squared >= half_range * half_range;
    let limit = T::lit(RESOLVED_TURN_RAD * RESOLVED_TURN_RAD);
    let whole =
        DriveLoad { force_n: -totals.force_on_guide.dot(&direction) - mouth, torque_n_m: -twist };
    let none = DriveLoad { force_n: T::zero(), torque_n_m: T::zero() };
    let guidewire = state.guidewire_share(model, whole).unwrap_or(none);
    Outputs {
        force_on_vessel_n: (-totals.force_on_instrument).into(),
        moment_on_vessel_n_m: (-totals.moment_on_instrument).into(),
        drive_force_n: whole.force_n - guidewire.force_n,
        drive_torque_n_m: whole.torque_n_m - guidewire.torque_n_m,
        guidewire_force_n: guidewire.force_n,
        guidewire_torque_n_m: guidewire.torque_n_m,
        peak_contact_force_n: force_squared.root(),
        peak_node: node,
        links: state.count as u16,
        unresolved: totals.largest_turn_squared > limit || state.outside || overstretched,
        lost: false,
    }
}

/// Configurational force at the guide's mouth \[N\]: the bending energy per length that insertion
/// would release, by which a bent instrument is pulled in.     docs/explanation/model.md (23)
fn configurational_force_n<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    moment: &Vector3<T>,
    twist: T,
) -> T {
    let half = T::lit(0.5);
    let base = state.count.saturating_sub(1).min(LINKS - 1);
    let (joint, h) = (&state.tables(model).joints[base], model.grid.cell_m(base));
    let softness = state.effects.softness(model);
    let bend_squared = moment.dot(moment) - twist * twist;
    let per_stiffness = half / (h * softness);
    // A pre-curvature that only comes back past the mouth releases no energy at the mouth.
    let straightened = model.description().effects.entry.guide.straightened_m > T::zero();
    let straight = if straightened { T::zero() } else { T::one() / h };
    // Tendons bend the instrument like a pre-curvature.
    let bend_by_tendons = state.effects.tendon_bend_at_mouth() + state.tendons.at_mouth;
    let unloaded = joint.unloaded * straight + bend_by_tendons * (T::one() / h);
    let spent = moment.dot(&state.guide.rotation.rotate(&unloaded))
        + half * h * softness * joint.energy(&unloaded);
    per_stiffness * (bend_squared / joint.bending + twist * twist / joint.torsion) + spent
}

/// Outputs of a step whose results are not finite.
fn lost_outputs<T: Real>() -> Outputs<T> {
    Outputs { unresolved: true, lost: true, ..Outputs::default() }
}

/// Middle and half length of the range [`STRAINS`].
fn strain_range<T: Number>() -> (T, T) {
    let half = 0.5 * (STRAINS.end - STRAINS.start);
    (T::lit(STRAINS.start + half), T::lit(half))
}

/// Every link contributes to the total force, so a number that is not finite anywhere shows in it.
fn is_finite<T: Real>(outputs: &Outputs<T>) -> bool {
    let sum = |v: &[T; 3]| v[0] + v[1] + v[2];
    let wrench = sum(&outputs.force_on_vessel_n) + sum(&outputs.moment_on_vessel_n_m);
    let catheter = outputs.drive_force_n + outputs.drive_torque_n_m;
    let guidewire = outputs.guidewire_force_n + outputs.guidewire_torque_n_m;
    (wrench + catheter + guidewire).is_finite()
}
