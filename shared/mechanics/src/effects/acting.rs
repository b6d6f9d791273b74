//! Where effects enter the recursion. The nominal model pays nothing for them: a solve is
//! made for each of [`Nominal`] and [`Acting`], and one is chosen once a step.

use cathforce_scalar::Vector3;

use super::pull::Pull;
use super::stream::Stream;
use super::wall_law::{Slid, WallLaw};
use crate::Real;
use crate::coaxial::Slide;
use crate::model::{maximum, minimum};
use crate::tables::Joint;

/// What a solve asks at each place where an effect may act; by default nothing changes.
pub(crate) trait Law<T: Real> {
    /// The wall remembers what it has relaxed to.
    const RELAXES: bool = false;
    /// Two instruments share the chain: radius and slide differ from sample to sample.
    const COAXIAL: bool = false;

    /// Outer radius at the sample `halves` half link lengths from the tip \[m\].
    #[inline(always)]
    fn radius(&self, _halves: usize, catheter_m: T) -> T {
        catheter_m
    }

    /// How the surface at that sample moves against the chain in this step.
    #[inline(always)]
    fn slide(&self, _halves: usize) -> Slide<T> {
        Slide { along_m: T::zero(), turn_rad: T::zero() }
    }

    /// Distance and normal of the wall seen from a point.
    #[inline(always)]
    fn wall(&self, _position: &Vector3<T>, distance_m: T, normal: Vector3<T>) -> (T, Vector3<T>) {
        (distance_m, normal)
    }

    /// Elastic force over the stiffness, its slope, and what the wall has relaxed to, for an
    /// indentation \[m\] with its slope and what it had relaxed to.
    #[inline(always)]
    fn indentation(&self, indented: T, slope: T, _relaxed: T) -> (T, T, T) {
        (indented, slope, T::zero())
    }

    /// Friction coefficient of a sample with this nominal stiffness \[N/m\].
    #[inline(always)]
    fn friction(&self, nominal: T, _slid: impl FnOnce() -> Slid<T>, _stiffness: T) -> T {
        nominal
    }

    /// Force of the fluid per length at a node; `None` where there is no stream.
    #[inline(always)]
    fn stream(&self, _tangent: &Vector3<T>, _distance: impl FnOnce() -> T) -> Option<Vector3<T>> {
        None
    }

    /// The joint at the proximal end of link `index`, bent by `bend` \[rad\], material.
    #[inline(always)]
    fn joint(&mut self, _index: usize, nominal: &Joint<T>, _bend: &Vector3<T>) -> Joint<T> {
        *nominal
    }
}

/// No effect in the recursion.
pub(crate) struct Nominal;

impl<T: Real> Law<T> for Nominal {}

/// The effects with the constants of one step.
pub(crate) struct Acting<T: Real> {
    pub wall: WallLaw<T>,
    pub stream: Option<Stream<T>>,
    pub pull: Option<Pull<T>>,
    /// Stiffness that softening has left, over the nominal one.
    pub softness: T,
    /// Insertion, and one over the arc past the mouth that is straightened, over link lengths;
    /// `None` if none is.
    pub straightened: Option<(T, T)>,
    /// Torsional compliance behind the entry plane \[rad/(N·m)\], its wind-up \[rad\], and the
    /// joint at the entry.
    pub windup: (T, T, usize),
    /// Over link lengths: arc of the joint at the entry.
    pub guide_cell: T,
}

impl<T: Real> Law<T> for Acting<T> {
    const RELAXES: bool = true;

    fn wall(&self, position: &Vector3<T>, distance_m: T, normal: Vector3<T>) -> (T, Vector3<T>) {
        self.wall.narrowed(position, distance_m, normal)
    }

    fn indentation(&self, indented: T, slope: T, relaxed: T) -> (T, T, T) {
        if slope <= T::zero() {
            // A wall that is not touched is at rest, and does not pull.
            return (T::zero(), T::zero(), T::zero());
        }
        let (lasting, lasting_slope) = self.wall.stiffened(indented, slope);
        let (fading, fading_slope, relaxed) = self.wall.relaxing(indented, slope, relaxed);
        (lasting + fading, lasting_slope + fading_slope, relaxed)
    }

    fn friction(&self, nominal: T, slid: impl FnOnce() -> Slid<T>, stiffness: T) -> T {
        nominal * self.wall.friction(&slid(), stiffness)
    }

    fn stream(&self, tangent: &Vector3<T>, distance: impl FnOnce() -> T) -> Option<Vector3<T>> {
        self.stream.as_ref().map(|stream| stream.force(tangent, distance()))
    }

    fn joint(&mut self, index: usize, nominal: &Joint<T>, bend: &Vector3<T>) -> Joint<T> {
        let mut joint = *nominal;
        joint.bending *= self.softness;
        joint.torsion *= self.softness;
        if let Some((insertion, per_link)) = self.straightened {
            // Joint j lies j + 1 links from the tip.     docs/model.md (33)
            let past_mouth = insertion - T::int(index as i32 + 1);
            joint.unloaded *= minimum(maximum(past_mouth * per_link, T::zero()), T::one());
        }
        if let Some(pull) = &mut self.pull {
            pull.pass(index, bend, &mut joint);
        }
        let (compliance, wound_rad, entry) = self.windup;
        if index == entry && compliance > T::zero() {
            // In series with the shaft behind the entry plane.     docs/model.md (37)
            let cell_torsion = joint.torsion / self.guide_cell;
            joint.torsion /= T::one() + cell_torsion * compliance;
            joint.unloaded.take_z(wound_rad / self.guide_cell);
        }
        joint
    }
}
