//! The problem: rod, vessel, wall and numerical choices.

use nalgebra::Vector3;

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
    /// Stiffness that relaxes over the one that stays, half of it in each of these times.
    pub relaxing_ratio: f64,
    pub relaxation_s: [f64; 2],
    /// Viscous time of bending: moment per rate of bending over the stiffness \[s\].
    pub bending_viscosity_s: f64,
    /// Force of a stream along the instrument towards its tip, per length \[N/m\].
    pub stream_n_per_m: f64,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Implicit Euler, first order.
    Euler,
    /// Two-step backward differentiation, second order.
    Bdf2,
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
