//! One linearised solve: eliminated from the tip to the guide, resolved on the way back.

use cathforce_scalar::{Pack, Vector3};

use crate::algebra::{Bend, Rotation, read_here};
use crate::coaxial::Slide;
use crate::contact::{Contact, Facing, Memory, Motion, Touch};
use crate::effects::acting::Law;
use crate::joint::{Cell, JointLoad};
use crate::lanes::Group;
use crate::model::maximum;
use crate::state::{Elimination, LinkLoads, LinkState, Span, State};
use crate::tables::Joint;
use crate::wrench::Wrench;
use crate::{Drag, Loads, Model, Real};

/// Strains that a link can have: half to twice its length. A drive that pulls at an instrument
/// stuck by friction would stretch it without end.
pub(crate) const STRAINS: core::ops::Range<f64> = -0.5..1.0;

/// Share of a wall's stiffness that stands against every motion of a point that touches it:
/// what rounding takes from A in one direction must not turn it negative across.
const ROUNDING: f64 = 1e-6;

/// How one solve treats time.
pub(crate) struct Scheme<T> {
    pub dt_s: T,
    /// 1 with inertia, 0 quasi-static.
    pub inertia: T,
    pub friction: T,
    /// What samples on the catheter and on the guidewire will slide of what they slid in the last
    /// step.
    pub sliding: [T; 2],
    pub drag: Drag<T>,
    pub predictor_gain: T,
    /// First solve of the step: the wall is looked up.
    pub first: bool,
    /// Last solve of the step: rates and contact memories are brought up to date.
    pub last: bool,
}

/// Totals of one solve; those on the instrument are found by the last one of a step alone.
pub(crate) struct Totals<T: Real> {
    pub force_on_instrument: Vector3<T>,
    /// About the entry point.
    pub moment_on_instrument: Vector3<T>,
    /// Force and moment of the instrument on the guide.
    pub force_on_guide: Vector3<T>,
    pub moment_on_guide: Vector3<T>,
    /// Largest |δφ|² \[rad²\].
    pub largest_turn_squared: T,
}

/// One solve, in place. Contact memories, rotations, positions and rates are brought up to
/// date; the totals are those of the linear model (forces that balance to the last digit).
#[inline(always)]
pub(crate) fn solve<T: Real, N: Pack<T>, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
    law: &mut L,
) -> Totals<T> {
    let chain = Chain::new(model, state, scheme);
    load::<T, N, L, LINKS>(model, state, scheme, &chain, law);
    flex::<T, N, L, LINKS>(model, state, &chain, law);
    let wrench = eliminate::<T, L, LINKS>(model, state, &chain, Wrench::beyond_tip(loads));
    if scheme.last {
        resolve::<T, N, L, LINKS, true>(state, scheme, &chain, &wrench)
    } else {
        resolve::<T, N, L, LINKS, false>(state, scheme, &chain, &wrench)
    }
}

/// Links inside the vessel, and what their joints stand for.
struct Chain<T> {
    count: usize,
    /// τ/dt, the viscous time of bending over the time of a step.
    damping: T,
    /// The cells of the joints at the base link, from the guide on: all others are full.
    at_base: [Cell<T>; 2],
}

impl<T: Real> Chain<T> {
    fn new<const LINKS: usize>(
        model: &Model<T, LINKS>,
        state: &State<T, LINKS>,
        scheme: &Scheme<T>,
    ) -> Self {
        let grid = &model.grid;
        let half = T::lit(0.5);
        let damping = model.bending_damping_s * scheme.inertia / scheme.dt_s;
        let count = state.count.min(LINKS);
        let [base, before] = [1, 2].map(|behind| count.saturating_sub(behind));
        let guide_cell_m = state.guide_cell_m(model);
        let base_cell_m = (grid.link_m(before) + state.base_length_m) * half;
        // Half of what is withdrawn goes out of either cell, as bent as it is.
        let withdrawn_m = maximum(-state.fed_m, T::zero()) * half;
        // As short as it may be, and with a shaft that winds up behind it, the guide's twist must
        // not be softer than its bending by more than single precision tells apart.
        let at_guide = Cell::new(guide_cell_m, grid.cell_m(base), withdrawn_m, [damping; 2]);
        let of_bending = [damping, T::zero()];
        let at_base = Cell::new(base_cell_m, grid.cell_m(before), withdrawn_m, of_bending);
        Self { count, damping, at_base: [at_guide, at_base] }
    }
}

/// Shares of the arc at one link, and what goes with them.
#[derive(Clone, Copy)]
struct Shares<T> {
    /// Of a link's half \[m\].
    arc: T,
    /// Of its node.
    node_arc: T,
    node_mass: T,
    /// Of the contact at the node \[N/m\].
    node_stiffness: T,
}

/// The wall that the samples at the nodes or the middles of links face.
#[inline(always)]
fn facing<T: Real, N: Pack<T>>(
    group: &Group<N>,
    eliminations: &[Elimination<T>],
    which: usize,
) -> Facing<N> {
    Facing::side_by_side(|lane| &eliminations[group.at(lane)].seen[which])
}

/// What they remember.
#[inline(always)]
fn remembered<T: Real, N: Pack<T>>(
    group: &Group<N>,
    links: &[LinkState<T>],
    which: usize,
) -> Memory<N> {
    Memory::side_by_side(|lane| &links[group.at(lane)].memory[which])
}

/// How they slide.
#[inline(always)]
fn slide<T: Real, N: Pack<T>, L: Law<T>>(group: &Group<N>, law: &L, which: usize) -> Slide<N> {
    let slides = N::lanes(|lane| law.slide(2 * group.at(lane) + which));
    Slide {
        along_m: N::each(|lane| slides[lane].along_m),
        turn_rad: N::each(|lane| slides[lane].turn_rad),
        of_last: N::each(|lane| slides[lane].of_last),
    }
}

/// What acts on every link at the predicted state.
///
/// No link waits for another: they are computed for side by side, as many as there are lanes. A
/// function of its own as [`eliminate`] is.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn load<T: Real, N: Pack<T>, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    chain: &Chain<T>,
    law: &mut L,
) {
    let State { links, eliminations, guide, fed_m, carried, overlaid, .. } = state;
    let tables = if L::COAXIAL { &*overlaid } else { &model.tables };
    let count = chain.count;
    let (links, eliminations) = (&links[..count], &mut eliminations[..count]);
    let wall = &model.wall;
    let half = T::lit(0.5);
    let inverse_dt = T::one() / scheme.dt_s;
    let inertia_per_mass = N::all(scheme.inertia * inverse_dt * inverse_dt);
    let carried_dt_s = N::all(scheme.dt_s * *carried);
    let Drag { at_rest_n_s_per_m2, swift_n_s_per_m2, swift_m_per_s } = scheme.drag;
    let drag_at_rest = N::all(at_rest_n_s_per_m2 * inverse_dt);
    let drag_rise = (swift_n_s_per_m2 - at_rest_n_s_per_m2) * inverse_dt;
    let drag_per_square = N::all(drag_rise / (swift_m_per_s * swift_m_per_s));
    let drag_rise = N::all(drag_rise);
    let feed_m_per_s = N::all(*fed_m * inverse_dt);
    let radius = model.description().instrument.outer_radius_m;
    let contact = Contact::<N>::new(wall, scheme, inverse_dt);
    // Inertia and drag are against the rig's air, not a vessel that moves in it.     docs/model.md (15)
    let moving = law.vessel_motion().map(|[by_m, m_per_s]| {
        let gained_m = by_m - m_per_s * (scheme.dt_s * *carried);
        let m_per_s2 = gained_m * (scheme.inertia * inverse_dt * inverse_dt);
        [by_m, m_per_s, m_per_s2].map(|v| N::vectors(|_| v))
    });
    let line = wall.line_stiffness_n_per_m2;

    // Beyond the tip there is nothing but the end of its contact.
    let mut distal_arc = T::zero();
    let mut distal_mass = T::zero();
    let mut end_stiffness = wall.end_stiffness_n_per_m;

    for group in Group::<N>::all(count) {
        let at = |lane: usize| group.at(lane);
        let link = |lane: usize| &links[at(lane)];
        let proximal = |lane: usize| links.get(at(lane) + 1).unwrap_or(guide);

        let shares = group.in_turn(|j, _| {
            let Span { length, share, .. } = links[j].span;
            let (arc, mass) = (length * half, tables.links[j].mass * share * half);
            let (node_arc, node_mass) = (arc + distal_arc, mass + distal_mass);
            (distal_arc, distal_mass) = (arc, mass);
            let node_stiffness = line * node_arc * half + end_stiffness;
            end_stiffness = T::zero();
            Shares { arc, node_arc, node_mass, node_stiffness }
        });
        let each = |of: fn(&Shares<T>) -> T| N::each(|lane| of(&shares[lane]));

        let tangent = || N::vectors(|lane| link(lane).tangent);
        let turn = N::vectors(|lane| link(lane).turn);
        let node_displacement = || N::vectors(|lane| link(lane).displacement);
        let node_radius = N::each(|lane| law.radius(2 * at(lane), radius));
        let middle_radius = N::each(|lane| law.radius(2 * at(lane) + 1, radius));
        let at_node = Motion {
            displacement: node_displacement(),
            turn,
            radius: node_radius,
            tangent: tangent(),
            slide: slide(&group, law, 0),
        };
        let displacement =
            (node_displacement() + N::vectors(|lane| proximal(lane).displacement)) * N::lit(0.5);
        let at_middle = Motion {
            displacement,
            turn,
            radius: middle_radius,
            tangent: tangent(),
            slide: slide(&group, law, 1),
        };
        let node_stiffness = each(|shares| shares.node_stiffness);
        let node = contact.touch(
            &*law,
            &facing(&group, eliminations, 0),
            node_stiffness,
            each(|shares| shares.node_arc) * N::lit(0.5),
            &at_node,
            &remembered(&group, links, 0),
        );
        read_here();
        let middle_arc = each(|shares| shares.arc);
        let middle = contact.touch(
            &*law,
            &facing(&group, eliminations, 1),
            N::all(line) * middle_arc,
            middle_arc,
            &at_middle,
            &remembered(&group, links, 1),
        );

        // The node: weight, inertia, drag against all motion but the feed's.     docs/model.md (15)
        let node_mass = each(|shares| shares.node_mass);
        let node_arc = each(|shares| shares.node_arc);
        let velocity = || N::vectors(|lane| link(lane).velocity);
        let mut beside = velocity() - tangent() * feed_m_per_s;
        if let Some([_, m_per_s, _]) = &moving {
            beside -= *m_per_s;
        }
        let drag = drag_at_rest + (beside.dot(&beside) * drag_per_square).smaller(drag_rise);
        let (inertia, damping) = (inertia_per_mass * node_mass, drag * node_arc);
        let mut force = N::vectors(|_| model.gravity) * node_mass
            - node_displacement() * (inertia + damping)
            + velocity() * (inertia * carried_dt_s)
            + tangent() * (damping * N::all(*fed_m));
        if let Some([by_m, _, m_per_s2]) = moving {
            force += by_m * damping + m_per_s2 * node_mass;
        }
        let to_wall = || facing(&group, eliminations, 0).gap + node_radius;
        if let Some(per_length) = law.stream(&tangent(), to_wall) {
            force += per_length * node_arc;
        }
        read_here();
        let kept_positive = (node.push + middle.push) * N::lit(ROUNDING);
        let at_node = node.force(&facing(&group, eliminations, 0).normal);
        let at_middle = middle.force(&facing(&group, eliminations, 1).normal);
        let force = N::apart(force + at_node + at_middle);
        let arm = |i: usize| N::vectors(|lane| eliminations[at(lane)].seen[i].arm);
        let moment = N::apart(arm(0).cross(&at_node).plus_cross(&arm(1), &at_middle));
        let stiffness = inertia + damping + kept_positive + node.stick + middle.stick;
        let (node, middle) = (node.apart(), middle.apart());
        for lane in 0..N::LANES {
            let kept = &mut eliminations[at(lane)];
            kept.loads = LinkLoads {
                force: force[lane],
                moment: moment[lane],
                stiffness: stiffness.lane(lane),
            };
            kept.touches = [node[lane], middle[lane]];
        }
    }
}

/// What every link's joint exerts at the predicted state.
///
/// Side by side and a function of its own as [`load`] is; the two at the base link, whose cells are
/// not full, come last and one by one.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn flex<T: Real, N: Pack<T>, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    chain: &Chain<T>,
    law: &mut L,
) {
    let State { links, eliminations, guide, overlaid, .. } = state;
    let tables = if L::COAXIAL { &*overlaid } else { &model.tables };
    let links = &links[..chain.count];
    let is_viscous = model.bending_damping_s > T::zero();
    let full = chain.count.saturating_sub(chain.at_base.len());
    for group in Group::<N>::all(full) {
        let distal = |lane: usize| &links[group.at(lane)];
        let proximal = |lane: usize| &links[group.at(lane) + 1];
        let bend = Bend::between(
            &Rotation::side_by_side(|lane| &proximal(lane).rotation),
            &Rotation::side_by_side(|lane| &distal(lane).rotation),
        );
        let angles = N::apart(bend.angle);
        let joints = group.in_turn(|j, lane| law.joint(j, &tables.joints[j], &angles[lane]));
        let joint = Joint::side_by_side(|lane| &joints[lane]);
        let turned = is_viscous
            .then(|| N::vectors(|lane| distal(lane).turn) - N::vectors(|lane| proximal(lane).turn));
        let viscous = turned.as_ref().map(|turned| (N::all(chain.damping), turned));
        let joint = JointLoad::<N>::new(&joint, &bend, viscous);
        let (moment, stiffness) = (N::apart(joint.moment), joint.stiffness.apart::<T>());
        for lane in 0..N::LANES {
            eliminations[group.at(lane)].joint = JointLoad {
                moment: moment[lane],
                stiffness: stiffness[lane],
                smallest: joint.smallest.lane(lane),
            };
        }
    }
    for j in full..chain.count {
        let cell = &chain.at_base[chain.count - 1 - j];
        let (proximal, distal) = (links.get(j + 1).unwrap_or(guide), &links[j]);
        let bend = Bend::between(&proximal.rotation, &distal.rotation);
        let joint = law.joint(j, &tables.joints[j], &bend.angle);
        let turned = distal.turn - proximal.turn;
        eliminations[j].joint = JointLoad::at_base(&joint, cell, &bend, &turned);
    }
}

/// Tip to guide.
///
/// A function of its own on the device, where it has the registers to itself; on a host it must be
/// compiled for the processor that the whole solve is compiled for.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn eliminate<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    chain: &Chain<T>,
    beyond_tip: Wrench<T>,
) -> Wrench<T> {
    let State { links, eliminations, overlaid, .. } = state;
    let tables = if L::COAXIAL { &*overlaid } else { &model.tables };
    let mut wrench = beyond_tip;
    for (j, (link, kept)) in links[..chain.count].iter().zip(eliminations).enumerate() {
        let Span { length, inverse_length, .. } = link.span;
        wrench.add_loads(&kept.loads, &kept.seen, &kept.touches);
        let stiffness = tables.links[j].axial * inverse_length;
        wrench.add_stretch(&link.tangent, stiffness, stiffness * length * link.strain, kept);
        wrench.shift(&link.tangent, length * (T::one() + link.strain));
        wrench.pass_joint(kept);
    }
    wrench
}

/// How a link has moved in a solve.
#[derive(Clone, Copy)]
struct Move<T: Real> {
    /// Of its node \[m\].
    dx: Vector3<T>,
    /// \[rad\]
    turn: Vector3<T>,
    /// \[m\]
    stretch: T,
}

/// Brings what the contacts at the nodes or the middles of links remember up to date; gives their
/// forces on the instrument.
#[inline(always)]
fn resolve_contact<T: Real, N: Pack<T>, L: Law<T>, const LAST: bool>(
    group: &Group<N>,
    links: &mut [LinkState<T>],
    eliminations: &mut [Elimination<T>],
    which: usize,
    dx: &Vector3<N>,
    turn: &Vector3<N>,
) -> N::Lanes<Vector3<T>> {
    let kept = |lane: usize| &eliminations[group.at(lane)];
    let touch = Touch::<N>::side_by_side(|lane| &kept(lane).touches[which]);
    let normal = N::vectors(|lane| kept(lane).seen[which].normal);
    let arm = N::vectors(|lane| kept(lane).seen[which].arm);
    let resolved = touch.resolve::<LAST>(&normal, &arm, dx, turn);
    let slip = N::apart(resolved.slip);
    for lane in group.guide_to_tip() {
        let (link, kept) = (&mut links[group.at(lane)], &mut eliminations[group.at(lane)]);
        let memory = &mut link.memory[which];
        memory.normal_n = resolved.normal_n.lane(lane);
        if LAST {
            memory.reached = resolved.reached.lane(lane);
            memory.slip = slip[lane];
            if L::RELAXES {
                memory.relaxed = kept.touches[which].relaxed;
            }
        } else {
            kept.seen[which].gap += resolved.along.lane(lane);
        }
    }
    N::apart(resolved.force)
}

/// Guide to tip.     docs/model.md (17)
///
/// What only the `LAST` solve of a step has to find is found in it alone: totals, the forces
/// at the nodes, rates, and what the contacts remember. A function of its own as [`eliminate`] is.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn resolve<T: Real, N: Pack<T>, L: Law<T>, const LINKS: usize, const LAST: bool>(
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    chain: &Chain<T>,
    at_guide: &Wrench<T>,
) -> Totals<T> {
    let State { links, eliminations, effects, .. } = state;
    let (links, eliminations) = (&mut links[..chain.count], &mut eliminations[..chain.count]);
    let mouth = &effects.mouth;
    let half = T::lit(0.5);
    let inverse_dt = T::one() / scheme.dt_s;
    let v = Vector3::zeros();
    let mut totals = Totals {
        force_on_instrument: v,
        moment_on_instrument: v,
        force_on_guide: at_guide.force,
        moment_on_guide: at_guide.moment,
        largest_turn_squared: T::zero(),
    };
    let mut largest_turn_squared = N::lit(0.0);
    let kept_rate = T::one() - scheme.predictor_gain;
    let new_rate = scheme.predictor_gain * inverse_dt;
    let mut before = Move { dx: v, turn: v, stretch: T::zero() };
    let mut position = *mouth;
    for group in Group::<N>::all(chain.count).rev() {
        // Each link waits for the one before it,
        let mut moves = N::lanes(|_| before);
        for lane in group.guide_to_tip() {
            let (link, kept) = (&links[group.at(lane)], &eliminations[group.at(lane)]);
            let in_factor = kept.turn - kept.by_displacement.mul_transposed(&before.dx)
                + kept.by_turn.mul_transposed(&before.turn);
            let turn = kept.factor.backward(&in_factor);
            let lever = link.tangent * (link.span.length * (T::one() + link.strain));
            let swung = before.dx.plus_cross(&turn, &lever);
            let stretch = kept.stretch.resolve(&swung, &turn);
            before = Move { dx: swung + link.tangent * stretch, turn, stretch };
            moves[lane] = before;
        }

        // but nothing of what follows from its motion does.
        let dx = N::vectors(|lane| moves[lane].dx);
        let turn = N::vectors(|lane| moves[lane].turn);
        largest_turn_squared = turn.dot(&turn).larger(largest_turn_squared);
        let at_node = resolve_contact::<T, N, L, LAST>(&group, links, eliminations, 0, &dx, &turn);
        let at_middle =
            resolve_contact::<T, N, L, LAST>(&group, links, eliminations, 1, &dx, &turn);
        let link = |lane: usize| &links[group.at(lane)];
        let rotation =
            Rotation::<N>::side_by_side(|lane| &link(lane).rotation).turned(&(turn * N::lit(0.5)));
        let tangent = rotation.tangent();
        let strain = N::each(|lane| link(lane).strain)
            + N::each(|lane| moves[lane].stretch) * N::each(|lane| link(lane).span.inverse_length);
        let strain = strain.larger(N::lit(STRAINS.start)).smaller(N::lit(STRAINS.end));
        let length = N::each(|lane| link(lane).span.length) * (N::lit(1.0) + strain);
        let (lever, tangent) = (N::apart(tangent * length), N::apart(tangent));
        let rotation = rotation.apart::<T>();
        for lane in group.guide_to_tip() {
            let j = group.at(lane);
            let (link, kept) = (&mut links[j], &eliminations[j]);
            let predicted = link.position;
            link.rotation = rotation[lane];
            link.tangent = tangent[lane];
            link.strain = strain.lane(lane);
            position += lever[lane];
            link.displacement += position - predicted;
            link.position = position;
            link.turn += moves[lane].turn;
            if !LAST {
                continue;
            }

            link.velocity = link.displacement * inverse_dt;
            link.rate = link.rate * kept_rate + link.turn * new_rate;
            let (at_node, at_middle) = (at_node[lane], at_middle[lane]);
            let [node_seen, middle_seen] = &kept.seen;
            let force = at_node + at_middle;
            totals.force_on_instrument += force;
            let moment = &mut totals.moment_on_instrument;
            *moment = moment.plus_cross(&(predicted - *mouth), &force);
            *moment = moment.plus_cross(&node_seen.arm, &at_node);
            *moment = moment.plus_cross(&middle_seen.arm, &at_middle);
            // The middle's force is shared by the two nodes of the link; the guide has none.
            let shared = if j + 1 == chain.count { v } else { at_middle * half };
            link.force = force - shared;
            if let Some(proximal) = links.get_mut(j + 1) {
                proximal.force += shared;
            }
        }
    }
    totals.largest_turn_squared = (0..N::LANES)
        .fold(T::zero(), |largest, lane| largest_turn_squared.lane(lane).larger(largest));
    totals
}
