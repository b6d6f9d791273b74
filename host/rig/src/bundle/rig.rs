//! `rig.toml`: what was set up, and the nominal parameters.

use toml::de::DeTable;

use super::rig_cause::RigCause;
use super::toml_reader::{Fault, Source, TableReader};
use crate::error::Place;

/// The only format there is.
pub const FORMAT: &str = "trial-bundle/1";

/// Density and viscosity of the fluids that a rig may name, at room and body temperature.
const WATER: (f64, f64) = (998.0, 1.0e-3);
const BLOOD: (f64, f64) = (1060.0, 3.5e-3);

/// A piece of the instrument of one stiffness, in the bundle's order: base to tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigSection {
    pub length_m: f64,
    pub youngs_modulus_pa: f64,
}

/// A piece of the unloaded tip, from the tip backwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipPiece {
    pub length_m: f64,
    pub curvature_per_m: f64,
}

/// Table `[instrument]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RigInstrument {
    pub length_m: f64,
    pub outer_diameter_m: f64,
    pub inner_diameter_m: f64,
    pub density_kg_per_m3: f64,
    pub poissons_ratio: f64,
    /// From the base to the tip.
    pub sections: Vec<RigSection>,
    /// From the tip backwards.
    pub tip_precurve: Vec<TipPiece>,
}

/// Table `[entry]`; `direction` and `up` are orthonormal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigEntry {
    pub position_m: [f64; 3],
    pub direction: [f64; 3],
    pub up: [f64; 3],
    pub guide_length_m: Option<f64>,
}

/// Table `[vessel]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigVessel {
    pub friction_coefficient: f64,
    /// Of one contact point, an instrument piece of length `wall_contact_spacing_m`.
    pub wall_stiffness_n_per_m: f64,
    pub wall_contact_spacing_m: f64,
    pub wall_tangential_ratio: Option<f64>,
}

/// What surrounds the instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    pub density_kg_per_m3: f64,
    pub viscosity_pa_s: f64,
}

/// Table `[environment]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigEnvironment {
    pub gravity_m_per_s2: [f64; 3],
    pub fluid: Option<Fluid>,
}

/// Table `[sensor]`; what is not stated is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigSensor {
    pub force_noise_sd_n: Option<f64>,
    pub force_rate_hz: Option<f64>,
    pub tip_noise_sd_m: Option<f64>,
    pub drive_noise_sd_n: Option<f64>,
    pub shape_noise_sd_m: Option<f64>,
    pub insertion_resolution_m: Option<f64>,
    pub rotation_resolution_rad: Option<f64>,
    pub position_noise_sd_m: Option<f64>,
}

/// A catheter or guidewire in a vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct CatheterRig {
    pub instrument: RigInstrument,
    pub entry: RigEntry,
    pub vessel: RigVessel,
    pub environment: RigEnvironment,
}

/// One axis on its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveRig {
    pub moving_mass_kg: f64,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq)]
pub enum Plant {
    Catheter(Box<CatheterRig>),
    Drive(DriveRig),
}

/// All of `rig.toml`.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    pub name: String,
    pub plant: Plant,
    pub sensor: RigSensor,
    /// Free text of `[nominal]`.
    pub note: Option<String>,
}

/// Something that looks wrong in `rig.toml`.
pub(crate) type RigWarning = (Place, String);

const POSITIVE: std::ops::RangeInclusive<f64> = f64::MIN_POSITIVE..=f64::MAX;
const NOT_NEGATIVE: std::ops::RangeInclusive<f64> = 0.0..=f64::MAX;
const CATHETER_KEYS: [&str; 9] = [
    "format",
    "name",
    "plant",
    "instrument",
    "entry",
    "vessel",
    "environment",
    "sensor",
    "nominal",
];
const DRIVE_KEYS: [&str; 6] = ["format", "name", "plant", "drive", "sensor", "nominal"];

impl Rig {
    /// Reads the text of `rig.toml`. Unknown keys, missing ones, wrong types and values that
    /// no instrument can have are faults; what merely looks wrong is warned of.
    pub(crate) fn parse(text: &str) -> Result<(Rig, Vec<RigWarning>), Fault> {
        let source = Source(text);
        let document = DeTable::parse(text).map_err(|error| {
            let place = error.span().map_or(Place::Whole, |span| source.place(&span));
            (place, RigCause::Syntax(error.message().to_owned()))
        })?;
        let is_drive = document.get_ref().iter().any(|(key, value)| {
            key.get_ref() == "plant" && value.get_ref().as_str() == Some("drive")
        });
        let known: &[&str] = if is_drive { &DRIVE_KEYS } else { &CATHETER_KEYS };
        let root = TableReader::new(source, String::new(), 0..0, document.get_ref(), known)?;
        let (format, place) = root.text("format")?;
        if format != FORMAT {
            return Err((place, choice("format", format, "\"trial-bundle/1\"")));
        }
        if let Some((plant, place)) = root.optional_text("plant")?
            && plant != "drive"
            && plant != "catheter"
        {
            return Err((place, choice("plant", plant, "\"catheter\" and \"drive\"")));
        }
        let mut warnings = Vec::new();
        let plant = if is_drive {
            let drive = root.table("drive", &["moving_mass_kg"])?;
            let moving_mass_kg = drive.number_in("moving_mass_kg", POSITIVE, "above 0")?;
            Plant::Drive(DriveRig { moving_mass_kg })
        } else {
            Plant::Catheter(Box::new(CatheterRig {
                instrument: instrument(&root)?,
                entry: entry(&root, &mut warnings)?,
                vessel: vessel(&root)?,
                environment: environment(&root)?,
            }))
        };
        let nominal = root.optional_table("nominal", &["note"])?;
        let note = nominal.map(|nominal| nominal.optional_text("note")).transpose()?.flatten();
        let rig = Rig {
            name: root.text("name")?.0.to_owned(),
            plant,
            sensor: sensor(&root)?,
            note: note.map(|(text, _)| text.to_owned()),
        };
        super::plausible::check(&root, &rig, &mut warnings)?;
        Ok((rig, warnings))
    }
}

fn choice(key: &'static str, found: &str, known: &'static str) -> RigCause {
    RigCause::Choice { key, found: found.to_owned(), known }
}

pub(crate) const INSTRUMENT_KEYS: [&str; 7] = [
    "length_m",
    "outer_diameter_m",
    "inner_diameter_m",
    "density_kg_per_m3",
    "poissons_ratio",
    "sections",
    "tip_precurve",
];
pub(crate) const SECTION_KEYS: [&str; 2] = ["length_m", "youngs_modulus_Pa"];
pub(crate) const PRECURVE_KEYS: [&str; 2] = ["length_m", "curvature_per_m"];

fn instrument(root: &TableReader<'_>) -> Result<RigInstrument, Fault> {
    use cathforce_mechanics::{MAX_PRECURVE, MAX_SECTIONS};

    let table = root.table("instrument", &INSTRUMENT_KEYS)?;
    let length_m = table.number_in("length_m", POSITIVE, "above 0")?;
    let outer_diameter_m = table.number_in("outer_diameter_m", POSITIVE, "above 0")?;
    let inner_diameter_m = table.number_in(
        "inner_diameter_m",
        0.0..=0.999 * outer_diameter_m,
        "at least 0 (a solid wire) and below the outer diameter",
    )?;
    let sections = table.tables("sections", &SECTION_KEYS)?;
    let sections = sections
        .iter()
        .map(|section| {
            Ok(RigSection {
                length_m: section.number_in("length_m", POSITIVE, "above 0")?,
                youngs_modulus_pa: section.number_in("youngs_modulus_Pa", POSITIVE, "above 0")?,
            })
        })
        .collect::<Result<Vec<_>, Fault>>()?;
    if sections.is_empty() {
        return Err((table.place_of("sections"), RigCause::NoSections));
    }
    let sum_m: f64 = sections.iter().map(|section| section.length_m).sum();
    if (sum_m - length_m).abs() > 1e-4 {
        return Err((table.place_of("sections"), RigCause::SectionLengths { sum_m, length_m }));
    }
    let tip_precurve = table
        .tables("tip_precurve", &PRECURVE_KEYS)?
        .iter()
        .map(|piece| {
            Ok(TipPiece {
                length_m: piece.number_in("length_m", NOT_NEGATIVE, "at least 0")?,
                curvature_per_m: piece.number("curvature_per_m")?.value,
            })
        })
        .collect::<Result<Vec<_>, Fault>>()?;
    for (key, found, most) in [
        ("instrument.sections", sections.len(), MAX_SECTIONS),
        ("instrument.tip_precurve", tip_precurve.len(), MAX_PRECURVE),
    ] {
        if found > most {
            let place = table.place_of(key.rsplit('.').next().unwrap_or(key));
            return Err((place, RigCause::TooMany { key, found, most }));
        }
    }
    Ok(RigInstrument {
        length_m,
        outer_diameter_m,
        inner_diameter_m,
        density_kg_per_m3: table.number_in("density_kg_per_m3", POSITIVE, "above 0")?,
        poissons_ratio: table.number_in("poissons_ratio", -0.99..=0.5, "between -1 and 0.5")?,
        sections,
        tip_precurve,
    })
}

pub(crate) const ENTRY_KEYS: [&str; 4] = ["position_m", "direction", "up", "guide_length_m"];

fn entry(root: &TableReader<'_>, warnings: &mut Vec<RigWarning>) -> Result<RigEntry, Fault> {
    use nalgebra::Vector3;

    /// Rounding of six decimals stays below.
    const EXACT: f64 = 1e-5;

    let table = root.table("entry", &ENTRY_KEYS)?;
    let mut unit = |key: &'static str| {
        let (vector, place) = table.vector(key)?;
        let vector = Vector3::from(vector);
        let length = vector.norm();
        if length < 1e-9 {
            return Err((place, RigCause::ZeroVector(key)));
        }
        if (length - 1.0).abs() > EXACT {
            let message = format!("entry.{key} has length {length:.6}, not 1; it was scaled");
            warnings.push((place, message));
        }
        Ok((vector / length, place))
    };
    let (direction, _) = unit("direction")?;
    let (up, place) = unit("up")?;
    let lean = up.dot(&direction);
    let across = up - direction * lean;
    if across.norm() < 1e-3 {
        return Err((place, RigCause::ParallelUp));
    }
    if lean.abs() > EXACT {
        let degrees = lean.abs().min(1.0).asin().to_degrees();
        let message = format!(
            "entry.up is {degrees:.3}° short of normal to direction; its normal part was taken"
        );
        warnings.push((place, message));
    }
    Ok(RigEntry {
        position_m: table.vector("position_m")?.0,
        direction: direction.into(),
        up: across.normalize().into(),
        guide_length_m: table.optional_number_in("guide_length_m", NOT_NEGATIVE, "at least 0")?,
    })
}

pub(crate) const VESSEL_KEYS: [&str; 4] = [
    "friction_coefficient",
    "wall_stiffness_N_per_m",
    "wall_contact_spacing_m",
    "wall_tangential_ratio",
];

fn vessel(root: &TableReader<'_>) -> Result<RigVessel, Fault> {
    let table = root.table("vessel", &VESSEL_KEYS)?;
    Ok(RigVessel {
        friction_coefficient: table.number_in(
            "friction_coefficient",
            0.0..=2.0,
            "between 0 and 2",
        )?,
        wall_stiffness_n_per_m: table.number_in("wall_stiffness_N_per_m", POSITIVE, "above 0")?,
        wall_contact_spacing_m: table.number_in("wall_contact_spacing_m", POSITIVE, "above 0")?,
        wall_tangential_ratio: table.optional_number_in(
            "wall_tangential_ratio",
            0.0..=100.0,
            "between 0 and 100",
        )?,
    })
}

pub(crate) const ENVIRONMENT_KEYS: [&str; 6] = [
    "gravity_m_per_s2",
    "fluid",
    "fluid_density_kg_per_m3",
    "fluid_viscosity_Pa_s",
    "density_kg_per_m3",
    "viscosity_Pa_s",
];

fn environment(root: &TableReader<'_>) -> Result<RigEnvironment, Fault> {
    let table = root.table("environment", &ENVIRONMENT_KEYS)?;
    let gravity_m_per_s2 = table.vector("gravity_m_per_s2")?.0;
    let nominal = match table.optional_text("fluid")? {
        None | Some(("none", _)) => None,
        Some(("water", _)) => Some(WATER),
        Some(("blood", _)) => Some(BLOOD),
        Some((other, place)) => {
            let known = "\"none\", \"water\" and \"blood\"";
            return Err((place, choice("environment.fluid", other, known)));
        }
    };
    // The format names the keys only as "density and viscosity": both spellings are read.
    let either = |long, short| -> Result<Option<f64>, Fault> {
        let given = table.optional_number_in(long, POSITIVE, "above 0")?;
        Ok(given.or(table.optional_number_in(short, POSITIVE, "above 0")?))
    };
    let density = either("fluid_density_kg_per_m3", "density_kg_per_m3")?;
    let viscosity = either("fluid_viscosity_Pa_s", "viscosity_Pa_s")?;
    let fluid = nominal.map(|(density_kg_per_m3, viscosity_pa_s)| Fluid {
        density_kg_per_m3: density.unwrap_or(density_kg_per_m3),
        viscosity_pa_s: viscosity.unwrap_or(viscosity_pa_s),
    });
    Ok(RigEnvironment { gravity_m_per_s2, fluid })
}

pub(crate) const SENSOR_KEYS: [&str; 8] = [
    "force_noise_sd_N",
    "force_rate_hz",
    "tip_noise_sd_m",
    "drive_noise_sd_N",
    "shape_noise_sd_m",
    "insertion_resolution_m",
    "rotation_resolution_rad",
    "position_noise_sd_m",
];

fn sensor(root: &TableReader<'_>) -> Result<RigSensor, Fault> {
    let Some(table) = root.optional_table("sensor", &SENSOR_KEYS)? else {
        return Ok(RigSensor::default());
    };
    let number = |key| table.optional_number_in(key, NOT_NEGATIVE, "at least 0");
    Ok(RigSensor {
        force_noise_sd_n: number("force_noise_sd_N")?,
        force_rate_hz: number("force_rate_hz")?,
        tip_noise_sd_m: number("tip_noise_sd_m")?,
        drive_noise_sd_n: number("drive_noise_sd_N")?,
        shape_noise_sd_m: number("shape_noise_sd_m")?,
        insertion_resolution_m: number("insertion_resolution_m")?,
        rotation_resolution_rad: number("rotation_resolution_rad")?,
        position_noise_sd_m: number("position_noise_sd_m")?,
    })
}
