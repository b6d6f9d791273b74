//! What the model is told about the rig: plain numbers with units, no tables.
//!
//! All of it is in the rig's frame, which is the vessel's unless an effect moves or turns the vessel
//! (`effects.wall.registration`, `motion`): then a step computes in the vessel's, and its outputs are
//! in the rig's.
//!
//! These types are what a device image carries. [`crate::Model::new`] turns them into the
//! tables that a step uses, on host and device alike.

use cathforce_scalar::Real;
use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::Effects;

/// Most stiffness sections of one instrument.
pub const MAX_SECTIONS: usize = 8;
/// Most pieces of one tip's pre-curvature.
pub const MAX_PRECURVE: usize = 16;

/// A piece of the instrument with constant properties.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section<T> {
    /// Length along the arc \[m\].
    pub length_m: T,
    /// E I \[N·m²\].
    pub bending_stiffness_n_m2: T,
    /// G J \[N·m²\].
    pub torsional_stiffness_n_m2: T,
    /// E A \[N\].
    pub axial_stiffness_n: T,
    /// Mass per length \[kg/m\].
    pub mass_kg_per_m: T,
}

/// A piece of the unloaded tip's curvature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrecurvePiece<T> {
    /// Length along the arc \[m\].
    pub length_m: T,
    /// Curvature \[1/m\], bending towards `up` at rotation 0 when positive.
    pub curvature_per_m: T,
    /// Curvature out of that plane \[1/m\], towards `direction × up` when positive.
    pub lateral_curvature_per_m: T,
    /// Torsion of the unloaded centre line \[rad/m\].
    pub torsion_per_m: T,
}

/// One catheter or guidewire, from its tip backwards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instrument<T> {
    /// Outer radius \[m\].
    pub outer_radius_m: T,
    /// Sections from the tip to the base; the last one goes on for ever.
    pub sections: Vec<Section<T>, MAX_SECTIONS>,
    /// Pre-curvature from the tip backwards; straight after the last piece.
    pub precurve: Vec<PrecurvePiece<T>, MAX_PRECURVE>,
}

/// Where the instrument enters the vessel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry<T> {
    /// Centre of the guide's mouth \[m\].
    pub position_m: [T; 3],
    /// Unit vector of insertion.
    pub direction: [T; 3],
    /// Unit vector, normal to `direction`: where a positive tip curvature bends at rotation 0.
    pub up: [T; 3],
}

/// The wall's law; its geometry is the [`crate::Lumen`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wall<T> {
    /// Normal force per indentation and per length of instrument \[N/m²\].
    pub line_stiffness_n_per_m2: T,
    /// Normal stiffness that the free end adds to its node \[N/m\].
    pub end_stiffness_n_per_m: T,
    /// Tangential stiffness before slip, over the normal one \[1\].
    pub tangential_ratio: T,
    /// Coulomb friction coefficient, static = kinetic \[1\].
    pub friction_coefficient: T,
    /// Indentation over which the normal force sets in smoothly \[m\].
    pub onset_m: T,
    /// Normal damping, as a time: damping force = stiffness · time · speed \[s\].
    pub damping_s: T,
}

/// Numerical choices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solver<T> {
    /// Length of a link of the shaft \[m\]; the model's links must reach from the mouth to the tip.
    pub link_length_m: T,
    /// So near the tip links are half as long \[m\]: as many as fit; 0: none.
    pub fine_tip_m: T,
    /// Time of one tick \[s\].
    pub tick_s: T,
    /// Equal parts of a tick: 1 or 2 on the device, up to 4.
    pub substeps: u8,
    /// Solves of each part (1 or 2).
    pub solves: u8,
    /// Share γ of a new rate that enters the predictor \[1\].
    pub predictor_gain: T,
    /// Viscous time of bending: moment = K (q + time · dq/dt) \[s\].
    pub bending_damping_s: T,
    /// On every node, against all motion but the feed's.
    pub drag: Drag<T>,
}

/// Drag per length; grows with the square of a node's speed.
///
/// It damps what a tick cannot follow, a whip or a contact that closes. A tip that moves freely
/// lags by it, so at rest there is little. docs/model.md (15).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drag<T> {
    /// Of a node at rest \[N·s/m²\].
    pub at_rest_n_s_per_m2: T,
    /// Of a swift one, no less than at rest \[N·s/m²\].
    pub swift_n_s_per_m2: T,
    /// Speed from which on it is swift \[m/s\].
    pub swift_m_per_s: T,
}

impl<T: Real> Drag<T> {
    /// The same at any speed.
    pub fn constant(n_s_per_m2: T) -> Self {
        Self {
            at_rest_n_s_per_m2: n_s_per_m2,
            swift_n_s_per_m2: n_s_per_m2,
            swift_m_per_s: T::one(),
        }
    }
}

/// The tendon of a steerable instrument, anchored at the tip and held at the handle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tendon<T> {
    /// How far it is pulled from where it is taut in the straight instrument \[m\].
    pub pull_m: T,
    /// Stiffness along itself \[N/m\].
    pub stiffness_n_per_m: T,
    /// Distance from the centre line \[m\].
    pub offset_m: T,
    /// Length that it bends, from the tip backwards \[m\].
    pub length_m: T,
    /// Where it lies around the centre line: 0 at `up`, 90° at `direction × up` \[rad\].
    pub angle_rad: T,
}

impl<T: Real> Tendon<T> {
    /// No tendon.
    pub fn none() -> Self {
        let zero = T::zero();
        Self {
            pull_m: zero,
            stiffness_n_per_m: zero,
            offset_m: zero,
            length_m: zero,
            angle_rad: zero,
        }
    }
}

/// Everything the model is told, except the lumen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description<T> {
    /// The catheter, or a guidewire on its own.
    pub instrument: Instrument<T>,
    /// Inside the catheter, with its own drive; `None` if there is none.
    pub guidewire: Option<Instrument<T>>,
    pub tendon: Tendon<T>,
    pub entry: Entry<T>,
    pub wall: Wall<T>,
    /// What the rig has beyond all this; [`Effects::off`] if nothing.
    pub effects: Effects<T>,
    /// Acceleration that acts on the instrument, buoyancy included \[m/s²\].
    pub gravity_m_per_s2: [T; 3],
    pub solver: Solver<T>,
}
