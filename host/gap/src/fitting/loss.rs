//! What a residual costs: the square of what is small, and less than that of what is far off.
//!
//! A snap that comes a quarter of a second late, or a whip that ends elsewhere, leaves residuals of ten
//! and more standard deviations in a few samples. Their squares would decide alone where a fit goes and
//! which effect is named, though of the size of an effect they say next to nothing. So whitened
//! residuals r are compared by Charbonnier's loss (1994), the smooth form of Huber's (1964),
//!
//! > ρ(r) = 2c² (√(1 + r²/c²) − 1),   w(r) = ρ′/2r = 1/√(1 + r²/c²)
//!
//! The sum of ρ is minimised by weighted least squares (Holland and Welsch 1977): to first order, a
//! step lowers Σ w r² with the weights that the residuals have before it. φ = sign(r) √ρ is what a residual
//! counts for in energies.
//!
//! A drive has no snaps, but friction that turns over where it turns, in some milliseconds of which no
//! position tells the course: there residuals are hundreds of standard deviations of a good sensor.

use crate::plant::Plant;

/// φ of a plant.
#[derive(Clone, Copy, Debug)]
pub struct Loss {
    /// c; infinite where residuals count with their squares.
    far: f64,
}

impl Loss {
    pub fn of(plant: &dyn Plant) -> Self {
        Self::beyond(plant.far_off())
    }

    /// With this c.
    pub fn beyond(far: f64) -> Self {
        Self { far }
    }

    /// Of differences that are small.
    pub const SQUARES: Self = Self { far: f64::INFINITY };

    /// φ(r) and √w(r).
    ///
    /// See docs/explanation/diagnosis.md (D4).
    pub fn of_residual(self, r: f64) -> (f64, f64) {
        let c = self.far;
        let root = (1.0 + (r / c).powi(2)).sqrt();
        // ρ = 2r²/(root + 1), which does not cancel where r is small.
        (r * (2.0 / (root + 1.0)).sqrt(), root.recip().sqrt())
    }

    /// The r of a φ.
    pub fn residual(self, phi: f64) -> f64 {
        phi * (1.0 + (phi / (2.0 * self.far)).powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_small_costs_its_square_and_what_is_far_off_grows_with_its_size() {
        let loss = Loss::beyond(3.0);
        let cost = |r: f64| loss.of_residual(r).0.powi(2);
        assert!((cost(0.3) / 0.09 - 1.0).abs() < 0.01);
        let (near, far) = (cost(1000.0), cost(2000.0));
        assert!((far / near - 2.0).abs() < 0.01, "{}", far / near);
        for r in [-40.0, -3.0, -1e-9, 0.0, 0.5, 7.0] {
            let (phi, root_weight) = loss.of_residual(r);
            assert!((loss.residual(phi) - r).abs() < 1e-9 * (1.0 + r.abs()), "{r}");
            let slope = (cost(r + 1e-6) - cost(r - 1e-6)) / 2e-6;
            assert!((slope - 2.0 * root_weight.powi(2) * r).abs() < 1e-4, "{r}");
        }
        assert_eq!(Loss::SQUARES.of_residual(40.0), (40.0, 1.0));
        assert_eq!(Loss::SQUARES.residual(40.0), 40.0);
    }
}
