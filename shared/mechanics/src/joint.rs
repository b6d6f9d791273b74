//! The elastic joints between links.

use cathforce_scalar::{Number, Real, Vector3};

use crate::algebra::{RelativeRotation, Sym3};
use crate::tables::Joint;

/// Moment and stiffness of a joint at the predicted state, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointLoad<T: Number> {
    /// μ
    pub moment: Vector3<T>,
    /// K
    pub stiffness: Sym3<T>,
    /// Its smallest eigenvalue.
    pub smallest_eigenvalue: T,
}

/// The arc that a joint at the base link stands for.
pub(crate) struct Cell<T> {
    /// Over that of the joint's full cell.
    share: T,
    /// One over it.
    inverse_share: T,
    /// What its bend counts: more than once where bent arc has left it in this step.
    bend_factor: T,
    twist_factor: T,
    /// Viscous over elastic stiffness, of bending and of twist.
    viscous: T,
    twist_viscous: T,
}

impl<T: Number> Cell<T> {
    /// `withdrawn` is the arc that has left it in this step; `damping` τ/dt, the viscous time over the
    /// time of a step, of bending and of twist.
    pub fn new(length: T, full: T, withdrawn: T, [bending, twist]: [T; 2]) -> Self {
        let withdrawn = withdrawn / (length + withdrawn);
        let left = T::lit(1.0) - withdrawn;
        Self {
            share: length / full,
            inverse_share: full / length,
            bend_factor: T::lit(1.0) + withdrawn * bending,
            twist_factor: T::lit(1.0) + withdrawn * twist,
            viscous: left * bending,
            twist_viscous: left * twist,
        }
    }
}

impl<T: Real> JointLoad<T> {
    pub const fn none() -> Self {
        Self { moment: T::ORIGIN, stiffness: Sym3::zero(), smallest_eigenvalue: T::ZERO }
    }
}

impl<T: Number> JointLoad<T> {
    /// The moment that a joint with a full cell exerts against its bend; `viscous` is τ/dt and what
    /// its distal link has turned more than its proximal one since the step began, if bending is
    /// viscous.     docs/model.md (4)
    #[inline(always)]
    pub fn new(
        joint: &Joint<T>,
        bend: &RelativeRotation<T>,
        viscous: Option<(T, &Vector3<T>)>,
    ) -> Self {
        let Joint { bending: mut kb, torsion: kt, .. } = *joint;
        let strain = bend.angle - joint.unloaded;
        let mut moment =
            bend.rotate_midway(&Vector3::new(kb * strain.x(), kb * strain.y(), kt * strain.z()));
        let t = bend.midway_tangent();
        if let Some((damping, turned)) = viscous {
            let against = turned * (kb * damping);
            moment += against - t * t.dot(&against);
            kb = kb + kb * damping;
        }
        Self::stiff(moment, &t, kb, kt)
    }

    /// The same of a joint whose cell is not full.
    pub fn at_base(
        joint: &Joint<T>,
        cell: &Cell<T>,
        bend: &RelativeRotation<T>,
        turned: &Vector3<T>,
    ) -> Self {
        let [kb, kt] = [joint.bending, joint.torsion].map(|k| k * cell.inverse_share);
        let bend_factor = Vector3::new(cell.bend_factor, cell.bend_factor, cell.twist_factor);
        let strain = bend.angle.component_mul(&bend_factor) - joint.unloaded * cell.share;
        let moment =
            bend.rotate_midway(&Vector3::new(kb * strain.x(), kb * strain.y(), kt * strain.z()));
        let t = bend.midway_tangent();
        let (viscous, twist_viscous) = (kb * cell.viscous, kt * cell.twist_viscous);
        let moment = moment + *turned * viscous + t * ((twist_viscous - viscous) * t.dot(turned));
        Self::stiff(
            moment,
            &t,
            kb * cell.bend_factor + viscous,
            kt * cell.twist_factor + twist_viscous,
        )
    }

    #[inline(always)]
    fn stiff(moment: Vector3<T>, t: &Vector3<T>, bending: T, twist: T) -> Self {
        let mut stiffness = Sym3::outer(&(t * (twist - bending)), t);
        stiffness.add_identity(bending);
        Self { moment, stiffness, smallest_eigenvalue: bending.smaller(twist) }
    }
}
