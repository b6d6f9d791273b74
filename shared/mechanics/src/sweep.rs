//! One linearised solve: eliminated from the tip to the guide, resolved on the way back.

use cathforce_scalar::Vector3;

use crate::algebra::{Bend, read_here};
use crate::contact::{Contact, Motion};
use crate::effects::acting::Law;
use crate::joint::{Cell, JointLoad};
use crate::state::{LinkLoads, Span, State};
use crate::wrench::Wrench;
use crate::{Loads, Model, Real};

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
    /// Drag on every node per length \[N·s/m²\].
    pub drag_n_s_per_m2: T,
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
pub(crate) fn solve<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
    law: &mut L,
) -> Totals<T> {
    let chain = Chain::new(model, state, scheme);
    load(model, state, scheme, &chain, law);
    let wrench = eliminate::<T, L, LINKS>(model, state, &chain, Wrench::beyond_tip(loads));
    if scheme.last {
        resolve::<T, L, LINKS, true>(state, scheme, &chain, &wrench)
    } else {
        resolve::<T, L, LINKS, false>(state, scheme, &chain, &wrench)
    }
}

/// Links inside the vessel, and the cells of their joints: all are equal but the two that the base
/// link reaches.
struct Chain<T> {
    count: usize,
    between: Cell<T>,
    at_base: Cell<T>,
    at_guide: Cell<T>,
}

impl<T: Real> Chain<T> {
    fn new<const LINKS: usize>(
        model: &Model<T, LINKS>,
        state: &State<T, LINKS>,
        scheme: &Scheme<T>,
    ) -> Self {
        let solver = &model.description().solver;
        let (h, base) = (solver.link_length_m, state.base_length_m);
        let damping = model.bending_damping_s * scheme.inertia / scheme.dt_s;
        let cell = |length: T| Cell::new(length, h, damping);
        Self {
            count: state.count.min(LINKS),
            between: cell(h),
            at_base: cell((h + base) * T::lit(0.5)),
            at_guide: cell(state.guide_cell_m(model)),
        }
    }

    /// Of the joint at the proximal end of a link.
    fn cell(&self, link: usize) -> &Cell<T> {
        match self.count - link {
            0 | 1 => &self.at_guide,
            2 => &self.at_base,
            _ => &self.between,
        }
    }
}

/// What acts on every link at the predicted state.
fn load<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    chain: &Chain<T>,
    law: &mut L,
) {
    let State { links, eliminations, guide, fed_m, carried, overlaid, .. } = state;
    let tables = if L::COAXIAL { &*overlaid } else { &model.tables };
    let proximal_of = |j: usize| links[..chain.count].get(j + 1).unwrap_or(guide);
    let wall = &model.wall;
    let half = T::lit(0.5);
    let inverse_dt = T::one() / scheme.dt_s;
    let inertia_per_mass = scheme.inertia * inverse_dt * inverse_dt;
    let carried_dt_s = scheme.dt_s * *carried;
    let drag = scheme.drag_n_s_per_m2 * inverse_dt;
    let radius = model.description().instrument.outer_radius_m;
    let contact = Contact::new(wall, scheme.friction, inverse_dt);
    let viscous = model.bending_damping_s > T::zero();

    // Beyond the tip there is nothing but the end of its contact.
    let mut distal_arc = T::zero();
    let mut distal_mass = T::zero();
    let mut end_stiffness = wall.end_stiffness_n_per_m;

    for (j, (link, kept)) in links[..chain.count].iter().zip(eliminations).enumerate() {
        let proximal = proximal_of(j);
        let Span { length, share, .. } = link.span;
        let (arc, mass) = (length * half, tables.links[j].mass * share * half);
        let (node_arc, node_mass) = (arc + distal_arc, mass + distal_mass);
        (distal_arc, distal_mass) = (arc, mass);

        let tangent = &link.tangent;
        let [node_radius, middle_radius] = [2 * j, 2 * j + 1].map(|i| law.radius(i, radius));
        let motion = |displacement, radius, halves| Motion {
            displacement,
            turn: link.turn,
            radius,
            tangent,
            slide: law.slide(halves),
        };
        let at_node = motion(link.displacement, node_radius, 2 * j);
        let displacement = (link.displacement + proximal.displacement) * half;
        let at_middle = motion(displacement, middle_radius, 2 * j + 1);
        let line = wall.line_stiffness_n_per_m2;
        let stiffness = line * node_arc * half + end_stiffness;
        end_stiffness = T::zero();
        let [node_seen, middle_seen] = &kept.seen;
        let node = contact.touch(&*law, node_seen, stiffness, &at_node, &link.memory[0]);
        read_here();
        let middle = contact.touch(&*law, middle_seen, line * arc, &at_middle, &link.memory[1]);

        // The node: weight, inertia, drag against all motion but the feed's.     docs/model.md (15)
        let (inertia, damping) = (inertia_per_mass * node_mass, drag * node_arc);
        let mut force = model.gravity * node_mass - link.displacement * (inertia + damping)
            + link.velocity * (inertia * carried_dt_s)
            + link.tangent * (damping * *fed_m);
        let to_wall = || node_seen.gap + node_radius;
        if let Some(per_length) = law.stream(tangent, to_wall) {
            force += per_length * node_arc;
        }
        read_here();
        let kept_positive = (node.push + middle.push) * T::lit(ROUNDING);
        let (at_node, at_middle) = (node.force(node_seen), middle.force(middle_seen));
        kept.loads = LinkLoads {
            force: force + at_node + at_middle,
            moment: node_seen.arm.cross(&at_node).plus_cross(&middle_seen.arm, &at_middle),
            stiffness: inertia + damping + kept_positive + node.stick + middle.stick,
        };
        kept.touches = [node, middle];

        read_here();
        let bend = Bend::between(&proximal.rotation, &link.rotation);
        let joint = law.joint(j, &tables.joints[j], &bend.angle);
        let curvature = if viscous { Some(&link.curvature) } else { None };
        kept.joint = JointLoad::new(&joint, chain.cell(j), &bend, curvature);
    }
}

/// Tip to guide.
#[inline(never)]
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

/// Guide to tip.     docs/model.md (17)
///
/// What only the `LAST` solve of a step has to find is found in it alone: totals, the forces
/// at the nodes, rates, and what the contacts remember.
#[inline(never)]
fn resolve<T: Real, L: Law<T>, const LINKS: usize, const LAST: bool>(
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    chain: &Chain<T>,
    at_guide: &Wrench<T>,
) -> Totals<T> {
    let State { links, eliminations, effects, .. } = state;
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
    let kept_rate = T::one() - scheme.predictor_gain;
    let new_rate = scheme.predictor_gain * inverse_dt;
    let (mut dx, mut turn) = (v, v);
    let mut position = *mouth;
    for j in (0..chain.count).rev() {
        let (link, kept) = (&mut links[j], &mut eliminations[j]);
        let Span { length, inverse_length, .. } = link.span;
        let in_factor = kept.turn - kept.by_displacement.mul_transposed(&dx)
            + kept.by_turn.mul_transposed(&turn);
        turn = kept.factor.backward(&in_factor);
        let swung = dx.plus_cross(&turn, &(link.tangent * (length * (T::one() + link.strain))));
        let stretch = kept.stretch.resolve(&swung, &turn);
        dx = swung + link.tangent * stretch;

        let predicted = link.position;
        let [node, middle] = &kept.touches;
        let [node_seen, middle_seen] = &mut kept.seen;
        let [node_memory, middle_memory] = &mut link.memory;
        let relaxes = L::RELAXES;
        let at_node = node.resolve::<LAST>(node_seen, &dx, &turn, node_memory, relaxes);
        let at_middle = middle.resolve::<LAST>(middle_seen, &dx, &turn, middle_memory, relaxes);

        link.rotation = link.rotation.turned(&(turn * half));
        link.tangent = link.rotation.tangent();
        let strain = link.strain + stretch * inverse_length;
        link.strain = strain.larger(T::lit(STRAINS.start)).smaller(T::lit(STRAINS.end));
        position += link.tangent * (length * (T::one() + link.strain));
        link.displacement += position - predicted;
        link.position = position;
        link.turn += turn;
        totals.largest_turn_squared = turn.dot(&turn).larger(totals.largest_turn_squared);
        if !LAST {
            continue;
        }

        link.velocity = link.displacement * inverse_dt;
        link.rate = link.rate * kept_rate + link.turn * new_rate;
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
    totals
}
