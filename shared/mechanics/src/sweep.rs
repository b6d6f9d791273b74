//! One linearised solve: eliminated from the tip to the guide, resolved on the way back.

use nalgebra::Vector3;

use crate::algebra::{Bend, dot, minus_mul_transposed, plus_cross, plus_mul};
use crate::contact::{Contact, Motion};
use crate::effects::acting::Law;
use crate::feed::SHORTEST_BASE;
use crate::joint::{Cell, JointLoad};
use crate::model::{maximum, minimum};
use crate::state::State;
use crate::wrench::Wrench;
use crate::{Loads, Model, Real};

/// Strains that a link can have: half to twice its length. A drive that pulls at an instrument
/// stuck by friction would stretch it without end.
pub(crate) const STRAINS: core::ops::Range<f64> = -0.5..1.0;

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

/// Totals of one solve.
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
    let mut wrench = Wrench::beyond_tip(loads);
    eliminate(model, state, scheme, &chain, law, &mut wrench);
    resolve::<T, L, LINKS>(state, scheme, &chain, &wrench)
}

/// Lengths along the chain: all links are equal but the base link, and all joints but the two
/// that it reaches.
struct Chain<T> {
    count: usize,
    full: Span<T>,
    base: Span<T>,
    between: Cell<T>,
    at_base: Cell<T>,
    at_guide: Cell<T>,
}

/// The length of a link.
struct Span<T> {
    length: T,
    /// Over the link length.
    share: T,
    /// One over the length that the stretch sees.
    inverse_length: T,
}

impl<T: Real> Chain<T> {
    fn new<const LINKS: usize>(
        model: &Model<T, LINKS>,
        state: &State<T, LINKS>,
        scheme: &Scheme<T>,
    ) -> Self {
        let solver = &model.description().solver;
        let (h, base) = (solver.link_length_m, state.base_length_m);
        let span = |length: T| {
            let stretched = maximum(length, h * T::lit(SHORTEST_BASE));
            Span { length, share: length / h, inverse_length: T::one() / stretched }
        };
        let damping = model.bending_damping_s * scheme.inertia / scheme.dt_s;
        let cell = |length: T| Cell::new(length, h, damping);
        Self {
            count: state.count.min(LINKS),
            full: span(h),
            base: span(base),
            between: cell(h),
            at_base: cell((h + base) * T::lit(0.5)),
            at_guide: cell(state.guide_cell_m(model)),
        }
    }

    fn span(&self, link: usize) -> &Span<T> {
        if link + 1 == self.count { &self.base } else { &self.full }
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

/// Tip to guide.
fn eliminate<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    chain: &Chain<T>,
    law: &mut L,
    wrench: &mut Wrench<T>,
) {
    let State { links, eliminations, guide, fed_m, carried, overlaid, .. } = state;
    let tables = if L::COAXIAL { &*overlaid } else { &model.tables };
    let proximal_of = |j: usize| links[..chain.count].get(j + 1).unwrap_or(guide);
    let description = model.description();
    let wall = &model.wall;
    let half = T::lit(0.5);
    let inverse_dt = T::one() / scheme.dt_s;
    let inertia_per_mass = scheme.inertia * inverse_dt * inverse_dt;
    let carried_dt_s = scheme.dt_s * *carried;
    let drag = scheme.drag_n_s_per_m2 * inverse_dt;
    let radius = description.instrument.outer_radius_m;
    let contact = Contact::new(wall, scheme.friction, inverse_dt);

    // Beyond the tip there is nothing but the end of its contact.
    let mut distal_arc = T::zero();
    let mut distal_mass = T::zero();
    let mut end_stiffness = wall.end_stiffness_n_per_m;

    for j in 0..chain.count {
        let (link, proximal, kept) = (&links[j], proximal_of(j), &mut eliminations[j]);
        let Span { length, share, inverse_length } = *chain.span(j);
        let tangent = &link.tangent;
        let stretched = length * (T::one() + link.strain);

        // The node: weight, inertia, drag against all motion but the feed's.     docs/model.md (15)
        let (arc, mass) = (length * half, tables.links[j].mass * share * half);
        let (node_arc, node_mass) = (arc + distal_arc, mass + distal_mass);
        let (inertia, damping) = (inertia_per_mass * node_mass, drag * node_arc);
        let mut force = model.gravity * node_mass - link.displacement * (inertia + damping)
            + link.velocity * (inertia * carried_dt_s)
            + link.tangent * (damping * *fed_m);
        let [node_radius, middle_radius] = [2 * j, 2 * j + 1].map(|i| law.radius(i, radius));
        let to_wall = || kept.seen[0].gap + node_radius;
        if let Some(per_length) = law.stream(tangent, to_wall) {
            force += per_length * node_arc;
        }
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
        kept.touches[0] = contact.touch(&*law, &kept.seen[0], stiffness, &at_node, &link.memory[0]);
        kept.touches[1] =
            contact.touch(&*law, &kept.seen[1], line * arc, &at_middle, &link.memory[1]);
        wrench.add_node(&force, inertia + damping, &kept.seen, &kept.touches);

        let stiffness = tables.links[j].axial * inverse_length;
        wrench.add_stretch(tangent, stiffness, stiffness * length * link.strain, kept);
        wrench.shift(tangent, stretched);
        let bend = Bend::between(&proximal.rotation, &link.rotation);
        let joint = law.joint(j, &tables.joints[j], &bend.angle);
        let joint = JointLoad::new(&joint, chain.cell(j), &bend, &link.curvature);
        wrench.pass_joint(&joint, kept);

        (distal_arc, distal_mass) = (arc, mass);
        end_stiffness = T::zero();
    }
}

/// Guide to tip.     docs/model.md (17)
fn resolve<T: Real, L: Law<T>, const LINKS: usize>(
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
        let Span { length, inverse_length, .. } = *chain.span(j);
        let kept = &mut eliminations[j];
        let link = &mut links[j];
        let proximal_turn = turn;
        turn = minus_mul_transposed(&kept.turn, &kept.by_displacement, &dx);
        turn = plus_mul(&turn, &kept.by_turn, &proximal_turn);
        let swung = plus_cross(&dx, &turn, &(link.tangent * (length * (T::one() + link.strain))));
        let stretch =
            kept.stretch_gain - dot(&kept.stretch_pull, &swung) - dot(&kept.stretch_turn, &turn);
        dx = swung + link.tangent * stretch;

        let predicted = link.position;
        let [node, middle] = &kept.touches;
        let [node_seen, middle_seen] = &mut kept.seen;
        let [node_memory, middle_memory] = &mut link.memory;
        let at_node = node.resolve(node_seen, &dx, &turn, node_memory, scheme.last, L::RELAXES);
        let at_middle =
            middle.resolve(middle_seen, &dx, &turn, middle_memory, scheme.last, L::RELAXES);
        let force = at_node + at_middle;
        totals.force_on_instrument += force;
        let moment = &mut totals.moment_on_instrument;
        *moment = plus_cross(moment, &(predicted - mouth), &force);
        *moment = plus_cross(moment, &node_seen.arm, &at_node);
        *moment = plus_cross(moment, &middle_seen.arm, &at_middle);
        // The middle's force is shared by the two nodes of the link; the guide has none.
        let shared = if j + 1 == chain.count { v } else { at_middle * half };
        link.force = force - shared;

        link.rotation = link.rotation.turned(&(turn * half));
        link.tangent = link.rotation.tangent();
        let strain = link.strain + stretch * inverse_length;
        link.strain = minimum(maximum(strain, T::lit(STRAINS.start)), T::lit(STRAINS.end));
        position += link.tangent * (length * (T::one() + link.strain));
        link.displacement += position - predicted;
        link.position = position;
        link.turn += turn;
        if scheme.last {
            link.velocity = link.displacement * inverse_dt;
            link.rate = link.rate * kept_rate + link.turn * new_rate;
        }
        totals.largest_turn_squared = maximum(dot(&turn, &turn), totals.largest_turn_squared);
        if let Some(proximal) = links.get_mut(j + 1) {
            proximal.force += shared;
        }
    }
    totals
}
