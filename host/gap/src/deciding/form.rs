//! Families of effects, and which form of its family a named effect has.

use serde::Serialize;

use crate::deciding::posterior::Posterior;
use crate::plant::Plant;

/// Effects that are forms of one family, each with the form's name.
const FAMILIES: [&[(&str, &str)]; 7] = [
    &[
        ("contact.friction", "Coulomb"),
        ("contact.stribeck", "Stribeck"),
        ("contact.load_friction", "load-dependent"),
    ],
    &[
        ("wall.stiffness", "linear"),
        ("wall.hyperelastic", "hyperelastic"),
        ("wall.viscoelastic", "relaxing"),
    ],
    &[
        ("instrument.stiffness", "elastic"),
        ("instrument.softening", "softening"),
        ("instrument.viscoelastic", "Kelvin–Voigt"),
    ],
    &[("sensor.bias", "constant"), ("sensor.drift", "drifting")],
    &[
        ("drive.coulomb", "Coulomb"),
        ("drive.viscous", "viscous"),
        ("drive.stribeck", "Stribeck"),
        ("drive.load_friction", "load-dependent"),
    ],
    &[
        ("transmission.dead_zone", "dead zone"),
        ("transmission.bouc_wen", "Bouc–Wen"),
        ("transmission.prandtl_ishlinskii", "Prandtl–Ishlinskii"),
        ("transmission.sheath", "capstan"),
    ],
    &[("transmission.lag", "low pass"), ("transmission.latency", "delay")],
];

/// The form of an effect's family that fits best, and how probable it is among the family's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Form {
    pub name: &'static str,
    pub probability: f64,
}

/// The form that a named effect is, with its probability among those of its family; `None` for an effect
/// that is a family of its own.
pub fn form(plant: &dyn Plant, posterior: &Posterior, effect: usize) -> Option<Form> {
    let id = plant.effects()[effect].id;
    let family = FAMILIES.iter().find(|family| family.iter().any(|(own, _)| *own == id))?;
    let (_, name) = family.iter().find(|(own, _)| *own == id)?;
    let is_in = |other: &usize| family.iter().any(|(own, _)| *own == plant.effects()[*other].id);
    let of_family: f64 = posterior
        .sets
        .iter()
        .filter(|own| own.effects.iter().any(is_in))
        .map(|own| own.in_all())
        .sum();
    let probability = posterior.of_effect(effect) / of_family.max(f64::MIN_POSITIVE);
    Some(Form { name, probability: probability.min(1.0) })
}
