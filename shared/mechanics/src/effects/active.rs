//! Where effects enter the recursion. The nominal model pays nothing for them: a solve is
//! made for each of [`Nominal`] and [`ActiveEffects`], and one is chosen once a step.

use cathforce_scalar::{Pack, Vector3};

use super::fluid::FluidForce;
use super::tendon::TendonBend;
use super::wall_law::WallLaw;
use crate::Real;
use crate::coaxial::Slide;
use crate::grid::Grid;
use crate::model::{maximum, minimum};
use crate::tables::Joint;

/// Softest twist of the joint at the entry, over its bending, that single precision keeps beside
/// that in one matrix.
const SOFTEST_TWIST: f64 = 1e-5;

/// What a solve asks at each place where an effect may act; by default nothing changes.
pub(crate) trait Law<T: Real> {
    /// The wall remembers what it has relaxed to.
    const RELAXES: bool = false;
    /// Two instruments share the chain: radius and slide differ from sample to sample.
    const COAXIAL: bool = false;

    /// Outer radius at a sample \[m\]: the node of link `sample / 2`, or its middle.
    #[inline(always)]
    fn radius(&self, _sample: usize, catheter_m: T) -> T {
        catheter_m
    }

    /// How the surface at that sample moves against the chain in this step.
    #[inline(always)]
    fn slide(&self, _sample: usize) -> Slide<T> {
        Slide { along_m: T::zero(), turn_rad: T::zero(), ratio_to_last: T::one() }
    }

    /// Distance and normal of the wall seen from a point.
    #[inline(always)]
    fn wall<N: Pack<T>>(
        &self,
        _position: &Vector3<N>,
        distance_m: N,
        normal: Vector3<N>,
    ) -> (N, Vector3<N>) {
        (distance_m, normal)
    }

    /// Elastic force over the stiffness, its slope, and what the wall has relaxed to, for an
    /// indentation \[m\] with its slope and what it had relaxed to.
    #[inline(always)]
    fn indentation_response<N: Pack<T>>(&self, indented: N, slope: N, _relaxed: N) -> (N, N, N) {
        (indented, slope, N::lit(0.0))
    }

    /// Friction coefficient of a sample with this normal force in the last tick \[N\], which stands
    /// for a piece of this length \[m\].
    #[inline(always)]
    fn friction<N: Pack<T>>(&self, nominal: N, _normal_n: N, _arc_m: N) -> N {
        nominal
    }

    /// Force of the fluid per length at a node; `None` where there is no stream.
    #[inline(always)]
    fn fluid_force<N: Pack<T>>(
        &self,
        _tangent: &Vector3<N>,
        _distance: impl FnOnce() -> N,
    ) -> Option<Vector3<N>> {
        None
    }

    /// How far the vessel carried the frame in which is computed, over the rig's, in this step and per
    /// time in the last one \[m, m/s\]; `None` of one that never moves.
    #[inline(always)]
    fn vessel_motion(&self) -> Option<[Vector3<T>; 2]> {
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
pub(crate) struct ActiveEffects<T: Real> {
    pub wall: WallLaw<T>,
    pub fluid: Option<FluidForce<T>>,
    pub tendon: Option<TendonBend<T>>,
    /// Stiffness that softening has left, over the nominal one.
    pub softness: T,
    pub vessel_motion: [Vector3<T>; 2],
    pub straightened: Option<Straightened<T>>,
    pub windup: Windup<T>,
}

/// The arc past the mouth whose pre-curve has not come back.     docs/model.md (33)
pub(crate) struct Straightened<T> {
    pub grid: Grid<T>,
    /// From the mouth to the node that the sweep has come to, over link lengths.
    pub past_mouth: T,
    /// Link length over that arc.
    pub per_link: T,
}

/// The shaft behind the entry plane, which twists.     docs/model.md (37)
pub(crate) struct Windup<T> {
    /// Torsional \[rad/(N·m)\].
    pub compliance: T,
    /// How far it is wound up \[rad\].
    pub wound_rad: T,
    /// The joint at the entry.
    pub entry: usize,
    /// Its arc, over that of its full cell.
    pub guide_cell: T,
    /// Of what the solve sees of its torsional stiffness, the share that is its own.
    pub twisting: T,
}

impl<T: Real> Windup<T> {
    /// Puts the shaft in series with the joint, which bends by `bend`.
    fn add_shaft(&mut self, bend: &Vector3<T>, joint: &mut Joint<T>) {
        let cell_torsion = joint.torsion / self.guide_cell;
        joint.torsion /= T::one() + cell_torsion * self.compliance;
        joint.unloaded.subtract_z(self.wound_rad / self.guide_cell);
        let softest = joint.bending * T::lit(SOFTEST_TWIST);
        if joint.torsion < softest {
            // The same moment, held against what the solve turns.
            self.twisting = joint.torsion / softest;
            let turned = bend.z() / self.guide_cell;
            let strain = (turned - joint.unloaded.z()) * self.twisting;
            let [up, side, _] = joint.unloaded.into();
            joint.unloaded = Vector3::new(up, side, turned - strain);
            joint.torsion = softest;
        }
    }
}

impl<T: Real> Law<T> for ActiveEffects<T> {
    const RELAXES: bool = true;

    #[inline(always)]
    fn wall<N: Pack<T>>(
        &self,
        position: &Vector3<N>,
        distance_m: N,
        normal: Vector3<N>,
    ) -> (N, Vector3<N>) {
        let (positions, normals) = (N::split_vectors(*position), N::split_vectors(normal));
        let walls = N::per_lane(|lane| {
            self.wall.narrowed(&positions[lane], distance_m.lane(lane), normals[lane])
        });
        (N::from_lanes(|lane| walls[lane].0), N::gather_vectors(|lane| walls[lane].1))
    }

    #[inline(always)]
    fn indentation_response<N: Pack<T>>(&self, indented: N, slope: N, relaxed: N) -> (N, N, N) {
        let walls = N::per_lane(|lane| {
            self.wall.elastic_response(indented.lane(lane), slope.lane(lane), relaxed.lane(lane))
        });
        let each = |of: fn(&(T, T, T)) -> T| N::from_lanes(|lane| of(&walls[lane]));
        (each(|wall| wall.0), each(|wall| wall.1), each(|wall| wall.2))
    }

    #[inline(always)]
    fn friction<N: Pack<T>>(&self, nominal: N, normal_n: N, arc_m: N) -> N {
        N::from_lanes(|lane| {
            nominal.lane(lane) * self.wall.friction(normal_n.lane(lane), arc_m.lane(lane))
        })
    }

    #[inline(always)]
    fn fluid_force<N: Pack<T>>(
        &self,
        tangent: &Vector3<N>,
        distance: impl FnOnce() -> N,
    ) -> Option<Vector3<N>> {
        let fluid = self.fluid.as_ref()?;
        let (tangents, distance) = (N::split_vectors(*tangent), distance());
        Some(N::gather_vectors(|lane| fluid.force(&tangents[lane], distance.lane(lane))))
    }

    #[inline(always)]
    fn vessel_motion(&self) -> Option<[Vector3<T>; 2]> {
        Some(self.vessel_motion)
    }

    fn joint(&mut self, index: usize, nominal: &Joint<T>, bend: &Vector3<T>) -> Joint<T> {
        let mut joint = *nominal;
        joint.bending *= self.softness;
        joint.torsion *= self.softness;
        if let Some(Straightened { grid, past_mouth, per_link }) = &mut self.straightened {
            *past_mouth -= grid.link(index);
            joint.unloaded *= minimum(maximum(*past_mouth * *per_link, T::zero()), T::one());
        }
        if let Some(tendon) = &mut self.tendon {
            tendon.bend_joint(index, bend, &mut joint);
        }
        if index == self.windup.entry && self.windup.compliance > T::zero() {
            self.windup.add_shaft(bend, &mut joint);
        }
        joint
    }
}
