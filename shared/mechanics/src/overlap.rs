//! Where two instruments lie in the one chain, and how they slide along it.

use crate::Real;
use crate::grid::Grid;
use crate::math::{maximum, minimum};
use crate::segments::{AxialPosition, InstrumentRole};

/// Positions of the two instruments in the chain, and their motion along it in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overlap<T> {
    pub catheter: AxialPosition<T>,
    pub wire: AxialPosition<T>,
    /// Feed of each instrument minus the feed of the chain \[m\].
    pub catheter_slid_m: T,
    pub wire_slid_m: T,
    /// Rotation of the guidewire relative to the catheter in the step \[rad\].
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

    /// The instrument whose tip is behind the other's: it slides along the chain. The guidewire if both
    /// tips are level.
    pub fn follower(&self) -> InstrumentRole {
        if self.catheter.behind_m > T::zero() {
            InstrumentRole::Catheter
        } else {
            InstrumentRole::Guidewire
        }
    }

    /// Share of a sample that the catheter covers, 0 to 1.     docs/explanation/model.md (25)
    ///
    /// The catheter's end is represented by a cone half a link long, so that the radius at a sample
    /// changes continuously as the end passes it.
    pub fn catheter_coverage(&self, sample: usize, grid: &Grid<T>) -> T {
        let behind = self.catheter.behind_m / (grid.link_length_m * T::lit(0.5));
        let covered = grid.sample(sample) * T::int(2) + T::one() - behind;
        minimum(maximum(covered, T::zero()), T::one())
    }
}

/// Motion of the surface at a sample relative to the chain in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slide<T> {
    /// Displacement along the chain, towards its tip \[m\].
    pub along_m: T,
    /// Rotation about its tangent \[rad\].
    pub turn_rad: T,
    /// Expected slip over the slip in the last step \[1\].
    pub ratio_to_last: T,
}
