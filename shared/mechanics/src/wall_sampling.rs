//! Sampling of the wall near the instrument: half of the sample points in each step, once for all of
//! its solves.

use core::mem::replace;

use cathforce_scalar::{Pack, Vector3};

use crate::effects::active::Law;
use crate::link_group::LinkGroup;
use crate::state::{LinkState, State};
use crate::{Lumen, Model, Real};

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Updates the wall at the two sample points of each link: its node, and the arc above its middle.
    /// docs/explanation/model.md (11)
    ///
    /// Nodes are sampled in one step, middles in the next. In between, a sample point uses the tangent
    /// plane of the wall from its last sample.
    #[inline(always)]
    pub(crate) fn sample_wall<N: Pack<T>>(
        &mut self,
        model: &Model<T, LINKS>,
        lumen: &Lumen<'_>,
        law: &impl Law<T>,
    ) {
        self.nodes_sampled = !self.nodes_sampled;
        let samples = [self.nodes_sampled, !self.nodes_sampled];
        let radius = model.description().instrument.outer_radius_m;
        let count = self.count.min(LINKS);
        let (links, eliminations) = (&self.links[..count], &mut self.eliminations[..count]);
        let proximal_of = |j: usize| links.get(j + 1).unwrap_or(&self.guide);
        let mut lowest = N::lit(1.0);
        // Beyond the tip, the curvature of the last link is continued.
        let beyond = |tip: &LinkState<T>| tip.tangent * T::lit(2.0) - proximal_of(0).tangent;
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
                if samples[i] {
                    let wall = lumen.sample_lanes::<T, N>(position);
                    let (distance, normal) = law.wall(&position, wall.distance_m, wall.normal);
                    let (normal, sampled_at) =
                        (N::split_vectors(normal), N::split_vectors(position));
                    for lane in 0..N::LANES {
                        let seen = &mut eliminations[at(lane)].proximity[i];
                        seen.distance = distance.lane(lane);
                        seen.normal = normal[lane];
                        seen.stiffness = wall.stiffness.lane(lane);
                        seen.sampled_at = sampled_at[lane];
                    }
                }
                let seen = |lane: usize| &eliminations[at(lane)].proximity[i];
                let normal = N::gather_vectors(|lane| seen(lane).normal);
                let moved = position - N::gather_vectors(|lane| seen(lane).sampled_at);
                let distance = N::from_lanes(|lane| seen(lane).distance) + normal.dot(&moved);
                lowest = lowest.smaller(distance);
                let arm = N::split_vectors(offset - normal * radius);
                let gap = distance - radius;
                for lane in 0..N::LANES {
                    let seen = &mut eliminations[at(lane)].proximity[i];
                    (seen.arm, seen.gap) = (arm[lane], gap.lane(lane));
                }
            }
        }
        let lowest = (1..N::LANES).fold(lowest.lane(0), |low, lane| low.smaller(lowest.lane(lane)));
        self.outside = lowest < T::lit(-0.5);
    }
}
