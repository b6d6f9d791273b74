//! Catalogue of the effects that a rig may have beyond its nominal model, and that a diagnosis may name.
//!
//! Units, off values and ranges come from `cathforce_mechanics` ([`Parameter::info`]). The catalogue adds the
//! name in reports, a plausible size, starting values of a fit, the channels that are affected, the
//! motion that excites an effect, and the effects that it is confused with.

#![forbid(unsafe_code)]

mod drive;
mod effect;
mod instrument;
mod sensor;
mod transmission;
mod vessel;

pub use effect::{Channel, Effect, Parameter, Plant, Role};

/// Every effect, group by group.
pub fn all() -> impl Iterator<Item = &'static Effect> {
    [drive::EFFECTS, vessel::EFFECTS, instrument::EFFECTS, sensor::EFFECTS, transmission::EFFECTS]
        .into_iter()
        .flatten()
}

impl Effect {
    /// The effect of that identifier.
    pub fn find(id: &str) -> Option<&'static Self> {
        all().find(|effect| effect.id == id)
    }
}

#[cfg(test)]
mod tests;
