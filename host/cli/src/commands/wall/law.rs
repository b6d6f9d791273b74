//! Laws from the command line and from a fit.

use std::path::Path;

use cathforce_material::{Law, Material};
use cathforce_wall::{Kinematics, WallMaterial};
use serde_json::Value;

use crate::args::LawArgument;
use crate::failure::{Code, Failure};

/// A law as it is called in a table.
pub struct Named {
    pub name: String,
    pub material: WallMaterial,
}

impl Named {
    pub fn new(law: Material, kinematics: Kinematics, poissons_ratio: f64) -> Self {
        WallMaterial { law, kinematics, poissons_ratio }.into()
    }
}

impl From<WallMaterial> for Named {
    fn from(material: WallMaterial) -> Self {
        Self { name: material.name().to_owned(), material }
    }
}

/// The law of one argument.
pub fn of_argument(argument: &LawArgument, poissons_ratio: f64) -> Result<Named, Failure> {
    let law = Law::from(argument.law);
    let units = law.parameter_names().iter().map(|(_, unit)| if *unit == "Pa" { 1e6 } else { 1.0 });
    let parameters: Vec<f64> = argument.parameters.iter().zip(units).map(|(x, u)| x * u).collect();
    let material = Material::new(law, &parameters).map_err(|error| {
        Failure::new(
            Code::Usage,
            format!("--law {error}\n  fix: give parameters of a material, in MPa"),
        )
    })?;
    let is_small = law == Law::Elastic && !argument.hencky;
    let kinematics = if is_small { Kinematics::Small } else { Kinematics::Large };
    Ok(Named::new(material, kinematics, poissons_ratio))
}

/// The laws of a result of `cathforce material fit`.
pub fn of_fit(path: &Path, poissons_ratio: f64) -> Result<Vec<Named>, Failure> {
    let refused = |cause: String| {
        Failure::input(format!(
            "{}: {cause}\n  fix: give a file that `cathforce material fit CURVE.csv --out FILE.json` wrote",
            path.display()
        ))
    };
    let text = std::fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
    let json: Value = serde_json::from_str(&text).map_err(|error| refused(error.to_string()))?;
    let fits = json["fits"].as_array().ok_or_else(|| refused("it holds no fits".into()))?;
    let mut laws = Vec::new();
    for fit in fits {
        let name = fit["law"].as_str().unwrap_or_default();
        let law = Law::ALL.into_iter().find(|law| law.name() == name);
        let law = law.ok_or_else(|| refused(format!("`{name}` is no law")))?;
        let parameters = fit["material"]["parameters_si"].as_array();
        // A fit whose parameters are no material has none; `material fit` warned of it.
        let Some(parameters) = parameters else { continue };
        let parameters: Vec<f64> = parameters.iter().filter_map(Value::as_f64).collect();
        let material =
            Material::new(law, &parameters).map_err(|error| refused(error.to_string()))?;
        let is_small = law == Law::Elastic;
        let kinematics = if is_small { Kinematics::Small } else { Kinematics::Large };
        laws.push(Named::new(material, kinematics, poissons_ratio));
    }
    if laws.is_empty() { Err(refused("none of its laws is a material".into())) } else { Ok(laws) }
}
