//! The stiffening of a wall: the parameters of the device's law that follow its finite elements.

use super::errors::Errors;
use crate::press::Pressed;

/// Stretch below which the device's law goes on straight, docs/explanation/model.md (39).
const LEAST_STRETCH: f64 = 0.2;
/// Shares of C01 that are tried.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Places in a round of the search, and rounds; each narrows the range tenfold.
const PLACES: usize = 41;
const ROUNDS: usize = 4;
/// Bounds of the setting `effects.wall.hyperelastic.strain_per_m` \[1/m\].
const STRAINS_PER_M: [f64; 2] = [-5e3, 1e5];

/// Loads and displacements of one contact point, and its stiffness at small loads \[N/m\].
#[derive(Clone, Debug)]
pub struct Curve {
    pub stiffness_n_per_m: f64,
    pub pressed: Vec<Pressed>,
}

/// The device's stiffening law and how well it follows the curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffening {
    /// 1/H \[1/m\]; negative where the wall softens.
    pub strain_per_m: f64,
    pub mooney_share: f64,
    /// Errors of the displacement at the loads that were fitted.
    pub fitted: Errors,
    /// At loads between them, which were not.
    pub between: Errors,
    /// At loads beyond them.
    pub beyond: Errors,
}

impl Stiffening {
    /// Fits the law to the loads `fitted_n` of all curves; the others check it.
    pub fn fit(curves: &[Curve], fitted_n: &[f64]) -> Self {
        let most = fitted_n.iter().copied().fold(0.0, f64::max);
        let is_fitted = |pressed: &Pressed| fitted_n.contains(&pressed.force_n);
        let errors = |law: [f64; 2], of: &dyn Fn(&Pressed) -> bool| {
            Errors::of(curves.iter().flat_map(|curve| {
                let pressed = curve.pressed.iter().filter(|pressed| of(pressed));
                pressed.map(move |p| {
                    indentation_mm(curve.stiffness_n_per_m, law, p.force_n) / p.displacement_mm
                        - 1.0
                })
            }))
        };
        let deepest_mm =
            curves.iter().flat_map(|c| &c.pressed).map(|p| p.displacement_mm).fold(0.0, f64::max);
        let law = search(1e3 / deepest_mm.max(1e-6), |law| errors(law, &is_fitted).rms);
        Self {
            strain_per_m: law[0],
            mooney_share: law[1],
            fitted: errors(law, &is_fitted),
            between: errors(law, &|p| !is_fitted(p) && p.force_n < most),
            beyond: errors(law, &|p| !is_fitted(p) && p.force_n > most),
        }
    }
}

/// The law with the least error. `scale_per_m`: 1/deepest indentation.
fn search(scale_per_m: f64, error: impl Fn([f64; 2]) -> f64) -> [f64; 2] {
    let mut best = ([0.0, 0.0], error([0.0, 0.0]));
    for share in SHARES {
        let (mut low, mut high) = (-3.0 * scale_per_m, 3.0 * scale_per_m);
        for _ in 0..ROUNDS {
            let place = |k: usize| low + (high - low) * k as f64 / (PLACES - 1) as f64;
            let at = |k: usize| place(k).clamp(STRAINS_PER_M[0], STRAINS_PER_M[1]);
            let errors = (0..PLACES).map(|k| (at(k), error([at(k), share])));
            let Some(least) = errors.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if least.1 < best.1 {
                best = ([least.0, share], least.1);
            }
            let step = (high - low) / (PLACES - 1) as f64;
            (low, high) = (least.0 - 2.0 * step, least.0 + 2.0 * step);
        }
    }
    best.0
}

/// φ_h over the indentation, both \[mm\].     docs/explanation/model.md (39)
fn response_mm([strain_per_m, share]: [f64; 2], indentation_mm: f64) -> f64 {
    let per_mm = 1e-3 * strain_per_m;
    if per_mm.abs() * indentation_mm < 1e-9 {
        return indentation_mm;
    }
    let force = |stretch: f64| {
        (stretch.powi(-2) - stretch) * (1.0 - share + share / stretch) / (3.0 * per_mm)
    };
    let stretch = 1.0 - per_mm * indentation_mm;
    if stretch >= LEAST_STRETCH {
        return force(stretch);
    }
    const STEP: f64 = 1e-6;
    let slope = (force(LEAST_STRETCH) - force(LEAST_STRETCH + STEP)) / STEP;
    force(LEAST_STRETCH) + slope * (LEAST_STRETCH - stretch)
}

/// Indentation of the device's wall under a force \[mm\].
///
/// `law`: `strain_per_m` and `mooney_share`. A law that softens may bear no such force; the answer is
/// infinite then.
pub fn indentation_mm(stiffness_n_per_m: f64, law: [f64; 2], force_n: f64) -> f64 {
    let wanted_mm = 1e3 * force_n / stiffness_n_per_m;
    let (mut low, mut high) = (0.0, wanted_mm);
    for _ in 0..60 {
        if response_mm(law, high) >= wanted_mm {
            break;
        }
        low = high;
        high *= 2.0;
        if high > 1e6 * wanted_mm {
            return f64::INFINITY;
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if response_mm(law, middle) < wanted_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(law: [f64; 2], stiffness_n_per_m: f64) -> Curve {
        let pressed = |force_n: f64| Pressed {
            force_n,
            displacement_mm: indentation_mm(stiffness_n_per_m, law, force_n),
            largest_mm: 0.0,
            corrections: 0,
        };
        Curve { stiffness_n_per_m, pressed: [0.2, 0.4, 0.6, 0.8, 1.2].map(pressed).to_vec() }
    }

    #[test]
    fn the_law_of_a_curve_is_found_again() {
        for law in [[0.0, 0.0], [80.0, 0.0], [120.0, 0.5], [-100.0, 1.0]] {
            let curves = [curve(law, 400.0), curve(law, 900.0)];
            let found = Stiffening::fit(&curves, &[0.2, 0.4, 0.8]);
            assert!(found.fitted.rms < 2e-3, "{law:?}: {found:?}");
            assert!(found.between.largest < 5e-3 && found.beyond.largest < 2e-2, "{found:?}");
            assert_eq!((found.between.count, found.beyond.count), (2, 2));
        }
    }

    /// Without stiffening the law is a spring, and the two branches of the formula meet.
    #[test]
    fn the_law_is_that_of_the_model() {
        assert!((indentation_mm(500.0, [0.0, 0.0], 1.0) - 2.0).abs() < 1e-9);
        let law = [400.0, 0.3];
        // Λ = 1 − 0.4 = 0.6: (1/0.36 − 0.6)(0.7 + 0.3/0.6)/3 × 2.5 mm.
        let expected = (1.0 / 0.36 - 0.6) * 1.2 / 3.0 * 2.5;
        assert!((response_mm(law, 1.0) - expected).abs() < 1e-12);
        let edge = response_mm(law, 2.0 - 1e-9) - response_mm(law, 2.0 + 1e-9);
        assert!(edge.abs() < 1e-5);
    }
}
