//! The confidence of a named effect: the share of such answers that are right.

use crate::deciding::posterior::Posterior;
use crate::plant::Plant;
use crate::rules::OfConfidence;

/// Probability that an effect is there, also where none of the sets that were fitted is the truth.
///
/// The posterior compares these sets with each other only. A catheter's shapes differ from rig to rig, so that in a
/// share of cases something else has won. The model of an axis has no such rivals.
///
/// See docs/explanation/diagnosis.md (D18).
pub fn confidence(
    rules: &OfConfidence,
    plant: &dyn Plant,
    posterior: &Posterior,
    effect: usize,
) -> f64 {
    let lapse = if plant.has_other_models() { rules.lapse } else { 0.0 };
    (1.0 - lapse) * posterior.of_effect(effect)
}
