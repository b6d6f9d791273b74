//! Laws that remember: branches that relax, and friction that follows the speed late.

/// A spring that relaxes beside the one that stays; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relaxing {
    /// Its stiffness over that of the spring that stays \[1\].
    pub ratio: f64,
    /// Time in which its force falls to 1/e \[s\].
    pub time_s: f64,
}

/// Branches of a wall or a joint; three of them resemble a power law over two decades of time.
pub const BRANCHES: usize = 3;

/// How the friction at rest falls off with the speed of sliding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fall {
    /// exp(−(v/v_s)²)
    #[default]
    Gaussian,
    /// (1 + v/v_s)^−exponent
    Power { exponent: f64 },
}

/// Friction of a point that depends on how fast this point itself has been sliding; none by default.
///
/// μ = μ_k (1 + e f(v̄)), where v̄ follows the speed of sliding with a lag. At rest μ = μ_k (1 + e).
/// A point that does not touch slides at the speed of its node.
///
/// Source: frictional memory as in Armstrong-Hélouvry, Dupont and Canudas de Wit, A survey of models,
/// analysis tools and compensation methods for the control of machines with friction, Automatica 30
/// (1994); the lag is of first order here, not a dead time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// e, the coefficient at rest over the one at high speed, less one; above −1 \[1\].
    pub excess: f64,
    /// v_s \[m/s\].
    pub speed_m_per_s: f64,
    /// f
    pub fall: Fall,
    /// Time of the lag \[s\].
    pub time_s: f64,
}

impl Memory {
    /// Coefficient over the one at high speed, at a speed that follows late.
    pub(crate) fn factor(&self, late_m_per_s: f64) -> f64 {
        if self.excess == 0.0 {
            return 1.0;
        }
        let x = late_m_per_s / self.speed_m_per_s;
        let left = match self.fall {
            Fall::Gaussian => (-x * x).exp(),
            Fall::Power { exponent } => (1.0 + x).powf(-exponent),
        };
        1.0 + self.excess * left
    }
}

/// Share of a relaxation that takes place in `dt_s`; all of it if its time is 0.
pub(crate) fn towards(dt_s: f64, time_s: f64) -> f64 {
    if time_s > 0.0 { 1.0 - (-dt_s / time_s).exp() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_falls_from_rest_to_speed_as_it_is_told() {
        let memory = Memory { excess: 0.8, speed_m_per_s: 5e-3, fall: Fall::Gaussian, time_s: 0.1 };
        let power = Memory { fall: Fall::Power { exponent: 0.5 }, ..memory };
        for own in [memory, power] {
            assert_eq!(own.factor(0.0), 1.8);
        }
        assert!((memory.factor(5e-3) - (1.0 + 0.8 * (-1f64).exp())).abs() < 1e-12);
        assert!((power.factor(15e-3) - 1.4).abs() < 1e-12);
        assert_eq!(Memory::default().factor(0.1), 1.0);
    }
}
