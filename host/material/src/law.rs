//! The four laws: energy, stress in a tensile test, and what a finite element needs of them.
//!
//! The energy W \[J/m³ = Pa\] is per volume of the unloaded material, and a function of the principal
//! stretches λ₁, λ₂, λ₃ with λ₁ λ₂ λ₃ = 1:
//!
//! | law | energy | initial shear modulus μ₀ |
//! | --- | --- | --- |
//! | elastic | E/3 Σ (ln λᵢ)² | E/3 |
//! | neo-Hookean | C10 (I₁ − 3) | 2 C10 |
//! | Mooney–Rivlin | C10 (I₁ − 3) + C01 (I₂ − 3) | 2 (C10 + C01) |
//! | Ogden, one term | 2 μ/α² (Σ λᵢ^α − 3) | μ |
//!
//! I₁ = Σ λᵢ² and I₂ = Σ λᵢ⁻². Sources: Pescio et al. 2025, equations (7) to (9); Ogden, "Large
//! deformation isotropic elasticity", Proc. R. Soc. A 326 (1972). In a tensile test the elastic law
//! is Hooke's σ = E (λ − 1) with the nominal stress. In three dimensions it is Hencky's law, which is
//! Hooke's with the logarithmic strain, so that a large rotation causes no stress; both agree to
//! first order in the strain.

use std::fmt::{Display, Formatter};

use thiserror::Error;

/// The name of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    Elastic,
    NeoHookean,
    MooneyRivlin,
    Ogden,
}

impl Law {
    pub const ALL: [Self; 4] = [Self::Elastic, Self::NeoHookean, Self::MooneyRivlin, Self::Ogden];

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Elastic => "elastic",
            Self::NeoHookean => "neo-hookean",
            Self::MooneyRivlin => "mooney-rivlin",
            Self::Ogden => "ogden",
        }
    }

    /// The names of its parameters, in the order of [`Material::parameters`], with their units.
    pub fn parameter_names(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Elastic => &[("E", "Pa")],
            Self::NeoHookean => &[("C10", "Pa")],
            Self::MooneyRivlin => &[("C10", "Pa"), ("C01", "Pa")],
            Self::Ogden => &[("mu", "Pa"), ("alpha", "1")],
        }
    }
}

impl Display for Law {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A law with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Young's modulus \[Pa\].
    Elastic {
        youngs_modulus_pa: f64,
    },
    NeoHookean {
        c10_pa: f64,
    },
    MooneyRivlin {
        c10_pa: f64,
        c01_pa: f64,
    },
    /// Initial shear modulus \[Pa\] and exponent \[1\].
    Ogden {
        mu_pa: f64,
        alpha: f64,
    },
}

/// Parameters with which a law is no material.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LawError {
    #[error("{law} has {expected} parameters ({names}), not {given}")]
    Number { law: Law, names: String, expected: usize, given: usize },
    #[error("{law}: its initial shear modulus is {modulus_pa:.4e} Pa, which is not above 0")]
    NotStiff { law: Law, modulus_pa: f64 },
    #[error("ogden: alpha is {0}; the law needs one other than 0, from -50 to 50")]
    Exponent(f64),
}

impl Material {
    /// A material from the parameters of its law, in SI units and the order of
    /// [`Law::parameter_names`].
    pub fn new(law: Law, parameters: &[f64]) -> Result<Self, LawError> {
        let material = match (law, parameters) {
            (Law::Elastic, &[youngs_modulus_pa]) => Self::Elastic { youngs_modulus_pa },
            (Law::NeoHookean, &[c10_pa]) => Self::NeoHookean { c10_pa },
            (Law::MooneyRivlin, &[c10_pa, c01_pa]) => Self::MooneyRivlin { c10_pa, c01_pa },
            (Law::Ogden, &[mu_pa, alpha]) => {
                if !(alpha.abs() > 1e-6 && alpha.abs() <= 50.0) {
                    return Err(LawError::Exponent(alpha));
                }
                Self::Ogden { mu_pa, alpha }
            }
            _ => {
                let names = law.parameter_names();
                return Err(LawError::Number {
                    law,
                    names: names.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
                    expected: names.len(),
                    given: parameters.len(),
                });
            }
        };
        let modulus_pa = material.shear_modulus_pa();
        if modulus_pa.is_finite() && modulus_pa > 0.0 {
            Ok(material)
        } else {
            Err(LawError::NotStiff { law, modulus_pa })
        }
    }

    pub fn law(&self) -> Law {
        match self {
            Self::Elastic { .. } => Law::Elastic,
            Self::NeoHookean { .. } => Law::NeoHookean,
            Self::MooneyRivlin { .. } => Law::MooneyRivlin,
            Self::Ogden { .. } => Law::Ogden,
        }
    }

    /// Its parameters in SI units, in the order of [`Law::parameter_names`].
    pub fn parameters(&self) -> Vec<f64> {
        match *self {
            Self::Elastic { youngs_modulus_pa } => vec![youngs_modulus_pa],
            Self::NeoHookean { c10_pa } => vec![c10_pa],
            Self::MooneyRivlin { c10_pa, c01_pa } => vec![c10_pa, c01_pa],
            Self::Ogden { mu_pa, alpha } => vec![mu_pa, alpha],
        }
    }

    /// Shear modulus of the unloaded material \[Pa\].
    pub fn shear_modulus_pa(&self) -> f64 {
        match *self {
            Self::Elastic { youngs_modulus_pa } => youngs_modulus_pa / 3.0,
            Self::NeoHookean { c10_pa } => 2.0 * c10_pa,
            Self::MooneyRivlin { c10_pa, c01_pa } => 2.0 * (c10_pa + c01_pa),
            Self::Ogden { mu_pa, .. } => mu_pa,
        }
    }

    /// Energy at principal stretches \[Pa\].
    pub fn energy_pa(&self, stretches: [f64; 3]) -> f64 {
        let sum = |of: &dyn Fn(f64) -> f64| stretches.iter().map(|&x| of(x)).sum::<f64>();
        match *self {
            Self::Elastic { youngs_modulus_pa } => {
                youngs_modulus_pa / 3.0 * sum(&|x| x.ln().powi(2))
            }
            Self::NeoHookean { c10_pa } => c10_pa * (sum(&|x| x * x) - 3.0),
            Self::MooneyRivlin { c10_pa, c01_pa } => {
                c10_pa * (sum(&|x| x * x) - 3.0) + c01_pa * (sum(&|x| 1.0 / (x * x)) - 3.0)
            }
            Self::Ogden { mu_pa, alpha } => {
                2.0 * mu_pa / (alpha * alpha) * (sum(&|x| x.powf(alpha)) - 3.0)
            }
        }
    }

    /// First and second derivative of the energy by the logarithm of one principal stretch \[Pa\].
    ///
    /// Every one of these energies is a sum over the three stretches, so there are no mixed
    /// derivatives: with e = ln λ the two are ∂W/∂eᵢ and ∂²W/∂eᵢ².
    pub fn log_derivatives_pa(&self, stretch: f64) -> (f64, f64) {
        match *self {
            Self::Elastic { youngs_modulus_pa } => {
                let twice = 2.0 / 3.0 * youngs_modulus_pa;
                (twice * stretch.ln(), twice)
            }
            Self::NeoHookean { c10_pa } => {
                let square = c10_pa * stretch * stretch;
                (2.0 * square, 4.0 * square)
            }
            Self::MooneyRivlin { c10_pa, c01_pa } => {
                let square = stretch * stretch;
                let (a, b) = (c10_pa * square, c01_pa / square);
                (2.0 * (a - b), 4.0 * (a + b))
            }
            Self::Ogden { mu_pa, alpha } => {
                let power = mu_pa * stretch.powf(alpha);
                (2.0 * power / alpha, 2.0 * power)
            }
        }
    }

    /// Force per area of the unloaded specimen in a tensile test \[Pa\].
    pub fn nominal_stress_pa(&self, stretch: f64) -> f64 {
        match *self {
            Self::Elastic { youngs_modulus_pa } => youngs_modulus_pa * (stretch - 1.0),
            _ => self.true_stress_pa(stretch) / stretch,
        }
    }

    /// Force per area of the stretched specimen in a tensile test \[Pa\].
    pub fn true_stress_pa(&self, stretch: f64) -> f64 {
        match *self {
            Self::Elastic { .. } => stretch * self.nominal_stress_pa(stretch),
            _ => {
                // The sides are free: what the energy gives there is the pressure that is taken off.
                let along = self.log_derivatives_pa(stretch).0;
                along - self.log_derivatives_pa(1.0 / stretch.sqrt()).0
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Material; 4] = [
        Material::Elastic { youngs_modulus_pa: 0.46e6 },
        Material::NeoHookean { c10_pa: 0.04e6 },
        Material::MooneyRivlin { c10_pa: 0.02e6, c01_pa: 0.09e6 },
        Material::Ogden { mu_pa: 0.14e6, alpha: 1.4 },
    ];

    #[test]
    fn the_derivatives_are_those_of_the_energy() {
        for material in ALL {
            for stretch in [0.4_f64, 0.9, 1.0, 1.7, 5.0] {
                let energy = |e: f64| material.energy_pa([(stretch.ln() + e).exp(), 1.0, 1.0]);
                let h = 1e-4;
                let (first, second) = material.log_derivatives_pa(stretch);
                let slope = (energy(h) - energy(-h)) / (2.0 * h);
                let bend = (energy(h) - 2.0 * energy(0.0) + energy(-h)) / (h * h);
                let scale = second.abs();
                assert!((first - slope).abs() < 1e-6 * scale, "{material:?} {stretch}");
                assert!((second - bend).abs() < 1e-5 * scale, "{material:?} {stretch}");
            }
        }
    }

    /// The nominal stress is the derivative of the energy of a specimen whose sides are free.
    #[test]
    fn the_stress_is_the_slope_of_the_energy() {
        for material in &ALL[1..] {
            for stretch in [0.5, 0.99, 1.3, 4.0] {
                let energy = |x: f64| material.energy_pa([x, 1.0 / x.sqrt(), 1.0 / x.sqrt()]);
                let slope = (energy(stretch + 1e-5) - energy(stretch - 1e-5)) / 2e-5;
                let stress = material.nominal_stress_pa(stretch);
                assert!((stress - slope).abs() < 1e-3 * material.shear_modulus_pa().abs());
            }
        }
    }

    /// All laws are three shear moduli stiff at first.
    #[test]
    fn youngs_modulus_is_three_shear_moduli() {
        for material in ALL {
            let modulus = material.nominal_stress_pa(1.0 + 1e-6) / 1e-6;
            let expected = 3.0 * material.shear_modulus_pa();
            assert!((modulus / expected - 1.0).abs() < 1e-5, "{material:?}");
        }
    }

    #[test]
    fn ogden_with_two_is_neo_hookean() {
        let ogden = Material::Ogden { mu_pa: 0.08e6, alpha: 2.0 };
        for stretch in [0.6, 1.0, 2.5] {
            let difference = ogden.true_stress_pa(stretch) - ALL[1].true_stress_pa(stretch);
            assert!(difference.abs() < 1e-6);
        }
    }

    #[test]
    fn impossible_parameters_are_refused() {
        let error =
            |law, parameters: &[f64]| Material::new(law, parameters).unwrap_err().to_string();
        assert!(error(Law::Ogden, &[1e5]).contains("has 2 parameters (mu, alpha), not 1"));
        assert!(error(Law::Ogden, &[1e5, 0.0]).contains("alpha is 0"));
        assert!(error(Law::MooneyRivlin, &[1e4, -2e4]).contains("not above 0"));
        assert!(error(Law::Elastic, &[f64::NAN]).contains("not above 0"));
    }
}
