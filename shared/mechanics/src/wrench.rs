//! The wrench that everything beyond a point of the instrument exerts on it, kept linear in
//! the point's motion:
//!
//! F = f − A δx − B δφ,  M = m − Bᵀ δx − C δφ.     docs/model.md (5)

use nalgebra::{Matrix3, Vector3};

use crate::algebra::{
    Factors, Sym3, add_outer, cross, dot, minus_mul, minus_mul_transposed, mul, mul_transposed,
    plus_cross, sub_cross, sub_outer, sub_product_cross,
};
use crate::contact::Touch;
use crate::joint::JointLoad;
use crate::model::{maximum, minimum};
use crate::proximity::Proximity;
use crate::state::Elimination;
use crate::{Loads, Real};

/// Share of a wall's stiffness that stands against every motion of a point that touches it:
/// what rounding takes from A in one direction must not turn it negative across.
const ROUNDING: f64 = 1e-6;

/// The linear wrench of everything distal to a point.
pub(crate) struct Wrench<T: Real> {
    pub force: Vector3<T>,
    pub moment: Vector3<T>,
    a: Sym3<T>,
    b: Matrix3<T>,
    c: Sym3<T>,
}

impl<T: Real> Wrench<T> {
    /// Beyond the tip: what pulls on it from outside, without stiffness.
    pub fn beyond_tip(loads: &Loads<T>) -> Self {
        Self {
            force: Vector3::from(loads.tip_force_n),
            moment: Vector3::from(loads.tip_moment_n_m),
            a: Sym3::zero(),
            b: Matrix3::zeros(),
            c: Sym3::zero(),
        }
    }

    /// A force at the node with isotropic stiffness, and the contacts of a link at its node and
    /// at its middle.     docs/model.md (14), (15)
    ///
    /// The arm of a contact at the node is along its normal: c = a × n = 0.
    #[inline(always)]
    pub fn add_node(
        &mut self,
        force: &Vector3<T>,
        stiffness: T,
        seen: &[Proximity<T>; 2],
        touches: &[Touch<T>; 2],
    ) {
        let ([at_node, at_middle], [node, middle]) = (seen, touches);
        let (node_arm, middle_arm) = (&at_node.arm, &at_middle.arm);
        self.force += force + node.force + middle.force;
        self.moment = plus_cross(&self.moment, node_arm, &node.force);
        self.moment = plus_cross(&self.moment, middle_arm, &middle.force);
        // A += k_s I + p n nᵀ
        let kept_positive = (node.push + middle.push) * T::lit(ROUNDING);
        self.a.add_identity(stiffness + kept_positive + node.stick + middle.stick);
        let (node_push, middle_push) = (at_node.normal * node.push, at_middle.normal * middle.push);
        self.a.add_outer(&node_push, &at_node.normal);
        self.a.add_outer(&middle_push, &at_middle.normal);
        // B += −k_s [a] + p n cᵀ
        let (node_held, middle_held) = (node_arm * node.stick, middle_arm * middle.stick);
        let turned = cross(middle_arm, &at_middle.normal);
        sub_cross(&mut self.b, &(node_held + middle_held));
        add_outer(&mut self.b, &middle_push, &turned);
        // C += k_s (|a|² I − a aᵀ) + p c cᵀ
        self.c.add_identity(dot(&node_held, node_arm) + dot(&middle_held, middle_arm));
        self.c.sub_outer(&node_held, node_arm);
        self.c.sub_outer(&middle_held, middle_arm);
        self.c.add_outer(&(turned * middle.push), &turned);
    }

    /// Eliminates the link's stretch along `tangent`.     docs/model.md (6)
    #[inline(always)]
    pub fn add_stretch(
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
        let (pull, turn) = (alpha * inverse, beta * inverse);
        self.a.sub_outer(&pull, &alpha);
        sub_outer(&mut self.b, &pull, &beta);
        self.c.sub_outer(&turn, &beta);
        kept.stretch_gain = gain;
        kept.stretch_pull = pull;
        kept.stretch_turn = turn;
    }

    /// From the distal to the proximal end of a link.     docs/model.md (7)
    #[inline(always)]
    pub fn shift(&mut self, tangent: &Vector3<T>, length: T) {
        let lever = tangent * length;
        let at_node = self.b;
        sub_product_cross(&mut self.b, &self.a, &lever);
        self.c.add_cross_products(&lever, &self.b, &at_node);
        let pull = maximum(dot(&lever, &self.force), T::zero());
        self.c.add_identity(pull);
        self.c.sub_outer(&(tangent * pull), tangent);
        self.moment = plus_cross(&self.moment, &lever, &self.force);
    }

    /// Eliminates the rotation of the link distal to a joint.     docs/model.md (8)
    #[inline(always)]
    pub fn pass_joint(&mut self, joint: &JointLoad<T>, kept: &mut Elimination<T>) {
        let JointLoad { moment, axis, bending: kb, twisting: kt } = joint;
        let smallest = minimum(*kb, *kb + *kt);
        let twist = axis * *kt;
        let mut d = self.c;
        d.add_identity(*kb);
        d.add_outer(&twist, axis);
        let factors = Factors::new(&d, smallest);
        let inverse = factors.inverse();
        // Z = B L⁻ᵀ, W = Z Δ⁻¹ of D = L Δ Lᵀ, Y = W L⁻¹
        let columns = [0, 1, 2].map(|i| self.b.column(i).into_owned());
        let z = factors.forward(columns);
        let w = factors.scale(z);
        let y = Matrix3::from_columns(&factors.backward(w));
        let (z, w) = (Matrix3::from_columns(&z), Matrix3::from_columns(&w));
        let scaled = factors.scale(factors.forward((self.moment - moment).into()));
        let turn = Vector3::from(factors.backward(scaled));
        // P = D⁻¹ K
        let mut p = inverse.scaled(*kb);
        add_outer(&mut p, &inverse.mul_vec(&twist), axis);

        self.force = minus_mul(&self.force, &z, &scaled.into());
        self.moment = moment + turn * *kb + twist * dot(axis, &turn);
        self.a.sub_product_transposed(&w, &z);
        // B ← Y K
        self.b = y * *kb;
        add_outer(&mut self.b, &mul(&y, &twist), axis);
        // C ← K (I − P)
        let rest = minus_mul_transposed(axis, &p, axis);
        self.c = Sym3 {
            xx: *kb * (T::one() - p.m11) + twist.x * rest.x,
            xy: twist.x * rest.y - *kb * p.m12,
            xz: twist.x * rest.z - *kb * p.m13,
            yy: *kb * (T::one() - p.m22) + twist.y * rest.y,
            yz: twist.y * rest.z - *kb * p.m23,
            zz: *kb * (T::one() - p.m33) + twist.z * rest.z,
        };
        kept.turn = turn;
        kept.by_displacement = y;
        kept.by_turn = p;
    }
}
