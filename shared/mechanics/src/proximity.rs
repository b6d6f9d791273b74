//! The wall that a sample point of the instrument sees.

use cathforce_scalar::{Number, Vector3};

use crate::Real;

/// One sample point, and the wall next to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proximity<T: Number> {
    /// From the link's distal node to the point of the surface next to the wall \[m\].
    pub arm: Vector3<T>,
    /// Unit normal into the lumen.
    pub normal: Vector3<T>,
    /// Distance from the surface to the wall; negative when the wall is indented \[m\].
    pub gap: T,
    /// Stiffness of the wall over the nominal one \[1\].
    pub stiffness: T,
    /// Position of the centre line when the wall was last sampled, and its distance then \[m\].
    pub sampled_at: Vector3<T>,
    pub distance: T,
}

impl<T: Real> Proximity<T> {
    pub const fn none() -> Self {
        let v = T::ORIGIN;
        let far = T::ONE;
        Self { arm: v, normal: v, gap: far, stiffness: T::ZERO, sampled_at: v, distance: far }
    }
}
