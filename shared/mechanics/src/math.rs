//! Scalar functions that give the same bits on host and device.

use crate::Real;

/// Sine and cosine from correctly rounded operations only, so that host and device agree.
///
/// The angle is reduced to ±π, divided by eight, and its sine and versine are doubled three times.
pub(crate) fn sin_cos<T: Real>(angle: T) -> (T, T) {
    let tau = T::lit(core::f64::consts::TAU);
    let turns = T::int((angle / tau + T::lit(0.5)).floor_int());
    let a = (angle - turns * tau) * T::lit(0.125);
    let s = a * a;
    let c = |x: f64| T::lit(x);
    let mut sin = a * (c(1.0) - s * (c(1.0 / 6.0) - s * (c(1.0 / 120.0) - s * c(1.0 / 5040.0))));
    let mut versine =
        s * (c(0.5) - s * (c(1.0 / 24.0) - s * (c(1.0 / 720.0) - s * c(1.0 / 40320.0))));
    for _ in 0..3 {
        // sin 2a = 2 sin a (1 − ver a), ver 2a = 2 sin² a
        let doubled = T::lit(2.0) * sin * (T::one() - versine);
        versine = T::lit(2.0) * sin * sin;
        sin = doubled;
    }
    (sin, T::one() - versine)
}

/// The larger of two numbers; `a` if it is NaN.
pub(crate) fn maximum<T: Real>(a: T, b: T) -> T {
    if a <= b { b } else { a }
}

/// The smaller of two numbers; `a` if it is NaN.
pub(crate) fn minimum<T: Real>(a: T, b: T) -> T {
    if a >= b { b } else { a }
}
