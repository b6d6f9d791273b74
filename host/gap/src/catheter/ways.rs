//! Models that are as good as each other, and go different ways where a vessel forks.
//!
//! Whether a tip is caught at a dividing wall or slides past it turns on less than any model, or
//! any measurement of the rig, knows. Ways differ from the first by that little.

use cathforce_mechanics::Description;
use cathforce_rig::SolverDefaults;

use super::WALL_UNCERTAINTY_M;

/// Steps of the finer model for one of the diagnosis.
const SUBSTEPS: u8 = 4;
/// One standard deviation of the priors of insertion offset and registration \[m\].
const OFFSET_M: f64 = 3e-4;
/// A coefficient of friction is stated no better than this.
const FRICTION: f64 = 0.05;

/// What one way differs by.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Solves of a step of the finer model.
    solves: u8,
    nearer_wall_m: f64,
    fed_m: f64,
    /// Of the phantom.
    y_m: f64,
    z_m: f64,
    /// Share of the coefficient that it has more.
    friction: f64,
}

const NOMINAL: Way =
    Way { solves: 1, nearer_wall_m: 0.0, fed_m: 0.0, y_m: 0.0, z_m: 0.0, friction: 0.0 };

/// The first is the model itself.
pub const WAYS: [Way; 16] = [
    NOMINAL,
    Way { solves: 2, ..NOMINAL },
    Way { nearer_wall_m: WALL_UNCERTAINTY_M, ..NOMINAL },
    Way { nearer_wall_m: -WALL_UNCERTAINTY_M, ..NOMINAL },
    Way { fed_m: OFFSET_M, ..NOMINAL },
    Way { fed_m: -OFFSET_M, ..NOMINAL },
    Way { y_m: OFFSET_M, ..NOMINAL },
    Way { y_m: -OFFSET_M, ..NOMINAL },
    Way { z_m: OFFSET_M, ..NOMINAL },
    Way { z_m: -OFFSET_M, ..NOMINAL },
    Way { friction: -FRICTION, ..NOMINAL },
    Way { friction: FRICTION, ..NOMINAL },
    Way { friction: -FRICTION, fed_m: OFFSET_M, ..NOMINAL },
    Way { friction: -FRICTION, fed_m: -OFFSET_M, ..NOMINAL },
    Way { friction: FRICTION, fed_m: OFFSET_M, ..NOMINAL },
    Way { friction: FRICTION, fed_m: -OFFSET_M, ..NOMINAL },
];

/// Of them, those on which the diagnosis' model is tried where it goes another way than the finer one:
/// mostly one of these goes with it where any of the sixteen does.
pub const ASIDE: [usize; 4] = [2, 12, 14, 15];

impl Way {
    /// The model on this way, with the links and steps that it has.
    pub fn apply(&self, description: &Description<f64>) -> Description<f64> {
        let mut on_way = description.clone();
        on_way.instrument.outer_radius_m += self.nearer_wall_m;
        on_way.wall.friction_coefficient *= 1.0 + self.friction;
        // A phantom that is nearer is entered farther.
        let registration = &mut on_way.effects.wall.registration;
        registration.x_m -= self.fed_m;
        registration.y_m += self.y_m;
        registration.z_m += self.z_m;
        on_way
    }

    /// The same with a quarter of the diagnosis' step, as the device has it.
    pub fn finer(&self, description: &Description<f64>) -> Description<f64> {
        let mut finer = self.apply(description);
        let device = SolverDefaults::default();
        (finer.wall.onset_m, finer.solver.predictor_gain) = (device.onset_m, device.predictor_gain);
        (finer.solver.substeps, finer.solver.solves) = (SUBSTEPS, self.solves);
        finer
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::catheter::nominal;

    #[test]
    fn ways_are_the_model_itself_and_others() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_rig::Bundle::open(&example).unwrap();
        let nominal = nominal(&bundle).unwrap();
        assert_eq!(WAYS[0].apply(&nominal), nominal);
        let finer: Vec<_> = WAYS.iter().map(|way| way.finer(&nominal)).collect();
        let device = SolverDefaults::default();
        for (k, own) in finer.iter().enumerate() {
            assert_eq!(own.wall.onset_m, device.onset_m);
            assert_eq!(own.solver.predictor_gain, device.predictor_gain);
            assert!(finer[..k].iter().all(|other| other != own), "{k} is one of those before it");
        }
        let nearer_m = finer[4].effects.wall.registration.x_m;
        assert_eq!(nearer_m, -OFFSET_M, "a phantom that is nearer is entered farther");
    }
}
