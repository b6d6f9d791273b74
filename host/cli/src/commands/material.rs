//! `cathforce material fit`: the laws of a material from a tensile test.

use std::fmt::Write as _;

use cathforce_material::{
    Curve, Fit, FitError, Form, Law, ReadOptions, Specimen, StressMeasure, fit, read_curve,
};
use serde_json::{Value, json};

use crate::args::{
    FormName, LawName, MaterialAction, MaterialArguments, MaterialFitArguments, Stress,
};
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// Correlation of neighbouring residuals above which the law misses the curve: noise of the few
/// dozens of rows that a test has stays below.
const MISSES: f64 = 0.5;

pub fn run(ui: &Ui, arguments: &MaterialArguments) -> Result<(), Failure> {
    match &arguments.action {
        MaterialAction::Fit(arguments) => fit_curve(ui, arguments),
    }
}

impl From<LawName> for Law {
    fn from(name: LawName) -> Self {
        match name {
            LawName::Elastic => Self::Elastic,
            LawName::NeoHookean => Self::NeoHookean,
            LawName::MooneyRivlin => Self::MooneyRivlin,
            LawName::Ogden => Self::Ogden,
        }
    }
}

fn fit_curve(ui: &Ui, arguments: &MaterialFitArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let options = ReadOptions {
        specimen: Specimen {
            gauge_m: arguments.gauge_mm.map(|mm| 1e-3 * mm),
            area_m2: arguments.area_mm2.map(|mm2| 1e-6 * mm2),
        },
        measure: arguments.stress.map(|stress| match stress {
            Stress::Nominal => StressMeasure::Nominal,
            Stress::True => StressMeasure::True,
        }),
    };
    let curve = read_curve(&arguments.curve, &options).map_err(Failure::input)?;
    let form = match arguments.form {
        FormName::Consistent => Form::Consistent,
        FormName::Printed => Form::Printed,
    };
    let mut laws: Vec<Law> = arguments.laws.iter().map(|law| (*law).into()).collect();
    if laws.is_empty() {
        laws = Law::ALL.to_vec();
    }
    let fits: Vec<Result<Fit, FitError>> = laws.iter().map(|law| fit(&curve, *law, form)).collect();
    for found in &fits {
        match found {
            Ok(found) => warn(ui, found, &curve),
            Err(error) => ui.warn(error),
        }
    }
    if fits.iter().all(Result::is_err) {
        let message = format!("{}: no law was fitted", arguments.curve.display());
        return Err(Failure::new(Code::Failed, message));
    }
    let found: Vec<&Fit> = fits.iter().flatten().collect();
    let json = json!({
        "curve": arguments.curve,
        "rows": curve.points.len(),
        "stress": curve.measure.name(),
        "stretch": curve.range(),
        "form": match form { Form::Consistent => "consistent", Form::Printed => "printed" },
        "fits": found.iter().map(|fit| to_json(fit)).collect::<Vec<_>>(),
    });
    arguments.json_file.write(ui, &json, text(&curve, &found))
}

/// What the figures of a fit do not say.
fn warn(ui: &Ui, fit: &Fit, curve: &Curve) {
    let law = fit.law;
    if fit.autocorrelation > MISSES {
        ui.warn(format_args!(
            "{law}: neighbouring residuals are alike (correlation {:.2}), so that the law misses the \
             curve rather than its noise; the intervals are too narrow",
            fit.autocorrelation
        ));
    }
    if let Err(error) = &fit.material {
        ui.warn(format_args!("{error}: these parameters are no material"));
    }
    if let Some((test, stretch)) = fit.unstable {
        ui.warn(format_args!(
            "{law}: the material gives way under {test} tension from a stretch of {stretch:.2} on, \
             within the {:.2} of the curve",
            curve.range()[1]
        ));
    }
}

/// A parameter in the unit that tables print, with the factor to it.
fn unit(unit: &str) -> (&'static str, f64) {
    match unit {
        "Pa" => ("MPa", 1e-6),
        _ => ("", 1.0),
    }
}

fn text(curve: &Curve, fits: &[&Fit]) -> String {
    let [low, high] = curve.range();
    let mut text = format!(
        "{} rows, {} stress, stretch {low:.3} to {high:.3}\n\n{:<14} {:<8} {:>10}   {:<24} {:>8} {:>10}\n",
        curve.points.len(),
        curve.measure.name(),
        "law",
        "",
        "value",
        "95 % interval",
        "R²",
        "RMSE MPa"
    );
    for fit in fits {
        for (index, parameter) in fit.parameters.iter().enumerate() {
            let (unit, factor) = unit(parameter.unit);
            let [value, low, high] =
                [parameter.value, parameter.low, parameter.high].map(|x| factor * x);
            let (law, figures) = match index {
                0 => (
                    fit.law.name(),
                    format!(" {:>8.4} {:>10.4}", fit.r_squared, 1e-6 * fit.rmse_pa),
                ),
                _ => ("", String::new()),
            };
            let interval = format!("{low:.4} to {high:.4} {unit}");
            let line =
                format!("{law:<14} {:<8} {value:>10.4}   {interval:<24}{figures}", parameter.name);
            // Writing to a string does not fail.
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    text
}

fn to_json(fit: &Fit) -> Value {
    let parameters: Vec<Value> = fit
        .parameters
        .iter()
        .map(|p| {
            json!({
                "name": p.name, "unit": p.unit, "value": p.value, "interval_95": [p.low, p.high],
            })
        })
        .collect();
    let material = fit.material.as_ref().ok().map(|material| {
        json!({
            "parameters_si": material.parameters(), "shear_modulus_pa": material.shear_modulus_pa(),
        })
    });
    json!({
        "law": fit.law.name(),
        "parameters": parameters,
        "r_squared": fit.r_squared,
        "rmse_pa": fit.rmse_pa,
        "residual_autocorrelation": fit.autocorrelation,
        "material": material,
        "unstable": fit.unstable.map(|(test, stretch)| json!({ "test": test, "stretch": stretch })),
    })
}
