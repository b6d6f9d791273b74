//! Effects that change the numbers from which tables are made, and nothing in the recursion.

use cathforce_scalar::Vector3;

use crate::algebra::Rotation;
use crate::{Description, Entry, Instrument, Real, Wall};

/// The instrument with the effects on its stiffness and pre-curvature.     docs/explanation/model.md (31)
///
/// The stored curvature of the shaft is added where the segments are made, because it is unbounded.
pub(crate) fn instrument<T: Real>(description: &Description<T>) -> Instrument<T> {
    let effects = &description.effects.instrument;
    let mut instrument = description.instrument.clone();
    let (tip, shaft) = (effects.stiffness.tip_factor, effects.stiffness.shaft_factor);
    if tip != shaft {
        split_single_section(&mut instrument);
    }
    let several = instrument.sections.len() > 1;
    for (i, section) in instrument.sections.iter_mut().enumerate() {
        let factor = if i == 0 && several { tip } else { shaft };
        section.bending_stiffness_n_m2 *= factor;
        section.torsional_stiffness_n_m2 *= factor;
        section.axial_stiffness_n *= factor;
    }
    for piece in &mut instrument.precurve {
        piece.curvature_per_m *= effects.tip_precurve.factor;
        piece.lateral_curvature_per_m *= effects.tip_precurve.factor;
        piece.torsion_per_m *= effects.tip_precurve.factor;
    }
    instrument
}

/// Splits an instrument of one section behind its pre-curved length, which becomes the tip section.
fn split_single_section<T: Real>(instrument: &mut Instrument<T>) {
    let curved = instrument.precurve.iter().fold(T::zero(), |sum, piece| sum + piece.length_m);
    if let ([only], true) = (instrument.sections.as_slice(), curved > T::zero()) {
        let tip = crate::Section { length_m: curved, ..*only };
        // Cannot fail: there are two sections of at most eight.
        let _ = instrument.sections.insert(0, tip);
    }
}

/// The contact law with the effect on the wall's stiffness.     docs/explanation/model.md (32)
pub(crate) fn wall<T: Real>(description: &Description<T>) -> Wall<T> {
    let factor = description.effects.wall.stiffness.factor;
    Wall {
        line_stiffness_n_per_m2: description.wall.line_stiffness_n_per_m2 * factor,
        end_stiffness_n_per_m: description.wall.end_stiffness_n_per_m * factor,
        ..description.wall
    }
}

/// Placement of the vessel: the transformation from its frame, in which the model computes, to the
/// rig's.     docs/explanation/model.md (36)
///
/// x_rig = p + R (x − p) + d, where p is the entry point of the description.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement<T: Real> {
    /// p
    pub entry: Vector3<T>,
    /// R
    pub turned: Rotation<T>,
    /// d
    pub offset: Vector3<T>,
}

impl<T: Real> Placement<T> {
    /// The registration of a description, without the wall's motion. `None` if the vessel neither moves
    /// nor is displaced.
    pub fn of(description: &Description<T>) -> Option<Self> {
        let wall = &description.effects.wall;
        let r = &wall.registration;
        if r.is_off() && wall.motion.is_off() {
            return None;
        }
        let half = Vector3::new(r.tilt_x_rad, r.tilt_y_rad, r.tilt_z_rad) * T::lit(0.5);
        Some(Self {
            entry: Vector3::from(description.entry.position_m),
            turned: Rotation::identity().turned(&half),
            offset: Vector3::new(r.x_m, r.y_m, r.z_m),
        })
    }

    /// A point of the vessel in the rig's frame.
    pub fn to_rig(self, point: &Vector3<T>) -> Vector3<T> {
        self.entry + self.turned.rotate(&(*point - self.entry)) + self.offset
    }

    /// A direction of the vessel in the rig's frame.
    pub fn direction_to_rig(self, direction: &Vector3<T>) -> Vector3<T> {
        self.turned.rotate(direction)
    }

    /// A point of the rig in the vessel's frame.
    pub fn to_vessel(self, point: &Vector3<T>) -> Vector3<T> {
        self.entry + self.direction_to_vessel(&(*point - self.entry - self.offset))
    }

    /// A direction of the rig in the vessel's frame.
    pub fn direction_to_vessel(self, direction: &Vector3<T>) -> Vector3<T> {
        Rotation { w: self.turned.w, v: -self.turned.v }.rotate(direction)
    }
}

/// The mouth of the guide in the rig's frame: past the entry plane by the guide's length.
pub(crate) fn mouth<T: Real>(entry: &Entry<T>, guide_length_m: T) -> Vector3<T> {
    Vector3::from(entry.position_m) + Vector3::from(entry.direction) * guide_length_m
}

impl<T: Real> Description<T> {
    /// Whether effects or tendons act in the recursion, where they cost time in every solve. All
    /// other effects only change numbers of the nominal model.
    pub fn has_active_effects(&self) -> bool {
        let (effects, zero) = (&self.effects, T::zero());
        let (wall, instrument, tendon) = (&effects.wall, &effects.instrument, &self.tendon);
        !(effects.contact.is_off()
            && wall.hyperelastic.is_off()
            && wall.viscoelastic.is_off()
            && wall.narrowing.is_off()
            && wall.motion.is_off()
            && instrument.viscoelastic.ratio == zero
            && instrument.softening.is_off()
            && instrument.torsional_windup.is_off()
            && effects.entry.guide.straightened_m == zero
            && effects.fluid.is_off())
            || tendon.stiffness_n_per_m * tendon.offset_m * tendon.length_m > zero
            || !self.tendons.is_empty()
    }
}
