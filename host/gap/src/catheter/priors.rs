//! How well a setup is known: priors of the nuisance parameters and of the perturbed models.

use cathforce_bundle::bundle::RigPriors;

use crate::plant::{Nuisance, Parameter};

/// Half width of the wall's uncertainty away from junctions \[m\].
const WALL_M: f64 = 40e-6;
/// How much farther it may be off where it bends into the lumen \[m\].
const JUNCTIONS_M: f64 = 1e-4;

/// Standard deviations of what differs from trial to trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Priors {
    bias_n: f64,
    shift_s: f64,
    /// Of the insertion offset.
    pub offset_m: f64,
    /// Of the phantom along each axis, and about it.
    pub registration_m: f64,
    tilt_rad: f64,
    /// Of the wall.
    pub wall_m: f64,
    /// Of the wall where a vessel divides, beyond that.
    pub junctions_m: f64,
}

impl Priors {
    /// Nuisances that any catheter has.
    pub const OF_ANY: usize = 12;

    /// What the rig states, and the usual for the rest.
    pub fn of(stated: &RigPriors) -> Self {
        Self {
            bias_n: stated.force_bias_sd_n.unwrap_or(3e-3),
            shift_s: stated.time_shift_sd_s.unwrap_or(3e-3),
            offset_m: stated.insertion_offset_sd_m.unwrap_or(3e-4),
            registration_m: stated.registration_sd_m.unwrap_or(3e-4),
            tilt_rad: stated.registration_sd_rad.unwrap_or(0.3_f64.to_radians()),
            wall_m: stated.wall_sd_m.unwrap_or(WALL_M),
            junctions_m: stated.wall_at_junctions_sd_m.unwrap_or(JUNCTIONS_M),
        }
    }

    /// Force bias, time shift, insertion offset, rigid registration, a nearer wall and, of a vessel that
    /// has them, nearer junctions, in the order that [`super::Catheter::play`] takes them.
    pub fn nuisances(&self, has_junctions: bool) -> Vec<Nuisance> {
        let of = |name, unit, sd, effect| Nuisance { name, unit, sd, effect: Some(effect) };
        let mut nuisances = vec![
            of("force bias x", "N", self.bias_n, "sensor.bias"),
            of("force bias y", "N", self.bias_n, "sensor.bias"),
            of("force bias z", "N", self.bias_n, "sensor.bias"),
            of("time shift", "s", self.shift_s, "drive.latency"),
            of("insertion offset", "m", self.offset_m, "wall.registration"),
            of("registration x", "m", self.registration_m, "wall.registration"),
            of("registration y", "m", self.registration_m, "wall.registration"),
            of("registration z", "m", self.registration_m, "wall.registration"),
            of("tilt x", "rad", self.tilt_rad, "wall.registration"),
            of("tilt y", "rad", self.tilt_rad, "wall.registration"),
            of("tilt z", "rad", self.tilt_rad, "wall.registration"),
            Nuisance { name: "nearer wall", unit: "m", sd: self.wall_m, effect: None },
        ];
        if has_junctions {
            let sd = self.junctions_m;
            nuisances.push(Nuisance { name: "nearer junctions", unit: "m", sd, effect: None });
        }
        nuisances
    }

    /// Standard deviations of a registration by its parameters, which are lengths and angles.
    pub fn of_registration(&self, parameters: &[Parameter]) -> Vec<f64> {
        let sd = |p: &Parameter| if p.unit == "rad" { self.tilt_rad } else { self.registration_m };
        parameters.iter().map(sd).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use super::*;
    use crate::catheter::library::Library;
    use crate::catheter::plant::nominal;

    #[test]
    fn what_a_rig_states_takes_the_place_of_the_usual() {
        let usual = Priors::of(&RigPriors::default());
        assert_eq!(usual.wall_m, WALL_M);
        assert_eq!(usual.nuisances(false).len(), Priors::OF_ANY);
        let stated = RigPriors {
            force_bias_sd_n: Some(1e-3),
            registration_sd_m: Some(1e-4),
            wall_sd_m: Some(2e-4),
            wall_at_junctions_sd_m: Some(5e-4),
            ..RigPriors::default()
        };
        let own = Priors::of(&stated);
        let changed: Vec<(&str, f64)> = own
            .nuisances(true)
            .iter()
            .zip(usual.nuisances(true))
            .filter(|(own, usual)| own.sd != usual.sd)
            .map(|(own, _)| (own.name, own.sd))
            .collect();
        assert_eq!(
            changed,
            [
                ("force bias x", 1e-3),
                ("force bias y", 1e-3),
                ("force bias z", 1e-3),
                ("registration x", 1e-4),
                ("registration y", 1e-4),
                ("registration z", 1e-4),
                ("nearer wall", 2e-4),
                ("nearer junctions", 5e-4),
            ]
        );
    }
    #[test]
    fn a_registration_has_the_priors_of_what_it_is_made_of() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let nominal = nominal(&Bundle::open(&example).unwrap()).unwrap();
        let library = Library::of(&nominal, &[[0.0; 3], [0.1, 0.0, 0.0]]);
        let registration = library.effects.iter().find(|own| own.id == "wall.registration");
        let parameters = &registration.unwrap().parameters;
        let stated = RigPriors { registration_sd_m: Some(1e-4), ..RigPriors::default() };
        let sds = Priors::of(&stated).of_registration(parameters);
        for (p, sd) in parameters.iter().zip(&sds) {
            let own = if p.name.starts_with("tilt") { 0.3_f64.to_radians() } else { 1e-4 };
            assert_eq!(*sd, own, "{}", p.name);
        }
        assert_eq!(sds.len(), 6);
    }
}
