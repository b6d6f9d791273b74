//! Reading `rig.toml`.

use nalgebra::Vector3;
use toml::de::DeTable;

use super::cause::RigCause;
use super::drive::{read_drive, refuse_other_axis};
use super::driven_tendons::{TENDONS, read_driven_tendons};
use super::instrument::{read_guidewire, read_instrument};
use super::keys::{
    ENTRY_KEYS, ENVIRONMENT_KEYS, PlantKind, SENSOR_KEYS, VESSEL_KEYS, WALL_REGIONS,
};
use super::plausible;
use super::priors::read_priors;
use super::read_transmission::{self, read_transmission};
use super::tendon::read_tendon;
use super::toml_reader::{Fault, Faults, NOT_NEGATIVE, POSITIVE, RigWarning, Source, TableReader};
use super::types::{
    CatheterRig, Fluid, Plant, Rig, RigEntry, RigEnvironment, RigSensor, RigVessel, WallRegion,
};
use crate::axis::Axis;
use crate::place::Place;

/// The only format there is.
pub const FORMAT: &str = "trial-bundle/1";

/// Density and viscosity of the fluids that a rig may name, at room and body temperature.
const WATER: (f64, f64) = (998.0, 1.0e-3);
const BLOOD: (f64, f64) = (1060.0, 3.5e-3);

/// Allowed stiffness of a wall region over the nominal one; a lumen can store 1/256 to 245.
const REGION_RATIOS: std::ops::RangeInclusive<f64> = 0.01..=100.0;
const CATHETER_KEYS: [&str; 13] = [
    "format",
    "name",
    "plant",
    "instrument",
    "guidewire",
    "tendon",
    TENDONS,
    "entry",
    "vessel",
    "environment",
    "sensor",
    "priors",
    "nominal",
];
const DRIVE_KEYS: [&str; 7] = ["format", "name", "plant", "drive", "sensor", "priors", "nominal"];
const TRANSMISSION_KEYS: [&str; 7] =
    ["format", "name", "plant", "transmission", "sensor", "priors", "nominal"];

/// The keys of a document, which depend on its plant.
const fn keys_of(plant: PlantKind) -> &'static [&'static str] {
    match plant {
        PlantKind::Catheter => &CATHETER_KEYS,
        PlantKind::Drive => &DRIVE_KEYS,
        PlantKind::Transmission => &TRANSMISSION_KEYS,
    }
}

impl Rig {
    /// Reads the text of `rig.toml`. Unknown and missing keys, wrong types and impossible values are
    /// faults; implausible values are warnings.
    ///
    /// `Err` holds the first fault and the others, in the order in which they were found.
    pub(crate) fn parse(text: &str) -> Result<(Rig, Vec<RigWarning>), (Fault, Vec<Fault>)> {
        let source = Source(text);
        let alone = |fault| (fault, Vec::new());
        let document = DeTable::parse(text).map_err(|error| {
            let place = error.span().map_or(Place::Whole, |span| source.place(&span));
            alone((place, RigCause::Syntax(error.message().to_owned())))
        })?;
        let faults = Faults::default();
        let root = TableReader::document(source, document.get_ref(), &faults);
        let plant = plant(&root).map_err(alone)?;
        let read = read(&root, plant);
        let mut found = faults.take().into_iter();
        match found.next() {
            None => Ok(read),
            Some(first) => Err((first, found.collect())),
        }
    }
}

fn read(root: &TableReader<'_>, kind: PlantKind) -> (Rig, Vec<RigWarning>) {
    let mut warnings = Vec::new();
    let plant = match kind {
        PlantKind::Drive => Plant::Drive(read_drive(root)),
        PlantKind::Transmission => Plant::Transmission(read_transmission(root)),
        PlantKind::Catheter => {
            let instrument = read_instrument(root);
            Plant::Catheter(Box::new(CatheterRig {
                guidewire: read_guidewire(root, &instrument),
                tendon: read_tendon(root, &instrument),
                tendons: read_driven_tendons(root, &instrument),
                instrument,
                entry: entry(root, &mut warnings),
                vessel: vessel(root),
                environment: environment(root),
            }))
        }
    };
    let (sensor, priors) = match &plant {
        Plant::Drive(drive) => {
            (sensor(root, Some(drive.axis)), read_priors(root, Some(drive.axis)))
        }
        Plant::Transmission(own) => {
            (read_transmission::read_sensor(root, own), read_transmission::read_priors(root, own))
        }
        Plant::Catheter(_) => (sensor(root, None), read_priors(root, None)),
    };
    let nominal = root.optional_table("nominal", &["note"]);
    let note = nominal.and_then(|nominal| nominal.optional_text("note"));
    let rig = Rig {
        name: root.text("name").to_owned(),
        plant,
        sensor,
        priors,
        note: note.map(|(text, _)| text.to_owned()),
    };
    if root.fault_count() == 0 {
        plausible::check(root, &rig, &mut warnings);
    }
    (rig, warnings)
}

/// Checks the format and the keys of the document, which depend on its plant.
///
/// `Err`: the fault that makes every other key of the document doubtful.
fn plant(root: &TableReader<'_>) -> Result<PlantKind, Fault> {
    if let Some((format, place)) = root.optional_text("format")
        && format != FORMAT
    {
        return Err((place, choice("format", format, "\"trial-bundle/1\"")));
    }
    let own = match root.optional_text("plant") {
        None => PlantKind::Catheter,
        Some((text, place)) => {
            let known = "\"catheter\", \"drive\" and \"transmission\"";
            let named = PlantKind::ALL.into_iter().find(|kind| kind.word() == text);
            named.ok_or_else(|| (place, choice("plant", text, known)))?
        }
    };
    let known = keys_of(own);
    if let Some((key, place)) = root.first_key(|key| !known.contains(&key)) {
        let other = PlantKind::ALL.into_iter().find(|kind| keys_of(*kind).contains(&key));
        if let Some(other) = other {
            let (own, other) = (own.word(), other.word());
            return Err((place, RigCause::OtherPlant { key: key.to_owned(), own, other }));
        }
    }
    root.check_keys(known);
    root.text("format");
    Ok(own)
}

fn choice(key: &'static str, found: &str, known: &'static str) -> RigCause {
    RigCause::Choice { key, found: found.to_owned(), known }
}

fn entry(root: &TableReader<'_>, warnings: &mut Vec<RigWarning>) -> RigEntry {
    /// Rounding to six decimals stays below this.
    const EXACT: f64 = 1e-5;

    let table = root.table("entry", &ENTRY_KEYS);
    let mut unit = |key: &'static str| {
        let (vector, place) = table.vector(key)?;
        let vector = Vector3::from(vector);
        let length = vector.norm();
        if length < 1e-9 {
            table.report(place, RigCause::ZeroVector(key));
            return None;
        }
        if (length - 1.0).abs() > EXACT {
            let message = format!("entry.{key} has length {length:.6}, not 1; it was scaled");
            warnings.push((place, message));
        }
        Some((vector / length, place))
    };
    let (direction, up) = (unit("direction"), unit("up"));
    let position_m = table.vector("position_m").map_or([0.0; 3], |(position_m, _)| position_m);
    let guide_length_m = table.optional_number_in("guide_length_m", NOT_NEGATIVE, "at least 0");
    let mut entry =
        RigEntry { position_m, direction: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0], guide_length_m };
    let Some(((direction, _), (up, place))) = direction.zip(up) else { return entry };
    let lean = up.dot(&direction);
    let across = up - direction * lean;
    if across.norm() < 1e-3 {
        table.report(place, RigCause::ParallelUp);
        return entry;
    }
    if lean.abs() > EXACT {
        let degrees = lean.abs().min(1.0).asin().to_degrees();
        let message = format!(
            "entry.up is {degrees:.3}° short of normal to direction; its normal part was taken"
        );
        warnings.push((place, message));
    }
    (entry.direction, entry.up) = (direction.into(), across.normalize().into());
    entry
}

const REGION_KEYS: [&str; 3] = ["centre_m", "radius_m", "stiffness_ratio"];

fn vessel(root: &TableReader<'_>) -> RigVessel {
    let table = root.table("vessel", &VESSEL_KEYS);
    RigVessel {
        friction_coefficient: table.number_in("friction_coefficient", 0.0..=2.0, "between 0 and 2"),
        wall_stiffness_n_per_m: table.number_in("wall_stiffness_N_per_m", POSITIVE, "above 0"),
        wall_contact_spacing_m: table.number_in("wall_contact_spacing_m", POSITIVE, "above 0"),
        wall_tangential_ratio: table.optional_number_in(
            "wall_tangential_ratio",
            0.0..=100.0,
            "between 0 and 100",
        ),
        wall_regions: wall_regions(&table),
    }
}

fn wall_regions(vessel: &TableReader<'_>) -> Vec<WallRegion> {
    let region = |table: &TableReader<'_>| WallRegion {
        centre_m: table.vector("centre_m").map_or([0.0; 3], |(centre_m, _)| centre_m),
        radius_m: table.number_in("radius_m", POSITIVE, "above 0"),
        stiffness_ratio: table.number_in("stiffness_ratio", REGION_RATIOS, "between 0.01 and 100"),
    };
    vessel.tables(WALL_REGIONS, &REGION_KEYS).iter().map(region).collect()
}

fn environment(root: &TableReader<'_>) -> RigEnvironment {
    let table = root.table("environment", &ENVIRONMENT_KEYS);
    let gravity_m_per_s2 =
        table.vector("gravity_m_per_s2").map_or([0.0; 3], |(gravity, _)| gravity);
    let before = table.fault_count();
    let nominal = match table.optional_text("fluid") {
        None | Some(("none", _)) => None,
        Some(("water", _)) => Some(WATER),
        Some(("blood", _)) => Some(BLOOD),
        Some((other, place)) => {
            let known = "\"none\", \"water\" and \"blood\"";
            table.report(place, choice("environment.fluid", other, known));
            None
        }
    };
    let is_known = table.fault_count() == before;
    // The format names the keys only as "density and viscosity": both spellings are read.
    let either = |long, short| {
        let (given, other) = (table.optional_number(long), table.optional_number(short));
        let key = if given.is_some() { long } else { short };
        let number = given.or(other)?;
        if let Some(other) = given.and(other) {
            table.report(other.place, RigCause::Twice { key: table.path(short), as_: long });
        }
        if nominal.is_none() && is_known {
            table.report(number.place, RigCause::NoFluid { key: table.path(key) });
            return None;
        }
        table.optional_number_in(key, POSITIVE, "above 0")
    };
    let density = either("fluid_density_kg_per_m3", "density_kg_per_m3");
    let viscosity = either("fluid_viscosity_Pa_s", "viscosity_Pa_s");
    let fluid = nominal.map(|(density_kg_per_m3, viscosity_pa_s)| Fluid {
        density_kg_per_m3: density.unwrap_or(density_kg_per_m3),
        viscosity_pa_s: viscosity.unwrap_or(viscosity_pa_s),
    });
    RigEnvironment { gravity_m_per_s2, fluid }
}

/// `axis`: of a drive on its own.
fn sensor(root: &TableReader<'_>, axis: Option<Axis>) -> RigSensor {
    let Some(table) = root.optional_table("sensor", &SENSOR_KEYS) else {
        return RigSensor::default();
    };
    let (position, command) = match axis {
        Some(Axis::Rotary) => ("position_noise_sd_rad", "drive_noise_sd_Nm"),
        _ => ("position_noise_sd_m", "drive_noise_sd_N"),
    };
    refuse_other_axis(
        &table,
        axis,
        &["position_noise_sd_m", "drive_noise_sd_N"],
        &["position_noise_sd_rad", "drive_noise_sd_Nm"],
    );
    let number = |key| table.optional_number_in(key, NOT_NEGATIVE, "at least 0");
    RigSensor {
        force_noise_sd_n: number("force_noise_sd_N"),
        force_rate_hz: number("force_rate_hz"),
        tip_noise_sd_m: number("tip_noise_sd_m"),
        drive_noise_sd_n: number(command),
        shape_noise_sd_m: number("shape_noise_sd_m"),
        insertion_resolution_m: number("insertion_resolution_m"),
        rotation_resolution_rad: number("rotation_resolution_rad"),
        position_noise_sd_m: number(position),
        output_noise_sd: None,
    }
}
