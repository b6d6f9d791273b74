//! A rig as it is, and as its bundle states it.

use cathforce_reference_solver::{Integrator, Numerics};
use nalgebra::Vector3;
use rand::Rng;
use serde::{Deserialize, Serialize};

use super::instruments::Device;
use super::path::arcs_m;
use super::segmentation::scanned;
use super::vessels::Vessel;
use crate::draw::blend_in_doubt_m;
use crate::motion::STEP_S;
use crate::rigs::Rig;

/// What a label says of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigTruth {
    pub vessel: String,
    pub instrument: String,
    /// Standard deviation of the error of the stated centre line, if it is that of a scan \[m\].
    pub scan_sd_m: Option<f64>,
    /// Distance between nodes \[m\], time step \[s\] and integrator of the solver.
    pub spacing_m: f64,
    pub step_s: f64,
    pub integrator: String,
}

/// A rig of a stranger.
#[derive(Clone, Debug)]
pub struct StrangeRig {
    /// As it is without any effect.
    pub real: Rig,
    /// As its bundle states it.
    pub stated: Rig,
    /// How the solver divides its arc and its time.
    pub numerics: Numerics,
    /// Length inside that no motion goes beyond \[m\].
    pub reach_m: f64,
    /// For its label.
    pub truth: RigTruth,
}

/// Ways of dividing arc and time: distance between nodes \[m\], steps a row, integrator. None is that of
/// the other blind tests (1 mm, one step a row, two-step backward differentiation).
const DISCRETISATIONS: [(f64, u32, Integrator); 4] = [
    (1.25e-3, 1, Integrator::BdfAlpha { alpha: -0.2 }),
    (0.8e-3, 1, Integrator::BdfAlpha { alpha: -0.1 }),
    (1.4e-3, 2, Integrator::Bdf2),
    (1.25e-3, 2, Integrator::Euler),
];
/// Length inside when a trial begins \[m\].
const START_M: [f64; 2] = [0.027, 0.034];
/// Motions end before this share of the vessel's length and before this insertion \[m\]: a longer way takes
/// longer to simulate and shows nothing new.
const REACH_SHARE: f64 = 0.85;
const REACH_M: f64 = 0.092;
/// Silicone and resin against lubricated polymer and steel \[1\].
const FRICTION: [f64; 2] = [0.18, 0.4];

impl StrangeRig {
    /// One rig of a family.
    pub fn draw((vessel, device): (Vessel, Device), rng: &mut impl Rng) -> Self {
        let anatomy = vessel.draw(rng);
        let mut stated = Rig {
            name: format!("{}-{}", vessel.name(), device.name()),
            instrument: device.draw(rng),
            branches: anatomy.branches,
            blend_m: anatomy.blend_m,
            up: Vector3::y(),
            friction_coefficient: rng.random_range(FRICTION[0]..FRICTION[1]),
            start_m: rng.random_range(START_M[0]..START_M[1]),
        };
        let mut real = stated.clone();
        if vessel.divides() {
            real.blend_m = blend_in_doubt_m(real.blend_m, rng);
        }
        let mut scan_sd_m = None;
        if vessel.is_scanned() {
            let (branches, sd_m) = scanned(&real.branches, rng);
            (stated.branches, scan_sd_m) = (branches, Some(sd_m));
        }
        let (spacing_m, steps, integrator) =
            DISCRETISATIONS[rng.random_range(0..DISCRETISATIONS.len())];
        let step_s = STEP_S / f64::from(steps);
        let numerics = Numerics { spacing_m, step_s, integrator, ..real.problem().numerics };
        let truth = RigTruth {
            vessel: vessel.name().to_owned(),
            instrument: device.name().to_owned(),
            scan_sd_m,
            spacing_m,
            step_s,
            integrator: format!("{integrator:?}"),
        };
        let reach_m = REACH_M.min(REACH_SHARE * length_m(&real));
        Self { real, stated, numerics, reach_m, truth }
    }
}

/// Length of the trunk and the shortest branch behind it \[m\].
fn length_m(rig: &Rig) -> f64 {
    let mut lengths = rig.branches.iter().map(|own| arcs_m(own).last().copied().unwrap_or(0.0));
    let trunk_m = lengths.next().unwrap_or(0.0);
    let shortest_m = lengths.fold(f64::INFINITY, f64::min);
    trunk_m + if shortest_m.is_finite() { shortest_m } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_scan_is_stated_where_another_vessel_is_and_nowhere_else() {
        for vessel in Vessel::ALL {
            let mut rng = ChaCha8Rng::seed_from_u64(8);
            let rig = StrangeRig::draw((vessel, Device::JWire), &mut rng);
            let same = rig.real.branches == rig.stated.branches;
            assert_eq!(same, !vessel.is_scanned());
            assert_eq!(rig.truth.scan_sd_m.is_some(), vessel.is_scanned());
            assert_eq!(rig.real.blend_m != rig.stated.blend_m, vessel.divides());
            assert!(rig.reach_m > rig.real.start_m + 0.035, "{vessel:?}: {}", rig.reach_m);
            assert_eq!(rig.real.name, format!("{}-j-wire", vessel.name()));
        }
    }

    #[test]
    fn no_stranger_is_divided_as_the_other_blind_tests_are() {
        let usual = crate::rigs::rigs()[0].problem().numerics;
        for (spacing_m, steps, integrator) in DISCRETISATIONS {
            assert!(spacing_m != usual.spacing_m && steps > 0);
            assert!(steps > 1 || integrator != usual.integrator);
        }
    }
}
