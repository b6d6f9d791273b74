//! Where a law stops being a material: more stretch with less force.

use crate::law::{Law, Material};

/// Stretches between 1 and the end of a curve at which the slope is looked at.
const STEPS: usize = 200;

/// The first stretch up to `most` at which the nominal stress falls while the stretch grows, and the
/// kind of test that shows it: tension along one axis, along two, or in a sheet of constant width.
///
/// A tensile test alone does not show it. A Mooney–Rivlin law with a negative C10 may follow a
/// tensile test well and yet burst in the two directions in which a vessel's wall is stretched.
/// The elastic law is never unstable as Hooke's law.
pub fn unstable_at(material: &Material, most: f64) -> Option<(&'static str, f64)> {
    if material.law() == Law::Elastic {
        return None;
    }
    let derivative = |stretch: f64| material.log_derivatives_pa(stretch).0;
    let tests: [(&'static str, &dyn Fn(f64) -> f64); 3] = [
        ("uniaxial", &|x| (derivative(x) - derivative(x.powf(-0.5))) / x),
        ("equibiaxial", &|x| (derivative(x) - derivative(x.powi(-2))) / x),
        ("planar", &|x| (derivative(x) - derivative(1.0 / x)) / x),
    ];
    let stretch = |step: usize| 1.0 + (most - 1.0) * step as f64 / STEPS as f64;
    let first = tests.iter().filter_map(|(name, stress)| {
        let falls = |&step: &usize| stress(stretch(step)) <= stress(stretch(step - 1));
        (1..=STEPS).find(falls).map(|step| (*name, stretch(step)))
    });
    first.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_constant_bursts_under_two_axes() {
        let good = Material::MooneyRivlin { c10_pa: 0.02e6, c01_pa: 0.09e6 };
        assert_eq!(unstable_at(&good, 6.5), None);
        let bad = Material::MooneyRivlin { c10_pa: 0.2e6, c01_pa: -0.05e6 };
        let (test, stretch) = unstable_at(&bad, 3.0).unwrap();
        assert_eq!(test, "equibiaxial");
        // The slope of 2 (C10 + C01 λ²)(λ − λ⁻⁵) vanishes there.
        let force = |x: f64| (0.2 - 0.05 * x * x) * (x - x.powi(-5));
        assert!(force(stretch + 0.02) < force(stretch) && force(stretch - 0.04) < force(stretch));
    }
}
