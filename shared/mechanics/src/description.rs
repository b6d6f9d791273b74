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

use crate::effects::nominal;
use crate::grid::Grid;
use crate::{Effects, parameters};

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

impl<T: Real> Solver<T> {
    /// What so many links reach \[m\].
    pub fn reach_m(&self, links: usize) -> T {
        self.link_length_m * Grid::new(self).node(links)
    }

    /// Links from the tip to the end of an arc \[m\].
    pub fn links_in(&self, arc_m: T) -> T {
        Grid::new(self).links_in(arc_m)
    }
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

/// The first thing wrong with a [`Description`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DescriptionError {
    /// This field is not finite or out of its range.
    Range(&'static str),
    /// The instrument has no section.
    NoSections,
    /// `entry.direction` and `entry.up` are not orthonormal.
    EntryFrame,
}

impl<T: Real> Instrument<T> {
    fn validate(&self) -> Result<(), DescriptionError> {
        if self.sections.is_empty() {
            return Err(DescriptionError::NoSections);
        }
        within("instrument.outer_radius_m", self.outer_radius_m, 1e-5, 1e-2)?;
        for s in &self.sections {
            within("section.length_m", s.length_m, 1e-4, 10.0)?;
            within("section.bending_stiffness_n_m2", s.bending_stiffness_n_m2, 1e-9, 1.0)?;
            within("section.torsional_stiffness_n_m2", s.torsional_stiffness_n_m2, 1e-9, 1.0)?;
            within("section.axial_stiffness_n", s.axial_stiffness_n, 0.1, 1e8)?;
            within("section.mass_kg_per_m", s.mass_kg_per_m, 1e-6, 1.0)?;
        }
        for p in &self.precurve {
            within("precurve.length_m", p.length_m, 0.0, 1.0)?;
            within("precurve.curvature_per_m", p.curvature_per_m, -1000.0, 1000.0)?;
            within("precurve.lateral_curvature_per_m", p.lateral_curvature_per_m, -1000.0, 1000.0)?;
            within("precurve.torsion_per_m", p.torsion_per_m, -1000.0, 1000.0)?;
        }
        Ok(())
    }
}

impl<T: Real> Description<T> {
    /// Whether effects or a tendon take much time in every solve: the others are numbers of the
    /// nominal one.     docs/model.md §5
    pub fn has_active_effects(&self) -> bool {
        nominal::has_active_effects(self)
    }

    /// Checks every number; the first fault found is returned.
    pub fn validate(&self) -> Result<(), DescriptionError> {
        use DescriptionError::EntryFrame;
        self.instrument.validate()?;
        if let Some(wire) = &self.guidewire {
            // Thinner than the catheter's outside: its bore is not described.
            let outside = self.instrument.outer_radius_m.to_f64();
            within("guidewire.outer_radius_m", wire.outer_radius_m, 1e-5, outside)?;
            wire.validate()?;
        }
        for x in self.entry.position_m {
            within("entry.position_m", x, -10.0, 10.0)?;
        }
        let (d, u) = (self.entry.direction, self.entry.up);
        let dot = |a: [T; 3], b: [T; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let near = |x: T, y: f64| (x - T::lit(y)).abs() <= T::lit(1e-4);
        if !(near(dot(d, d), 1.0) && near(dot(u, u), 1.0) && near(dot(d, u), 0.0)) {
            return Err(EntryFrame);
        }
        let w = &self.wall;
        within("wall.line_stiffness_n_per_m2", w.line_stiffness_n_per_m2, 1.0, 1e9)?;
        within("wall.end_stiffness_n_per_m", w.end_stiffness_n_per_m, 0.0, 1e7)?;
        within("wall.tangential_ratio", w.tangential_ratio, 0.0, 100.0)?;
        within("wall.onset_m", w.onset_m, 1e-7, 1e-3)?;
        within("wall.damping_s", w.damping_s, 0.0, 1.0)?;
        for info in parameters() {
            // Every key has its number.
            let value = self.parameter(info.key).unwrap_or(T::zero());
            within(info.key, value, info.min, info.max)?;
        }
        for g in self.gravity_m_per_s2 {
            within("gravity_m_per_s2", g, -100.0, 100.0)?;
        }
        let s = &self.solver;
        within("solver.link_length_m", s.link_length_m, 2e-4, 2e-2)?;
        within("solver.fine_tip_m", s.fine_tip_m, 0.0, 10.0)?;
        within("solver.tick_s", s.tick_s, 1e-4, 1e-2)?;
        within("solver.substeps", T::int(i32::from(s.substeps)), 1.0, 4.0)?;
        within("solver.predictor_gain", s.predictor_gain, 0.0, 1.0)?;
        within("solver.bending_damping_s", s.bending_damping_s, 0.0, 1.0)?;
        let Drag { at_rest_n_s_per_m2, swift_n_s_per_m2, swift_m_per_s } = s.drag;
        within("solver.drag.swift_n_s_per_m2", swift_n_s_per_m2, 0.0, 1e3)?;
        let at_most = swift_n_s_per_m2.to_f64();
        within("solver.drag.at_rest_n_s_per_m2", at_rest_n_s_per_m2, 0.0, at_most)?;
        within("solver.drag.swift_m_per_s", swift_m_per_s, 1e-3, 1e3)
    }
}

fn within<T: Real>(name: &'static str, x: T, low: f64, high: f64) -> Result<(), DescriptionError> {
    // Written so that NaN fails.
    if x >= T::lit(low) && x <= T::lit(high) { Ok(()) } else { Err(DescriptionError::Range(name)) }
}
