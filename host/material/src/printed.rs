//! The two ways of reading a law for a fit.

use crate::curve::{Point, StressMeasure};
use crate::law::{Law, LawError, Material};

/// How a law's formula meets the stress of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// The stress that follows from the law's energy, nominal or true as the curve's is.
    #[default]
    Consistent,
    /// The formulas as Pescio et al. 2025 print them in Table 2, set equal to the nominal stress:
    ///
    /// | law | σ |
    /// | --- | --- |
    /// | elastic | E (λ − 1) |
    /// | neo-Hookean | 2 (λ² − 1/λ) μ |
    /// | Mooney–Rivlin | 2 (λ² − 1/λ)(C10 + C01/λ) |
    /// | Ogden | μ₁ (λ^α₁ − λ^(−α₁/2)) |
    ///
    /// The last three are true stresses by the paper's own energies (7) to (9). The paper's elastic
    /// modulus, 0.46 MPa, is 2.5 MPa over a strain of 5.5, so its curve is nominal: force over 54 mm².
    /// The parameters found so follow the curve, but they are not those of the energies.
    Printed,
}

impl Form {
    /// Names and units of the parameters in this form.
    pub fn parameter_names(self, law: Law) -> &'static [(&'static str, &'static str)] {
        match (self, law) {
            (Self::Printed, Law::NeoHookean) => &[("mu", "Pa")],
            (Self::Printed, Law::Ogden) => &[("mu1", "Pa"), ("alpha1", "1")],
            _ => law.parameter_names(),
        }
    }

    /// The stress that the law predicts at a point of a curve \[Pa\].
    pub fn stress_pa(
        self,
        law: Law,
        parameters: &[f64],
        measure: StressMeasure,
        stretch: f64,
    ) -> f64 {
        let (first, second) = (parameters[0], parameters.get(1).copied().unwrap_or(0.0));
        if self == Self::Printed {
            let x = stretch;
            return match law {
                Law::Elastic => first * (x - 1.0),
                Law::NeoHookean => 2.0 * (x * x - 1.0 / x) * first,
                Law::MooneyRivlin => 2.0 * (x * x - 1.0 / x) * (first + second / x),
                Law::Ogden => first * (x.powf(second) - x.powf(-0.5 * second)),
            };
        }
        let material = match law {
            Law::Elastic => Material::Elastic { youngs_modulus_pa: first },
            Law::NeoHookean => Material::NeoHookean { c10_pa: first },
            Law::MooneyRivlin => Material::MooneyRivlin { c10_pa: first, c01_pa: second },
            Law::Ogden => Material::Ogden { mu_pa: first, alpha: second },
        };
        match measure {
            StressMeasure::Nominal => material.nominal_stress_pa(stretch),
            StressMeasure::True => material.true_stress_pa(stretch),
        }
    }

    /// The stress of a point that the formula is compared with \[Pa\], and the measure it is in.
    pub(crate) fn observed_pa(self, point: &Point, measure: StressMeasure) -> f64 {
        match (self, measure) {
            (Self::Printed, StressMeasure::True) => point.stress_pa / point.stretch,
            _ => point.stress_pa,
        }
    }

    /// The material whose energy has these parameters. In the printed form the parameters go into
    /// the paper's energies as they are; Ogden's printed μ₁ is 2 μ/α of its energy.
    pub fn material(self, law: Law, parameters: &[f64]) -> Result<Material, LawError> {
        match (self, law, parameters) {
            (Self::Printed, Law::Ogden, &[mu1_pa, alpha]) => {
                Material::new(law, &[0.5 * mu1_pa * alpha, alpha])
            }
            _ => Material::new(law, parameters),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The printed hyperelastic formulas are the true stresses of the energies.
    #[test]
    fn the_printed_formulas_are_true_stresses() {
        for (law, parameters) in [
            (Law::NeoHookean, &[0.04e6][..]),
            (Law::MooneyRivlin, &[0.02e6, 0.09e6]),
            (Law::Ogden, &[0.2e6, 1.4]),
        ] {
            let material = Form::Printed.material(law, parameters).unwrap();
            for stretch in [0.7, 1.5, 6.5] {
                let printed =
                    Form::Printed.stress_pa(law, parameters, StressMeasure::Nominal, stretch);
                let stress = material.true_stress_pa(stretch);
                assert!((printed - stress).abs() < 1e-9 * stress.abs().max(1.0), "{law} {stretch}");
            }
        }
    }
}
