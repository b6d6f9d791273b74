//! Sampling of the wall near the instrument: half of the sample points in each step, once for all of
//! its solves.

use core::marker::PhantomData;
use core::mem::replace;

use cathforce_scalar::{Catheters, Number, Pack, PlainPack, Vector3};

use crate::chain::Chain;
use crate::effects::active::Law;
use crate::link_group::LinkGroup;
use crate::state::LinkState;
use crate::{Lumen, Real, WallSample};

/// Least distance to the wall that is stored; below it, a point is beyond the stored wall \[m\].
pub(crate) const OUTSIDE_M: f64 = -0.5;

/// The wall next to a point of each lane.
pub(crate) trait Sampler<N: Number> {
    fn sample(&self, position: Vector3<N>) -> WallSample<N>;
}

/// The stored wall.
pub(crate) struct Stored<'a, 'l, T> {
    lumen: &'a Lumen<'l>,
    number: PhantomData<T>,
}

impl<'a, 'l, T> Stored<'a, 'l, T> {
    pub fn new(lumen: &'a Lumen<'l>) -> Self {
        Self { lumen, number: PhantomData }
    }
}

impl<T: Real, N: PlainPack<T>> Sampler<N> for Stored<'_, '_, T> {
    #[inline(always)]
    fn sample(&self, position: Vector3<N>) -> WallSample<N> {
        self.lumen.sample_lanes::<T, N>(position)
    }
}

/// Updates the wall at the two sample points of each link: its node, and the arc above its middle. Returns
/// the least distance to the wall \[m\].     docs/explanation/model.md (11)
///
/// Nodes are sampled in one step, middles in the next. In between, a sample point uses the tangent
/// plane of the wall from its last sample. `of_nodes`: the catheters whose nodes are sampled.
#[inline(always)]
pub(crate) fn sample_wall<S: Catheters, N: Pack<S>, const LINKS: usize>(
    chain: &mut Chain<'_, S, LINKS>,
    of_nodes: S::Mask,
    radius: S,
    lumen: &impl Sampler<N>,
    law: &impl Law<S>,
) -> S {
    let Chain { links, eliminations, guide, count: counts, longest, .. } = chain;
    let samples = [of_nodes, S::not(of_nodes)];
    let count = (*longest).min(LINKS);
    let (links, eliminations) = (&links[..count], &mut eliminations[..count]);
    let proximal_of = |j: usize| links.get(j + 1).unwrap_or(*guide);
    let mut lowest = N::lit(1.0);
    // Beyond the tip, the curvature of the last link is continued.
    let beyond = |tip: &LinkState<S>| tip.tangent * S::lit(2.0) - proximal_of(0).tangent;
    let mut distal_tangent = links.first().map_or(Vector3::zeros(), beyond);
    for group in LinkGroup::<N>::all(count) {
        let at = |lane: usize| group.at(lane);
        let link = |lane: usize| &links[at(lane)];
        let distal_tangents =
            group.map_in_order(|j, _| replace(&mut distal_tangent, links[j].tangent));
        // docs/explanation/model.md (7)
        let length = N::from_lanes(|lane| link(lane).span.length);
        let tangent = N::gather_vectors(|lane| link(lane).tangent);
        let sagitta = (N::gather_vectors(|lane| proximal_of(at(lane)).tangent)
            - N::gather_vectors(|lane| distal_tangents[lane]))
            * (length * N::lit(0.0625));
        let strain = N::from_lanes(|lane| link(lane).strain);
        let half_chord = length * (N::lit(1.0) + strain) * N::lit(0.5);
        let node = N::gather_vectors(|lane| link(lane).position);
        let offsets = [Vector3::zeros(), sagitta - tangent * half_chord];
        for (i, offset) in offsets.into_iter().enumerate() {
            let radius = N::from_lanes(|lane| law.radius(2 * at(lane) + i, radius));
            let position = node + offset;
            if S::any(samples[i]) {
                let wall = lumen.sample(position);
                let (distance, normal) = law.wall(&position, wall.distance_m, wall.normal);
                let (normal, sampled_at) = (N::split_vectors(normal), N::split_vectors(position));
                for lane in 0..N::LANES {
                    let seen = &mut eliminations[at(lane)].proximity[i];
                    let [distance, stiffness] =
                        [distance, wall.stiffness].map(|number| number.lane(lane));
                    ((seen.distance, seen.stiffness), (seen.normal, seen.sampled_at)) = S::either(
                        samples[i],
                        || ((distance, stiffness), (normal[lane], sampled_at[lane])),
                        || ((seen.distance, seen.stiffness), (seen.normal, seen.sampled_at)),
                    );
                }
            }
            let seen = |lane: usize| &eliminations[at(lane)].proximity[i];
            let normal = N::gather_vectors(|lane| seen(lane).normal);
            let moved = position - N::gather_vectors(|lane| seen(lane).sampled_at);
            let distance = N::from_lanes(|lane| seen(lane).distance) + normal.dot(&moved);
            let present = S::present(*counts, at(0));
            lowest = N::where_present(present, lowest.smaller(distance), lowest);
            let arm = N::split_vectors(offset - normal * radius);
            let gap = distance - radius;
            for lane in 0..N::LANES {
                let seen = &mut eliminations[at(lane)].proximity[i];
                (seen.arm, seen.gap) = (arm[lane], gap.lane(lane));
            }
        }
    }
    (1..N::LANES).fold(lowest.lane(0), |low, lane| low.smaller(lowest.lane(lane)))
}
