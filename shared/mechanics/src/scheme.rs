//! The time integration scheme of one solve.

use crate::Drag;

/// How one solve treats time.
pub(crate) struct Scheme<T> {
    pub dt_s: T,
    /// 1 with inertia, 0 quasi-static.
    pub inertia: T,
    pub friction: T,
    /// What samples on the catheter and on the guidewire will slide of what they slid in the last
    /// step.
    pub sliding: [T; 2],
    pub drag: Drag<T>,
    pub predictor_gain: T,
    /// First solve of the step: the wall is looked up.
    pub first: bool,
    /// Last solve of the step: rates and contact memories are brought up to date.
    pub last: bool,
}
