//! One step.

use crate::{Drive, Lumen, Model, Outputs, Real, State};

/// Advances the model by one tick to the drive's new position.
pub fn step<T: Real>(
    _model: &Model<T>,
    _lumen: &Lumen<'_>,
    _state: &mut State<T>,
    _drive: Drive<T>,
) -> Outputs<T> {
    Outputs::default()
}

/// One quasi-static step towards the drive's position, frictionless: how a run begins.
///
/// Feeds from wherever the model is (at first the empty guide) by a bounded amount a call;
/// returns `true` once the drive's position is reached and the shape has come to rest.
pub fn settle<T: Real>(
    _model: &Model<T>,
    _lumen: &Lumen<'_>,
    _state: &mut State<T>,
    _drive: Drive<T>,
) -> bool {
    true
}
