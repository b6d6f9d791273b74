//! One linearised solve by the articulated-body recursion: forward elimination from the tip to the
//! guide, then back substitution from the guide to the tip.

use cathforce_scalar::{Blend, Catheters, Number, Pack, Vector3};

use crate::Loads;
use crate::algebra::Rotation;
use crate::assembly::{assemble_loads, joint_moments};
use crate::chain::{Body, Chain};
use crate::contact::LinearContact;
use crate::effects::active::Law;
use crate::link_group::LinkGroup;
use crate::scheme::Scheme;
use crate::state::{Elimination, LinkState, Span};
use crate::wrench::Wrench;

/// Axial strains that a link can have, from half to twice its length. Without this limit, a drive that
/// pulls at an instrument stuck by friction would stretch it without bound.
pub(crate) const STRAINS: core::ops::Range<f64> = -0.5..1.0;

/// Totals of one solve. Only the last solve of a step computes those on the instrument.
pub(crate) struct Totals<T: Number> {
    pub force_on_instrument: Vector3<T>,
    /// About the mouth of the guide \[N·m\].
    pub moment_on_instrument: Vector3<T>,
    /// Force of the instrument on the guide \[N\], and its moment \[N·m\].
    pub force_on_guide: Vector3<T>,
    pub moment_on_guide: Vector3<T>,
    /// Largest |δφ|² of a link \[rad²\].
    pub largest_turn_squared: T,
}

/// One solve, in place: updates rotations, positions, rates and contact states. The totals are those
/// of the linear model, whose forces balance to the last digit.
#[inline(always)]
pub(crate) fn solve<S: Catheters, N: Pack<S>, L: Law<S>, const LINKS: usize>(
    body: &Body<'_, S, LINKS>,
    chain: &mut Chain<'_, S, LINKS>,
    loads: &Loads<S>,
    scheme: &Scheme<S>,
    law: &mut L,
) -> Totals<S> {
    // The number of links is an argument: of one that is read from memory the compiler does not know the
    // largest value, and the device's code would have panics (P13).
    let count = chain.longest.min(LINKS);
    assemble_loads::<S, N, L, LINKS>(body, chain, count, scheme, law);
    joint_moments::<S, N, L, LINKS>(body, chain, law);
    let wrench = forward_elimination::<S, LINKS>(body, chain, Wrench::beyond_tip(loads));
    if scheme.last {
        back_substitution::<S, N, L, LINKS, true>(chain, scheme, &wrench)
    } else {
        back_substitution::<S, N, L, LINKS, false>(chain, scheme, &wrench)
    }
}

/// From tip to guide: eliminates the stretch and the rotation of each link by Schur complements.
///
/// On the device it is a separate function, so that it has all registers to itself. On a host it is
/// inlined, so that it is compiled for the same instruction set as the rest of the solve.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn forward_elimination<S: Catheters, const LINKS: usize>(
    body: &Body<'_, S, LINKS>,
    chain: &mut Chain<'_, S, LINKS>,
    beyond_tip: Wrench<S>,
) -> Wrench<S> {
    let Chain { links, eliminations, .. } = chain;
    let (tables, count) = (body.tables, chain.longest.min(LINKS));
    let mut wrench = beyond_tip;
    for (j, (link, elimination)) in links[..count].iter().zip(&mut **eliminations).enumerate() {
        // The wrench of a shorter chain stays that at its guide.
        let at_guide = (S::ABREAST && j >= chain.shortest).then(|| wrench.clone());
        let Span { length, inverse_length, .. } = link.span;
        wrench.add_loads(&elimination.loads, &elimination.proximity, &elimination.contacts);
        let stiffness = tables.links[j].axial * inverse_length;
        wrench.eliminate_stretch(
            &link.tangent,
            stiffness,
            stiffness * length * link.strain,
            elimination,
        );
        wrench.shift(&link.tangent, length * (S::lit(1.0) + link.strain));
        wrench.eliminate_joint(elimination);
        if let Some(at_guide) = at_guide {
            wrench = Blend::blend(S::present(chain.count, j), wrench, at_guide);
        }
    }
    wrench
}

/// Correction of a link's motion by one solve.
#[derive(Clone, Copy)]
struct LinkMotion<T: Number> {
    /// Displacement of its node \[m\].
    dx: Vector3<T>,
    /// Rotation \[rad\].
    turn: Vector3<T>,
    /// Elongation \[m\].
    stretch: T,
}

impl<S: Number> Blend<S> for LinkMotion<S> {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            dx: Blend::blend(mask, yes.dx, no.dx),
            turn: Blend::blend(mask, yes.turn, no.turn),
            stretch: S::choose(mask, yes.stretch, no.stretch),
        }
    }
}

/// Updates the contact states at the nodes or the middles of links; returns the forces on the
/// instrument \[N\].
#[inline(always)]
fn update_contacts<S: Catheters, N: Pack<S>, L: Law<S>, const LAST: bool>(
    group: &LinkGroup<N>,
    links: &mut [LinkState<S>],
    eliminations: &mut [Elimination<S>],
    which: usize,
    dx: &Vector3<N>,
    turn: &Vector3<N>,
) -> N::Lanes<Vector3<S>> {
    let elimination = |lane: usize| &eliminations[group.at(lane)];
    let contact = LinearContact::<N>::gather(|lane| &elimination(lane).contacts[which]);
    let normal = N::gather_vectors(|lane| elimination(lane).proximity[which].normal);
    let arm = N::gather_vectors(|lane| elimination(lane).proximity[which].arm);
    let update = contact.return_mapping::<LAST>(&normal, &arm, dx, turn);
    let slip = N::split_vectors(update.slip);
    for lane in group.guide_to_tip() {
        let (link, elimination) = (&mut links[group.at(lane)], &mut eliminations[group.at(lane)]);
        let memory = &mut link.memory[which];
        memory.normal_n = update.normal_n.lane(lane);
        if LAST {
            memory.trial_slip_m = update.trial_slip_m.lane(lane);
            memory.slip = slip[lane];
            if L::RELAXES {
                memory.relaxed = elimination.contacts[which].relaxed;
            }
        } else {
            let gap = &mut elimination.proximity[which].gap;
            *gap = *gap + update.along.lane(lane);
        }
    }
    N::split_vectors(update.force)
}

/// From guide to tip: each link's motion follows from its proximal neighbour's.
/// docs/explanation/model.md (20)
///
/// Only the `LAST` solve of a step computes totals, nodal forces, rates and contact states. It is a
/// separate function for the reason given at [`forward_elimination`].
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn back_substitution<S: Catheters, N: Pack<S>, L: Law<S>, const LINKS: usize, const LAST: bool>(
    chain: &mut Chain<'_, S, LINKS>,
    scheme: &Scheme<S>,
    at_guide: &Wrench<S>,
) -> Totals<S> {
    let Chain { links, eliminations, mouth, count: counts, longest, .. } = chain;
    let (count, counts) = ((*longest).min(LINKS), *counts);
    let (links, eliminations) = (&mut links[..count], &mut eliminations[..count]);
    let half = S::lit(0.5);
    let inverse_dt = S::lit(1.0) / scheme.dt_s;
    let v = Vector3::zeros();
    let mut totals = Totals {
        force_on_instrument: v,
        moment_on_instrument: v,
        force_on_guide: at_guide.force,
        moment_on_guide: at_guide.moment,
        largest_turn_squared: S::lit(0.0),
    };
    let mut largest_turn_squared = N::lit(0.0);
    let kept_rate = S::lit(1.0) - scheme.predictor_gain;
    let new_rate = scheme.predictor_gain * inverse_dt;
    let mut before = LinkMotion { dx: v, turn: v, stretch: S::lit(0.0) };
    let mut position = **mouth;
    'groups: for group in LinkGroup::<N>::all(count).rev() {
        // The recursion itself is sequential: each link needs its proximal neighbour's motion.
        let mut motions = N::per_lane(|_| before);
        for lane in group.guide_to_tip() {
            // Every lane is in range. Said this way, the device's code has no panic here (P13).
            let (Some(link), Some(elimination)) =
                (links.get(group.at(lane)), eliminations.get(group.at(lane)))
            else {
                continue 'groups;
            };
            let in_factor = elimination.turn
                - elimination.by_displacement.mul_transposed(&before.dx)
                + elimination.by_rotation.mul_transposed(&before.turn);
            let turn = elimination.factor.backward(&in_factor);
            let lever = link.tangent * (link.span.length * (S::lit(1.0) + link.strain));
            let swung = before.dx.plus_cross(&turn, &lever);
            let stretch = elimination.stretch.back_substitute(&swung, &turn);
            let moved = LinkMotion { dx: swung + link.tangent * stretch, turn, stretch };
            // A chain that is not as long has not begun here.
            before = S::either(S::present(counts, group.at(lane)), || moved, || before);
            motions[lane] = before;
        }

        // The rest follows from each link's own motion, one link in each lane.
        let dx = N::gather_vectors(|lane| motions[lane].dx);
        let turn = N::gather_vectors(|lane| motions[lane].turn);
        largest_turn_squared = turn.dot(&turn).larger(largest_turn_squared);
        let at_node = update_contacts::<S, N, L, LAST>(&group, links, eliminations, 0, &dx, &turn);
        let at_middle =
            update_contacts::<S, N, L, LAST>(&group, links, eliminations, 1, &dx, &turn);
        let link = |lane: usize| &links[group.at(lane)];
        let rotation =
            Rotation::<N>::gather(|lane| &link(lane).rotation).turned(&(turn * N::lit(0.5)));
        let tangent = rotation.tangent();
        let strain = N::from_lanes(|lane| link(lane).strain)
            + N::from_lanes(|lane| motions[lane].stretch)
                * N::from_lanes(|lane| link(lane).span.inverse_length);
        let strain = strain.larger(N::lit(STRAINS.start)).smaller(N::lit(STRAINS.end));
        let length = N::from_lanes(|lane| link(lane).span.length) * (N::lit(1.0) + strain);
        let (lever, tangent) = (N::split_vectors(tangent * length), N::split_vectors(tangent));
        let rotation = rotation.split::<S>();
        for lane in group.guide_to_tip() {
            let j = group.at(lane);
            let (link, elimination) = (&mut links[j], &eliminations[j]);
            let predicted = link.position;
            link.rotation = rotation[lane];
            link.tangent = tangent[lane];
            link.strain = strain.lane(lane);
            let present = S::present(counts, j);
            position = S::either(present, || position + lever[lane], || position);
            link.displacement += position - predicted;
            link.position = position;
            link.turn += motions[lane].turn;
            if !LAST {
                continue;
            }

            link.velocity = link.displacement * inverse_dt;
            link.rate = link.rate * kept_rate + link.turn * new_rate;
            let (at_node, at_middle) = (at_node[lane], at_middle[lane]);
            let [node_seen, middle_seen] = &elimination.proximity;
            let force = at_node + at_middle;
            let moment = totals.moment_on_instrument;
            let moment = moment.plus_cross(&(predicted - **mouth), &force);
            let moment = moment.plus_cross(&node_seen.arm, &at_node);
            let moment = moment.plus_cross(&middle_seen.arm, &at_middle);
            (totals.force_on_instrument, totals.moment_on_instrument) = S::either(
                present,
                || (totals.force_on_instrument + force, moment),
                || (totals.force_on_instrument, totals.moment_on_instrument),
            );
            // The two nodes of a link share the force at its middle; the base link has only one.
            let shared = S::either(S::has(counts, j + 1), || at_middle * half, || v);
            link.force = force - shared;
            if let Some(proximal) = links.get_mut(j + 1) {
                proximal.force += shared;
            }
        }
    }
    totals.largest_turn_squared = (0..N::LANES)
        .fold(S::lit(0.0), |largest, lane| largest_turn_squared.lane(lane).larger(largest));
    totals
}
