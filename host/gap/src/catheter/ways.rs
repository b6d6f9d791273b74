//! Perturbed models that are as plausible as the nominal one and may take another branch at a bifurcation.
//!
//! Whether a tip is caught at a dividing wall or slides past it depends on less than any model or any
//! measurement of the rig can tell. Each perturbation stays within that uncertainty.

use cathforce_bundle::SolverDefaults;

use super::priors::Priors;
use super::simulate::Setup;

/// Steps of the finer model for one of the diagnosis.
const SUBSTEPS: u8 = 4;
/// Its share of a new rate that enters the predictor. The device's (0.15) goes with its drag and damping
/// of the wall, which a diagnosis has otherwise (`WALL_DAMPING_S`).
const PREDICTOR_GAIN: f64 = 0.12;
/// A coefficient of friction is stated no better than this.
const FRICTION: f64 = 0.05;

/// What one way differs by: lengths in standard deviations of their priors.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Solves of a step of the finer model.
    solves: u8,
    nearer_wall: f64,
    nearer_junctions: f64,
    fed: f64,
    /// Of the phantom.
    y: f64,
    z: f64,
    /// Share of the coefficient that it has more.
    friction: f64,
}

const NOMINAL: Way = Way {
    solves: 1,
    nearer_wall: 0.0,
    nearer_junctions: 0.0,
    fed: 0.0,
    y: 0.0,
    z: 0.0,
    friction: 0.0,
};

/// The first is the model itself.
pub const WAYS: [Way; 18] = [
    NOMINAL,
    Way { solves: 2, ..NOMINAL },
    Way { nearer_wall: 1.0, ..NOMINAL },
    Way { nearer_wall: -1.0, ..NOMINAL },
    Way { fed: 1.0, ..NOMINAL },
    Way { fed: -1.0, ..NOMINAL },
    Way { y: 1.0, ..NOMINAL },
    Way { y: -1.0, ..NOMINAL },
    Way { z: 1.0, ..NOMINAL },
    Way { z: -1.0, ..NOMINAL },
    Way { friction: -FRICTION, ..NOMINAL },
    Way { friction: FRICTION, ..NOMINAL },
    Way { friction: -FRICTION, fed: 1.0, ..NOMINAL },
    Way { friction: -FRICTION, fed: -1.0, ..NOMINAL },
    Way { friction: FRICTION, fed: 1.0, ..NOMINAL },
    Way { friction: FRICTION, fed: -1.0, ..NOMINAL },
    Way { nearer_junctions: 1.0, ..NOMINAL },
    Way { nearer_junctions: -1.0, ..NOMINAL },
];

/// Of them, the first ones are those of a vessel without junctions.
pub const WITHOUT_JUNCTIONS: usize = 16;

/// Of them, those on which the diagnosis' model is tried where it goes another way than the finer one:
/// mostly one of these goes with it where any of the first sixteen does.
pub const ASIDE: [usize; 4] = [2, 12, 14, 15];

impl Way {
    /// The model on this way, with the links and steps that it has.
    pub fn apply(&self, setup: &Setup, priors: &Priors) -> Setup {
        let mut moved = setup.clone();
        moved.junctions_m += self.nearer_junctions * priors.junctions_m;
        let on_way = &mut moved.description;
        on_way.instrument.outer_radius_m += self.nearer_wall * priors.wall_m;
        on_way.wall.friction_coefficient *= 1.0 + self.friction;
        // A phantom that is nearer is entered farther.
        let registration = &mut on_way.effects.wall.registration;
        registration.x_m -= self.fed * priors.offset_m;
        registration.y_m += self.y * priors.registration_m;
        registration.z_m += self.z * priors.registration_m;
        moved
    }

    /// The same with a quarter of the diagnosis' step, as long as the device's.
    pub fn finer(&self, setup: &Setup, priors: &Priors) -> Setup {
        let mut moved = self.apply(setup, priors);
        let device = SolverDefaults::default();
        let finer = &mut moved.description;
        (finer.wall.onset_m, finer.solver.predictor_gain) = (device.onset_m, PREDICTOR_GAIN);
        (finer.solver.substeps, finer.solver.solves) = (SUBSTEPS, self.solves);
        moved
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::catheter::plant::nominal;

    #[test]
    fn ways_are_the_model_itself_and_others() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(&example).unwrap();
        let nominal = Setup::from(nominal(&bundle).unwrap());
        let priors = Priors::of(&bundle.rig.priors);
        assert_eq!(WAYS[0].apply(&nominal, &priors), nominal);
        let finer: Vec<_> = WAYS.iter().map(|way| way.finer(&nominal, &priors)).collect();
        let device = SolverDefaults::default();
        for (k, own) in finer.iter().enumerate() {
            assert_eq!(own.description.wall.onset_m, device.onset_m);
            assert_eq!(own.description.solver.predictor_gain, PREDICTOR_GAIN);
            assert!(finer[..k].iter().all(|other| other != own), "{k} is one of those before it");
        }
        let nearer_m = finer[4].description.effects.wall.registration.x_m;
        assert_eq!(nearer_m, -priors.offset_m, "a phantom that is nearer is entered farther");
        let moves = |way: &Way| way.nearer_junctions != 0.0;
        assert!(!WAYS[..WITHOUT_JUNCTIONS].iter().any(moves));
        assert!(WAYS[WITHOUT_JUNCTIONS..].iter().all(moves));
    }
}
