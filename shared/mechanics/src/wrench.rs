//! The wrench that everything beyond a point of the instrument exerts on it, kept linear in
//! the point's motion:
//!
//! F = f − A δx − B δφ,  M = m − Bᵀ δx − C δφ.     docs/model.md (5)

use nalgebra::{Matrix3, Vector3};

use crate::algebra::{
    Factor, Sym3, add_outer, cross, dot, mul_transposed, outer, plus_cross, read_here, sub_cross,
    sub_outer, sub_product_cross,
};
use crate::contact::Touch;
use crate::proximity::Proximity;
use crate::state::{Elimination, LinkLoads, Stretch};
use crate::{Loads, Real};

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

    /// The loads of a link, and the stiffness of its contacts at its node and at its
    /// middle.     docs/model.md (14), (15)
    ///
    /// The arm of a contact at the node is along its normal: c = a × n = 0.
    #[inline(always)]
    pub fn add_loads(
        &mut self,
        loads: &LinkLoads<T>,
        seen: &[Proximity<T>; 2],
        touches: &[Touch<T>; 2],
    ) {
        read_here();
        let ([at_node, at_middle], [node, middle]) = (seen, touches);
        let (node_arm, middle_arm) = (&at_node.arm, &at_middle.arm);
        self.force += loads.force;
        self.moment += loads.moment;
        // A += k_s I + p n nᵀ
        self.a.add_identity(loads.stiffness);
        self.a.add_outer(&(at_node.normal * node.push), &at_node.normal);
        let middle_push = at_middle.normal * middle.push;
        self.a.add_outer(&middle_push, &at_middle.normal);
        // B += −k_s [a] + p n cᵀ
        let turned = cross(middle_arm, &at_middle.normal);
        add_outer(&mut self.b, &middle_push, &turned);
        self.c.add_outer(&(turned * middle.push), &turned);
        let (node_held, middle_held) = (node_arm * node.stick, middle_arm * middle.stick);
        sub_cross(&mut self.b, &(node_held + middle_held));
        // C += k_s (|a|² I − a aᵀ) + p c cᵀ
        self.c.add_identity(dot(&node_held, node_arm) + dot(&middle_held, middle_arm));
        self.c.sub_outer(&node_held, node_arm);
        self.c.sub_outer(&middle_held, middle_arm);
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
        read_here();
        let alpha = self.a.mul_vec(tangent);
        let beta = mul_transposed(&self.b, tangent);
        let inverse = T::one() / (stiffness + dot(tangent, &alpha).positive()).root();
        let (pull, turn) = (alpha * inverse, beta * inverse);
        let gain = (dot(&self.force, tangent) - tension) * inverse;
        self.force -= pull * gain;
        self.moment -= turn * gain;
        self.a.sub_square(&pull);
        sub_outer(&mut self.b, &pull, &turn);
        self.c.sub_square(&turn);
        kept.stretch = Stretch { gain, pull, turn, inverse };
    }

    /// From the distal to the proximal end of a link.     docs/model.md (7)
    #[inline(always)]
    pub fn shift(&mut self, tangent: &Vector3<T>, length: T) {
        read_here();
        let lever = tangent * length;
        self.moment = plus_cross(&self.moment, &lever, &self.force);
        self.c.add_cross_product_transposed(&lever, &self.b);
        sub_product_cross(&mut self.b, &self.a, &lever);
        self.c.add_cross_product(&lever, &self.b);
        let pull = dot(&lever, &self.force).positive();
        self.c.add_identity(pull);
        self.c.sub_outer(&(tangent * pull), tangent);
    }

    /// Eliminates the rotation of the link distal to a joint.     docs/model.md (8)
    ///
    /// With D = C + K = L Δ Lᵀ, Z = B L⁻ᵀ and X = K L⁻ᵀ, column by column.
    #[inline(always)]
    pub fn pass_joint(&mut self, kept: &mut Elimination<T>) {
        read_here();
        let d = self.c.plus(&kept.joint.stiffness);
        let factor = Factor::new(&d, kept.joint.smallest);
        kept.factor = factor;
        // f −= Z Δ⁻¹ s, A −= Z Δ⁻¹ Zᵀ
        let s = factor.forward((self.moment - kept.joint.moment).into());
        let z = factor.forward([0, 1, 2].map(|i| self.b.column(i).into_owned()));
        for (i, z) in z.iter().enumerate() {
            kept.turn[i] = s[i] * factor.inverse[i];
            kept.by_displacement[i] = z * factor.inverse[i];
            self.force -= z * kept.turn[i];
            self.a.sub_outer(&kept.by_displacement[i], z);
        }
        read_here();
        // m = μ + X Δ⁻¹ s, B = Z Δ⁻¹ Xᵀ, C = K − X Δ⁻¹ Xᵀ
        let k = kept.joint.stiffness;
        let x = kept.factor.forward(k.columns());
        (self.moment, self.c) = (kept.joint.moment, k);
        for (i, x) in x.iter().enumerate() {
            kept.by_turn[i] = x * kept.factor.inverse[i];
            self.moment += x * kept.turn[i];
            self.c.sub_outer(&kept.by_turn[i], x);
        }
        let z = &kept.by_displacement;
        self.b = outer(&z[0], &x[0]);
        add_outer(&mut self.b, &z[1], &x[1]);
        add_outer(&mut self.b, &z[2], &x[2]);
    }
}
