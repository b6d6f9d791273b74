//! The elastic joints between links.

use cathforce_scalar::{Blend, Number, Real, Vector3};

use crate::algebra::{RelativeRotation, Sym3};
use crate::tables::Joint;

/// Moment and stiffness of a joint at the predicted state, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointLoad<T: Number> {
    /// μ \[N·m\].
    pub moment: Vector3<T>,
    /// K \[N·m/rad\].
    pub stiffness: Sym3<T>,
    /// Smallest eigenvalue of K \[N·m/rad\].
    pub smallest_eigenvalue: T,
}

/// Cell of a joint at the base link, which is not a full cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell<T> {
    /// Its arc over that of the full cell \[1\].
    share: T,
    /// Inverse of `share`.
    inverse_share: T,
    /// Factors on the bend and the twist in the moment: above 1 where bent arc has left the cell in
    /// this step, because bend that leaves with its arc is no change of curvature.
    bend_factor: T,
    twist_factor: T,
    /// Viscous over elastic stiffness, of bending and of twist \[1\].
    viscous: T,
    twist_viscous: T,
}

impl<T: Number> Cell<T> {
    /// `length`, `full`: arcs of the cell and of the full cell \[m\]; `withdrawn`: arc that has left the
    /// cell in this step \[m\]; the last: τ/dt of bending and of twist \[1\].
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

// A device has one catheter.
#[cfg(not(target_os = "none"))]
impl<N: Number> Cell<N> {
    /// Gathers those of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a Cell<S>) -> Self
    where
        N: cathforce_scalar::Gather<S>,
    {
        Self {
            share: N::from_lanes(|lane| of(lane).share),
            inverse_share: N::from_lanes(|lane| of(lane).inverse_share),
            bend_factor: N::from_lanes(|lane| of(lane).bend_factor),
            twist_factor: N::from_lanes(|lane| of(lane).twist_factor),
            viscous: N::from_lanes(|lane| of(lane).viscous),
            twist_viscous: N::from_lanes(|lane| of(lane).twist_viscous),
        }
    }
}

impl<S: Number> Blend<S> for Cell<S> {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        let of = |yes, no| S::choose(mask, yes, no);
        Self {
            share: of(yes.share, no.share),
            inverse_share: of(yes.inverse_share, no.inverse_share),
            bend_factor: of(yes.bend_factor, no.bend_factor),
            twist_factor: of(yes.twist_factor, no.twist_factor),
            viscous: of(yes.viscous, no.viscous),
            twist_viscous: of(yes.twist_viscous, no.twist_viscous),
        }
    }
}

impl<S: Number> Blend<S> for JointLoad<S> {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            moment: Blend::blend(mask, yes.moment, no.moment),
            stiffness: Blend::blend(mask, yes.stiffness, no.stiffness),
            smallest_eigenvalue: S::choose(mask, yes.smallest_eigenvalue, no.smallest_eigenvalue),
        }
    }
}

impl<T: Real> JointLoad<T> {
    pub const fn none() -> Self {
        Self { moment: T::ORIGIN, stiffness: Sym3::zero(), smallest_eigenvalue: T::ZERO }
    }
}

impl<T: Number> JointLoad<T> {
    /// Moment and stiffness of a joint with a full cell.     docs/explanation/model.md (8)
    ///
    /// `viscous`: τ/dt \[1\], and the rotation of the distal minus that of the proximal link since the
    /// step began \[rad\]; `None` if bending is not viscous.
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

    /// Moment and stiffness of a joint whose cell is not full.
    #[cfg_attr(not(target_arch = "arm"), inline(always))]
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
