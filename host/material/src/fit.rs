//! The parameters of a law that follow a curve best, with intervals.
//!
//! Least squares by Levenberg–Marquardt (Moré's form, of the crate `levenberg-marquardt`). With n rows,
//! p parameters, residuals r and the Jacobian J of the stress at the solution:
//!
//!   s² = Σ r²/(n − p)      RMSE = s      R² = 1 − Σ r²/Σ (σ − σ̄)²
//!   interval of parameter k: value ± t(0.975; n − p) √(s² [(JᵀJ)⁻¹]ₖₖ)
//!
//! RMSE and intervals are defined as MATLAB's curve fitting toolbox defines them, which Pescio et al.
//! 2025 used. The intervals hold for independent errors. Where neighbouring residuals are alike, the
//! law itself misses the curve, and [`Fit::autocorrelation`] says so.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra_of_fits::{DMatrix, DVector, Dyn, storage::Owned};
use statrs::distribution::{ContinuousCDF, StudentsT};
use thiserror::Error;

use crate::curve::{Curve, StressMeasure};
use crate::law::{Law, LawError, Material};
use crate::printed::Form;
use crate::stability::unstable_at;

/// Exponents at which a search for Ogden's begins. Between two of them the sum of squares has one
/// minimum at most, as far as curves of elastomers show.
const OGDEN_STARTS: [f64; 9] = [-6.0, -3.0, -1.0, 0.5, 1.3, 2.0, 3.0, 5.0, 9.0];
/// Step of the central differences, relative to the parameter: the cube root of the rounding.
const RELATIVE_STEP: f64 = 6e-6;
/// Share of the intervals.
const CONFIDENCE: f64 = 0.95;
/// Largest condition number of JᵀJ with columns of length 1. Above it the curve says nothing about
/// one combination of the parameters that rounding does not drown. Mooney–Rivlin reaches it at 0.1 %
/// of stretch.
const WORST_CONDITION: f64 = 1e8;

/// A parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: &'static str,
    /// `Pa` or `1`.
    pub unit: &'static str,
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// A law that was fitted to a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub law: Law,
    pub form: Form,
    pub parameters: Vec<Parameter>,
    pub r_squared: f64,
    pub rmse_pa: f64,
    pub rows: usize,
    /// Of neighbouring residuals, from −1 to 1; near 0 where the errors are independent.
    pub autocorrelation: f64,
    /// The material, unless the parameters are impossible ones.
    pub material: Result<Material, LawError>,
    /// As of [`unstable_at`], up to the largest stretch of the curve.
    pub unstable: Option<(&'static str, f64)>,
}

/// Why a law was not fitted.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FitError {
    #[error(
        "{law}: the curve does not tell its parameters apart\n  fix: give a curve that goes to a \
         larger stretch, or choose a law with fewer parameters"
    )]
    NotIdentifiable { law: Law },
    #[error("{law}: the search ended without a solution ({reason})\n  fix: choose another law")]
    NotFound { law: Law, reason: String },
    #[error(
        "{law}: {rows} rows are too few for {parameters} parameters and their intervals\n  fix: give \
         at least {} rows", .parameters + 2
    )]
    TooFewRows { law: Law, rows: usize, parameters: usize },
}

/// Fits a law to a curve.
pub fn fit(curve: &Curve, law: Law, form: Form) -> Result<Fit, FitError> {
    let parameters = law.parameter_names().len();
    let rows = curve.points.len();
    if rows < parameters + 2 {
        return Err(FitError::TooFewRows { law, rows, parameters });
    }
    let best = search(curve, law, form)?;
    let residuals = best.residuals().unwrap_or_default() * best.scale_pa;
    let sum_of_squares = residuals.norm_squared();
    let dof = (rows - parameters) as f64;
    let values = best.values();
    let deviation = deviations(&best, sum_of_squares / dof, law)?;
    let t = quantile(dof);
    let named = form.parameter_names(law).iter().zip(&values).zip(&deviation);
    let material = form.material(law, &values);
    let most = curve.range()[1];
    Ok(Fit {
        law,
        form,
        parameters: named
            .map(|((&(name, unit), &value), sd)| Parameter {
                name,
                unit,
                value,
                low: value - t * sd,
                high: value + t * sd,
            })
            .collect(),
        r_squared: 1.0 - sum_of_squares / total_of_squares(&best),
        rmse_pa: (sum_of_squares / dof).sqrt(),
        rows,
        autocorrelation: autocorrelation(residuals.as_slice()),
        unstable: material.as_ref().ok().and_then(|material| unstable_at(material, most)),
        material,
    })
}

/// The best of the searches from several starts; a law that is linear in its parameters needs one.
fn search<'a>(curve: &'a Curve, law: Law, form: Form) -> Result<Problem<'a>, FitError> {
    let starts = match law {
        Law::Ogden => OGDEN_STARTS.map(|alpha| DVector::from_vec(vec![1.0, alpha])).to_vec(),
        _ => vec![DVector::from_element(law.parameter_names().len(), 1.0)],
    };
    let mut best: Option<(f64, Problem<'a>)> = None;
    let mut reason = String::new();
    for start in starts {
        let mut problem = Problem::new(curve, law, form, start);
        problem.scale_first();
        let (solved, report) = LevenbergMarquardt::new().with_patience(200).minimize(problem);
        if !report.termination.was_successful() {
            reason = format!("{:?}", report.termination);
            continue;
        }
        let objective = report.objective_function;
        if objective.is_finite() && best.as_ref().is_none_or(|(least, _)| objective < *least) {
            best = Some((objective, solved));
        }
    }
    best.map(|(_, problem)| problem).ok_or(FitError::NotFound { law, reason })
}

/// Standard deviations of the parameters in SI units.
fn deviations(problem: &Problem<'_>, variance_pa2: f64, law: Law) -> Result<Vec<f64>, FitError> {
    let unidentifiable = || FitError::NotIdentifiable { law };
    let jacobian = problem.jacobian().ok_or_else(unidentifiable)? * problem.scale_pa;
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    if lengths.iter().any(|length| !(length.is_finite() && *length > 0.0)) {
        return Err(unidentifiable());
    }
    // Columns of length 1, so that the condition does not depend on units.
    let mut scaled = jacobian;
    for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let normal = scaled.tr_mul(&scaled);
    let eigenvalues = normal.clone().symmetric_eigenvalues();
    if eigenvalues.max() > WORST_CONDITION * eigenvalues.min() {
        return Err(unidentifiable());
    }
    let inverse = normal.try_inverse().ok_or_else(unidentifiable)?;
    let units = problem.units();
    let sd = |k: usize| (variance_pa2 * inverse[(k, k)]).sqrt() / lengths[k] * units[k];
    Ok((0..lengths.len()).map(sd).collect())
}

/// Student's t that encloses [`CONFIDENCE`] on both sides.
fn quantile(dof: f64) -> f64 {
    StudentsT::new(0.0, 1.0, dof).map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * CONFIDENCE))
}

fn total_of_squares(problem: &Problem<'_>) -> f64 {
    let observed = || problem.curve.points.iter().map(|point| problem.observed_pa(point));
    let mean = observed().sum::<f64>() / problem.curve.points.len() as f64;
    observed().map(|stress| (stress - mean).powi(2)).sum()
}

/// Correlation of neighbouring residuals; 0 where there is nothing left to correlate.
fn autocorrelation(residuals: &[f64]) -> f64 {
    let all: f64 = residuals.iter().map(|r| r * r).sum();
    let neighbours: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    if all > 0.0 { neighbours / all } else { 0.0 }
}

/// Residuals over the largest stress of the curve, and parameters in units of it: numbers near 1.
#[derive(Clone)]
struct Problem<'a> {
    curve: &'a Curve,
    law: Law,
    form: Form,
    scale_pa: f64,
    scaled: DVector<f64>,
}

impl<'a> Problem<'a> {
    fn new(curve: &'a Curve, law: Law, form: Form, start: DVector<f64>) -> Self {
        let largest = curve.points.iter().map(|point| point.stress_pa.abs()).fold(0.0, f64::max);
        let scale_pa = if largest > 0.0 { largest } else { 1.0 };
        Self { curve, law, form, scale_pa, scaled: start }
    }

    /// Units of the parameters: the scale of stress, or 1.
    fn units(&self) -> Vec<f64> {
        let names = self.law.parameter_names();
        names.iter().map(|(_, unit)| if *unit == "Pa" { self.scale_pa } else { 1.0 }).collect()
    }

    /// The parameters in SI units.
    fn values(&self) -> Vec<f64> {
        self.scaled.iter().zip(self.units()).map(|(value, unit)| value * unit).collect()
    }

    fn observed_pa(&self, point: &crate::curve::Point) -> f64 {
        self.form.observed_pa(point, self.curve.measure)
    }

    fn predicted(&self, scaled: &DVector<f64>) -> DVector<f64> {
        let measure = match self.form {
            Form::Consistent => self.curve.measure,
            Form::Printed => StressMeasure::Nominal,
        };
        let values: Vec<f64> = scaled.iter().zip(self.units()).map(|(x, unit)| x * unit).collect();
        let stress = |stretch| self.form.stress_pa(self.law, &values, measure, stretch);
        let stresses = self.curve.points.iter().map(|point| stress(point.stretch) / self.scale_pa);
        DVector::from_iterator(self.curve.points.len(), stresses)
    }

    /// Gives the first parameter the value that is best with the others: the stress is proportional
    /// to all parameters that are stresses.
    fn scale_first(&mut self) {
        let predicted = self.predicted(&self.scaled);
        let observed = DVector::from_iterator(
            self.curve.points.len(),
            self.curve.points.iter().map(|point| self.observed_pa(point) / self.scale_pa),
        );
        let factor = predicted.dot(&observed) / predicted.norm_squared();
        if factor.is_finite() && factor != 0.0 {
            let units = self.law.parameter_names();
            for (value, (_, unit)) in self.scaled.iter_mut().zip(units) {
                *value *= if *unit == "Pa" { factor } else { 1.0 };
            }
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.scaled.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.scaled.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut residuals = self.predicted(&self.scaled);
        for (residual, point) in residuals.iter_mut().zip(&self.curve.points) {
            *residual -= self.observed_pa(point) / self.scale_pa;
        }
        residuals.iter().all(|r| r.is_finite()).then_some(residuals)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.curve.points.len(), self.scaled.len());
        for k in 0..self.scaled.len() {
            let step = RELATIVE_STEP * self.scaled[k].abs().max(1e-3);
            let at = |offset: f64| {
                let mut moved = self.scaled.clone();
                moved[k] += offset;
                self.predicted(&moved)
            };
            jacobian.set_column(k, &((at(step) - at(-step)) / (2.0 * step)));
        }
        jacobian.iter().all(|x| x.is_finite()).then_some(jacobian)
    }
}
