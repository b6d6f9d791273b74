//! The step, compiled in this crate.
//!
//! A generic function is compiled again in each crate and each test that calls it, and a step takes
//! a quarter of a minute. Behind the methods of [`Compiled`] it is compiled once for each number type
//! and number of links.

#[cfg(not(target_os = "none"))]
use crate::abreast::{Attendant, advance_abreast};
use crate::settle::approach_rest;
use crate::step::advance;
use crate::{Drives, Loads, Lumen, Model, Outputs, Real, State};

/// Advances the model by one tick to the drives' new positions.
///
/// `drives`: a [`Drive`] of the catheter alone, or [`Drives`] with the guidewire's too. Insertions
/// beyond the reach of the links are clamped, and the outputs are flagged as unresolved. Total on any
/// input; a number that is not finite gives [`Outputs::lost`].
pub fn step<T: Compiled<LINKS>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: impl Into<Drives<T>>,
) -> Outputs<T> {
    step_loaded(model, lumen, state, drives, &Loads::default())
}

/// [`step`] with external loads.
///
/// A step with a result that is not finite resets the state and begins the run again. Each tick from
/// there on is one step of [`settle`] and is flagged as lost, until the shape is at rest.
pub fn step_loaded<T: Compiled<LINKS>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: impl Into<Drives<T>>,
    loads: &Loads<T>,
) -> Outputs<T> {
    T::step_loaded(model, lumen, state, drives.into(), loads)
}

/// One frictionless quasi-static step towards the drives' positions; this is how a run begins.
///
/// Each call feeds by a bounded amount from where the model is, at first the empty guide. Returns
/// `true` once the drives' positions are reached and the shape is at rest.
pub fn settle<T: Compiled<LINKS>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: impl Into<Drives<T>>,
) -> bool {
    settle_loaded(model, lumen, state, drives, &Loads::default())
}

/// [`settle`] with external loads.
pub fn settle_loaded<T: Compiled<LINKS>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    drives: impl Into<Drives<T>>,
    loads: &Loads<T>,
) -> bool {
    T::settle_loaded(model, lumen, state, drives.into(), loads)
}

/// The most links that anything is computed with, on the host.
pub const MOST_LINKS: usize = 512;

/// A number type whose step with at most `LINKS` links is compiled in this crate.
///
/// Devices use `f32` with [`MAX_LINKS`](crate::MAX_LINKS), the host `f64` too. Studies of convergence,
/// with fewer links or with more, use [`MOST_LINKS`].
pub trait Compiled<const LINKS: usize>: Real {
    /// [`step_loaded`](crate::step_loaded)
    fn step_loaded(
        model: &Model<Self, LINKS>,
        lumen: &Lumen<'_>,
        state: &mut State<Self, LINKS>,
        drives: Drives<Self>,
        loads: &Loads<Self>,
    ) -> Outputs<Self>;

    /// [`settle_loaded`](crate::settle_loaded)
    fn settle_loaded(
        model: &Model<Self, LINKS>,
        lumen: &Lumen<'_>,
        state: &mut State<Self, LINKS>,
        drives: Drives<Self>,
        loads: &Loads<Self>,
    ) -> bool;
}

macro_rules! compile {
    ($($number:ty: $($links:literal)+;)+) => { $($(
        impl Compiled<$links> for $number {
            fn step_loaded(
                model: &Model<Self, $links>,
                lumen: &Lumen<'_>,
                state: &mut State<Self, $links>,
                drives: Drives<Self>,
                loads: &Loads<Self>,
            ) -> Outputs<Self> {
                advance(model, lumen, state, drives, loads)
            }

            fn settle_loaded(
                model: &Model<Self, $links>,
                lumen: &Lumen<'_>,
                state: &mut State<Self, $links>,
                drives: Drives<Self>,
                loads: &Loads<Self>,
            ) -> bool {
                approach_rest(model, lumen, state, drives, loads)
            }
        }
    )+)+ };
}

compile! { f32: 64; }
// No board computes these.
#[cfg(not(target_os = "none"))]
compile! { f64: 64; }
// The tests of this library, which is compiled again for them, use none of these.
#[cfg(not(any(test, target_os = "none")))]
compile! {
    f32: 512;
    f64: 512;
}

/// Steps catheters abreast until the attendant has taken out every one of them. Each has the bits that it
/// has alone.
///
/// There must be at most [`side_by_side`](crate::side_by_side) of them, all in one lumen and of kinds that go
/// together ([`Kind`](crate::Kind)); those beyond that number are left as they are.
#[cfg(not(target_os = "none"))]
pub fn step_abreast<T: CompiledAbreast<LINKS>, const LINKS: usize>(
    models: &[&Model<T, LINKS>],
    lumen: &Lumen<'_>,
    states: &mut [&mut State<T, LINKS>],
    attendant: &mut dyn Attendant<T, LINKS>,
) {
    T::step_abreast(models, lumen, states, attendant);
}

/// A number type whose step of catheters abreast is compiled in this crate.
#[cfg(not(target_os = "none"))]
pub trait CompiledAbreast<const LINKS: usize>: Compiled<LINKS> {
    /// [`step_abreast`]
    fn step_abreast(
        models: &[&Model<Self, LINKS>],
        lumen: &Lumen<'_>,
        states: &mut [&mut State<Self, LINKS>],
        attendant: &mut dyn Attendant<Self, LINKS>,
    );
}

#[cfg(not(target_os = "none"))]
macro_rules! compile_abreast {
    ($($number:ty),+) => { $(
        impl CompiledAbreast<64> for $number {
            fn step_abreast(
                models: &[&Model<Self, 64>],
                lumen: &Lumen<'_>,
                states: &mut [&mut State<Self, 64>],
                attendant: &mut dyn Attendant<Self, 64>,
            ) {
                advance_abreast(models, lumen, states, attendant);
            }
        }
    )+ };
}
#[cfg(not(target_os = "none"))]
compile_abreast! { f32, f64 }
