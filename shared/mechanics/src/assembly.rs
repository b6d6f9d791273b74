//! Loads on every link and moments of every joint at the predicted state, linearised for the solve.

use cathforce_scalar::{Blend, Catheters, Pack, Vector3};

use crate::Drag;
use crate::algebra::{RelativeRotation, Rotation, reload_barrier};
use crate::chain::{Body, Chain};
use crate::contact::{ContactLaw, ContactState, Motion, WallGap};
use crate::effects::active::Law;
use crate::joint::JointLoad;
use crate::link_group::LinkGroup;
use crate::overlap::Slide;
use crate::scheme::Scheme;
use crate::state::{Elimination, LinkLoads, LinkState, Span};
use crate::tables::Joint;

/// Isotropic stiffness at a touching sample, over the wall's normal stiffness. Rounding of A along the
/// normal could otherwise make A negative across it.
const ROUNDING: f64 = 1e-6;

/// Arc, mass and stiffness lumped at the two samples of one link.
#[derive(Clone, Copy)]
struct LumpedProperties<T> {
    /// Half the link's length \[m\].
    arc: T,
    /// Tributary length of its node \[m\].
    node_arc: T,
    node_mass: T,
    /// Nominal normal stiffness of the contact at the node \[N/m\].
    node_stiffness: T,
}

/// The wall at the nodes (`which` = 0) or the middles (1) of links.
#[inline(always)]
fn wall_gap<S: Catheters, N: Pack<S>>(
    group: &LinkGroup<N>,
    eliminations: &[Elimination<S>],
    which: usize,
) -> WallGap<N> {
    WallGap::gather(|lane| &eliminations[group.at(lane)].proximity[which])
}

/// Contact states at the nodes or the middles of links.
#[inline(always)]
fn contact_states<S: Catheters, N: Pack<S>>(
    group: &LinkGroup<N>,
    links: &[LinkState<S>],
    which: usize,
) -> ContactState<N> {
    ContactState::gather(|lane| &links[group.at(lane)].memory[which])
}

/// Motion of the surface against the chain at the nodes or the middles of links.
#[inline(always)]
fn surface_slide<S: Catheters, N: Pack<S>, L: Law<S>>(
    group: &LinkGroup<N>,
    law: &L,
    which: usize,
) -> Slide<N> {
    let slides = N::per_lane(|lane| law.slide(2 * group.at(lane) + which));
    Slide {
        along_m: N::from_lanes(|lane| slides[lane].along_m),
        turn_rad: N::from_lanes(|lane| slides[lane].turn_rad),
        ratio_to_last: N::from_lanes(|lane| slides[lane].ratio_to_last),
    }
}

/// Loads on every link at the predicted state: contacts, weight, inertia, drag, fluid.
///
/// Links do not depend on each other here, so one is computed in each lane. It is a separate function
/// for the reason given at `forward_elimination`.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
pub(crate) fn assemble_loads<S: Catheters, N: Pack<S>, L: Law<S>, const LINKS: usize>(
    body: &Body<'_, S, LINKS>,
    chain: &mut Chain<'_, S, LINKS>,
    count: usize,
    scheme: &Scheme<S>,
    law: &mut L,
) {
    let Chain { links, eliminations, guide, fed_m, momentum_share, .. } = chain;
    let Body { tables, wall, .. } = *body;
    let (links, eliminations) = (&links[..count], &mut eliminations[..count]);
    let masses = &tables.links[..count];
    let half = S::lit(0.5);
    let inverse_dt = S::lit(1.0) / scheme.dt_s;
    let inertia_per_mass = N::splat(scheme.inertia * inverse_dt * inverse_dt);
    let carried_dt_s = N::splat(scheme.dt_s * *momentum_share);
    let Drag { at_rest_n_s_per_m2, swift_n_s_per_m2, swift_m_per_s } = scheme.drag;
    let drag_at_rest = N::splat(at_rest_n_s_per_m2 * inverse_dt);
    let drag_rise = (swift_n_s_per_m2 - at_rest_n_s_per_m2) * inverse_dt;
    let drag_per_square = N::splat(drag_rise / (swift_m_per_s * swift_m_per_s));
    let drag_rise = N::splat(drag_rise);
    let feed_m_per_s = N::splat(*fed_m * inverse_dt);
    let radius = body.radius_m;
    let contact = ContactLaw::<N>::new(wall, scheme, inverse_dt);
    // A moving vessel is an accelerated frame; inertia and drag refer to the rig's frame.
    // docs/explanation/model.md (16)
    let moving = law.vessel_motion().map(|[by_m, m_per_s]| {
        let gained_m = by_m - m_per_s * (scheme.dt_s * *momentum_share);
        let m_per_s2 = gained_m * (scheme.inertia * inverse_dt * inverse_dt);
        [by_m, m_per_s, m_per_s2].map(|v| N::gather_vectors(|_| v))
    });
    let line = wall.line_stiffness_n_per_m2;

    // The tip has no distal neighbour, but its contact has the end's stiffness.
    let mut distal_arc = S::lit(0.0);
    let mut distal_mass = S::lit(0.0);
    let mut end_stiffness = wall.end_stiffness_n_per_m;

    for group in LinkGroup::<N>::all(count) {
        let at = |lane: usize| group.at(lane);
        let link = |lane: usize| &links[at(lane)];
        let proximal = |lane: usize| links.get(at(lane) + 1).unwrap_or(*guide);

        let lumped = group.map_in_order(|j, _| {
            let Span { length, share, .. } = links[j].span;
            let (arc, mass) = (length * half, masses[j].mass * share * half);
            let (node_arc, node_mass) = (arc + distal_arc, mass + distal_mass);
            (distal_arc, distal_mass) = (arc, mass);
            let node_stiffness = line * node_arc * half + end_stiffness;
            end_stiffness = S::lit(0.0);
            LumpedProperties { arc, node_arc, node_mass, node_stiffness }
        });
        let each = |of: fn(&LumpedProperties<S>) -> S| N::from_lanes(|lane| of(&lumped[lane]));

        let tangent = || N::gather_vectors(|lane| link(lane).tangent);
        let turn = N::gather_vectors(|lane| link(lane).turn);
        let node_displacement = || N::gather_vectors(|lane| link(lane).displacement);
        let node_radius = N::from_lanes(|lane| law.radius(2 * at(lane), radius));
        let middle_radius = N::from_lanes(|lane| law.radius(2 * at(lane) + 1, radius));
        let at_node = Motion {
            displacement: node_displacement(),
            turn,
            radius: node_radius,
            tangent: tangent(),
            slide: surface_slide(&group, law, 0),
        };
        let displacement = (node_displacement()
            + N::gather_vectors(|lane| proximal(lane).displacement))
            * N::lit(0.5);
        let at_middle = Motion {
            displacement,
            turn,
            radius: middle_radius,
            tangent: tangent(),
            slide: surface_slide(&group, law, 1),
        };
        let node_stiffness = each(|lumped| lumped.node_stiffness);
        let node = contact.linearise(
            &*law,
            &wall_gap(&group, eliminations, 0),
            node_stiffness,
            each(|lumped| lumped.node_arc) * N::lit(0.5),
            &at_node,
            &contact_states(&group, links, 0),
        );
        reload_barrier();
        let middle_arc = each(|lumped| lumped.arc);
        let middle = contact.linearise(
            &*law,
            &wall_gap(&group, eliminations, 1),
            N::splat(line) * middle_arc,
            middle_arc,
            &at_middle,
            &contact_states(&group, links, 1),
        );

        // Weight, inertia, and drag against all motion except the feed.     docs/explanation/model.md (16)
        let node_mass = each(|lumped| lumped.node_mass);
        let node_arc = each(|lumped| lumped.node_arc);
        let velocity = || N::gather_vectors(|lane| link(lane).velocity);
        let mut beside = velocity() - tangent() * feed_m_per_s;
        if let Some([_, m_per_s, _]) = &moving {
            beside -= *m_per_s;
        }
        let drag = drag_at_rest + (beside.dot(&beside) * drag_per_square).smaller(drag_rise);
        let (inertia, damping) = (inertia_per_mass * node_mass, drag * node_arc);
        let mut force = N::gather_vectors(|_| *body.gravity) * node_mass
            - node_displacement() * (inertia + damping)
            + velocity() * (inertia * carried_dt_s)
            + tangent() * (damping * N::splat(*fed_m));
        if let Some([by_m, _, m_per_s2]) = moving {
            force += by_m * damping + m_per_s2 * node_mass;
        }
        let to_wall = || wall_gap(&group, eliminations, 0).gap + node_radius;
        if let Some(per_length) = law.fluid_force(&tangent(), to_wall) {
            force += per_length * node_arc;
        }
        reload_barrier();
        let kept_positive = (node.normal_excess + middle.normal_excess) * N::lit(ROUNDING);
        let at_node = node.force(&wall_gap(&group, eliminations, 0).normal);
        let at_middle = middle.force(&wall_gap(&group, eliminations, 1).normal);
        let force = N::split_vectors(force + at_node + at_middle);
        let arm = |i: usize| N::gather_vectors(|lane| eliminations[at(lane)].proximity[i].arm);
        let moment = N::split_vectors(arm(0).cross(&at_node).plus_cross(&arm(1), &at_middle));
        let stiffness = inertia
            + damping
            + kept_positive
            + node.tangential_stiffness
            + middle.tangential_stiffness;
        let (node, middle) = (node.split(), middle.split());
        for lane in 0..N::LANES {
            let elimination = &mut eliminations[at(lane)];
            elimination.loads = LinkLoads {
                force: force[lane],
                moment: moment[lane],
                stiffness: stiffness.lane(lane),
            };
            elimination.contacts = [node[lane], middle[lane]];
        }
    }
}

/// Moment and stiffness of every link's proximal joint at the predicted state.
///
/// Joints are computed one in each lane, as in [`assemble_loads`]. The two joints at the base link,
/// whose cells are not full, follow one by one.
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
pub(crate) fn joint_moments<S: Catheters, N: Pack<S>, L: Law<S>, const LINKS: usize>(
    body: &Body<'_, S, LINKS>,
    chain: &mut Chain<'_, S, LINKS>,
    law: &mut L,
) {
    let Chain { links, eliminations, guide, tendon_cells, springs, at_base, .. } = chain;
    let tables = body.tables;
    let count = chain.longest.min(LINKS);
    let inside = &links[..count];
    let [up, side] = [[1.0, 0.0], [0.0, 1.0]];
    let is_viscous = body.is_viscous;
    // Of catheters abreast, one's base link may be beside another's full ones.
    let base = chain.shortest.min(count).saturating_sub(at_base.len());
    let full = if S::ABREAST { count } else { base };
    for group in LinkGroup::<N>::all(full) {
        let distal = |lane: usize| &links[group.at(lane)];
        // Every full joint has a link behind it, so the remainder changes nothing. With it the device's code
        // has no panic here (P13), and one instruction less than a check takes.
        let proximal = |lane: usize| &links[(group.at(lane) + 1) % LINKS];
        let bend = RelativeRotation::between(
            &Rotation::gather(|lane| &proximal(lane).rotation),
            &Rotation::gather(|lane| &distal(lane).rotation),
        );
        let angles = N::split_vectors(bend.angle);
        let joints =
            group.map_in_order(|j, lane| law.joint(j, &tables.joints[j], &angles[lane], *springs));
        let joint = Joint::gather(|lane| &joints[lane]);
        let turned = is_viscous.then(|| {
            N::gather_vectors(|lane| distal(lane).turn)
                - N::gather_vectors(|lane| proximal(lane).turn)
        });
        let viscous = turned.as_ref().map(|turned| (N::splat(chain.damping), turned));
        let joint = JointLoad::<N>::new(&joint, &bend, viscous);
        let (moment, stiffness) = (N::split_vectors(joint.moment), joint.stiffness.split::<S>());
        for lane in 0..N::LANES {
            eliminations[group.at(lane)].joint = JointLoad {
                moment: moment[lane],
                stiffness: stiffness[lane],
                smallest_eigenvalue: joint.smallest_eigenvalue.lane(lane),
            };
        }
        if let Some(tendon_cells) = tendon_cells.filter(|_| law.has_tendons()) {
            let midway = |[x, y]: [f64; 2]| {
                let axis = Vector3::new(N::lit(x), N::lit(y), N::lit(0.0));
                N::split_vectors(bend.rotate_midway(&axis))
            };
            let (up, side) = (midway(up), midway(side));
            for lane in (0..N::LANES).filter(|&lane| group.has(lane)) {
                let (j, axes) = (group.at(lane), [up[lane], side[lane]]);
                let load = &mut eliminations[j].joint;
                law.load_joint(j, &joints[lane], &angles[lane], &axes, tendon_cells, load);
            }
        }
    }
    // Said this way, the device's code has no panic here (P13).
    for j in base..count {
        let Some(distal) = inside.get(j) else {
            continue;
        };
        let proximal = inside.get(j + 1).unwrap_or(*guide);
        let [at_guide, next] = at_base;
        let cell = S::either(S::has(chain.count, j + 1), || *next, || *at_guide);
        let bend = RelativeRotation::between(&proximal.rotation, &distal.rotation);
        let joint = law.joint(j, &tables.joints[j], &bend.angle, *springs);
        let turned = distal.turn - proximal.turn;
        let mut load = JointLoad::at_base(&joint, &cell, &bend, &turned);
        if let Some(tendon_cells) = tendon_cells.filter(|_| law.has_tendons()) {
            let midway = |[x, y]: [f64; 2]| {
                bend.rotate_midway(&Vector3::new(S::lit(x), S::lit(y), S::lit(0.0)))
            };
            let axes = [midway(up), midway(side)];
            law.load_joint(j, &joint, &bend.angle, &axes, tendon_cells, &mut load);
        }
        let place = &mut eliminations[j].joint;
        *place = if S::ABREAST {
            Blend::blend(S::has(chain.count, j + at_base.len()), *place, load)
        } else {
            load
        };
    }
}
