//! Articulated-body wrench: what everything distal to a point of the instrument exerts on it, linear
//! in the point's motion:
//!
//! F = f − A δx − B δφ,  M = m − Bᵀ δx − C δφ.     docs/explanation/model.md (14)

use cathforce_scalar::{Blend, Number, Vector3};

use crate::Loads;
use crate::algebra::{LdltFactor, Matrix3, Sym3, reload_barrier};
use crate::contact::LinearContact;
use crate::proximity::Proximity;
use crate::state::{Elimination, LinkLoads, Stretch};

/// The linear wrench of everything distal to a point.
#[derive(Clone)]
pub(crate) struct Wrench<T: Number> {
    pub force: Vector3<T>,
    pub moment: Vector3<T>,
    a: Sym3<T>,
    b: Matrix3<T>,
    c: Sym3<T>,
}

impl<T: Number> Wrench<T> {
    /// At the tip: the external loads, without stiffness.
    pub fn beyond_tip(loads: &Loads<T>) -> Self {
        Self {
            force: Vector3::from(loads.tip_force_n),
            moment: Vector3::from(loads.tip_moment_n_m),
            a: Sym3::nothing(),
            b: Matrix3::nothing(),
            c: Sym3::nothing(),
        }
    }

    /// Adds the loads of a link, and the stiffness of the contacts at its node and at its middle.
    /// docs/explanation/model.md (15), (16)
    ///
    /// The arm of the contact at the node is parallel to its normal, so c = a × n = 0 there.
    #[inline(always)]
    pub fn add_loads(
        &mut self,
        loads: &LinkLoads<T>,
        seen: &[Proximity<T>; 2],
        contacts: &[LinearContact<T>; 2],
    ) {
        reload_barrier();
        let ([at_node, at_middle], [node, middle]) = (seen, contacts);
        let (node_arm, middle_arm) = (&at_node.arm, &at_middle.arm);
        self.force += loads.force;
        self.moment += loads.moment;
        // A += k_s I + p n nᵀ
        self.a.add_identity(loads.stiffness);
        self.a.add_outer(&(at_node.normal * node.normal_excess), &at_node.normal);
        let middle_normal_excess = at_middle.normal * middle.normal_excess;
        self.a.add_outer(&middle_normal_excess, &at_middle.normal);
        // B += −k_s [a] + p n cᵀ
        let turned = middle_arm.cross(&at_middle.normal);
        self.b.add_outer(&middle_normal_excess, &turned);
        self.c.add_outer(&(turned * middle.normal_excess), &turned);
        let (node_held, middle_held) =
            (node_arm * node.tangential_stiffness, middle_arm * middle.tangential_stiffness);
        self.b.sub_cross(&(node_held + middle_held));
        // C += k_s (|a|² I − a aᵀ) + p c cᵀ
        self.c.add_identity(node_held.dot(node_arm) + middle_held.dot(middle_arm));
        self.c.sub_outer(&node_held, node_arm);
        self.c.sub_outer(&middle_held, middle_arm);
    }

    /// Eliminates the link's stretch along `tangent`.     docs/explanation/model.md (17)
    #[inline(always)]
    pub fn eliminate_stretch(
        &mut self,
        tangent: &Vector3<T>,
        stiffness: T,
        tension: T,
        elimination: &mut Elimination<T>,
    ) {
        reload_barrier();
        let alpha = self.a.mul_vec(tangent);
        let beta = self.b.mul_transposed(tangent);
        let inverse = T::lit(1.0) / (stiffness + tangent.dot(&alpha).positive());
        let (by_displacement, by_rotation) = (alpha * inverse, beta * inverse);
        let gain = self.force.dot(tangent) - tension;
        self.force -= by_displacement * gain;
        self.moment -= by_rotation * gain;
        self.a.sub_outer(&by_displacement, &alpha);
        self.b.sub_outer(&by_displacement, &beta);
        self.c.sub_outer(&by_rotation, &beta);
        elimination.stretch = Stretch { free: gain * inverse, by_displacement, by_rotation };
    }

    /// From the distal to the proximal end of a link.     docs/explanation/model.md (18)
    #[inline(always)]
    pub fn shift(&mut self, tangent: &Vector3<T>, length: T) {
        reload_barrier();
        let lever = tangent * length;
        self.moment = self.moment.plus_cross(&lever, &self.force);
        let tension = lever.dot(&self.force).positive();
        self.c.add_identity(tension);
        self.c.sub_outer(&(tangent * tension), tangent);
        self.c.add_cross_product_transposed(&lever, &self.b);
        self.b.sub_product_cross(&self.a, &lever);
        self.c.add_cross_product(&lever, &self.b);
    }

    /// Eliminates the rotation of the link distal to a joint.     docs/explanation/model.md (19)
    ///
    /// Schur complement of D = C + K = L Δ Lᵀ, with Z = B L⁻ᵀ and X = K L⁻ᵀ, column by column.
    #[inline(always)]
    pub fn eliminate_joint(&mut self, elimination: &mut Elimination<T>) {
        reload_barrier();
        let d = self.c.plus(&elimination.joint.stiffness);
        let factor = LdltFactor::new(&d, elimination.joint.smallest_eigenvalue);
        elimination.factor = factor;
        // f −= Z Δ⁻¹ s, A −= Z Δ⁻¹ Zᵀ
        let s = factor.forward((self.moment - elimination.joint.moment).into());
        let z = factor.forward(self.b.columns());
        let mut by_displacement = z;
        let mut turn = s;
        for i in 0..3 {
            turn[i] = turn[i] * factor.inverse[i];
            by_displacement[i] *= factor.inverse[i];
            self.force -= z[i] * turn[i];
            self.a.sub_outer(&by_displacement[i], &z[i]);
        }
        elimination.turn = turn.into();
        elimination.by_displacement = Matrix3::from_columns(&by_displacement);
        reload_barrier();
        // m = μ + X Δ⁻¹ s, B = Z Δ⁻¹ Xᵀ, C = K − X Δ⁻¹ Xᵀ
        let k = elimination.joint.stiffness;
        let x = elimination.factor.forward(k.columns());
        (self.moment, self.c) = (elimination.joint.moment, k);
        let mut by_rotation = x;
        for i in 0..3 {
            by_rotation[i] *= elimination.factor.inverse[i];
            self.moment += x[i] * turn[i];
            self.c.sub_outer(&by_rotation[i], &x[i]);
        }
        elimination.by_rotation = Matrix3::from_columns(&by_rotation);
        let z = &by_displacement;
        self.b = Matrix3::outer(&z[0], &x[0]);
        self.b.add_outer(&z[1], &x[1]);
        self.b.add_outer(&z[2], &x[2]);
    }
}

impl<T: Number> Blend<T> for Wrench<T> {
    #[inline(always)]
    fn blend(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self {
            force: Blend::blend(mask, yes.force, no.force),
            moment: Blend::blend(mask, yes.moment, no.moment),
            a: Blend::blend(mask, yes.a, no.a),
            b: Blend::blend(mask, yes.b, no.b),
            c: Blend::blend(mask, yes.c, no.c),
        }
    }
}
