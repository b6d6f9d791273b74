//! The effects of a transmission, and the model that a point of their parameters is.

use cathforce_bundle::bundle::{Axis, TransmissionRig};

use super::model::Model;
use crate::plant::{Effect, Parameter, Point};

/// Which effect an entry of the library is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Is {
    Gain,
    Curvature,
    DeadZone,
    BoucWen,
    PrandtlIshlinskii,
    Sheath,
    Compliance,
    Lag,
    Latency,
    Offset,
    Drift,
}

/// How large things are on this transmission, so that priors mean the same on any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Travel of the input.
    pub travel: f64,
    /// Range that the output moves over by the stated gain.
    pub range: f64,
    /// RMS of the load at the output \[N\] or \[N·m\]; `None` without one.
    pub load: Option<f64>,
    /// Length of a trial \[s\].
    pub duration_s: f64,
}

/// Largest dead zone, and twice the largest radius of a stop, over the travel: a trial is not scored before its input
/// has covered as much, because nobody knows where it began in its slack.
pub const MOST_SLACK: f64 = 0.2;
/// Shortest length over which the hysteresis of Bouc and Wen turns round, over the travel: what turns round sooner is a
/// dead zone.
const LEAST_LENGTH: f64 = 2e-3;

/// The library of a transmission on which everything is 1: bounds and priors as multiples of [`counted_in`].
pub fn listed() -> Vec<Effect> {
    let one = Scale { travel: 1.0, range: 1.0, load: Some(1.0), duration_s: 1.0 };
    let rig = TransmissionRig {
        input: Axis::Linear,
        output: Axis::Linear,
        gain: 1.0,
        dead_zone: 0.0,
        dead_zone_follows: 0.0,
        compliance: 0.0,
        time_constant_s: 0.0,
        sheath: Some(cathforce_bundle::bundle::RigSheath {
            bend_rad: 1.0,
            friction_coefficient: 0.0,
            pull_n: 1.0,
            return_n_per_m: 1.0,
            tendon_n_per_m: 1.0,
        }),
        bouc_wen: None,
        prandtl_ishlinskii: None,
    };
    library(&one, &rig).into_iter().map(|(_, effect)| effect).collect()
}

/// What the bounds of a parameter of a transmission go by: q is the travel of the input, p the range of the output, l the
/// RMS of the load, t the length of a trial. `None` where they are the same on every transmission.
pub fn counted_in(parameter: &str) -> Option<&'static str> {
    let name = parameter.trim_end_matches("_rad").trim_end_matches("_m");
    match name {
        "width" | "height" | "length" | "radius" => Some("q"),
        "output" => Some("p"),
        "m_per_n" | "rad_per_nm" => Some("p/l"),
        "output_m_per_s" | "output_rad_per_s" => Some("p/t"),
        _ => None,
    }
}

/// The library with what each entry is. Values that `rig.toml` states are those without an effect.
pub fn library(scale: &Scale, rig: &TransmissionRig) -> Vec<(Is, Effect)> {
    let Scale { travel: q, range: p, load, duration_s: t } = *scale;
    let of = |axis, linear, rotary| match axis {
        Axis::Linear => linear,
        Axis::Rotary => rotary,
    };
    let (input, output) = (rig.input.unit(), rig.output.unit());
    let stated = Model::stated(rig, [-0.5 * q, 0.5 * q]);
    let [bouc_wen_height, bouc_wen_length, sharpness] = stated.bouc_wen;
    let [prandtl_height, radius] = stated.prandtl_ishlinskii;
    let parameter = |name, unit, [low, high]: [f64; 2], off: f64, scale| Parameter {
        name,
        unit,
        // What rig.toml states is within the bounds, whatever they are.
        low: low.min(off),
        high: high.max(off),
        off,
        scale,
    };
    let positive = |name, unit, high, off, scale| parameter(name, unit, [0.0, high], off, scale);
    let signed = |name, unit, high: f64, scale| parameter(name, unit, [-high, high], 0.0, scale);
    let effect = |id, what, parameters, starts: &[&[f64]], confused_with| Effect {
        id,
        what,
        parameters,
        starts: starts.iter().map(|values| values.to_vec()).collect(),
        confused_with,
    };
    let mut all = vec![
        (
            Is::Gain,
            effect(
                "transmission.gain",
                "the output moves more, or less, than the gain says",
                vec![signed("ratio", "1", 0.5, 0.03)],
                &[&[0.05], &[-0.05], &[0.2], &[-0.2]],
                &["transmission.curvature", "transmission.compliance"],
            ),
        ),
        (
            Is::Curvature,
            effect(
                "transmission.curvature",
                "the gain changes along the travel",
                vec![signed("share", "1", 0.8, 0.05)],
                &[&[0.1], &[-0.1]],
                &["transmission.gain", "transmission.offset"],
            ),
        ),
        (
            Is::DeadZone,
            effect(
                "transmission.dead_zone",
                "a reversal takes up slack before the output follows",
                vec![
                    positive(
                        of(rig.input, "width_m", "width_rad"),
                        input,
                        MOST_SLACK * q,
                        rig.dead_zone,
                        0.01 * q,
                    ),
                    positive("follows", "1", 0.95, rig.dead_zone_follows, 0.1),
                ],
                &[&[0.005 * q, 0.0], &[0.02 * q, 0.0], &[0.08 * q, 0.0], &[0.03 * q, 0.4]],
                &[
                    "transmission.bouc_wen",
                    "transmission.prandtl_ishlinskii",
                    "transmission.sheath",
                    "transmission.lag",
                ],
            ),
        ),
        (
            Is::BoucWen,
            effect(
                "transmission.bouc_wen",
                "hysteresis whose loss grows to a limit after a reversal, as the model of Bouc and Wen has it",
                vec![
                    positive(
                        of(rig.input, "height_m", "height_rad"),
                        input,
                        0.5 * MOST_SLACK * q,
                        bouc_wen_height,
                        0.01 * q,
                    ),
                    parameter(
                        of(rig.input, "length_m", "length_rad"),
                        input,
                        [LEAST_LENGTH * q, MOST_SLACK * q],
                        bouc_wen_length,
                        0.02 * q,
                    ),
                    parameter("sharpness", "1", [1.0, 5.0], sharpness, 0.5),
                ],
                &[
                    &[0.003 * q, 0.01 * q, 1.0],
                    &[0.01 * q, 0.03 * q, 1.0],
                    &[0.03 * q, 0.08 * q, 1.0],
                    &[0.01 * q, 0.03 * q, 2.0],
                ],
                &[
                    "transmission.prandtl_ishlinskii",
                    "transmission.dead_zone",
                    "transmission.sheath",
                ],
            ),
        ),
        (
            Is::PrandtlIshlinskii,
            effect(
                "transmission.prandtl_ishlinskii",
                "hysteresis of many stops, as the model of Prandtl and Ishlinskii has it",
                vec![
                    positive(
                        of(rig.input, "height_m", "height_rad"),
                        input,
                        0.5 * MOST_SLACK * q,
                        prandtl_height,
                        0.01 * q,
                    ),
                    parameter(
                        of(rig.input, "radius_m", "radius_rad"),
                        input,
                        [LEAST_LENGTH * q, MOST_SLACK * q],
                        radius,
                        0.05 * q,
                    ),
                ],
                &[&[0.003 * q, 0.02 * q], &[0.01 * q, 0.06 * q], &[0.03 * q, 0.15 * q]],
                &["transmission.bouc_wen", "transmission.dead_zone", "transmission.sheath"],
            ),
        ),
    ];
    if let Some(sheath) = rig.sheath {
        let mu = sheath.friction_coefficient;
        all.push((
            Is::Sheath,
            effect(
                "transmission.sheath",
                "friction of the tendon along its bent sheath",
                vec![positive("friction_coefficient", "1", 1.0, mu, 0.1)],
                &[&[mu + 0.05], &[mu + 0.2], &[0.5 * mu]],
                &["transmission.dead_zone", "transmission.bouc_wen"],
            ),
        ));
    }
    if let Some(load) = load {
        all.push((
            Is::Compliance,
            effect(
                "transmission.compliance",
                "the output gives way under its load",
                vec![positive(
                    of(rig.output, "m_per_n", "rad_per_nm"),
                    of(rig.output, "m/N", "rad/(N·m)"),
                    p / load,
                    rig.compliance,
                    0.02 * p / load,
                )],
                &[&[0.01 * p / load], &[0.05 * p / load]],
                &["transmission.gain"],
            ),
        ));
    }
    all.extend([
        (
            Is::Lag,
            effect(
                "transmission.lag",
                "the output follows late, as a low pass: how far depends on the rate",
                vec![positive("time_s", "s", 1.0, rig.time_constant_s, 0.03)],
                &[&[0.01], &[0.05], &[0.2]],
                &["transmission.latency", "transmission.dead_zone"],
            ),
        ),
        (
            Is::Latency,
            effect(
                "transmission.latency",
                "the output is reported later than the input",
                vec![signed("time_s", "s", 0.5, 0.02)],
                &[&[0.01], &[-0.01], &[0.05]],
                &["transmission.lag", "transmission.dead_zone"],
            ),
        ),
        (
            Is::Offset,
            effect(
                "transmission.offset",
                "the output is not 0 where the input is",
                vec![signed(of(rig.output, "output_m", "output_rad"), output, 2.0 * p, 0.05 * p)],
                &[&[0.02 * p], &[-0.02 * p]],
                &["transmission.curvature", "transmission.drift"],
            ),
        ),
        (
            Is::Drift,
            effect(
                "transmission.drift",
                "the output creeps with time",
                vec![signed(
                    of(rig.output, "output_m_per_s", "output_rad_per_s"),
                    of(rig.output, "m/s", "rad/s"),
                    p / t,
                    0.02 * p / t,
                )],
                &[&[0.02 * p / t], &[-0.02 * p / t]],
                &["transmission.offset"],
            ),
        ),
    ]);
    all
}

/// The model with the parameters of a point.
pub fn at_point(stated: &Model, kinds: &[Is], point: &Point) -> Model {
    let mut own = stated.clone();
    for (kind, values) in kinds.iter().zip(&point.effects) {
        match kind {
            Is::Gain => own.gain = stated.gain * (1.0 + values[0]),
            Is::Curvature => own.curvature = values[0],
            Is::DeadZone => (own.dead_zone, own.follows) = (values[0], values[1]),
            Is::BoucWen => own.bouc_wen = [values[0], values[1], values[2]],
            Is::PrandtlIshlinskii => own.prandtl_ishlinskii = [values[0], values[1]],
            Is::Sheath => {
                if let Some(sheath) = &mut own.sheath {
                    sheath.friction_coefficient = values[0];
                }
            }
            Is::Compliance => own.compliance = values[0],
            Is::Lag => own.time_constant_s = values[0],
            Is::Latency => own.latency_s = values[0],
            Is::Offset => own.offset = values[0],
            Is::Drift => own.drift_per_s = values[0],
        }
    }
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listed_goes_by_what_it_is_counted_in() {
        let scale = Scale { travel: 0.02, range: 0.5, load: Some(3.0), duration_s: 40.0 };
        let rig = TransmissionRig {
            input: Axis::Linear,
            output: Axis::Linear,
            gain: 25.0,
            dead_zone: 0.0,
            dead_zone_follows: 0.0,
            compliance: 0.0,
            time_constant_s: 0.0,
            sheath: None,
            bouc_wen: None,
            prandtl_ishlinskii: None,
        };
        let listed = listed();
        let own = library(&scale, &rig);
        assert_eq!(own.len() + 1, listed.len(), "all but the sheath");
        for (_, own) in &own {
            let listed = listed.iter().find(|listed| listed.id == own.id).unwrap();
            for (listed, own) in listed.parameters.iter().zip(&own.parameters) {
                let by = match counted_in(own.name) {
                    Some("q") => 0.02,
                    Some("p") => 0.5,
                    Some("p/l") => 0.5 / 3.0,
                    Some("p/t") => 0.5 / 40.0,
                    Some(other) => panic!("{other}"),
                    None => 1.0,
                };
                for (a, b) in [(listed.low, own.low), (listed.high, own.high)] {
                    assert!((by * a - b).abs() <= 1e-12 * b.abs(), "{}: {a} for {b}", own.name);
                }
            }
        }
    }

    #[test]
    fn without_effects_the_model_is_the_stated_one() {
        let scale = Scale { travel: 0.02, range: 0.02, load: None, duration_s: 40.0 };
        let rig = TransmissionRig {
            input: Axis::Linear,
            output: Axis::Rotary,
            gain: -2.0,
            dead_zone: 1e-3,
            dead_zone_follows: 0.2,
            compliance: 0.0,
            time_constant_s: 0.03,
            sheath: None,
            bouc_wen: None,
            prandtl_ishlinskii: None,
        };
        let stated = Model::stated(&rig, [-0.01, 0.01]);
        let (kinds, effects): (Vec<Is>, Vec<Effect>) = library(&scale, &rig).into_iter().unzip();
        assert_eq!(at_point(&stated, &kinds, &Point::off(&effects, 0)), stated);
    }
}
