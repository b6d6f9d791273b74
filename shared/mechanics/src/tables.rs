//! Elastic properties of joints and links.     docs/explanation/model.md (2), (24)

use cathforce_scalar::{Gather, Number, Vector3};

use crate::Real;
use crate::grid::Grid;
use crate::segments::Walk;

/// Elastic properties of one joint, over the full cell around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint<T: Number> {
    /// Bending stiffness 1/∫ds/EI \[N·m/rad\].
    pub bending: T,
    /// Torsional stiffness 1/∫ds/GJ \[N·m/rad\].
    pub torsion: T,
    /// Rotation of the unloaded cell ∫κ₀ ds, material axes (up, side, tangent) \[rad\].
    pub unloaded: Vector3<T>,
}

impl<N: Number> Joint<N> {
    /// Gathers those of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a Joint<S>) -> Self
    where
        N: Gather<S>,
    {
        Self {
            bending: N::from_lanes(|lane| of(lane).bending),
            torsion: N::from_lanes(|lane| of(lane).torsion),
            unloaded: N::gather_vectors(|lane| of(lane).unloaded),
        }
    }
}

impl<T: Real> Joint<T> {
    /// Twice the elastic energy of a rotation from the unloaded state \[J\].
    pub fn energy(&self, turn: &Vector3<T>) -> T {
        self.bending * (turn.x() * turn.x() + turn.y() * turn.y())
            + self.torsion * turn.z() * turn.z()
    }

    const fn nothing() -> Self {
        Self { bending: T::ZERO, torsion: T::ZERO, unloaded: T::ORIGIN }
    }
}

/// Properties of one link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<T> {
    /// Mean axial stiffness, length/∫ds/EA \[N\].
    pub axial: T,
    /// Mass \[kg\].
    pub mass: T,
}

impl<T: Real> Link<T> {
    const fn nothing() -> Self {
        Self { axial: T::ZERO, mass: T::ZERO }
    }
}

/// Joints and links of a chain, from its tip on.
#[derive(Clone, Debug)]
pub(crate) struct Tables<T: Number, const LINKS: usize> {
    /// For link j: the joint at its proximal end.
    pub joints: [Joint<T>; LINKS],
    /// Link j, from joint j + 1 to node j.
    pub links: [Link<T>; LINKS],
}

impl<T: Real, const LINKS: usize> Tables<T, LINKS> {
    /// Tables without stiffness and mass.
    pub const fn new() -> Self {
        Self { joints: [Joint::nothing(); LINKS], links: [Link::nothing(); LINKS] }
    }

    /// Resets to [`Tables::new`] in place.
    pub fn reset(&mut self) {
        self.joints.iter_mut().for_each(|joint| *joint = Joint::nothing());
        self.links.iter_mut().for_each(|link| *link = Link::nothing());
    }

    /// Fills the first `count` links and their joints; `walk`: at the chain's tip.
    pub fn fill(&mut self, count: usize, grid: &Grid<T>, mut walk: Walk<'_, T>) {
        let h = grid.link_length_m;
        let mut distal_half = walk.integral_to(h * grid.middle(0));
        for (j, (link, joint)) in
            self.links.iter_mut().zip(&mut self.joints).take(count).enumerate()
        {
            let proximal_half = walk.integral_to(h * grid.node(j + 1));
            let piece = distal_half + proximal_half;
            *link = Link { axial: grid.link_m(j) / piece.axial_compliance, mass: piece.mass };
            distal_half = walk.integral_to(h * grid.middle(j + 1));
            let cell = proximal_half + distal_half;
            *joint = Joint {
                bending: T::one() / cell.bending_compliance,
                torsion: T::one() / cell.torsion_compliance,
                unloaded: cell.unloaded,
            };
        }
    }
}
