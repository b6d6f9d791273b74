//! The wrench that everything beyond a point of the instrument exerts on it, kept linear in
//! the point's motion:
//!
//! F = f − A δx − B δφ,  M = m − Bᵀ δx − C δφ.     docs/model.md (5)

use cathforce_scalar::Vector3;

use crate::algebra::{Factor, Matrix3, Sym3, read_here};
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
        let turned = middle_arm.cross(&at_middle.normal);
        self.b.add_outer(&middle_push, &turned);
        self.c.add_outer(&(turned * middle.push), &turned);
        let (node_held, middle_held) = (node_arm * node.stick, middle_arm * middle.stick);
        self.b.sub_cross(&(node_held + middle_held));
        // C += k_s (|a|² I − a aᵀ) + p c cᵀ
        self.c.add_identity(node_held.dot(node_arm) + middle_held.dot(middle_arm));
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
        let beta = self.b.mul_transposed(tangent);
        let inverse = T::one() / (stiffness + tangent.dot(&alpha).positive());
        let (pull, turn) = (alpha * inverse, beta * inverse);
        let gain = self.force.dot(tangent) - tension;
        self.force -= pull * gain;
        self.moment -= turn * gain;
        self.a.sub_outer(&pull, &alpha);
        self.b.sub_outer(&pull, &beta);
        self.c.sub_outer(&turn, &beta);
        kept.stretch = Stretch { free: gain * inverse, pull, turn };
    }

    /// From the distal to the proximal end of a link.     docs/model.md (7)
    #[inline(always)]
    pub fn shift(&mut self, tangent: &Vector3<T>, length: T) {
        read_here();
        let lever = tangent * length;
        self.moment = self.moment.plus_cross(&lever, &self.force);
        let pull = lever.dot(&self.force).positive();
        self.c.add_identity(pull);
        self.c.sub_outer(&(tangent * pull), tangent);
        self.c.add_cross_product_transposed(&lever, &self.b);
        self.b.sub_product_cross(&self.a, &lever);
        self.c.add_cross_product(&lever, &self.b);
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
        let z = factor.forward(self.b.columns());
        let mut by_displacement = z;
        let mut turn = s;
        for i in 0..3 {
            turn[i] *= factor.inverse[i];
            by_displacement[i] *= factor.inverse[i];
            self.force -= z[i] * turn[i];
            self.a.sub_outer(&by_displacement[i], &z[i]);
        }
        kept.turn = turn.into();
        kept.by_displacement = Matrix3::from_columns(&by_displacement);
        read_here();
        // m = μ + X Δ⁻¹ s, B = Z Δ⁻¹ Xᵀ, C = K − X Δ⁻¹ Xᵀ
        let k = kept.joint.stiffness;
        let x = kept.factor.forward(k.columns());
        (self.moment, self.c) = (kept.joint.moment, k);
        let mut by_turn = x;
        for i in 0..3 {
            by_turn[i] *= kept.factor.inverse[i];
            self.moment += x[i] * turn[i];
            self.c.sub_outer(&by_turn[i], &x[i]);
        }
        kept.by_turn = Matrix3::from_columns(&by_turn);
        let z = &by_displacement;
        self.b = Matrix3::outer(&z[0], &x[0]);
        self.b.add_outer(&z[1], &x[1]);
        self.b.add_outer(&z[2], &x[2]);
    }
}
