//! A guidewire inside the catheter: where the two lie in the one chain, which of them the wall
//! touches, and how that one slides.     docs/model.md §6

use cathforce_scalar::{Pack, Vector3};

use crate::effects::active::Law;
use crate::grid::Grid;
use crate::model::{maximum, minimum};
use crate::segments::{AxialPosition, InstrumentRole, Segments, Walk};
use crate::solve::Scheme;
use crate::state::State;
use crate::tables::{Joint, Tables};
use crate::{Model, Real};

/// How the two instruments lie in the chain, and how they slide along it in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overlap<T> {
    pub catheter: AxialPosition<T>,
    pub wire: AxialPosition<T>,
    /// Feed of each less the chain's \[m\].
    pub catheter_slid_m: T,
    pub wire_slid_m: T,
    /// Turn of the wire against the catheter \[rad\].
    pub wire_rolled_rad: T,
}

impl<T: Real> Overlap<T> {
    pub const fn new() -> Self {
        let o = T::ZERO;
        Self {
            catheter: AxialPosition::leading(),
            wire: AxialPosition::leading(),
            catheter_slid_m: o,
            wire_slid_m: o,
            wire_rolled_rad: o,
        }
    }

    /// The one that does not lead: it slides in or on the chain. Where the tips meet, it is the
    /// wire.
    pub fn follower(&self) -> InstrumentRole {
        if self.catheter.behind_m > T::zero() {
            InstrumentRole::Catheter
        } else {
            InstrumentRole::Guidewire
        }
    }

    /// Share of a sample that the catheter covers.     docs/model.md (40)
    ///
    /// Its end stands for a cone of half a link of the shaft, so that no sample jumps as it passes.
    pub fn catheter_coverage(&self, sample: usize, grid: &Grid<T>) -> T {
        let behind = self.catheter.behind_m / (grid.link_length_m * T::lit(0.5));
        let covered = grid.sample(sample) * T::int(2) + T::one() - behind;
        minimum(maximum(covered, T::zero()), T::one())
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Joints and links as they are in this step.
    pub(crate) fn tables<'a>(&'a self, model: &'a Model<T, LINKS>) -> &'a Tables<T, LINKS> {
        if model.guidewire.is_some() { &self.coaxial_tables } else { &model.tables }
    }

    /// Both instruments from the chain's tip on; `wire` is the model's.
    pub(crate) fn walk<'a>(
        &self,
        model: &'a Model<T, LINKS>,
        wire: &'a Segments<T>,
    ) -> Walk<'a, T> {
        let Overlap { catheter, wire: placed, .. } = self.overlap;
        Walk::new((&model.catheter, catheter), Some((wire, placed)))
    }

    /// Makes the tables of the chain as the instruments lie in it now, and of the first link where
    /// none is out of the guide: its mouth has a joint then too.     docs/model.md (39)
    pub(crate) fn fill_coaxial_tables(&mut self, model: &Model<T, LINKS>) {
        if let Some(wire) = &model.guidewire {
            let walk = self.walk(model, wire);
            self.coaxial_tables.fill(self.count.clamp(1, LINKS), &model.grid, walk);
        }
    }
}

/// How the surface at a sample moves against the chain in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slide<T> {
    /// Along the chain, towards its tip \[m\].
    pub along_m: T,
    /// About its tangent \[rad\].
    pub turn_rad: T,
    /// What it will slide of what it slid in the last step.
    pub ratio_to_last: T,
}

/// The law of a chain of two instruments, over that of its effects.
pub(crate) struct Coaxial<'a, T, L> {
    effects: &'a mut L,
    overlap: Overlap<T>,
    /// As [`MotionRatio::sliding`](crate::pace::Paced).
    sliding: [T; 2],
    grid: Grid<T>,
    /// Radius of the catheter less the wire's \[m\].
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
    fn joint(&mut self, index: usize, nominal: &Joint<T>, bend: &Vector3<T>) -> Joint<T> {
        self.effects.joint(index, nominal, bend)
    }
}
