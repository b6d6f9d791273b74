//! Effects in the recursion. They cost the nominal model nothing, because the solve is compiled once
//! for [`Nominal`] and once for [`ActiveEffects`], and each step chooses one of them.

use cathforce_scalar::{Catheters, Pack, Vector3};

use super::driven_tendons::{DrivenTendons, TendonCell};
use super::fluid::FluidForce;
use super::relaxation::Springs;
use super::tendon::TendonBend;
use super::wall_law::WallLaw;
use crate::Real;
use crate::grid::Grid;
use crate::joint::JointLoad;
use crate::math::{maximum, minimum};
use crate::overlap::Slide;
use crate::tables::Joint;

/// Smallest torsional over bending stiffness of the joint at the entry. Single precision still resolves
/// both in one matrix.
const SOFTEST_TWIST: f64 = 1e-5;

/// Places in a solve where effects may act. The defaults change nothing.
pub(crate) trait Law<S: Catheters> {
    /// The wall relaxes, so contacts keep the indentation to which it has relaxed.
    const RELAXES: bool = false;
    /// Two instruments share the chain, so radius and slip differ between samples.
    const COAXIAL: bool = false;

    /// Outer radius at a sample \[m\]. A sample is the node of link `sample / 2` if even, else its middle.
    #[inline(always)]
    fn radius(&self, _sample: usize, catheter_m: S) -> S {
        catheter_m
    }

    /// Motion of the surface at a sample relative to the chain in this step.
    #[inline(always)]
    fn slide(&self, _sample: usize) -> Slide<S> {
        Slide { along_m: S::lit(0.0), turn_rad: S::lit(0.0), ratio_to_last: S::lit(1.0) }
    }

    /// Distance \[m\] and normal of the wall at a point, from those of the nominal wall.
    #[inline(always)]
    fn wall<N: Pack<S>>(
        &self,
        _position: &Vector3<N>,
        distance_m: N,
        normal: Vector3<N>,
    ) -> (N, Vector3<N>) {
        (distance_m, normal)
    }

    /// Elastic response of the wall to an indentation \[m\].
    ///
    /// `slope`: derivative of the nominal force over stiffness \[1\]; `relaxed`: indentation to which
    /// the wall had relaxed \[m\]. Returns elastic force over stiffness \[m\], its derivative \[1\], and the
    /// new relaxed indentation \[m\].
    #[inline(always)]
    fn indentation_response<N: Pack<S>>(&self, indented: N, slope: N, _relaxed: N) -> (N, N, N) {
        (indented, slope, N::lit(0.0))
    }

    /// Friction coefficient of a sample, from the nominal one. `normal_n`: normal force in the last solve
    /// \[N\]; `arc_m`: tributary length \[m\].
    #[inline(always)]
    fn friction<N: Pack<S>>(&self, nominal: N, _normal_n: N, _arc_m: N) -> N {
        nominal
    }

    /// Force of the fluid per length at a node \[N/m\]; `None` without flow. `distance`: to the wall \[m\].
    #[inline(always)]
    fn fluid_force<N: Pack<S>>(
        &self,
        _tangent: &Vector3<N>,
        _distance: impl FnOnce() -> N,
    ) -> Option<Vector3<N>> {
        None
    }

    /// Motion of the mouth relative to the vessel's frame: displacement in this step \[m\] and velocity in
    /// the last one \[m/s\]; `None` if the vessel never moves.
    #[inline(always)]
    fn vessel_motion(&self) -> Option<[Vector3<S>; 2]> {
        None
    }

    /// There are tendons that drives pull.
    #[inline(always)]
    fn has_tendons(&self) -> bool {
        false
    }

    /// Adds the tendons to the load of a joint. Joints are visited from the tip to the guide.
    ///
    /// `joint`, `bend`: as of [`Law::joint`]; `axes`: up and side halfway between the joint's links.
    #[inline(always)]
    fn load_joint(
        &mut self,
        _index: usize,
        _joint: &Joint<S>,
        _bend: &Vector3<S>,
        _axes: &[Vector3<S>; 2],
        _cells: &[TendonCell<S>],
        _load: &mut JointLoad<S>,
    ) {
    }

    /// The joint at the proximal end of link `index`, which is rotated by `bend`, material axes \[rad\].
    ///
    /// `springs`: `None` for catheters abreast, which have no effects.
    #[inline(always)]
    fn joint<const LINKS: usize>(
        &mut self,
        _index: usize,
        nominal: &Joint<S>,
        _bend: &Vector3<S>,
        _springs: Option<&Springs<S, LINKS>>,
    ) -> Joint<S> {
        *nominal
    }
}

/// No effect in the recursion.
pub(crate) struct Nominal;

impl<S: Catheters> Law<S> for Nominal {}

/// The effects with the constants of one step.
pub(crate) struct ActiveEffects<'a, T: Real> {
    pub wall: WallLaw<T>,
    pub fluid: Option<FluidForce<T>>,
    pub tendon: Option<TendonBend<T>>,
    pub tendons: Option<DrivenTendons<'a, T>>,
    /// Stiffness after softening, over the nominal one \[1\].
    pub softness: T,
    pub vessel_motion: [Vector3<T>; 2],
    pub straightened: Option<Straightened<T>>,
    pub windup: Windup<T>,
}

/// The arc past the mouth along which the pre-curvature comes back.     docs/explanation/model.md (43)
pub(crate) struct Straightened<T> {
    pub grid: Grid<T>,
    /// Arc from the mouth to the present node of the recursion \[link lengths\].
    pub past_mouth: T,
    /// Link length over the arc along which the pre-curvature comes back \[1\].
    pub per_link: T,
}

/// Torsional wind-up of the shaft behind the entry plane.     docs/explanation/model.md (44)
pub(crate) struct Windup<T> {
    /// Torsional compliance of the shaft \[rad/(N·m)\].
    pub compliance: T,
    /// Present twist of the shaft \[rad\].
    pub wound_rad: T,
    /// Index of the joint at the entry.
    pub entry: usize,
    /// Its arc over that of its full cell \[1\].
    pub guide_cell: T,
    /// Its actual torsional stiffness over the one that the solve uses, 0 to 1.
    pub twisting: T,
}

impl<T: Real> Windup<T> {
    /// Puts the shaft in series with the joint, which is rotated by `bend` \[rad\].
    fn add_shaft(&mut self, bend: &Vector3<T>, joint: &mut Joint<T>) {
        let cell_torsion = joint.torsion / self.guide_cell;
        joint.torsion /= T::one() + cell_torsion * self.compliance;
        joint.unloaded.subtract_z(self.wound_rad / self.guide_cell);
        let softest = joint.bending * T::lit(SOFTEST_TWIST);
        if joint.torsion < softest {
            // A stiffer joint with the same moment at the present twist.
            self.twisting = joint.torsion / softest;
            let turned = bend.z() / self.guide_cell;
            let strain = (turned - joint.unloaded.z()) * self.twisting;
            let [up, side, _] = joint.unloaded.into();
            joint.unloaded = Vector3::new(up, side, turned - strain);
            joint.torsion = softest;
        }
    }
}

impl<T: Real> Law<T> for ActiveEffects<'_, T> {
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

    #[inline(always)]
    fn has_tendons(&self) -> bool {
        self.tendons.is_some()
    }

    fn load_joint(
        &mut self,
        index: usize,
        joint: &Joint<T>,
        bend: &Vector3<T>,
        axes: &[Vector3<T>; 2],
        cells: &[TendonCell<T>],
        load: &mut JointLoad<T>,
    ) {
        if let (Some(tendons), Some(cell)) = (&mut self.tendons, cells.get(index)) {
            tendons.load_joint(index, joint, bend, axes, cell, load);
        }
    }

    fn joint<const LINKS: usize>(
        &mut self,
        index: usize,
        nominal: &Joint<T>,
        bend: &Vector3<T>,
        springs: Option<&Springs<T, LINKS>>,
    ) -> Joint<T> {
        let mut joint = *nominal;
        joint.bending *= self.softness;
        joint.torsion *= self.softness;
        if let Some(Straightened { grid, past_mouth, per_link }) = &mut self.straightened {
            *past_mouth -= grid.link(index);
            joint.unloaded *= minimum(maximum(*past_mouth * *per_link, T::zero()), T::one());
        }
        if let Some(springs) = springs {
            springs.add_to(index, &mut joint);
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
