//! Effects with shapes that neither the library of the diagnosis nor the other blind tests have.

use nalgebra::Vector3;

use crate::change::Truth;

/// One difference from the nominal rig.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Friction coefficient, times nominal, and a soft tangential contact before it slides (Dahl).
    Dahl { factor: f64, tangential_ratio: f64 },
    /// Friction that follows Stribeck's curve of each point's own speed with a lag (LuGre's memory).
    Lugre { excess: f64, speed_m_per_s: f64, time_s: f64 },
    /// Friction that falls by a power of each point's own speed.
    PowerOfSpeed { excess: f64, speed_m_per_s: f64, exponent: f64 },
    /// Wall stiffness, times nominal, of a wall that yields: force k (1 − exp(−a δ))/a.
    Yielding { factor: f64, per_m: f64 },
    /// Phantom displaced, turned, and bent as it is clamped: off by the square of the distance.
    BentPhantom { offset_m: Vector3<f64>, tilt_rad: Vector3<f64>, sag_per_m: Vector3<f64> },
    /// A smooth plaque on one side of the wall that takes a share of the room for the instrument; the
    /// other side stays.
    OneSided { arc_m: f64, share: f64, half_m: f64, angle_rad: f64 },
    /// A narrowing that begins steeply and ends gently.
    Tilted { arc_m: f64, share: f64, steep_m: f64, gentle_m: f64 },
    /// Phantom that breathes and, faster and another way, beats.
    BreathAndPulse {
        breath_m: Vector3<f64>,
        breath_s: f64,
        pulse_m: Vector3<f64>,
        pulse_s: f64,
        phase: f64,
    },
    /// Stiffness that grows e-fold, beginning with a share of the nominal one.
    Toe { per_m: f64, toe: f64 },
    /// Wall that relaxes over two decades of time.
    FractionalWall { ratio: f64, time_s: f64 },
    /// Coefficient that falls by a small power of the load.
    PowerOfLoad { excess: f64, load_n_per_m: f64, exponent: f64 },

    /// Elastic moduli that change gradually from the tip's factor to the shaft's.
    Graded { shaft: f64, tip: f64, over_m: f64 },
    /// Curvature that the shaft keeps, and whose direction winds along it.
    Helical { per_m: f64, turns_per_m: f64, phase_rad: f64 },
    /// Pre-curvature, times nominal, in a plane that is turned out of its own.
    TurnedTip { factor: f64, turn_rad: f64 },
    /// Stiffness that is lost as a stretched exponential.
    Stretched { share: f64, time_s: f64 },
    /// Mass, times nominal, of shaft and tip.
    Filled { shaft: f64, tip: f64 },
    /// Bending of a standard linear solid.
    StandardSolid { ratio: f64, time_s: f64 },
    /// Bending that relaxes over two decades of time.
    FractionalBend { ratio: f64, time_s: f64 },

    /// Introducer whose friction is larger at rest, and elastic before it slides.
    StribeckDrag { coulomb_n: f64, excess: f64, speed_m_per_s: f64, elastic_m: f64 },
    /// A guide that reaches past the entry plane and points a little aside.
    SkewGuide { length_m: f64, skew_rad: f64, side_rad: f64 },

    /// Feed that ripples with two harmonics.
    TwoHarmonics { ratio: f64, second: f64, pitch_m: f64, phase: f64 },
    /// Feed lost under load beyond a threshold.
    ThresholdSlip { per_n: f64, threshold_n: f64 },
    /// A dead zone in series with a spring.
    CompliantBacklash { width_m: f64, per_n: f64 },
    /// Feed and rotation, times what the encoder says; a roller that is not round.
    UnevenScale { insertion: f64, rotation: f64, uneven: f64, pitch_m: f64 },
    /// Motion that follows late, partly by a dead time and partly by a lag of first order.
    Sluggish { dead_s: f64, lag_s: f64 },
    /// Shaft before the entry that twists, and is held by friction outside.
    HeldWindup { free_length_m: f64, held_rad: f64 },

    /// Pulsating flow whose drag goes by the square of the speed.
    SquareFlow { velocity_m_per_s: Vector3<f64>, pulse: f64, frequency_hz: f64 },

    /// Zero that differs from trial to trial around another mean.
    BiasByTrial { force_n: Vector3<f64>, varies: f64, phase: f64 },
    /// Zero that drifts as a hyperbolic tangent.
    SaturatingDrift { end_n: Vector3<f64>, time_s: f64 },
    /// Zero that drifts evenly between two moments.
    RampDrift { end_n: Vector3<f64>, from_s: f64, to_s: f64 },
    /// Reading over force, other for every axis, with a cubic part.
    CubicGain { factor: f64, axes: Vector3<f64>, cubic_per_n2: f64 },
    /// Axes that are turned and not at right angles.
    Crosstalk { rotation_rad: Vector3<f64>, shear: f64 },
    /// A sensor that rings: of second order.
    Ringing { time_s: f64, damping: f64 },

    // Not in the library.
    /// Coefficient in withdrawal, times the one in feed; turns round over some feed.
    DirectedSmoothly { factor: f64, over_m: f64 },
    /// A cable that pulls at the phantom the harder, the more was fed.
    HardeningCable { per_m: Vector3<f64>, hardening_per_m: f64 },
    /// A table that shakes with two tones that beat.
    Beating { force_n: Vector3<f64>, frequency_hz: f64, apart_hz: f64 },
    /// Sensor with dry friction inside: its reading lags by up to a width.
    DrySensor { width_n: f64 },
    /// Rotation that also feeds, as a screw.
    Screw { m_per_rad: f64 },
    /// Rotation that ripples with its angle.
    RotaryRipple { ratio: f64, per_turn: f64, phase_rad: f64 },
    /// A kink: a short soft piece of shaft that is bent.
    Kink { behind_m: f64, length_m: f64, factor: f64, bent_rad: f64 },
    /// A phantom on a soft foot: it gives way to the force.
    SoftMount { m_per_n: f64 },
    /// A force at the tip, fixed in space, as of a magnet.
    TipPull { force_n: Vector3<f64> },
    /// A soft tangential contact before it slides; the coefficient is nominal.
    Presliding { tangential_ratio: f64 },
}

impl Form {
    /// The effect that a diagnosis should name.
    pub fn id(&self) -> &'static str {
        self.names().0
    }

    /// The family of its shape.
    pub fn family(&self) -> &'static str {
        self.names().1
    }

    fn names(&self) -> (&'static str, &'static str) {
        match self {
            Self::Dahl { .. } => ("contact.friction", "dahl"),
            Self::Lugre { .. } => ("contact.stribeck", "lugre"),
            Self::PowerOfSpeed { .. } => ("contact.stribeck", "power-of-speed"),
            Self::Yielding { .. } => ("wall.stiffness", "yielding"),
            Self::BentPhantom { .. } => ("wall.registration", "bent-phantom"),
            Self::OneSided { .. } => ("wall.narrowing", "one-sided"),
            Self::Tilted { .. } => ("wall.narrowing", "tilted"),
            Self::BreathAndPulse { .. } => ("wall.motion", "breath-and-pulse"),
            Self::Toe { .. } => ("wall.hyperelastic", "toe"),
            Self::FractionalWall { .. } => ("wall.viscoelastic", "fractional-wall"),
            Self::PowerOfLoad { .. } => ("contact.load_friction", "power-of-load"),
            Self::Graded { .. } => ("instrument.stiffness", "graded"),
            Self::Helical { .. } => ("instrument.stored_curvature", "helical"),
            Self::TurnedTip { .. } => ("instrument.tip_precurve", "turned-tip"),
            Self::Stretched { .. } => ("instrument.softening", "stretched"),
            Self::Filled { .. } => ("instrument.weight", "filled"),
            Self::StandardSolid { .. } => ("instrument.viscoelastic", "standard-solid"),
            Self::FractionalBend { .. } => ("instrument.viscoelastic", "fractional-bend"),
            Self::StribeckDrag { .. } => ("entry.drag", "stribeck-drag"),
            Self::SkewGuide { .. } => ("entry.guide", "skew-guide"),
            Self::TwoHarmonics { .. } => ("drive.ripple", "two-harmonics"),
            Self::ThresholdSlip { .. } => ("drive.slip", "threshold-slip"),
            Self::CompliantBacklash { .. } => ("drive.backlash", "compliant-backlash"),
            Self::UnevenScale { .. } => ("drive.encoder_scale", "uneven-scale"),
            Self::Sluggish { .. } => ("drive.latency", "sluggish"),
            Self::HeldWindup { .. } => ("instrument.torsional_windup", "held-windup"),
            Self::SquareFlow { .. } => ("fluid.drag", "square-flow"),
            Self::BiasByTrial { .. } => ("sensor.bias", "bias-by-trial"),
            Self::SaturatingDrift { .. } => ("sensor.drift", "saturating-drift"),
            Self::RampDrift { .. } => ("sensor.drift", "ramp-drift"),
            Self::CubicGain { .. } => ("sensor.gain", "cubic-gain"),
            Self::Crosstalk { .. } => ("sensor.misalignment", "crosstalk"),
            Self::Ringing { .. } => ("sensor.time_constant", "ringing"),
            Self::DirectedSmoothly { .. } => ("outside.directed_friction", "directed-smoothly"),
            Self::HardeningCable { .. } => ("outside.cable", "hardening-cable"),
            Self::Beating { .. } => ("outside.shaking", "beating"),
            Self::DrySensor { .. } => ("outside.hysteresis", "dry-sensor"),
            Self::Screw { .. } => ("outside.screw", "screw"),
            Self::RotaryRipple { .. } => ("outside.rotary_ripple", "rotary-ripple"),
            Self::Kink { .. } => ("outside.kink", "kink"),
            Self::SoftMount { .. } => ("outside.soft_mount", "soft-mount"),
            Self::TipPull { .. } => ("outside.tip_pull", "tip-pull"),
            Self::Presliding { .. } => ("outside.presliding", "presliding"),
        }
    }

    /// Its label, with those parameters that mean the same in the library. `friction_coefficient`: of
    /// the nominal rig.
    pub fn truth(&self, friction_coefficient: f64) -> Truth {
        let axes = |names: [&'static str; 3], v: Vector3<f64>| {
            names.into_iter().zip(v.iter().copied()).collect::<Vec<_>>()
        };
        let parameters = match *self {
            Self::Dahl { factor, .. } => {
                vec![("friction_coefficient", factor * friction_coefficient)]
            }
            Self::BentPhantom { offset_m, .. } => axes(["x_m", "y_m", "z_m"], offset_m),
            Self::SkewGuide { length_m, .. } => vec![("length_m", length_m)],
            Self::HeldWindup { free_length_m, .. } => vec![("free_length_m", free_length_m)],
            Self::UnevenScale { insertion, rotation, .. } => {
                vec![("insertion", insertion), ("rotation", rotation)]
            }
            Self::Sluggish { dead_s, lag_s } => vec![("time_s", dead_s + lag_s)],
            Self::BiasByTrial { force_n, .. } => axes(["x_n", "y_n", "z_n"], force_n),
            Self::Crosstalk { rotation_rad, .. } => axes(["x_rad", "y_rad", "z_rad"], rotation_rad),
            _ => Vec::new(),
        };
        let parameters = parameters.into_iter().map(|(name, value)| (name.to_owned(), value));
        Truth { id: self.id().to_owned(), parameters: parameters.collect() }
    }
}
