//! A catheter with a guidewire, and both drives.

use cathforce_mechanics::*;

use crate::rod::rod;

pub type Chain = Model<f64>;

/// E I of catheter and guidewire \[N·m²\].
pub const CATHETER_EI: f64 = 1e-4;
pub const WIRE_EI: f64 = 6e-5;

/// Positions of both drives, without rotation.
pub fn at(catheter_m: f64, guidewire_m: f64) -> Drives<f64> {
    Drives {
        catheter: Drive { insertion_m: catheter_m, rotation_rad: 0.0 },
        guidewire: Drive { insertion_m: guidewire_m, rotation_rad: 0.0 },
        tendons_m: [0.0; MAX_TENDONS],
    }
}

/// A curvature towards `up` over `length_m` from the tip.
pub fn curved(length_m: f64, curvature_per_m: f64) -> PrecurvePiece<f64> {
    PrecurvePiece { length_m, curvature_per_m, lateral_curvature_per_m: 0.0, torsion_per_m: 0.0 }
}

/// Two straight, uniform, weightless instruments; `links` links reach `length_m`.
pub fn pair(length_m: f64, links: usize) -> Description<f64> {
    let mut pair = rod(length_m, links, CATHETER_EI);
    let mut wire = rod(length_m, links, WIRE_EI).instrument;
    wire.outer_radius_m = 0.45e-3;
    pair.guidewire = Some(wire);
    pair
}
