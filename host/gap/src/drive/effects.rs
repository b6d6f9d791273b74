//! The effects of a drive: an axis of known mass, driven by a force, whose position is measured.
//!
//! With the measured position q, the force that moves the mass is
//!
//! > F = e (M q̈ + L + f(q, q̇)) + D q̇,   f = F_c s + F_v q̇ + F_s exp(−(q̇/v_s)²) s + μ |M q̈ + L| s
//! >     + F_0 + A cos(2π q/λ) + B sin(2π q/λ),   δ ds/d|q| = tanh(q̇/v_ε) − s
//!
//! Dry friction may change evenly in the course of a trial, as it does where an axis warms up.
//! L is a load that is known, and D q̇ what the voltage that a motor induces takes from one that is given a
//! voltage. Of a rotary axis q is an angle, F a torque and M an inertia.
//!
//! δ is the presliding distance of Coulomb friction, over which all friction turns with it.
//! e is 0 while a gap of width b is crossed after a reversal (backlash), else 1. The encoder may
//! count (1 + c) of what was travelled and report it late; the command's measurement has a gain,
//! a time constant, a bias and a drift.

use std::f64::consts::TAU;

use cathforce_bundle::bundle::Axis as Kind;

use super::course::Course;
use crate::plant::{Along, Effect, Parameter, Point, Swing};
use crate::signal::Gaussian;

/// Velocity over which Coulomb friction turns over, at most \[m/s\] and as a share of the largest
/// speed: what moves slowly must not spend its way in between.
const MOST_TURNOVER_M_PER_S: f64 = 0.5e-3;
const TURNOVER_SHARE: f64 = 5e-3;
/// But never less than this share of it: there are fast axes, and such whose position is an angle.
const LEAST_TURNOVER_SHARE: f64 = 1e-3;

/// What the command's measurement follows late is smoothed so far first, in grid points: a low pass
/// of all that is predicted would take away the noise of the position, and be found wherever that
/// is large.
const FOLLOWED_SD: f64 = 8.0;

/// Ripples a travel: fewer are no ripple but a force that differs from one end to the other, more
/// are lost in the smoothing.
const LEAST_CYCLES: f64 = 2.0;
const MOST_CYCLES: f64 = 200.0;
/// Order of the nuisances; a ripple is a force bias that comes and goes.
pub const FORCE_BIAS: usize = 0;
pub const TIME_SHIFT: usize = 1;

/// Order of the library; indices into [`Point::effects`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
enum Is {
    Coulomb,
    Viscous,
    Offset,
    Stribeck,
    LoadFriction,
    Backlash,
    Ripple,
    FrictionDrift,
    EncoderScale,
    Latency,
    Bias,
    Drift,
    Gain,
    TimeConstant,
}

/// How large things are on this axis, so that priors mean the same on any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// RMS of the command \[N\].
    pub force_n: f64,
    /// Largest speed \[m/s\].
    pub speed_m_per_s: f64,
    /// Travel \[m\].
    pub travel_m: f64,
    /// Length of a trial \[s\].
    pub duration_s: f64,
}

impl Scale {
    /// Velocity over which Coulomb friction turns over \[m/s\].
    pub fn turnover_m_per_s(&self) -> f64 {
        let most = MOST_TURNOVER_M_PER_S.max(LEAST_TURNOVER_SHARE * self.speed_m_per_s);
        (TURNOVER_SHARE * self.speed_m_per_s).min(most)
    }
}

/// The library of an axis on which everything is 1: bounds and priors as multiples of
/// [`counted_in`].
pub fn listed() -> Vec<Effect> {
    let one = Scale { force_n: 1.0, speed_m_per_s: 1.0, travel_m: 1.0, duration_s: 1.0 };
    library(&one, Kind::Linear)
}

/// What bounds of a parameter of this unit go by: f is the RMS of the command, v the largest speed,
/// q the travel, t the length of a trial. `None` where they are the same on every axis.
pub fn counted_in(unit: &str) -> Option<&'static str> {
    match unit {
        "N" | "N·m" => Some("f"),
        "m/s" | "rad/s" => Some("v"),
        "m" | "rad" => Some("q"),
        "N·s/m" | "N·m·s/rad" => Some("f/v"),
        "N/s" | "N·m/s" => Some("f/t"),
        _ => None,
    }
}

/// The library, in the order of [`Is`].
pub fn library(scale: &Scale, kind: Kind) -> Vec<Effect> {
    let name = |linear, rotary| match kind {
        Kind::Linear => linear,
        Kind::Rotary => rotary,
    };
    let (newton, metre, speed) = (name("N", "N·m"), name("m", "rad"), name("m/s", "rad/s"));
    let force = name("force_n", "torque_nm");
    let Scale { force_n: f, speed_m_per_s: v, travel_m: q, duration_s: t } = *scale;
    let positive =
        |name, unit, high, scale| Parameter { name, unit, low: 0.0, high, off: 0.0, scale };
    let signed =
        |name, unit, high: f64, scale| Parameter { name, unit, low: -high, high, off: 0.0, scale };
    let effect = |id, what, parameters, starts: &[&[f64]], confused_with| Effect {
        id,
        what,
        parameters,
        starts: starts.iter().map(|values| values.to_vec()).collect(),
        confused_with,
    };
    let lengths = [3.0, 6.0, 12.5, 25.0, 50.0].map(|n| q / n);
    let ripple: Vec<[f64; 3]> = lengths.iter().map(|&length| [0.05 * f, 0.0, length]).collect();
    let ripple: Vec<&[f64]> = ripple.iter().map(|values| values.as_slice()).collect();
    vec![
        effect(
            "drive.coulomb",
            "friction of constant size against the motion",
            vec![
                positive(force, newton, 10.0 * f, f),
                positive(name("presliding_m", "presliding_rad"), metre, 0.1 * q, 2e-4 * q),
            ],
            &[&[0.2 * f, 0.0], &[0.5 * f, 0.0], &[f, 0.0]],
            &["drive.viscous", "drive.stribeck", "drive.load_friction"],
        ),
        effect(
            "drive.viscous",
            "friction proportional to the speed",
            vec![positive(
                name("n_s_per_m", "nm_s_per_rad"),
                name("N·s/m", "N·m·s/rad"),
                10.0 * f / v,
                f / v,
            )],
            &[&[0.2 * f / v], &[0.5 * f / v], &[f / v]],
            &["drive.latency", "drive.stribeck"],
        ),
        effect(
            "drive.offset",
            name(
                "a constant force: friction differs between the two directions",
                "a constant torque: friction differs between the two directions",
            ),
            vec![signed(force, newton, 2.0 * f, 0.2 * f)],
            &[&[0.05 * f], &[-0.05 * f]],
            &["sensor.bias"],
        ),
        effect(
            "drive.stribeck",
            name(
                "friction that falls as motion sets in: by 63 % at speed_m_per_s",
                "friction that falls as motion sets in: by 63 % at speed_rad_per_s",
            ),
            vec![
                positive(force, newton, 5.0 * f, 0.3 * f),
                Parameter {
                    name: name("speed_m_per_s", "speed_rad_per_s"),
                    unit: speed,
                    // What falls sooner than friction turns over is another turnover.
                    low: TURNOVER_SHARE * v,
                    high: 0.3 * v,
                    off: 0.05 * v,
                    scale: 0.05 * v,
                },
            ],
            &[&[0.1 * f, 0.02 * v], &[0.1 * f, 0.05 * v], &[0.1 * f, 0.15 * v]],
            &["drive.coulomb", "drive.viscous"],
        ),
        effect(
            "drive.load_friction",
            "friction proportional to the load, be it inertia or a known one",
            vec![positive("per_force", "1", 1.0, 0.1)],
            &[&[0.02], &[0.05], &[0.2]],
            &["drive.coulomb", "sensor.gain"],
        ),
        effect(
            "drive.backlash",
            "a gap that is crossed without load after a reversal",
            vec![positive(name("position_m", "position_rad"), metre, 0.05 * q, 1e-3 * q)],
            &[&[1e-4 * q], &[1e-3 * q], &[5e-3 * q]],
            &["drive.latency", "drive.coulomb"],
        ),
        effect(
            "drive.ripple",
            "a force that repeats with the position",
            vec![
                signed(name("cosine_n", "cosine_nm"), newton, 2.0 * f, 0.1 * f),
                signed(name("sine_n", "sine_nm"), newton, 2.0 * f, 0.1 * f),
                Parameter {
                    name: name("wavelength_m", "wavelength_rad"),
                    unit: metre,
                    low: q / MOST_CYCLES,
                    high: q / LEAST_CYCLES,
                    off: 0.25 * q,
                    scale: 0.1 * q,
                },
            ],
            &ripple,
            &["drive.offset"],
        ),
        effect(
            "drive.friction_drift",
            "dry friction changes in the course of a trial, as where the axis warms up",
            vec![signed(force, newton, 2.0 * f, 0.1 * f)],
            &[&[0.1 * f], &[-0.1 * f]],
            &["sensor.drift"],
        ),
        effect(
            "drive.encoder_scale",
            "the encoder counts more, or less, than was travelled",
            vec![signed("ratio", "1", 0.5, 0.03)],
            &[&[0.05], &[-0.05]],
            &["sensor.gain"],
        ),
        effect(
            "drive.latency",
            "the encoder reports later than the force was applied",
            vec![signed("time_s", "s", 0.05, 0.01)],
            &[&[0.004], &[-0.004], &[0.012]],
            &["sensor.time_constant", "drive.backlash"],
        ),
        effect(
            "sensor.bias",
            "a constant in the command's measurement",
            vec![signed(force, newton, 2.0 * f, 0.1 * f)],
            &[&[0.05 * f], &[-0.05 * f]],
            &["drive.offset"],
        ),
        effect(
            "sensor.drift",
            "a bias that grows with time",
            vec![signed(
                name("force_n_per_s", "torque_nm_per_s"),
                name("N/s", "N·m/s"),
                f / t,
                0.05 * f / t,
            )],
            &[&[0.05 * f / t], &[-0.05 * f / t]],
            &["drive.offset"],
        ),
        effect(
            "sensor.gain",
            "the command is measured too large, or too small",
            vec![signed("ratio", "1", 0.5, 0.03)],
            &[&[0.05], &[-0.05]],
            &["drive.encoder_scale", "drive.load_friction"],
        ),
        effect(
            "sensor.time_constant",
            "the command's measurement follows late, as a low pass",
            vec![positive("time_s", "s", 0.1, 0.01)],
            &[&[0.002], &[0.01]],
            &["drive.latency"],
        ),
    ]
}

/// The command's measurement at every point of the motion, before it is smoothed \[N\].
pub fn command(course: &Course, point: &Point) -> Vec<f64> {
    let known = &course.known;
    let value = |effect: Is, parameter: usize| point.effects[effect as usize][parameter];
    let counted = 1.0 + value(Is::EncoderScale, 0);
    let engaged = engagement(&course.position_m, counted * value(Is::Backlash, 0));
    let (coulomb, viscous) = (value(Is::Coulomb, 0), value(Is::Viscous, 0));
    let (excess, stribeck) = (value(Is::Stribeck, 0), value(Is::Stribeck, 1));
    let [cosine, sine, length] = [0, 1, 2].map(|i| value(Is::Ripple, i));
    let rippled = cosine != 0.0 || sine != 0.0;
    let dt_s = course.dt_s;
    let middle_s = 0.5 * dt_s * course.position_m.len() as f64;
    // By the end of the trial, beside what friction is in its middle.
    let warming = value(Is::FrictionDrift, 0);
    let lag = value(Is::TimeConstant, 0);
    let sign = course.against(value(Is::Coulomb, 1));
    let applied = |i: usize| {
        let velocity = course.velocity_m_per_s[i] / counted;
        let load = known.load.get(i).copied().unwrap_or(0.0);
        let carried = known.inertia * course.acceleration_m_per_s2[i] / counted + load;
        let sign = sign[i];
        let mut friction = coulomb * sign + viscous * velocity;
        if excess != 0.0 {
            friction += excess * (-(velocity / stribeck).powi(2)).exp() * sign;
        }
        friction += value(Is::LoadFriction, 0) * carried.abs() * sign;
        if warming != 0.0 {
            friction += warming * sign * (i as f64 * dt_s / middle_s - 1.0);
        }
        friction += value(Is::Offset, 0);
        if rippled {
            let angle = TAU * course.position_m[i] / (counted * length);
            friction += cosine * angle.cos() + sine * angle.sin();
        }
        engaged.as_ref().map_or(1.0, |e| e[i]) * (carried + friction) + known.induced * velocity
    };
    let mut force_n: Vec<f64> = (0..course.position_m.len()).map(applied).collect();
    if lag > 0.0 {
        follow(&mut force_n, course.every, 1.0 - (-dt_s / lag).exp());
    }
    let measured = |(i, followed): (usize, f64)| {
        let drift = value(Is::Drift, 0) * (i as f64 * dt_s - middle_s);
        (1.0 + value(Is::Gain, 0)) * followed + value(Is::Bias, 0) + drift
    };
    force_n.into_iter().enumerate().map(measured).collect()
}

/// Lets a force at every n-th grid point follow late, by this share of what it is behind at every point.
pub(crate) fn follow(force_n: &mut [f64], every: usize, share: f64) {
    let smooth = Gaussian::new(FOLLOWED_SD / every as f64).smooth(force_n);
    let mut followed = smooth[0];
    for (force, now) in force_n.iter_mut().zip(smooth) {
        followed += share * (now - followed);
        *force += followed - now;
    }
}

/// By how much the mass is engaged: 0 inside a gap of this width, 1 at its ends; `None` without
/// a gap. It engages over a twentieth of the gap.
fn engagement(position_m: &[f64], gap_m: f64) -> Option<Vec<f64>> {
    if gap_m <= 0.0 {
        return None;
    }
    let (mut inside, mut last) = (0.0, position_m.first().copied().unwrap_or_default());
    let half = 0.5 * gap_m;
    let at = |&position: &f64| {
        inside = (inside + position - last).clamp(-half, half);
        last = position;
        1.0 - ((half - f64::abs(inside)) / (0.05 * gap_m)).min(1.0)
    };
    Some(position_m.iter().map(at).collect())
}

/// How an effect swings along the position: a ripple is a bias of the force that comes and goes.
pub fn swing(effect: usize, travel_m: f64) -> Option<Swing> {
    (effect == Is::Ripple as usize).then(|| Swing {
        nuisances: vec![FORCE_BIAS],
        along: Along::Position,
        cycles: [LEAST_CYCLES, MOST_CYCLES].map(|cycles| cycles / travel_m),
        own_phase: None,
        parameters: |amplitudes, cycles, phase| {
            let (sine, cosine) = phase.sin_cos();
            vec![amplitudes[0] * sine, amplitudes[0] * cosine, 1.0 / cycles]
        },
    })
}

/// The inertial force of an effect over that without it; `None` of one that does not change it alike
/// everywhere.
pub fn inertia_ratio(effect: usize, values: &[f64]) -> Option<f64> {
    match effect {
        e if e == Is::EncoderScale as usize => Some(1.0 / (1.0 + values[0])),
        e if e == Is::Gain as usize => Some(1.0 + values[0]),
        _ => None,
    }
}

/// Which effect shifts the time axis: it acts where the smoothed command is read.
pub fn latency_s(point: &Point) -> f64 {
    point.effects[Is::Latency as usize][0]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale =
        Scale { force_n: 40.0, speed_m_per_s: 0.1, travel_m: 0.2, duration_s: 10.0 };

    #[test]
    fn what_is_listed_is_what_is_fitted() {
        let own = library(&SCALE, Kind::Linear);
        for (listed, own) in listed().iter().zip(&own) {
            for (listed, own) in listed.parameters.iter().zip(&own.parameters) {
                let Scale { force_n: f, speed_m_per_s: v, travel_m: q, duration_s: t } = SCALE;
                let by = match counted_in(own.unit) {
                    Some("f") => f,
                    Some("v") => v,
                    Some("q") => q,
                    Some("f/v") => f / v,
                    Some("f/t") => f / t,
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
    fn the_order_of_the_library_is_that_of_its_indices() {
        let library = library(&SCALE, Kind::Linear);
        for (id, index) in [
            ("drive.coulomb", Is::Coulomb),
            ("drive.viscous", Is::Viscous),
            ("drive.offset", Is::Offset),
            ("drive.stribeck", Is::Stribeck),
            ("drive.load_friction", Is::LoadFriction),
            ("drive.backlash", Is::Backlash),
            ("drive.ripple", Is::Ripple),
            ("drive.friction_drift", Is::FrictionDrift),
            ("drive.encoder_scale", Is::EncoderScale),
            ("drive.latency", Is::Latency),
            ("sensor.bias", Is::Bias),
            ("sensor.drift", Is::Drift),
            ("sensor.gain", Is::Gain),
            ("sensor.time_constant", Is::TimeConstant),
        ] {
            assert_eq!(library[index as usize].id, id);
        }
        assert_eq!(library.len(), Is::TimeConstant as usize + 1);
    }

    #[test]
    fn a_gap_is_crossed_without_load_and_carries_again() {
        let there: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-4).collect();
        let back = there.iter().rev();
        let path: Vec<f64> = there.iter().chain(back).copied().collect();
        let engaged = engagement(&path, 2e-3).unwrap();
        assert_eq!(engaged[50], 1.0, "forwards, long after the start");
        assert_eq!(engaged[110], 0.0, "1 mm after the reversal");
        assert_eq!(engaged[180], 1.0, "the gap is behind it");
        assert!(engagement(&path, 0.0).is_none());
    }
}
