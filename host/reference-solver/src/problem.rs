//! The problem: rod, vessel, wall and numerical choices.

use nalgebra::Vector3;

use crate::beyond::{BRANCHES, Memory, Relaxing};
use crate::lumen::Lumen;
use crate::rod::Rod;

/// The mouth of the tight straight guide that the instrument leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Centre of the guide's mouth \[m\].
    pub position_m: Vector3<f64>,
    /// Unit vector of insertion.
    pub direction: Vector3<f64>,
    /// Unit vector normal to it, towards which `Curve::up_per_m` bends at rotation 0.
    pub up: Vector3<f64>,
}

/// The wall's law: Signorini's condition on an elastic foundation, Coulomb friction at the
/// instrument's surface with elastic sticking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallLaw {
    /// Normal force per indentation and per length of instrument \[N/m²\].
    pub line_stiffness_n_per_m2: f64,
    /// Additional normal stiffness at the free end \[N/m\].
    pub end_stiffness_n_per_m: f64,
    /// Ratio of the tangential stiffness before slip to the normal stiffness \[1\].
    pub tangential_ratio: f64,
    /// Coulomb's coefficient \[1\].
    pub friction_coefficient: f64,
}

/// Extensions of that law; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beyond {
    /// One over the indentation in which the wall's stiffness grows e-fold \[1/m\].
    pub stiffening_per_m: f64,
    /// The coefficient is larger by this share at small loads \[1\].
    pub light_friction: f64,
    /// Normal force per length by which that share has fallen to 1/e \[N/m\].
    pub light_load_n_per_m: f64,
    /// If above 0, that share falls like (1 + load/`light_load_n_per_m`) to minus this power instead \[1\].
    pub light_power: f64,
    /// Coefficient that depends on the speed of each point.
    pub memory: Memory,
    /// Springs of the wall that relax, over its stiffness.
    pub relaxing: [Relaxing; BRANCHES],
    /// Springs of bending that relax, over its stiffness.
    pub relaxing_bends: [Relaxing; BRANCHES],
    /// Viscous time of bending: moment per rate of bending over the stiffness \[s\].
    pub bending_viscosity_s: f64,
    /// Force of a stream along the instrument towards its tip, per length \[N/m\].
    pub stream_n_per_m: f64,
    /// Mass at the tip, such as a sensor's \[kg\].
    pub tip_mass_kg: f64,
    /// Square-law drag of still air: force per length over the square of the speed \[kg/m²\].
    pub air_drag_kg_per_m2: f64,
    /// Pulsating flow around the instrument.
    pub flow: Flow,
}

/// A flow that pulsates, with a parabolic profile over the distance from the wall.
///
/// F = −½ ρ A C (v − v_f) |v − v_f|, with v_f = V x (2 − x) (1 + Z sin(2π f t + φ)) and x = min(d/R, 1).
/// Source: Salehizadeh et al., Dynamic Modeling and Identification of a Robotic Intracardiac Echo
/// Catheter, eqs. (16) and (17); A is taken per length, and the profile is scaled to its largest speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow {
    /// ρ \[kg/m³\].
    pub density_kg_per_m3: f64,
    /// C, the drag coefficient \[1\].
    pub coefficient: f64,
    /// A, the area that the flow meets per length: a diameter \[m\].
    pub width_m: f64,
    /// V, the mean velocity in mid-stream \[m/s\].
    pub velocity_m_per_s: Vector3<f64>,
    /// Z, the amplitude of the pulse over the mean \[1\].
    pub pulse_ratio: f64,
    /// f \[Hz\].
    pub frequency_hz: f64,
    /// φ at time 0 \[rad\].
    pub phase_rad: f64,
    /// R, the distance from the wall at which the flow is fastest; 0 for the same speed everywhere \[m\].
    pub lumen_radius_m: f64,
}

impl Flow {
    /// Drag per length over the square of the relative speed \[kg/m²\].
    pub(crate) fn drag_kg_per_m2(&self) -> f64 {
        0.5 * self.density_kg_per_m3 * self.width_m * self.coefficient
    }

    /// Velocity at a distance from the wall and a time \[m/s\].
    pub(crate) fn at(&self, distance_m: f64, t_s: f64) -> Vector3<f64> {
        let radius = self.lumen_radius_m;
        let x = if radius > 0.0 { (distance_m / radius).clamp(0.0, 1.0) } else { 1.0 };
        let phase = std::f64::consts::TAU * self.frequency_hz * t_s + self.phase_rad;
        self.velocity_m_per_s * (x * (2.0 - x) * (1.0 + self.pulse_ratio * phase.sin()))
    }
}

/// Dead loads at the tip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipLoad {
    /// Force, fixed in space \[N\].
    pub force_n: Vector3<f64>,
    /// Moment that turns the last edge, fixed in space \[N·m\].
    pub moment_n_m: Vector3<f64>,
}

/// How time is discretised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Implicit Euler, first order.
    Euler,
    /// Two-step backward differentiation, second order, but for the viscosity of bending, which is of first
    /// order.
    Bdf2,
    /// Second order in everything, from the trapezoidal rule (`alpha` −0.5), which keeps energy, to two-step
    /// backward differentiation (0), which damps what a step does not resolve. Steps of another length than
    /// the one before, and the first one, are of first order.
    ///
    /// Source: Till, Aloi and Rucker, Real-time dynamics of soft and continuum robots based on Cosserat rod
    /// models, Int. J. Robotics Research 38 (2019).
    BdfAlpha { alpha: f64 },
}

/// Numerical choices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numerics {
    /// Distance between nodes along the unstretched rod \[m\].
    pub spacing_m: f64,
    /// Time step \[s\]; halved where Newton's method does not converge.
    pub step_s: f64,
    /// How time is discretised.
    pub integrator: Integrator,
    /// Largest force out of balance at a node \[N\].
    pub tolerance_n: f64,
}

impl Default for Numerics {
    fn default() -> Self {
        Self { spacing_m: 1e-3, step_s: 2e-3, integrator: Integrator::Bdf2, tolerance_n: 1e-8 }
    }
}

/// A rod, the vessel it is fed into, and how finely that is solved.
#[derive(Clone, Debug)]
pub struct Problem {
    pub rod: Rod,
    pub entry: Entry,
    pub lumen: Lumen,
    pub wall: WallLaw,
    pub beyond: Beyond,
    /// Acceleration that acts on the rod, buoyancy included \[m/s²\].
    pub gravity_m_per_s2: Vector3<f64>,
    /// Drag per length against all motion but the feed along the rod \[N·s/m²\].
    pub drag_n_s_per_m2: f64,
    pub tip_load: TipLoad,
    pub numerics: Numerics,
}
