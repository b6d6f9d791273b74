//! A parameter that is fitted.

use cathforce_gap::catheter::Wanted;
use cathforce_mechanics::ParameterInfo;

/// A parameter with its bounds.
pub struct Fit {
    pub wanted: Wanted,
    pub start: f64,
    pub info: &'static ParameterInfo,
    /// Whether the bounds were given by hand.
    pub own_bounds: bool,
}
