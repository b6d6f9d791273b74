//! The wall that a sample point of the instrument sees.

use cathforce_scalar::Vector3;

use crate::Real;

/// Where one sample point is, and the wall that it sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proximity<T: Real> {
    /// From the link's distal node to the point of the surface that is next to the wall \[m\].
    pub arm: Vector3<T>,
    /// Normal into the lumen.
    pub normal: Vector3<T>,
    /// From the surface to the wall, negative if it is indented \[m\].
    pub gap: T,
    /// The wall's stiffness over the nominal one.
    pub stiffness: T,
    /// Where the wall was last looked up, and how far it was from there \[m\].
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
