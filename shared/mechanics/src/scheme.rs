//! The time integration scheme of one solve.

use crate::Drag;

/// How one solve treats time.
pub(crate) struct Scheme<T> {
    /// Time step \[s\].
    pub dt_s: T,
    /// 1 with inertia, 0 quasi-static.
    pub inertia: T,
    /// Coulomb friction coefficient \[1\].
    pub friction: T,
    /// Expected slip of samples in this step over their slip in the last one, on the catheter and on
    /// the guidewire \[1\].
    pub sliding: [T; 2],
    pub drag: Drag<T>,
    pub predictor_gain: T,
    /// First solve of the step: it samples the wall.
    pub first: bool,
    /// Last solve of the step: it updates rates and contact states.
    pub last: bool,
}
