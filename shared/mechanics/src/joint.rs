//! The elastic joints between links.

use cathforce_scalar::{Number, Pack, Real, Vector3};

use crate::algebra::{Bend, Sym3};
use crate::tables::Joint;

/// Moment and stiffness of a joint at the predicted state, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointLoad<T: Number> {
    /// μ
    pub moment: Vector3<T>,
    /// K
    pub stiffness: Sym3<T>,
    /// Its smallest eigenvalue.
    pub smallest: T,
}

/// The arc that a joint stands for.
pub(crate) struct Cell<T> {
    /// Over that of the joint's full cell.
    share: T,
    /// One over it.
    inverse_share: T,
    /// Damped over elastic stiffness, of bending and of twist.
    stiffening: T,
    twist_stiffening: T,
    /// Viscous bending and twist per that of a full cell at the step's start.
    memory: T,
    twist_memory: T,
}

impl<T: Number> Cell<T> {
    /// `damping` is τ/dt, the viscous time over the time of a step, of bending and of twist.
    pub fn new(length: T, full: T, [bending, twist]: [T; 2]) -> Self {
        let share = length / full;
        Self {
            share,
            inverse_share: full / length,
            stiffening: T::lit(1.0) + bending,
            twist_stiffening: T::lit(1.0) + twist,
            memory: share * bending,
            twist_memory: share * twist,
        }
    }
}

impl<N: Number> Cell<N> {
    /// Those of some lanes side by side.
    #[inline(always)]
    pub fn side_by_side<'a, T: Real>(of: impl Fn(usize) -> &'a Cell<T>) -> Self
    where
        N: Pack<T>,
    {
        let cells = N::lanes(of);
        Self {
            share: N::each(|lane| cells[lane].share),
            inverse_share: N::each(|lane| cells[lane].inverse_share),
            stiffening: N::each(|lane| cells[lane].stiffening),
            twist_stiffening: N::each(|lane| cells[lane].twist_stiffening),
            memory: N::each(|lane| cells[lane].memory),
            twist_memory: N::each(|lane| cells[lane].twist_memory),
        }
    }
}

impl<T: Real> JointLoad<T> {
    pub const fn none() -> Self {
        Self { moment: T::ORIGIN, stiffness: Sym3::zero(), smallest: T::ZERO }
    }
}

impl<T: Number> JointLoad<T> {
    /// The moment that a joint exerts against its bend; `before` is what that was over a full cell
    /// when the step began, if bending is viscous.     docs/model.md (4)
    #[inline(always)]
    pub fn new(
        joint: &Joint<T>,
        cell: &Cell<T>,
        bend: &Bend<T>,
        before: Option<&Vector3<T>>,
    ) -> Self {
        let kb = joint.bending * cell.inverse_share;
        let kt = joint.torsion * cell.inverse_share;
        let stiffening = Vector3::new(cell.stiffening, cell.stiffening, cell.twist_stiffening);
        let mut strain = bend.angle.times(&stiffening) - joint.unloaded * cell.share;
        if let Some(before) = before {
            strain -= before.times(&Vector3::new(cell.memory, cell.memory, cell.twist_memory));
        }
        let moment =
            bend.rotate_midway(&Vector3::new(kb * strain.x(), kb * strain.y(), kt * strain.z()));
        let t = bend.midway_tangent();
        let bending = kb * cell.stiffening;
        let twist = kt * cell.twist_stiffening;
        let mut stiffness = Sym3::outer(&(t * (twist - bending)), &t);
        stiffness.add_identity(bending);
        Self { moment, stiffness, smallest: bending.smaller(twist) }
    }
}
