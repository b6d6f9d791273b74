//! Where two instruments lie in the one chain, and how they slide along it.     docs/model.md §6

use crate::Real;
use crate::grid::Grid;
use crate::math::{maximum, minimum};
use crate::segments::{AxialPosition, InstrumentRole};

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
