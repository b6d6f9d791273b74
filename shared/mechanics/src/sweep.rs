//! One linearised solve: eliminated from the tip to the guide, resolved on the way back.
//!
//! The wrench that everything beyond a point exerts on it is kept linear in the point's
//! motion:
//!
//! F = f − A δx − B δφ,  M = m − Bᵀ δx − C δφ.     docs/model.md (5)

use nalgebra::{Matrix3, Vector3};

use crate::algebra::{Factors, Sym3, add_cross, add_outer, cross, dot, mul, mul_transposed};
use crate::contact::{Contact, Motion, Touch};
use crate::effects::acting::Law;
use crate::feed::SHORTEST_BASE;
use crate::model::{Joint, maximum};
use crate::state::{Elimination, State};
use crate::{Loads, Lumen, Model, Real};

/// How one solve treats time.
pub(crate) struct Scheme<T> {
    pub dt_s: T,
    /// 1 with inertia, 0 quasi-static.
    pub inertia: T,
    pub friction: T,
    /// Drag on every node per length \[N·s/m²\].
    pub drag_n_s_per_m2: T,
    pub predictor_gain: T,
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
    /// A point of the instrument is beyond the stored wall.
    pub outside: bool,
}

/// The linear wrench of everything distal to a point.
struct Wrench<T: Real> {
    force: Vector3<T>,
    moment: Vector3<T>,
    a: Sym3<T>,
    b: Matrix3<T>,
    c: Sym3<T>,
}

impl<T: Real> Wrench<T> {
    /// Beyond the tip: what pulls on it from outside, without stiffness.
    fn beyond_tip(loads: &Loads<T>) -> Self {
        Self {
            force: Vector3::from(loads.tip_force_n),
            moment: Vector3::from(loads.tip_moment_n_m),
            a: Sym3::zero(),
            b: Matrix3::zeros(),
            c: Sym3::zero(),
        }
    }

    /// A force at the node, with isotropic stiffness.
    #[inline(always)]
    fn add_force(&mut self, force: &Vector3<T>, stiffness: T) {
        self.force += force;
        self.a.add_identity(stiffness);
    }

    /// A contact with the surface, off the node by its arm.     docs/model.md (14)
    #[inline(always)]
    fn add_touch(&mut self, touch: &Touch<T>) {
        let Touch { force, normal, arm, stick, push, .. } = touch;
        let (stick, push) = (*stick, *push);
        self.force += force;
        self.moment += cross(arm, force);
        self.a.add_identity(stick);
        self.a.add_outer(push, normal);
        let turned = cross(arm, normal);
        add_cross(&mut self.b, -stick, arm);
        add_outer(&mut self.b, push, normal, &turned);
        self.c.add_identity(stick * dot(arm, arm));
        self.c.add_outer(-stick, arm);
        self.c.add_outer(push, &turned);
    }

    /// Eliminates the link's stretch along `tangent`.     docs/model.md (6)
    #[inline(always)]
    fn add_stretch(
        &mut self,
        tangent: &Vector3<T>,
        stiffness: T,
        tension: T,
        kept: &mut Elimination<T>,
    ) {
        let alpha = self.a.mul_vec(tangent);
        let beta = mul_transposed(&self.b, tangent);
        let inverse = T::one() / (stiffness + maximum(dot(tangent, &alpha), T::zero()));
        let gain = (dot(&self.force, tangent) - tension) * inverse;
        self.force -= alpha * gain;
        self.moment -= beta * gain;
        self.a.add_outer(-inverse, &alpha);
        add_outer(&mut self.b, -inverse, &alpha, &beta);
        self.c.add_outer(-inverse, &beta);
        kept.stretch_gain = gain;
        kept.stretch_pull = alpha * inverse;
        kept.stretch_turn = beta * inverse;
    }

    /// From the distal to the proximal end of a link.     docs/model.md (7)
    #[inline(always)]
    fn shift(&mut self, lever: &Vector3<T>) {
        let at_node = self.b;
        self.b -= self.a.mul_cross(lever);
        self.c.add_cross_products(lever, &self.b, &at_node);
        let pull = dot(lever, &self.force);
        if pull > T::zero() {
            let along = T::one() / dot(lever, lever);
            self.c.add_identity(pull);
            self.c.add_outer(-pull * along, lever);
        }
        self.moment += cross(lever, &self.force);
    }

    /// Eliminates the rotation of the link distal to a joint.     docs/model.md (8)
    #[inline(always)]
    fn pass_joint(&mut self, joint: &JointLoad<T>, kept: &mut Elimination<T>) {
        let JointLoad { moment, axis, bending, twisting } = joint;
        let (kb, kt) = (*bending, *twisting);
        let smallest = if kt < T::zero() { kb + kt } else { kb };
        let factors = Factors::new(&self.c.plus_axial(kb, kt, axis), smallest);
        let inverse = factors.inverse();
        let residual = self.moment - moment;
        kept.inverse = inverse;
        kept.coupling = self.b;
        kept.residual = residual;
        kept.bending = kb;
        kept.twisting = kt;
        kept.axis = *axis;

        // Z = B L⁻ᵀ, W = Z D⁻¹ of the factors, Y = W L⁻¹.
        let columns = [self.b.column(0), self.b.column(1), self.b.column(2)];
        let z = factors.forward(columns.map(|column| column.into_owned()));
        let w = factors.scale(z);
        let y = Matrix3::from_columns(&factors.backward(w));
        let (z, w) = (Matrix3::from_columns(&z), Matrix3::from_columns(&w));
        let scaled = factors.scale(factors.forward(residual.into()));
        let turn = Vector3::from(factors.backward(scaled));
        self.force -= mul(&z, &scaled.into());
        self.moment = moment + turn * kb + axis * (kt * dot(axis, &turn));
        self.a.sub_product_transposed(&w, &z);
        // B ← Y K
        let ya = mul(&y, axis);
        self.b = y * kb;
        add_outer(&mut self.b, kt, &ya, axis);
        // C ← K − K D⁻¹ K
        let u = inverse.mul_vec(axis);
        let s = dot(axis, &u);
        let (kb2, kbt) = (-kb * kb, -kb * kt);
        let i = &inverse;
        self.c = Sym3 {
            xx: kb2 * i.xx,
            xy: kb2 * i.xy,
            xz: kb2 * i.xz,
            yy: kb2 * i.yy,
            yz: kb2 * i.yz,
            zz: kb2 * i.zz,
        };
        self.c.add_identity(kb);
        self.c.add_outer(kt - kt * kt * s, axis);
        self.c.add_outer_pair(kbt, &u, axis);
    }
}

/// Moment and stiffness of a joint at the predicted state, world axes.
struct JointLoad<T: Real> {
    moment: Vector3<T>,
    axis: Vector3<T>,
    bending: T,
    /// Torsional less bending stiffness.
    twisting: T,
}

/// One solve, in place. Contact memories, rotations, positions and rates are brought up to
/// date; the totals are those of the linear model (forces that balance to the last digit).
pub(crate) fn solve<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
    law: &mut L,
) -> Totals<T> {
    let count = state.count.min(LINKS);
    let mut wrench = Wrench::beyond_tip(loads);
    eliminate(model, lumen, state, scheme, count, law, &mut wrench);
    let guide = guide_joint(model, state, scheme, count, law);
    let before = (wrench.force, wrench.b);
    if let Some(base) = count.checked_sub(1) {
        wrench.pass_joint(&guide, &mut state.eliminations[base]);
    }
    resolve(model, state, scheme, count, &before, &guide)
}

/// Tip to guide.
fn eliminate<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    count: usize,
    law: &mut L,
    wrench: &mut Wrench<T>,
) {
    let description = model.description();
    let wall = &model.wall;
    let h = description.solver.link_length_m;
    let (half, quarter) = (T::lit(0.5), T::lit(0.25));
    let inverse_dt = T::one() / scheme.dt_s;
    let contact = Contact {
        wall,
        lumen,
        radius_m: description.instrument.outer_radius_m,
        friction: scheme.friction,
        inverse_dt,
    };
    let drag = scheme.drag_n_s_per_m2 * inverse_dt;
    let guide_tangent = state.guide.tangent();
    let mut distal_length = T::zero();
    let mut distal_mass = T::zero();
    for j in 0..count {
        let base = j + 1 == count;
        let length = if base { state.base_length_m } else { h };
        if j > 0 {
            let cell = (distal_length + length) * half;
            let load = joint_load(model, state, j, cell, scheme, law);
            wrench.pass_joint(&load, &mut state.eliminations[j - 1]);
        }
        let link = &state.links[j];
        let kept = &mut state.eliminations[j];
        let lever = link.tangent * (length * (T::one() + link.strain));

        // The node: weight, inertia, drag.     docs/model.md (15)
        let mass = model.links[j].mass * (length / h);
        let node_mass = (mass + distal_mass) * half;
        let inertia = scheme.inertia * node_mass * inverse_dt * inverse_dt;
        let damping = drag * (length + distal_length) * half;
        let lag = link.displacement - link.velocity * scheme.dt_s;
        let drift = link.displacement - link.tangent * state.fed_m;
        let force = model.gravity * node_mass - lag * inertia - drift * damping;
        wrench.add_force(&force, inertia + damping);
        let to_wall = || lumen.sample(&link.position).distance_m;
        if let Some(per_length) = law.stream(&link.tangent, to_wall) {
            wrench.add_force(&(per_length * ((length + distal_length) * half)), T::zero());
        }

        // Contact at the node, and on the arc above the middle of the link.     docs/model.md (16)
        let end = if j == 0 { wall.end_stiffness_n_per_m } else { T::zero() };
        let turn = link.turn;
        let node_motion = Motion { displacement: link.displacement, turn };
        kept.touches[0] = contact.touch(
            &*law,
            &link.position,
            &Vector3::zeros(),
            wall.line_stiffness_n_per_m2 * (length + distal_length) * quarter + end,
            &node_motion,
            &link.memory[0],
        );
        let proximal = if base { None } else { state.links.get(j + 1) };
        let (proximal_tangent, proximal_displacement) =
            proximal.map_or((guide_tangent, Vector3::zeros()), |p| (p.tangent, p.displacement));
        let sagitta = if j == 0 {
            (proximal_tangent - link.tangent) * (length * T::lit(0.125))
        } else {
            (proximal_tangent - state.links[j - 1].tangent) * (length * T::lit(0.0625))
        };
        let offset = sagitta - lever * half;
        let middle_motion =
            Motion { displacement: (link.displacement + proximal_displacement) * half, turn };
        kept.touches[1] = contact.touch(
            &*law,
            &(link.position + offset),
            &offset,
            wall.line_stiffness_n_per_m2 * length * half,
            &middle_motion,
            &link.memory[1],
        );
        for touch in &kept.touches {
            wrench.add_touch(touch);
        }

        let elastic_length = maximum(length, h * T::lit(SHORTEST_BASE));
        let stiffness = model.links[j].axial * (h / elastic_length);
        let tension = stiffness * length * link.strain;
        wrench.add_stretch(&link.tangent, stiffness, tension, kept);
        wrench.shift(&lever);
        kept.lever = lever;
        distal_length = length;
        distal_mass = mass;
    }
}

/// Moment of the joint at node j at the predicted state.     docs/model.md (4)
fn joint_load<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    j: usize,
    cell: T,
    scheme: &Scheme<T>,
    law: &mut impl Law<T>,
) -> JointLoad<T> {
    let (near, far) = (state.links[j].rotation, state.links[j - 1].rotation);
    let bend = near.to(&far).log();
    let before = state.links[j].curvature * cell;
    let joint = law.joint(j - 1, &model.joints[j - 1], &bend);
    elastic_moment(model, &joint, cell, scheme, &bend, &before, near.midway(&far))
}

/// The joint at the guide's mouth: the base link's half against the guide.
fn guide_joint<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    scheme: &Scheme<T>,
    count: usize,
    law: &mut impl Law<T>,
) -> JointLoad<T> {
    let near = state.guide;
    let far = count.checked_sub(1).map_or(near, |base| state.links[base].rotation);
    let bend = near.to(&far).log();
    let cell = state.guide_cell_m(model);
    let before = state.guide_curvature * cell;
    let distal_link = count.saturating_sub(1);
    let joint = law.joint(distal_link, &model.joints[distal_link], &bend);
    elastic_moment(model, &joint, cell, scheme, &bend, &before, near.midway(&far))
}

fn elastic_moment<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    joint: &Joint<T>,
    cell: T,
    scheme: &Scheme<T>,
    bend: &Vector3<T>,
    before: &Vector3<T>,
    midway: crate::algebra::Rotation<T>,
) -> JointLoad<T> {
    let h = model.description().solver.link_length_m;
    let Joint { bending, torsion, unloaded } = joint;
    let scale = h / cell;
    let damping = model.bending_damping_s * scheme.inertia / scheme.dt_s;
    let (kb, kt) = (*bending * scale, *torsion * scale);
    let stiffen = T::one() + damping;
    // Elastic, and viscous against the curvature at the step's start.     docs/model.md (4)
    let strain = bend - unloaded * (cell / h) + (bend - before) * damping;
    let axis = midway.tangent();
    let moment = midway.rotate(&strain) * kb + axis * ((kt - kb) * strain.z);
    JointLoad { moment, axis, bending: kb * stiffen, twisting: (kt - kb) * stiffen }
}

/// Guide to tip.     docs/model.md (17)
fn resolve<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &mut State<T, LINKS>,
    scheme: &Scheme<T>,
    count: usize,
    base_wrench: &(Vector3<T>, Matrix3<T>),
    guide: &JointLoad<T>,
) -> Totals<T> {
    let half = T::lit(0.5);
    let inverse_dt = T::one() / scheme.dt_s;
    let v = Vector3::zeros();
    let mut totals = Totals {
        force_on_instrument: v,
        moment_on_instrument: v,
        force_on_guide: base_wrench.0,
        moment_on_guide: guide.moment,
        largest_turn_squared: T::zero(),
        outside: false,
    };
    let (mut dx, mut turn) = (v, v);
    let mouth = state.effects.mouth;
    let mut position = mouth;
    for j in (0..count).rev() {
        let base = j + 1 == count;
        let length = state.length_m(model, j);
        let kept = &state.eliminations[j];
        let link = &mut state.links[j];
        let drive = turn * kept.bending + kept.axis * (kept.twisting * dot(&kept.axis, &turn));
        turn = kept.inverse.mul_vec(&(kept.residual - mul_transposed(&kept.coupling, &dx) + drive));
        if base {
            totals.force_on_guide -= mul(&base_wrench.1, &turn);
            totals.moment_on_guide +=
                turn * kept.bending + kept.axis * (kept.twisting * dot(&kept.axis, &turn));
        }
        let swung = dx + cross(&turn, &kept.lever);
        let stretch =
            kept.stretch_gain - dot(&kept.stretch_pull, &swung) - dot(&kept.stretch_turn, &turn);
        dx = swung + link.tangent * stretch;

        let predicted = link.position;
        let [at_node, at_middle] = core::array::from_fn(|i| {
            let touch = &kept.touches[i];
            let force = touch.resolve(&dx, &turn, &mut link.memory[i], scheme.last);
            totals.force_on_instrument += force;
            totals.outside |= touch.outside;
            totals.moment_on_instrument += cross(&(predicted + touch.arm - mouth), &force);
            force
        });
        // The middle's force is shared by the two nodes of the link; the guide has none.
        let shared = if base { v } else { at_middle * half };
        link.force = at_node + (at_middle - shared);

        link.rotation = link.rotation.turned(&(turn * half));
        link.tangent = link.rotation.tangent();
        link.strain += stretch
            / maximum(length, model.description().solver.link_length_m * T::lit(SHORTEST_BASE));
        position += link.tangent * (length * (T::one() + link.strain));
        link.displacement += position - predicted;
        link.position = position;
        link.turn += turn;
        if scheme.last {
            link.velocity = link.displacement * inverse_dt;
            link.rate += (link.turn * inverse_dt - link.rate) * scheme.predictor_gain;
        }
        totals.largest_turn_squared = maximum(dot(&turn, &turn), totals.largest_turn_squared);
        if let Some(proximal) = state.links.get_mut(j + 1) {
            proximal.force += shared;
        }
    }
    totals
}
