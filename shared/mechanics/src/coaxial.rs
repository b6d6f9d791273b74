//! A guidewire inside the catheter: both share one chain of links. This file makes the chain's tables,
//! and gives the radius and the slip of the instrument that the wall touches at each sample.

use cathforce_scalar::{Pack, Vector3};

use crate::effects::active::Law;
use crate::effects::driven_tendons::TendonCell;
use crate::effects::relaxation::Springs;
use crate::grid::Grid;
use crate::joint::JointLoad;
use crate::overlap::{Overlap, Slide};
use crate::scheme::Scheme;
use crate::segments::{Segments, Walk};
use crate::state::State;
use crate::tables::{Joint, Tables};
use crate::{Model, Real};

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Tables of the joints and links in this step.
    pub(crate) fn tables<'a>(&'a self, model: &'a Model<T, LINKS>) -> &'a Tables<T, LINKS> {
        if model.guidewire.is_some() { &self.coaxial_tables } else { &model.tables }
    }

    /// Walk along both instruments from the chain's tip; `wire`: the model's guidewire.
    pub(crate) fn walk<'a>(
        &self,
        model: &'a Model<T, LINKS>,
        wire: &'a Segments<T>,
    ) -> Walk<'a, T> {
        let Overlap { catheter, wire: placed, .. } = self.overlap;
        Walk::new((&model.catheter, catheter), Some((wire, placed)))
    }

    /// Fills the tables of the chain for the present positions of the instruments. While no link is
    /// inside the vessel, the first one is filled, because the mouth has a joint even then.
    /// docs/explanation/model.md (24)
    pub(crate) fn fill_coaxial_tables(&mut self, model: &Model<T, LINKS>) {
        if let Some(wire) = &model.guidewire {
            let walk = self.walk(model, wire);
            self.coaxial_tables.fill(self.count.clamp(1, LINKS), &model.grid, walk);
        }
    }
}

/// The law of a chain of two instruments, on top of the law of the effects.
pub(crate) struct Coaxial<'a, T, L> {
    effects: &'a mut L,
    overlap: Overlap<T>,
    /// As `sliding` of [`MotionRatio`](crate::drive_motion::MotionRatio).
    sliding: [T; 2],
    grid: Grid<T>,
    /// Radius of the catheter minus the guidewire's \[m\].
    step_m: T,
}

impl<'a, T: Real, L: Law<T>> Coaxial<'a, T, L> {
    /// `None` without a guidewire.
    pub fn new<const LINKS: usize>(
        model: &Model<T, LINKS>,
        overlap: &Overlap<T>,
        scheme: &Scheme<T>,
        effects: &'a mut L,
    ) -> Option<Self> {
        let description = model.description();
        let wire = description.guidewire.as_ref()?;
        Some(Self {
            effects,
            overlap: *overlap,
            sliding: scheme.sliding,
            grid: model.grid,
            step_m: description.instrument.outer_radius_m - wire.outer_radius_m,
        })
    }

    fn catheter_coverage(&self, sample: usize) -> T {
        self.overlap.catheter_coverage(sample, &self.grid)
    }
}

impl<T: Real, L: Law<T>> Law<T> for Coaxial<'_, T, L> {
    const RELAXES: bool = L::RELAXES;
    const COAXIAL: bool = true;

    #[inline(always)]
    fn radius(&self, sample: usize, catheter_m: T) -> T {
        catheter_m - self.step_m * (T::one() - self.catheter_coverage(sample))
    }

    #[inline(always)]
    fn slide(&self, sample: usize) -> Slide<T> {
        let covered = self.catheter_coverage(sample);
        let bare = T::one() - covered;
        let Overlap { catheter_slid_m, wire_slid_m, wire_rolled_rad, .. } = self.overlap;
        Slide {
            along_m: catheter_slid_m * covered + wire_slid_m * bare,
            turn_rad: wire_rolled_rad * bare,
            ratio_to_last: self.sliding[0] * covered + self.sliding[1] * bare,
        }
    }

    #[inline(always)]
    fn wall<N: Pack<T>>(
        &self,
        position: &Vector3<N>,
        distance_m: N,
        normal: Vector3<N>,
    ) -> (N, Vector3<N>) {
        self.effects.wall(position, distance_m, normal)
    }

    #[inline(always)]
    fn indentation_response<N: Pack<T>>(&self, indented: N, slope: N, relaxed: N) -> (N, N, N) {
        self.effects.indentation_response(indented, slope, relaxed)
    }

    #[inline(always)]
    fn friction<N: Pack<T>>(&self, nominal: N, normal_n: N, arc_m: N) -> N {
        self.effects.friction(nominal, normal_n, arc_m)
    }

    #[inline(always)]
    fn fluid_force<N: Pack<T>>(
        &self,
        tangent: &Vector3<N>,
        distance: impl FnOnce() -> N,
    ) -> Option<Vector3<N>> {
        self.effects.fluid_force(tangent, distance)
    }

    #[inline(always)]
    fn vessel_motion(&self) -> Option<[Vector3<T>; 2]> {
        self.effects.vessel_motion()
    }

    #[inline(always)]
    fn has_tendons(&self) -> bool {
        self.effects.has_tendons()
    }

    #[inline(always)]
    fn load_joint(
        &mut self,
        index: usize,
        joint: &Joint<T>,
        bend: &Vector3<T>,
        axes: &[Vector3<T>; 2],
        cells: &[TendonCell<T>],
        load: &mut JointLoad<T>,
    ) {
        self.effects.load_joint(index, joint, bend, axes, cells, load);
    }

    #[inline(always)]
    fn joint<const LINKS: usize>(
        &mut self,
        index: usize,
        nominal: &Joint<T>,
        bend: &Vector3<T>,
        springs: Option<&Springs<T, LINKS>>,
    ) -> Joint<T> {
        self.effects.joint(index, nominal, bend, springs)
    }
}
