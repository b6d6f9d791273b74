//! Table `[transmission]`, and the sensor and the priors that go with it.

use super::cause::RigCause;
use super::keys::PlantKind;
use super::priors::{RigPriors, prior_keys};
use super::toml_reader::{NOT_NEGATIVE, POSITIVE, TableReader};
use super::transmission::{RigBoucWen, RigPrandtlIshlinskii, RigSheath, TransmissionRig};
use super::types::RigSensor;
use crate::axis::Axis;

const KEYS: [&str; 13] = [
    "gain_m_per_m",
    "gain_rad_per_m",
    "gain_m_per_rad",
    "gain_rad_per_rad",
    "dead_zone_m",
    "dead_zone_rad",
    "dead_zone_follows",
    "compliance_m_per_N",
    "compliance_rad_per_Nm",
    "time_constant_s",
    "sheath",
    "bouc_wen",
    "prandtl_ishlinskii",
];
/// Output and input of the gains, in the order of their keys.
const GAINS: [(&str, Axis, Axis); 4] = [
    ("gain_m_per_m", Axis::Linear, Axis::Linear),
    ("gain_rad_per_m", Axis::Rotary, Axis::Linear),
    ("gain_m_per_rad", Axis::Linear, Axis::Rotary),
    ("gain_rad_per_rad", Axis::Rotary, Axis::Rotary),
];
const SHEATH_KEYS: [&str; 5] =
    ["bend_rad", "friction_coefficient", "pull_N", "return_N_per_m", "tendon_N_per_m"];
const BOUC_WEN_KEYS: [&str; 5] = ["height_m", "height_rad", "length_m", "length_rad", "sharpness"];
const PRANDTL_ISHLINSKII_KEYS: [&str; 4] = ["height_m", "height_rad", "radius_m", "radius_rad"];
/// Those of `[sensor]`.
pub(super) const SENSOR_KEYS: [&str; 4] =
    ["input_noise_sd_m", "input_noise_sd_rad", "output_noise_sd_m", "output_noise_sd_rad"];

/// A share of the motion: with 1 nothing would be lost.
const SHARE: std::ops::RangeInclusive<f64> = 0.0..=0.99;
/// Exponents of the model of Bouc and Wen.
const SHARPNESS: std::ops::RangeInclusive<f64> = 1.0..=10.0;

/// The key in the unit of an axis; the other one is refused.
fn key_of(
    table: &TableReader<'_>,
    axis: Axis,
    [linear, rotary]: [&'static str; 2],
    of: &'static str,
) -> &'static str {
    let (own, other) = match axis {
        Axis::Linear => (linear, rotary),
        Axis::Rotary => (rotary, linear),
    };
    if table.has(other) {
        let (why, fix) = match of {
            "input" => (
                "is not in the unit of the input, which the key of the gain names last",
                "write the key that ends in the unit of the input",
            ),
            _ => (
                "is not in the unit of the output, which the key of the gain names first",
                "write the key that is in the unit of the output",
            ),
        };
        let cause = RigCause::Contradiction { key: table.path(other), why, fix };
        table.report(table.place_of(other), cause);
    }
    own
}

pub(super) fn read_transmission(root: &TableReader<'_>) -> TransmissionRig {
    let table = root.table("transmission", &KEYS);
    let (gain, output, input) = read_gain(&table);
    let key = |names, of| {
        let axis = if of == "input" { input } else { output };
        key_of(&table, axis, names, of)
    };
    let not_negative = |key| table.optional_number_in(key, NOT_NEGATIVE, "at least 0");
    let dead_zone = not_negative(key(["dead_zone_m", "dead_zone_rad"], "input"));
    let compliance = not_negative(key(["compliance_m_per_N", "compliance_rad_per_Nm"], "output"));
    let follows = table.optional_number_in("dead_zone_follows", SHARE, "from 0 to 0.99");
    let bouc_wen = table.optional_table("bouc_wen", &BOUC_WEN_KEYS).map(|own| RigBoucWen {
        height: positive(&own, key_of(&own, input, ["height_m", "height_rad"], "input")),
        length: positive(&own, key_of(&own, input, ["length_m", "length_rad"], "input")),
        sharpness: own.optional_number_in("sharpness", SHARPNESS, "from 1 to 10").unwrap_or(1.0),
    });
    let prandtl = table.optional_table("prandtl_ishlinskii", &PRANDTL_ISHLINSKII_KEYS);
    let prandtl_ishlinskii = prandtl.map(|own| RigPrandtlIshlinskii {
        height: positive(&own, key_of(&own, input, ["height_m", "height_rad"], "input")),
        radius: positive(&own, key_of(&own, input, ["radius_m", "radius_rad"], "input")),
    });
    let own = TransmissionRig {
        input,
        output,
        gain,
        dead_zone: dead_zone.unwrap_or(0.0),
        dead_zone_follows: follows.unwrap_or(0.0),
        compliance: compliance.unwrap_or(0.0),
        time_constant_s: not_negative("time_constant_s").unwrap_or(0.0),
        sheath: read_sheath(&table, input),
        bouc_wen,
        prandtl_ishlinskii,
    };
    check_slope(&table, &own);
    own
}

fn positive(table: &TableReader<'_>, key: &'static str) -> f64 {
    table.number_in(key, POSITIVE, "above 0")
}

/// The gain, and the kinds of output and input that its key names.
fn read_gain(table: &TableReader<'_>) -> (f64, Axis, Axis) {
    let mut given = GAINS.into_iter().filter(|(key, ..)| table.has(key));
    let Some((key, output, input)) = given.next() else {
        // Reported by the key of a transmission of lengths.
        table.number("gain_m_per_m");
        return (1.0, Axis::Linear, Axis::Linear);
    };
    if let Some((other, ..)) = given.next() {
        let (why, fix) = ("stands beside another gain", "keep the one in the units of the trials");
        let cause = RigCause::Contradiction { key: table.path(other), why, fix };
        table.report(table.place_of(other), cause);
    }
    let number = table.number(key);
    if number.value == 0.0 {
        let (key, meaning) = (table.path(key), "not 0");
        table.report(number.place, RigCause::Range { key, value: 0.0, meaning });
        return (1.0, output, input);
    }
    (number.value, output, input)
}

fn read_sheath(table: &TableReader<'_>, input: Axis) -> Option<RigSheath> {
    let own = table.optional_table("sheath", &SHEATH_KEYS)?;
    if input == Axis::Rotary {
        let cause = RigCause::Contradiction {
            key: own.path("tendon_N_per_m"),
            why: "is of a tendon, whose input is a length, but the key of the gain names an angle",
            fix: "give the input of the trials in metres of the tendon, and gain_rad_per_m or gain_m_per_m",
        };
        own.report(own.place(), cause);
    }
    Some(RigSheath {
        bend_rad: own.number_in("bend_rad", NOT_NEGATIVE, "at least 0"),
        friction_coefficient: own.number_in("friction_coefficient", 0.0..=2.0, "between 0 and 2"),
        pull_n: own.number_in("pull_N", NOT_NEGATIVE, "at least 0"),
        return_n_per_m: own
            .optional_number_in("return_N_per_m", NOT_NEGATIVE, "at least 0")
            .unwrap_or(0.0),
        tendon_n_per_m: positive(&own, "tendon_N_per_m"),
    })
}

/// After a reversal the output must not run against the input, else there is no inverse.
fn check_slope(table: &TableReader<'_>, own: &TransmissionRig) {
    if table.fault_count() > 0 {
        return;
    }
    let refuse = |key: &'static str, why, fix| {
        let cause = RigCause::Contradiction { key: table.path(key), why, fix };
        table.report(table.place_of(key), cause);
    };
    if own.bouc_wen.is_some_and(|own| own.height > own.length) {
        refuse(
            "bouc_wen",
            "loses more than the input moves after a reversal, for its height is above its length",
            "give a length of at least the height",
        );
    }
    if own.prandtl_ishlinskii.is_some_and(|own| 2.0 * own.height > own.radius) {
        refuse(
            "prandtl_ishlinskii",
            "loses more than the input moves after a reversal, for twice its height is above its radius",
            "give a radius of at least twice the height",
        );
    }
}

/// Table `[sensor]` of a transmission.
pub(super) fn read_sensor(root: &TableReader<'_>, rig: &TransmissionRig) -> RigSensor {
    let Some(table) = root.optional_table("sensor", &SENSOR_KEYS) else {
        return RigSensor::default();
    };
    let number = |key| table.optional_number_in(key, NOT_NEGATIVE, "at least 0");
    let input = key_of(&table, rig.input, ["input_noise_sd_m", "input_noise_sd_rad"], "input");
    let output = key_of(&table, rig.output, ["output_noise_sd_m", "output_noise_sd_rad"], "output");
    RigSensor {
        position_noise_sd_m: number(input),
        output_noise_sd: number(output),
        ..RigSensor::default()
    }
}

/// Table `[priors]` of a transmission.
pub(super) fn read_priors(root: &TableReader<'_>, rig: &TransmissionRig) -> RigPriors {
    let Some(table) = root.optional_table("priors", prior_keys(PlantKind::Transmission)) else {
        return RigPriors::default();
    };
    let zero = key_of(&table, rig.output, ["output_zero_sd_m", "output_zero_sd_rad"], "output");
    RigPriors {
        output_zero_sd: table.optional_number_in(zero, POSITIVE, "above 0"),
        time_shift_sd_s: table.optional_number_in("time_shift_sd_s", POSITIVE, "above 0"),
        ..RigPriors::default()
    }
}
