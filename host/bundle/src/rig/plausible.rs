//! Values that are possible but suggest a wrong unit, usually by a factor of a thousand.

use std::ops::RangeInclusive;

use super::instrument::{
    GUIDEWIRE, INSTRUMENT, INSTRUMENT_KEYS, PRECURVE_KEYS, RigInstrument, SECTION_KEYS,
};
use super::keys::{ENTRY_KEYS, ENVIRONMENT_KEYS, PlantKind, SENSOR_KEYS, VESSEL_KEYS};
use super::priors::prior_keys;
use super::toml_reader::{RigWarning, TableReader};
use super::types::{Plant, Rig};

/// An instrument of a higher density is of metal.
const METAL_KG_PER_M3: f64 = 3000.0;

/// The usual range of a number.
struct Usual {
    key: &'static str,
    range: RangeInclusive<f64>,
    /// Said when the number is too small, and when it is too large.
    says: [&'static str; 2],
}

const DIMENSIONS: [Usual; 3] = [
    Usual {
        key: "length_m",
        range: 0.05..=5.0,
        says: ["shorter than any instrument", "longer than any instrument: millimetres?"],
    },
    Usual {
        key: "outer_diameter_m",
        range: 1e-4..=1.5e-2,
        says: ["thinner than a hair", "thicker than a finger: millimetres?"],
    },
    Usual {
        key: "density_kg_per_m3",
        range: 100.0..=25_000.0,
        says: ["lighter than cork: g/cm³?", "denser than any metal"],
    },
];

const VESSEL: [Usual; 2] = [
    Usual {
        key: "wall_stiffness_N_per_m",
        range: 10.0..=1e6,
        says: ["softer than any vessel or phantom: N/mm?", "stiffer than a steel plate"],
    },
    Usual {
        key: "wall_contact_spacing_m",
        range: 1e-4..=0.1,
        says: ["below a tenth of a millimetre", "longer than a hand: millimetres?"],
    },
];

const SENSOR: [Usual; 7] = [
    Usual { key: "force_noise_sd_N", range: 0.0..=1.0, says: ["", "larger than the forces: mN?"] },
    Usual { key: "drive_noise_sd_N", range: 0.0..=2.0, says: ["", "larger than the forces: mN?"] },
    Usual {
        key: "force_rate_hz",
        range: 1.0..=2e5,
        says: ["slower than one a second: kHz?", "faster than any force sensor"],
    },
    Usual {
        key: "tip_noise_sd_m",
        range: 0.0..=0.02,
        says: ["", "coarser than any camera: millimetres?"],
    },
    Usual {
        key: "shape_noise_sd_m",
        range: 0.0..=0.02,
        says: ["", "coarser than any camera: millimetres?"],
    },
    Usual {
        key: "insertion_resolution_m",
        range: 0.0..=0.005,
        says: ["", "coarser than any encoder: millimetres?"],
    },
    Usual {
        key: "rotation_resolution_rad",
        range: 0.0..=0.5,
        says: ["", "coarser than any encoder: degrees?"],
    },
];

/// Usual priors. Only the first applies to a drive as well, whose forces may be of any size.
const PRIORS: [Usual; 7] = [
    Usual {
        key: "time_shift_sd_s",
        range: 0.0..=0.1,
        says: ["", "longer than the delay of any link: milliseconds?"],
    },
    Usual {
        key: "force_bias_sd_N",
        range: 0.0..=0.5,
        says: ["", "more than any catheter pushes: millinewtons?"],
    },
    Usual {
        key: "insertion_offset_sd_m",
        range: 0.0..=0.01,
        says: ["", "worse than any ruler: millimetres?"],
    },
    Usual {
        key: "registration_sd_m",
        range: 0.0..=0.01,
        says: ["", "worse than any ruler: millimetres?"],
    },
    Usual {
        key: "registration_sd_rad",
        range: 0.0..=0.1,
        says: ["", "more than is seen by eye: degrees?"],
    },
    Usual {
        key: "wall_sd_m",
        range: 0.0..=1e-3,
        says: ["", "coarser than any scan: millimetres?"],
    },
    Usual {
        key: "wall_at_junctions_sd_m",
        range: 0.0..=1e-3,
        says: ["", "coarser than any scan: millimetres?"],
    },
];

fn usual(table: &TableReader<'_>, expected: &[Usual], warnings: &mut Vec<RigWarning>) {
    for Usual { key, range, says } in expected {
        if let Some(number) = table.optional_number(key)
            && !range.contains(&number.value)
        {
            let says = says[usize::from(number.value > *range.end())];
            warnings.push((number.place, format!("{key} = {} is {says}", number.value)));
        }
    }
}

/// Adds warnings about what looks wrong in a rig that could be read.
pub(crate) fn check(root: &TableReader<'_>, rig: &Rig, warnings: &mut Vec<RigWarning>) {
    let kind = match rig.plant {
        Plant::Catheter(_) => PlantKind::Catheter,
        Plant::Drive(_) => PlantKind::Drive,
        Plant::Transmission(_) => PlantKind::Transmission,
    };
    if kind != PlantKind::Transmission
        && let Some(sensor) = root.optional_table("sensor", &SENSOR_KEYS)
    {
        usual(&sensor, &SENSOR, warnings);
    }
    if let Some(priors) = root.optional_table("priors", prior_keys(kind)) {
        let is_catheter = kind == PlantKind::Catheter;
        usual(&priors, if is_catheter { &PRIORS } else { &PRIORS[..1] }, warnings);
    }
    let Plant::Catheter(catheter) = &rig.plant else { return };

    for (name, instrument) in
        [(INSTRUMENT, Some(&catheter.instrument)), (GUIDEWIRE, catheter.guidewire.as_ref())]
    {
        if let Some(instrument) = instrument {
            let table = root.table(name, &INSTRUMENT_KEYS);
            check_instrument(&table, instrument, warnings);
        }
    }

    if let Some((position, place)) = root.table("entry", &ENTRY_KEYS).vector("position_m")
        && position.iter().any(|x| x.abs() > 2.0)
    {
        let message = format!("position_m = {position:?} is metres away: millimetres?");
        warnings.push((place, message));
    }
    usual(&root.table("vessel", &VESSEL_KEYS), &VESSEL, warnings);
    let environment = root.table("environment", &ENVIRONMENT_KEYS);
    let Some((gravity, place)) = environment.vector("gravity_m_per_s2") else { return };
    let size = gravity.iter().map(|x| x * x).sum::<f64>().sqrt();
    // A size of 1 suggests that the unit is g.
    if size > 15.0 || (size > 0.0 && size < 1.5) {
        let message = format!("gravity of {size} m/s² is not that of the Earth: wrong unit?");
        warnings.push((place, message));
    }
}

fn check_instrument(
    table: &TableReader<'_>,
    instrument: &RigInstrument,
    warnings: &mut Vec<RigWarning>,
) {
    usual(table, &DIMENSIONS, warnings);
    let density = instrument.density_kg_per_m3;
    for section in table.tables("sections", &SECTION_KEYS) {
        let modulus = section.number("youngs_modulus_Pa");
        let (value, place) = (modulus.value, modulus.place);
        let says = if density < METAL_KG_PER_M3 && value > 2e11 {
            "stiffer than steel, for a polymer's density: a thousand times too large?"
        } else if density < METAL_KG_PER_M3 && value > 1.5e10 {
            "stiffer than any polymer of this density: a thousand times too large?"
        } else if value > 6e11 {
            "stiffer than steel: a thousand times too large?"
        } else if value < 1e5 {
            "softer than rubber: MPa or GPa without the factor?"
        } else {
            continue;
        };
        let message = match value > 1e9 {
            true => {
                let giga = 1e-9 * value;
                format!("youngs_modulus_Pa = {value:e}, {giga} GPa, is {says} {giga} MPa?")
            }
            false => format!("youngs_modulus_Pa = {value:e} is {says}"),
        };
        warnings.push((place, message));
    }
    let mut curved = false;
    let mut bent = false;
    for piece in table.tables("tip_precurve", &PRECURVE_KEYS) {
        let (curvature, length) = (piece.number("curvature_per_m"), piece.number("length_m"));
        curved |= curvature.value != 0.0;
        bent |= curvature.value.abs() > 0.5;
        if curvature.value.abs() * instrument.outer_diameter_m > 2.0 {
            let message = format!(
                "curvature_per_m = {} bends tighter than the instrument is thick",
                curvature.value
            );
            warnings.push((curvature.place, message));
        }
        if length.value > 0.5 {
            let message =
                format!("length_m = {} is longer than any tip: millimetres?", length.value);
            warnings.push((length.place, message));
        }
    }
    if curved && !bent {
        let message = "every curvature of tip_precurve is below 0.5 /m, as good as straight: \
                       given per millimetre?";
        warnings.push((table.place_of("tip_precurve"), message.into()));
    }
}
