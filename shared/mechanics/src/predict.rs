//! The predictor, which moves the state to the initial guess of the next solve.

use cathforce_scalar::{Catheters, Kernel, Pack, PlainPack, Vector3};

use crate::Real;
use crate::algebra::Rotation;
use crate::link_group::LinkGroup;
use crate::math::maximum;
use crate::state::{LinkState, State};

/// Largest predicted rotation of a link in a step \[rad\]. A link with a larger one is not predicted.
const LARGEST_PREDICTED_TURN: f64 = 0.2;
/// Square of half of it.
const LARGEST_SQUARED: f64 = 0.25 * LARGEST_PREDICTED_TURN * LARGEST_PREDICTED_TURN;

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Predicts rotations by the filtered rates, and positions from the base.
    /// docs/explanation/model.md (5)
    ///
    /// The result is the initial guess of the solve; `dt_s` = 0 predicts no rotation. `ratio`: factor
    /// on the rates, see [`MotionRatio`](crate::drive_motion::MotionRatio).
    #[inline(never)]
    pub(crate) fn predict(&mut self, dt_s: T, ratio: T) {
        T::run_vectorised(PredictKernel { state: self, prediction: Prediction::new(dt_s, ratio) });
    }
}

/// Constants of the prediction in one step.
#[derive(Clone, Copy)]
pub(crate) struct Prediction<T> {
    /// Time over which the rates are predicted to act \[s\].
    pub dt_s: T,
    /// Square of half a rotation from which on a rate is forgotten. One that is too large only by the
    /// drives' acceleration is kept for later steps.
    pub forgotten: T,
}

impl<T: Real> Prediction<T> {
    #[inline(always)]
    pub fn new(dt_s: T, ratio: T) -> Self {
        let forgotten = T::lit(LARGEST_SQUARED) * maximum(ratio * ratio, T::one());
        Self { dt_s: dt_s * ratio, forgotten }
    }
}

/// [`State::predict`], with one link in each lane.
struct PredictKernel<'a, T: Real, const LINKS: usize> {
    state: &'a mut State<T, LINKS>,
    prediction: Prediction<T>,
}

impl<T: Real, const LINKS: usize> Kernel<T> for PredictKernel<'_, T, LINKS> {
    type Output = ();

    #[inline(always)]
    fn run<N: PlainPack<T>>(self) {
        let Self { state, prediction } = self;
        let count = state.count.min(LINKS);
        predict::<T, N>(&mut state.links[..count], count, state.effects.mouth, &prediction);
    }
}

/// Predicts all `links`, of which each catheter has `counts`, from the mouth to the tip.
#[inline(always)]
pub(crate) fn predict<S: Catheters, N: Pack<S>>(
    links: &mut [LinkState<S>],
    counts: S::Count,
    mouth: Vector3<S>,
    prediction: &Prediction<S>,
) {
    let Prediction { dt_s, forgotten } = *prediction;
    let half_dt = N::splat(dt_s * S::lit(0.5));
    let largest = S::lit(LARGEST_SQUARED);
    let mut position = mouth;
    for group in LinkGroup::<N>::all(links.len()).rev() {
        // Every group is in range. Said this way, the device's code has no panic here (P13).
        if group.at(0) >= links.len() {
            continue;
        }
        let link = |lane: usize| &links[group.at(lane)];
        let half = N::gather_vectors(|lane| link(lane).rate) * half_dt;
        let squared = half.dot(&half);
        let rotation = Rotation::<N>::gather(|lane| &link(lane).rotation).turned(&half);
        let tangent = N::split_vectors(rotation.tangent());
        let rotation = rotation.split::<S>();
        for lane in group.guide_to_tip() {
            let present = S::present(counts, group.at(lane));
            let link = &mut links[group.at(lane)];
            let squared = squared.lane(lane);
            let is_small = squared.below(largest);
            (link.rotation, link.tangent, link.turn) = S::either(
                is_small,
                || (rotation[lane], tangent[lane], link.rate * dt_s),
                || (link.rotation, link.tangent, Vector3::zeros()),
            );
            if !S::all(is_small) {
                let is_forgotten = squared.reaches(forgotten);
                link.rate = S::either(is_forgotten, Vector3::zeros, || link.rate);
            }
            // docs/explanation/model.md (6)
            let lever = link.tangent * (link.span.length * (S::lit(1.0) + link.strain));
            position = S::either(present, || position + lever, || position);
            link.displacement = position - link.position;
            link.position = position;
        }
    }
}
