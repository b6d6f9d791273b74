//! Drag of the fluid.     docs/explanation/model.md (45)

use cathforce_scalar::Vector3;

use super::FluidDrag;
use crate::Real;
use crate::math::{maximum, minimum, sin_cos};

/// The flow in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FluidForce<T: Real> {
    /// Force per length in mid-stream, along the instrument and as a vector of which the part across it
    /// acts \[N/m\].
    along: T,
    across: Vector3<T>,
    /// Inverse of the distance from the wall at which the flow is fastest \[1/m\].
    inverse_radius: T,
}

impl<T: Real> FluidForce<T> {
    /// `turns`: phase of the pulse \[periods\].
    pub fn new(drag: &FluidDrag<T>, turns: T) -> Self {
        let (sin, _) = sin_cos(turns * T::lit(core::f64::consts::TAU) + drag.phase_rad);
        let now = T::one() + drag.pulse_ratio * sin;
        Self {
            along: drag.along_n_per_m * now,
            across: Vector3::new(drag.x_n_per_m, drag.y_n_per_m, drag.z_n_per_m) * now,
            inverse_radius: T::one() / drag.lumen_radius_m,
        }
    }

    /// Force per length at a point of the instrument \[N/m\]; `distance_m`: to the wall.
    pub fn force(&self, tangent: &Vector3<T>, distance_m: T) -> Vector3<T> {
        let x = minimum(maximum(distance_m * self.inverse_radius, T::zero()), T::one());
        let profile = x * (T::lit(2.0) - x);
        let across = self.across - tangent * tangent.dot(&self.across);
        (across + tangent * self.along) * profile
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_is_parabolic_and_pulses() {
        let mut drag = FluidDrag::off();
        drag.along_n_per_m = 0.1;
        drag.z_n_per_m = 0.2;
        drag.pulse_ratio = 0.5;
        drag.lumen_radius_m = 4e-3;
        let tangent = Vector3::new(0.6, 0.0, 0.8);
        let at =
            |turns, distance_m| FluidForce::<f64>::new(&drag, turns).force(&tangent, distance_m);
        assert_eq!(at(0.0, 0.0).norm(), 0.0);
        let middle = at(0.0, 4e-3);
        assert!((middle.dot(&tangent) - 0.1).abs() < 1e-12);
        assert!((middle - tangent * 0.1 - Vector3::new(-0.096, 0.0, 0.072)).norm() < 1e-12);
        assert!((at(0.0, 2e-3) - middle * 0.75).norm() < 1e-12);
        assert!((at(0.25, 1.0) - middle * 1.5).norm() < 1e-9);
    }
}
