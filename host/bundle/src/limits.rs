//! Which key of `rig.toml` leads to a number that the model refuses.

use cathforce_mechanics::{Description, DescriptionError, Instrument, Real};

use crate::bundle::Bundle;
use crate::error::BundleError;
use crate::place::Place;
use crate::rig::{BeyondModel, CatheterRig, RigCause, RigInstrument, place_of_key};

/// A field of a description with its range and unit.
struct Limit {
    field: &'static str,
    low: f64,
    high: f64,
    unit: &'static str,
}

/// The ranges of `Description::validate` for the fields that come from a rig; a test compares the two.
const LIMITS: [Limit; 12] = [
    Limit { field: "instrument.outer_radius_m", low: 1e-5, high: 1e-2, unit: "m" },
    Limit { field: "section.length_m", low: 1e-4, high: 10.0, unit: "m" },
    Limit { field: "section.bending_stiffness_n_m2", low: 1e-9, high: 1.0, unit: "N·m²" },
    Limit { field: "section.torsional_stiffness_n_m2", low: 1e-9, high: 1.0, unit: "N·m²" },
    Limit { field: "section.axial_stiffness_n", low: 0.1, high: 1e8, unit: "N" },
    Limit { field: "section.mass_kg_per_m", low: 1e-6, high: 1.0, unit: "kg/m" },
    Limit { field: "precurve.length_m", low: 0.0, high: 1.0, unit: "m" },
    Limit { field: "precurve.curvature_per_m", low: -1000.0, high: 1000.0, unit: "1/m" },
    Limit { field: "entry.position_m", low: -10.0, high: 10.0, unit: "m" },
    Limit { field: "wall.line_stiffness_n_per_m2", low: 1.0, high: 1e9, unit: "N/m²" },
    Limit { field: "wall.end_stiffness_n_per_m", low: 0.0, high: 1e7, unit: "N/m" },
    Limit { field: "gravity_m_per_s2", low: -100.0, high: 100.0, unit: "m/s²" },
];

/// A number of a rig, by its key, and the number of the model that is computed from it.
struct Origin {
    key: String,
    given: f64,
    model: f64,
}

/// Refuses a rig whose model has a number out of range. Names the key of `rig.toml`, its line and the
/// values that it may have.
pub(crate) fn check<T: Real>(
    bundle: &Bundle,
    description: &Description<T>,
) -> Result<(), BundleOrModel> {
    let Err(error) = description.validate() else { return Ok(()) };
    let DescriptionError::Range(field) = error else { return Err(BundleOrModel::Model(error)) };
    let found = bundle.catheter().and_then(|rig| {
        let limit = LIMITS.iter().find(|limit| limit.field == field)?;
        let origins = origins(field, rig, description);
        // The negation makes NaN count as out of range.
        let beyond = |origin: &Origin| !(limit.low..=limit.high).contains(&origin.model);
        Some((limit, origins.into_iter().find(beyond)?))
    });
    let Some((limit, origin)) = found else { return Err(BundleOrModel::Model(error)) };
    let file = bundle.path.join("rig.toml");
    // The text is read again, since places are needed only for a rig that is wrong.
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    let place = place_of_key(&text, &origin.key).unwrap_or(Place::Whole);
    let cause = cause(limit, &origin);
    Err(BundleOrModel::Bundle(BundleError::new(&file, place, cause)))
}

/// The refusal: of a bundle, with its place, or of a model whose number belongs to no known key.
pub(crate) enum BundleOrModel {
    Bundle(BundleError),
    Model(DescriptionError),
}

fn cause(limit: &Limit, origin: &Origin) -> RigCause {
    let Limit { field, low, high, unit } = limit;
    let Origin { key, given, model } = origin;
    // With the rest of the rig fixed, the model's number is proportional to the key's.
    let bounds = [low, high].map(|bound| bound * given / model);
    let may_be = match bounds.iter().all(|bound| bound.is_finite()) {
        // Rounded, the bounds might be refused themselves.
        true => format!(
            "about {} to {}",
            rounded(bounds[0].min(bounds[1])),
            rounded(bounds[0].max(bounds[1]))
        ),
        false => "another number".to_owned(),
    };
    RigCause::Model(Box::new(BeyondModel {
        key: key.clone(),
        value: rounded(*given),
        why: format!(
            "the model's {field} would be {} {unit}, and is {} to {} {unit}",
            rounded(*model),
            rounded(*low),
            rounded(*high)
        ),
        may_be,
    }))
}

/// A number with four digits, with an exponent if it is large or small.
fn rounded(x: f64) -> String {
    let x = format!("{x:.3e}").parse::<f64>().unwrap_or(x);
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

fn origins<T: Real>(field: &str, rig: &CatheterRig, description: &Description<T>) -> Vec<Origin> {
    let origin =
        |key: &str, given: f64, model: T| Origin { key: key.into(), given, model: model.to_f64() };
    let (wall, vessel) = (&description.wall, &rig.vessel);
    let stiffness =
        |model| vec![origin("vessel.wall_stiffness_N_per_m", vessel.wall_stiffness_n_per_m, model)];
    let vector = |key: &str, given: [f64; 3], model: [T; 3]| {
        given.into_iter().zip(model).map(|(given, model)| origin(key, given, model)).collect()
    };
    match field {
        "entry.position_m" => vector(field, rig.entry.position_m, description.entry.position_m),
        "gravity_m_per_s2" => vector(
            "environment.gravity_m_per_s2",
            rig.environment.gravity_m_per_s2,
            description.gravity_m_per_s2,
        ),
        "wall.line_stiffness_n_per_m2" => stiffness(wall.line_stiffness_n_per_m2),
        "wall.end_stiffness_n_per_m" => stiffness(wall.end_stiffness_n_per_m),
        _ => {
            let own = of_instrument(field, "instrument", &rig.instrument, &description.instrument);
            let wire = rig.guidewire.as_ref().zip(description.guidewire.as_ref());
            let wire = wire.map(|(rig, model)| of_instrument(field, "guidewire", rig, model));
            own.into_iter().chain(wire.unwrap_or_default()).collect()
        }
    }
}

fn of_instrument<T: Real>(
    field: &str,
    table: &str,
    rig: &RigInstrument,
    model: &Instrument<T>,
) -> Vec<Origin> {
    let origin = |key: String, given: f64, model: T| Origin { key, given, model: model.to_f64() };
    // The model's sections go from the tip to the base.
    let sections = rig.sections.iter().zip(model.sections.iter().rev()).enumerate();
    let of_section = |key: &str, given: fn(&RigInstrument, usize) -> f64| {
        let numbers = sections.clone().map(|(i, (_, section))| {
            let model = match field {
                "section.length_m" => section.length_m,
                "section.bending_stiffness_n_m2" => section.bending_stiffness_n_m2,
                "section.torsional_stiffness_n_m2" => section.torsional_stiffness_n_m2,
                "section.axial_stiffness_n" => section.axial_stiffness_n,
                _ => section.mass_kg_per_m,
            };
            origin(format!("{table}.{}", key.replace('#', &i.to_string())), given(rig, i), model)
        });
        numbers.collect::<Vec<_>>()
    };
    let pieces = rig.tip_precurve.iter().zip(&model.precurve).enumerate();
    match field {
        "instrument.outer_radius_m" => {
            let key = format!("{table}.outer_diameter_m");
            vec![origin(key, rig.outer_diameter_m, model.outer_radius_m)]
        }
        "section.length_m" => of_section("sections[#].length_m", |rig, i| rig.sections[i].length_m),
        "section.mass_kg_per_m" => of_section("density_kg_per_m3", |rig, _| rig.density_kg_per_m3),
        "section.bending_stiffness_n_m2"
        | "section.torsional_stiffness_n_m2"
        | "section.axial_stiffness_n" => {
            of_section("sections[#].youngs_modulus_Pa", |rig, i| rig.sections[i].youngs_modulus_pa)
        }
        "precurve.length_m" => pieces
            .map(|(i, (piece, model))| {
                origin(
                    format!("{table}.tip_precurve[{i}].length_m"),
                    piece.length_m,
                    model.length_m,
                )
            })
            .collect(),
        "precurve.curvature_per_m" => pieces
            .map(|(i, (piece, model))| {
                let key = format!("{table}.tip_precurve[{i}].curvature_per_m");
                origin(key, piece.curvature_per_m, model.curvature_per_m)
            })
            .collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundle::{
        Plant, Rig, RigEntry, RigEnvironment, RigPriors, RigSection, RigSensor, RigVessel, TipPiece,
    };
    use crate::description::{SolverDefaults, describe};

    fn rig() -> CatheterRig {
        let sections = [0.2, 0.05].map(|length_m| RigSection { length_m, youngs_modulus_pa: 5e7 });
        CatheterRig {
            instrument: RigInstrument {
                length_m: 0.25,
                outer_diameter_m: 1.6e-3,
                inner_diameter_m: 1e-3,
                density_kg_per_m3: 1100.0,
                poissons_ratio: 0.4,
                sections: sections.to_vec(),
                tip_precurve: vec![TipPiece { length_m: 0.01, curvature_per_m: 50.0 }],
            },
            guidewire: None,
            tendon: None,
            tendons: Vec::new(),
            entry: RigEntry {
                position_m: [0.0; 3],
                direction: [1.0, 0.0, 0.0],
                up: [0.0, 1.0, 0.0],
                guide_length_m: None,
            },
            vessel: RigVessel {
                friction_coefficient: 0.3,
                wall_stiffness_n_per_m: 4000.0,
                wall_contact_spacing_m: 0.005,
                wall_tangential_ratio: None,
                wall_regions: Vec::new(),
            },
            environment: RigEnvironment { gravity_m_per_s2: [0.0, 0.0, -9.81], fluid: None },
        }
    }

    /// Every limit is the model's own: just within it is accepted, just beyond it refused by name.
    #[test]
    fn the_limits_are_those_of_the_model() {
        let defaults = SolverDefaults::default();
        let nominal = describe::<f64>(&rig(), &defaults, 1e-3);
        assert_eq!(nominal.validate(), Ok(()));
        for Limit { field, low, high, .. } in &LIMITS {
            let with = |value: f64| {
                let mut description = nominal.clone();
                let section = &mut description.instrument.sections[0];
                match *field {
                    "instrument.outer_radius_m" => description.instrument.outer_radius_m = value,
                    "section.length_m" => section.length_m = value,
                    "section.bending_stiffness_n_m2" => section.bending_stiffness_n_m2 = value,
                    "section.torsional_stiffness_n_m2" => section.torsional_stiffness_n_m2 = value,
                    "section.axial_stiffness_n" => section.axial_stiffness_n = value,
                    "section.mass_kg_per_m" => section.mass_kg_per_m = value,
                    "precurve.length_m" => description.instrument.precurve[0].length_m = value,
                    "precurve.curvature_per_m" => {
                        description.instrument.precurve[0].curvature_per_m = value;
                    }
                    "entry.position_m" => description.entry.position_m[1] = value,
                    "wall.line_stiffness_n_per_m2" => {
                        description.wall.line_stiffness_n_per_m2 = value;
                    }
                    "wall.end_stiffness_n_per_m" => description.wall.end_stiffness_n_per_m = value,
                    "gravity_m_per_s2" => description.gravity_m_per_s2[0] = value,
                    other => panic!("{other} is not tried"),
                }
                description.validate()
            };
            let refused = Err(DescriptionError::Range(field));
            let step = 1e-6 * (high - low).abs().min(high.abs());
            assert_eq!((with(*low), with(*high)), (Ok(()), Ok(())), "{field}");
            assert_eq!(with(high + step), refused, "{field}");
            assert_eq!(with(low - 1e-6 * low.abs().max(1e-9)), refused, "{field}");
        }
    }

    /// The key's own bounds follow from the model's.
    #[test]
    fn a_refused_number_is_named_by_its_key_with_its_bounds() {
        let mut rig = rig();
        rig.instrument.sections[1].youngs_modulus_pa = 5e14;
        let description = describe::<f32>(&rig, &SolverDefaults::default(), 1e-3);
        let bundle = Bundle {
            path: "nowhere".into(),
            rig: Rig {
                name: "a".into(),
                plant: Plant::Catheter(Box::new(rig)),
                sensor: RigSensor::default(),
                priors: RigPriors::default(),
                note: None,
            },
            mesh: None,
            centreline: Vec::new(),
            trials: Vec::new(),
            warnings: Vec::new(),
        };
        let Err(BundleOrModel::Bundle(error)) = check(&bundle, &description) else {
            panic!("it is refused by its key")
        };
        let said = error.to_string();
        assert!(said.contains("`instrument.sections[1].youngs_modulus_Pa` = 5e14 "), "{said}");
        // I = π/64 (1.6⁴ − 1⁴) mm⁴ = 0.272621 mm⁴, so that 1 N·m² is 3.668e12 Pa.
        assert!(said.contains("to 3.668e12, "), "{said}");
    }
}
