//! Effects that a reality may have.
//!
//! Shapes are chosen other than those of the diagnosis' own library: transitions are exponential
//! or rounded where that has rational functions or corners, profiles are Gaussian, waves are not
//! sinusoidal.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// One difference from the nominal rig.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Friction coefficient, times nominal.
    Friction {
        factor: f64,
    },
    /// Coefficient at rest above the one in motion by `excess`; gone like exp(−v/speed).
    Stribeck {
        excess: f64,
        speed_m_per_s: f64,
    },
    /// Wall stiffness, times nominal.
    WallStiffness {
        factor: f64,
    },
    /// Phantom turned by `tilt_rad` (a rotation vector) about the entry, then displaced.
    Registration {
        offset_m: Vector3<f64>,
        tilt_rad: Vector3<f64>,
    },
    /// Gaussian loss of radius around a place of the vessel's arc.
    Narrowing {
        arc_m: f64,
        depth_m: f64,
        sd_m: f64,
    },
    /// Phantom that breathes: quickly out, slowly back, a pause.
    Breathing {
        amplitude_m: Vector3<f64>,
        period_s: f64,
        phase: f64,
    },
    /// Elastic moduli of shaft and tip, times nominal.
    Stiffness {
        shaft: f64,
        tip: f64,
    },
    /// Curvature that the shaft keeps, fading over its arc behind the tip.
    StoredCurvature {
        up_per_m: f64,
        side_per_m: f64,
    },
    /// Pre-curvature, times nominal; more so towards the shaft.
    Precurve {
        factor: f64,
    },
    /// Stiffness that is lost over time, half of it quickly and half slowly.
    Softening {
        share: f64,
        time_s: f64,
    },
    /// Weight, times nominal.
    Weight {
        factor: f64,
    },
    /// Friction of the introducer, outside the vessel; turns round like tanh.
    EntryDrag {
        coulomb_n: f64,
        viscous_n_s_per_m: f64,
        turn_m: f64,
    },
    /// A guide that reaches past the entry plane.
    Guide {
        length_m: f64,
    },
    /// Feed whose speed goes up and down in triangles.
    Ripple {
        ratio: f64,
        pitch_m: f64,
        phase: f64,
    },
    /// Feed lost under load, quadratically at small loads.
    Slip {
        per_n: f64,
    },
    /// Dead zone at reversal whose ends are taken up softly.
    Backlash {
        width_m: f64,
    },
    /// Feed and rotation, times what the encoder says.
    EncoderScale {
        insertion: f64,
        rotation: f64,
    },
    /// Motion that follows the encoder late.
    Latency {
        time_s: f64,
    },
    Bias {
        force_n: Vector3<f64>,
    },
    /// Warming up: rises towards its end value.
    Drift {
        end_n: Vector3<f64>,
        time_s: f64,
    },
    /// Reading over force, falling off a little towards large forces.
    Gain {
        factor: f64,
    },
    Misalignment {
        rotation_rad: Vector3<f64>,
    },
    /// Two equal first-order lags in a row.
    TimeConstant {
        each_s: f64,
    },

    /// Wall whose stiffness grows exponentially with indentation.
    Stiffening {
        per_m: f64,
    },
    /// Wall that relaxes in two times, half of the ratio each.
    Relaxing {
        ratio: f64,
        times_s: [f64; 2],
    },
    /// Coefficient that is larger at small loads, falling exponentially.
    LightFriction {
        excess: f64,
        load_n_per_m: f64,
    },
    /// Bending moment per rate of bend, over the stiffness.
    Viscous {
        time_s: f64,
    },
    /// Shaft before the entry that twists, and follows a little late.
    Windup {
        free_length_m: f64,
    },
    /// Stream along the instrument, pulsating like a heartbeat: a hump and a pause.
    Stream {
        along_n_per_m: f64,
        pulse: f64,
        period_s: f64,
    },

    // Not in the library.
    /// Coefficient in withdrawal, times the one in feed.
    DirectedFriction {
        factor: f64,
    },
    /// A cable that pulls at the phantom in proportion to what has been fed.
    Cable {
        per_m: Vector3<f64>,
    },
    /// A table that shakes.
    Shaking {
        force_n: Vector3<f64>,
        frequency_hz: f64,
    },
    /// Sensor whose reading depends on where the force came from (Bouc–Wen).
    Hysteresis {
        share: f64,
        width_n: f64,
    },
    /// Feed that is lost all at once.
    Jump {
        at_share: f64,
        length_m: f64,
    },
    /// A rough piece of the instrument: more friction while it passes.
    RoughPiece {
        from_m: f64,
        to_m: f64,
        factor: f64,
    },
}

/// What a label says of one effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Identifier of the diagnosis format; `outside.…` for what the library does not have.
    pub id: String,
    /// Parameters of the library's effect that have a counterpart here, by name.
    pub parameters: BTreeMap<String, f64>,
}

impl Change {
    /// The effect that a diagnosis should name.
    pub fn id(&self) -> &'static str {
        match self {
            Self::Friction { .. } => "contact.friction",
            Self::Stribeck { .. } => "contact.stribeck",
            Self::WallStiffness { .. } => "wall.stiffness",
            Self::Registration { .. } => "wall.registration",
            Self::Narrowing { .. } => "wall.narrowing",
            Self::Breathing { .. } => "wall.motion",
            Self::Stiffness { .. } => "instrument.stiffness",
            Self::StoredCurvature { .. } => "instrument.stored_curvature",
            Self::Precurve { .. } => "instrument.tip_precurve",
            Self::Softening { .. } => "instrument.softening",
            Self::Weight { .. } => "instrument.weight",
            Self::EntryDrag { .. } => "entry.drag",
            Self::Guide { .. } => "entry.guide",
            Self::Ripple { .. } => "drive.ripple",
            Self::Slip { .. } => "drive.slip",
            Self::Backlash { .. } => "drive.backlash",
            Self::EncoderScale { .. } => "drive.encoder_scale",
            Self::Latency { .. } => "drive.latency",
            Self::Bias { .. } => "sensor.bias",
            Self::Drift { .. } => "sensor.drift",
            Self::Gain { .. } => "sensor.gain",
            Self::Misalignment { .. } => "sensor.misalignment",
            Self::TimeConstant { .. } => "sensor.time_constant",
            Self::Stiffening { .. } => "wall.hyperelastic",
            Self::Relaxing { .. } => "wall.viscoelastic",
            Self::LightFriction { .. } => "contact.load_friction",
            Self::Viscous { .. } => "instrument.viscoelastic",
            Self::Windup { .. } => "instrument.torsional_windup",
            Self::Stream { .. } => "fluid.drag",
            Self::DirectedFriction { .. } => "outside.directed_friction",
            Self::Cable { .. } => "outside.cable",
            Self::Shaking { .. } => "outside.shaking",
            Self::Hysteresis { .. } => "outside.hysteresis",
            Self::Jump { .. } => "outside.jump",
            Self::RoughPiece { .. } => "outside.rough_piece",
        }
    }

    /// Its label. `friction_coefficient`: of the nominal rig.
    pub fn truth(&self, friction_coefficient: f64) -> Truth {
        let parameters: Vec<(&str, f64)> = match *self {
            Self::Friction { factor } => {
                vec![("friction_coefficient", factor * friction_coefficient)]
            }
            Self::WallStiffness { factor } | Self::Weight { factor } => vec![("factor", factor)],
            Self::Stiffness { shaft, tip } => vec![("shaft_factor", shaft), ("tip_factor", tip)],
            Self::EntryDrag { coulomb_n, viscous_n_s_per_m, .. } => {
                vec![("coulomb_n", coulomb_n), ("viscous_n_s_per_m", viscous_n_s_per_m)]
            }
            Self::Guide { length_m } => vec![("length_m", length_m)],
            Self::Backlash { width_m } => vec![("insertion_m", width_m)],
            Self::EncoderScale { insertion, rotation } => {
                vec![("insertion", insertion), ("rotation", rotation)]
            }
            Self::Latency { time_s } => vec![("time_s", time_s)],
            Self::Windup { free_length_m } => vec![("free_length_m", free_length_m)],
            Self::Bias { force_n } => {
                vec![("x_n", force_n.x), ("y_n", force_n.y), ("z_n", force_n.z)]
            }
            Self::Misalignment { rotation_rad: r } => {
                vec![("x_rad", r.x), ("y_rad", r.y), ("z_rad", r.z)]
            }
            Self::Registration { offset_m: d, .. } => {
                vec![("x_m", d.x), ("y_m", d.y), ("z_m", d.z)]
            }
            _ => Vec::new(),
        };
        let parameters = parameters.into_iter().map(|(name, value)| (name.to_owned(), value));
        Truth { id: self.id().to_owned(), parameters: parameters.collect() }
    }
}
