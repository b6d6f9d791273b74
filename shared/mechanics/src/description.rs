//! Description of the rig: plain numbers with units, no tables.
//!
//! All numbers are in the rig's frame. It is also the vessel's, unless an effect moves or turns the
//! vessel (`effects.wall.registration`, `effects.wall.motion`). A step then computes in the vessel's
//! frame and converts its outputs.
//!
//! A device image contains these types. [`crate::Model::new`] makes the tables of a step from them, on
//! host and device alike. Names and order of the fields are part of the image's schema.

use cathforce_scalar::Real;
use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::Effects;

/// Most stiffness sections of one instrument.
pub const MAX_SECTIONS: usize = 8;
/// Most pieces of one tip's pre-curvature.
pub const MAX_PRECURVE: usize = 16;

/// A section of an instrument with constant stiffness.
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

/// A piece of the unloaded tip with constant curvature.
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
    /// Sections from the tip backwards; the last one is unbounded.
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
    /// Unit vector normal to `direction`, towards which a positive curvature bends at rotation 0.
    pub up: [T; 3],
}

/// Contact law of the wall; its geometry is the [`crate::Lumen`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wall<T> {
    /// Normal force per indentation and per length of instrument \[N/m²\].
    pub line_stiffness_n_per_m2: T,
    /// Normal stiffness that the free end adds to its node \[N/m\].
    pub end_stiffness_n_per_m: T,
    /// Tangential stiffness while sticking, over the normal one \[1\].
    pub tangential_ratio: T,
    /// Coulomb friction coefficient, static = kinetic \[1\].
    pub friction_coefficient: T,
    /// Indentation over which the normal stiffness rises to its full value \[m\].
    pub onset_m: T,
    /// Normal damping, as a time: damping force = stiffness · time · speed \[s\].
    pub damping_s: T,
}

/// Numerical choices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solver<T> {
    /// Length of a link of the shaft \[m\]. All links together must reach from the mouth to the tip.
    pub link_length_m: T,
    /// Arc from the tip within which links are half as long \[m\]; 0 for none.
    pub fine_tip_m: T,
    /// Time of one tick \[s\].
    pub tick_s: T,
    /// Equal substeps of a tick: 1 or 2 on the device, up to 4 on a host.
    pub substeps: u8,
    /// Solves of each substep, 1 or 2.
    pub solves: u8,
    /// Gain γ of the filter on the predictor's rates \[1\].
    pub predictor_gain: T,
    /// Viscous time of bending: moment = K (q + time · dq/dt) \[s\].
    pub bending_damping_s: T,
    /// Drag on every node, against all motion except the feed.
    pub drag: Drag<T>,
}

/// Drag per length, which grows with the square of a node's speed.     docs/explanation/model.md (16)
///
/// It damps motion that is too fast for the time step, such as a whip or a closing contact. It also
/// makes a freely moving tip lag, so it is small at low speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drag<T> {
    /// Drag coefficient of a node at rest \[N·s/m²\].
    pub at_rest_n_s_per_m2: T,
    /// Drag coefficient at `swift_m_per_s` and above, not below the one at rest \[N·s/m²\].
    pub swift_n_s_per_m2: T,
    /// Speed at which the drag coefficient reaches its largest value \[m/s\].
    pub swift_m_per_s: T,
}

impl<T: Real> Drag<T> {
    /// The same coefficient at any speed \[N·s/m²\].
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
    /// Pull from the position where it is taut in the straight instrument \[m\].
    pub pull_m: T,
    /// Axial stiffness \[N/m\].
    pub stiffness_n_per_m: T,
    /// Distance from the centre line \[m\].
    pub offset_m: T,
    /// Length of the instrument that it bends, from the tip backwards \[m\].
    pub length_m: T,
    /// Angle around the centre line: 0 at `up`, π/2 at `direction × up` \[rad\].
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

/// Most driven tendons of one catheter.
pub const MAX_TENDONS: usize = 4;

/// A tendon that a drive pulls while the instrument works. It runs from its anchor on the catheter through
/// the guide to the drive.     docs/explanation/model.md (48)–(53)
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrivenTendon<T> {
    /// Angle around the centre line: 0 at `up`, π/2 at `direction × up` \[rad\].
    pub angle_rad: T,
    /// Distance from the centre line \[m\].
    pub offset_m: T,
    /// Arc from the tip to its anchor \[m\].
    pub anchor_m: T,
    /// Axial stiffness of its whole length \[N/m\].
    pub stiffness_n_per_m: T,
    /// Dead zone: displacement that takes up slack before it pulls \[m\].
    pub slack_m: T,
    /// Friction coefficient in its lumen while its drive holds still \[1\].
    pub static_friction: T,
    /// Friction coefficient in its lumen while its drive moves \[1\].
    pub sliding_friction: T,
    /// Angle by which its lumen is bent between the drive and the entry plane \[rad\].
    pub bend_behind_rad: T,
}

/// Complete description of the rig, except the lumen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description<T> {
    /// The catheter, or a guidewire on its own.
    pub instrument: Instrument<T>,
    /// Inside the catheter, with its own drive; `None` if there is none.
    pub guidewire: Option<Instrument<T>>,
    /// A tendon that is pulled by the same length all the time.
    pub tendon: Tendon<T>,
    /// Tendons whose drives send their displacements in every tick.
    pub tendons: Vec<DrivenTendon<T>, MAX_TENDONS>,
    pub entry: Entry<T>,
    pub wall: Wall<T>,
    /// Effects beyond the nominal model; [`Effects::off`] for none.
    pub effects: Effects<T>,
    /// Acceleration of gravity, reduced by buoyancy \[m/s²\].
    pub gravity_m_per_s2: [T; 3],
    pub solver: Solver<T>,
}
