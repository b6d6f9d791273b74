//! Reading `rig.toml`.

use toml::de::DeTable;

use super::cause::RigCause;
use super::instrument::{read_guidewire, read_instrument};
use super::keys::{ENTRY_KEYS, ENVIRONMENT_KEYS, SENSOR_KEYS, VESSEL_KEYS, WALL_REGIONS};
use super::plausible;
use super::priors::read_priors;
use super::tendon::read_tendon;
use super::toml_reader::{Fault, NOT_NEGATIVE, POSITIVE, RigWarning, Source, TableReader};
use super::types::{
    CatheterRig, DriveRig, Fluid, Plant, Rig, RigEntry, RigEnvironment, RigSensor, RigVessel,
    WallRegion,
};
use crate::place::Place;

/// The only format there is.
pub const FORMAT: &str = "trial-bundle/1";

/// Density and viscosity of the fluids that a rig may name, at room and body temperature.
const WATER: (f64, f64) = (998.0, 1.0e-3);
const BLOOD: (f64, f64) = (1060.0, 3.5e-3);

/// Allowed stiffness of a wall region over the nominal one; a lumen can store 1/256 to 245.
const REGION_RATIOS: std::ops::RangeInclusive<f64> = 0.01..=100.0;
const CATHETER_KEYS: [&str; 12] = [
    "format",
    "name",
    "plant",
    "instrument",
    "guidewire",
    "tendon",
    "entry",
    "vessel",
    "environment",
    "sensor",
    "priors",
    "nominal",
];
const DRIVE_KEYS: [&str; 7] = ["format", "name", "plant", "drive", "sensor", "priors", "nominal"];

impl Rig {
    /// Reads the text of `rig.toml`. Unknown and missing keys, wrong types and impossible values are
    /// faults; implausible values are warnings.
    pub(crate) fn parse(text: &str) -> Result<(Rig, Vec<RigWarning>), Fault> {
        let source = Source(text);
        let document = DeTable::parse(text).map_err(|error| {
            let place = error.span().map_or(Place::Whole, |span| source.place(&span));
            (place, RigCause::Syntax(error.message().to_owned()))
        })?;
        let root = TableReader::document(source, document.get_ref());
        // The format comes first: keys of another format are no spelling mistakes.
        if let Some((format, place)) = root.optional_text("format")?
            && format != FORMAT
        {
            return Err((place, choice("format", format, "\"trial-bundle/1\"")));
        }
        // The known keys depend on the plant, so a wrong plant is reported before wrong keys.
        let is_drive = match root.optional_text("plant")? {
            None | Some(("catheter", _)) => false,
            Some(("drive", _)) => true,
            Some((other, place)) => {
                return Err((place, choice("plant", other, "\"catheter\" and \"drive\"")));
            }
        };
        let (known, others) = match is_drive {
            true => (&DRIVE_KEYS[..], &CATHETER_KEYS[..]),
            false => (&CATHETER_KEYS[..], &DRIVE_KEYS[..]),
        };
        if let Some((key, place)) = root.first_key(|key| !known.contains(&key))
            && others.contains(&key)
        {
            let [own, other] = if is_drive { ["drive", "catheter"] } else { ["catheter", "drive"] };
            return Err((place, RigCause::OtherPlant { key: key.to_owned(), own, other }));
        }
        root.check_keys(known)?;
        root.text("format")?;
        let mut warnings = Vec::new();
        let plant = if is_drive {
            let drive = root.table("drive", &["moving_mass_kg"])?;
            let moving_mass_kg = drive.number_in("moving_mass_kg", POSITIVE, "above 0")?;
            Plant::Drive(DriveRig { moving_mass_kg })
        } else {
            let instrument = read_instrument(&root)?;
            Plant::Catheter(Box::new(CatheterRig {
                guidewire: read_guidewire(&root, &instrument)?,
                tendon: read_tendon(&root, &instrument)?,
                instrument,
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
            priors: read_priors(&root, is_drive)?,
            note: note.map(|(text, _)| text.to_owned()),
        };
        plausible::check(&root, &rig, &mut warnings)?;
        Ok((rig, warnings))
    }
}

fn choice(key: &'static str, found: &str, known: &'static str) -> RigCause {
    RigCause::Choice { key, found: found.to_owned(), known }
}

fn entry(root: &TableReader<'_>, warnings: &mut Vec<RigWarning>) -> Result<RigEntry, Fault> {
    use nalgebra::Vector3;

    /// Rounding to six decimals stays below this.
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

const REGION_KEYS: [&str; 3] = ["centre_m", "radius_m", "stiffness_ratio"];

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
        wall_regions: wall_regions(&table)?,
    })
}

fn wall_regions(vessel: &TableReader<'_>) -> Result<Vec<WallRegion>, Fault> {
    let region = |table: &TableReader<'_>| {
        Ok(WallRegion {
            centre_m: table.vector("centre_m")?.0,
            radius_m: table.number_in("radius_m", POSITIVE, "above 0")?,
            stiffness_ratio: table.number_in(
                "stiffness_ratio",
                REGION_RATIOS,
                "between 0.01 and 100",
            )?,
        })
    };
    vessel.tables(WALL_REGIONS, &REGION_KEYS)?.iter().map(region).collect()
}

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
        let (given, other) = (table.optional_number(long)?, table.optional_number(short)?);
        let key = if given.is_some() { long } else { short };
        let Some(number) = given.or(other) else { return Ok(None) };
        if let Some(other) = given.and(other) {
            return Err((other.place, RigCause::Twice { key: table.path(short), as_: long }));
        }
        if nominal.is_none() {
            return Err((number.place, RigCause::NoFluid { key: table.path(key) }));
        }
        table.optional_number_in(key, POSITIVE, "above 0")
    };
    let density = either("fluid_density_kg_per_m3", "density_kg_per_m3")?;
    let viscosity = either("fluid_viscosity_Pa_s", "viscosity_Pa_s")?;
    let fluid = nominal.map(|(density_kg_per_m3, viscosity_pa_s)| Fluid {
        density_kg_per_m3: density.unwrap_or(density_kg_per_m3),
        viscosity_pa_s: viscosity.unwrap_or(viscosity_pa_s),
    });
    Ok(RigEnvironment { gravity_m_per_s2, fluid })
}

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
