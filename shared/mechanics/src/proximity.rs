//! The wall near the instrument: looked up for half of the samples in turn, once a step for all
//! of its solves.

use core::mem::replace;

use cathforce_scalar::{Pack, Vector3};

use crate::effects::acting::Law;
use crate::lanes::Group;
use crate::state::{LinkState, State};
use crate::{Lumen, Model, Real};

/// Where one sample point is, and the wall that it sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proximity<T: Real> {
    /// From the link's distal node to the point of the surface that is next to the wall \[m\].
    pub arm: Vector3<T>,
    /// Normal into the lumen.
    pub normal: Vector3<T>,
    /// From the surface to the wall, negative if it is indented \[m\].
    pub gap: T,
    /// The wall's stiffness over the nominal one.
    pub stiffness: T,
    /// Where the wall was last looked up, and how far it was from there \[m\].
    looked_from: Vector3<T>,
    distance: T,
}

impl<T: Real> Proximity<T> {
    pub const fn none() -> Self {
        let v = T::ORIGIN;
        let far = T::ONE;
        Self { arm: v, normal: v, gap: far, stiffness: T::ZERO, looked_from: v, distance: far }
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// The wall at the two sample points of each link: its node, and the arc above its middle.
    ///
    /// A sample is looked up every second step, the nodes in one and the middles in the next; in
    /// between it moves before the plane that it saw.     docs/model.md (10)
    #[inline(always)]
    pub(crate) fn look<N: Pack<T>>(
        &mut self,
        model: &Model<T, LINKS>,
        lumen: &Lumen<'_>,
        law: &impl Law<T>,
    ) {
        self.nodes_look = !self.nodes_look;
        let looks = [self.nodes_look, !self.nodes_look];
        let radius = model.description().instrument.outer_radius_m;
        let count = self.count.min(LINKS);
        let (links, eliminations) = (&self.links[..count], &mut self.eliminations[..count]);
        let proximal_of = |j: usize| links.get(j + 1).unwrap_or(&self.guide);
        let mut lowest = N::lit(1.0);
        // Beyond the tip the curvature goes on.
        let beyond = |tip: &LinkState<T>| tip.tangent * T::lit(2.0) - proximal_of(0).tangent;
        let mut distal_tangent = links.first().map_or(Vector3::zeros(), beyond);
        for group in Group::<N>::all(count) {
            let at = |lane: usize| group.at(lane);
            let link = |lane: usize| &links[at(lane)];
            let distal_tangents =
                group.in_turn(|j, _| replace(&mut distal_tangent, links[j].tangent));
            // docs/model.md (16)
            let length = N::each(|lane| link(lane).span.length);
            let tangent = N::vectors(|lane| link(lane).tangent);
            let sagitta = (N::vectors(|lane| proximal_of(at(lane)).tangent)
                - N::vectors(|lane| distal_tangents[lane]))
                * (length * N::lit(0.0625));
            let strain = N::each(|lane| link(lane).strain);
            let half_chord = length * (N::lit(1.0) + strain) * N::lit(0.5);
            let node = N::vectors(|lane| link(lane).position);
            let offsets = [Vector3::zeros(), sagitta - tangent * half_chord];
            for (i, offset) in offsets.into_iter().enumerate() {
                let radius = N::each(|lane| law.radius(2 * at(lane) + i, radius));
                let position = node + offset;
                if looks[i] {
                    let wall = lumen.sample_lanes::<T, N>(position);
                    let (distance, normal) = law.wall(&position, wall.distance_m, wall.normal);
                    let (normal, looked_from) = (N::apart(normal), N::apart(position));
                    for lane in 0..N::LANES {
                        let seen = &mut eliminations[at(lane)].seen[i];
                        seen.distance = distance.lane(lane);
                        seen.normal = normal[lane];
                        seen.stiffness = wall.stiffness.lane(lane);
                        seen.looked_from = looked_from[lane];
                    }
                }
                let seen = |lane: usize| &eliminations[at(lane)].seen[i];
                let normal = N::vectors(|lane| seen(lane).normal);
                let moved = position - N::vectors(|lane| seen(lane).looked_from);
                let distance = N::each(|lane| seen(lane).distance) + normal.dot(&moved);
                lowest = lowest.smaller(distance);
                let arm = N::apart(offset - normal * radius);
                let gap = distance - radius;
                for lane in 0..N::LANES {
                    let seen = &mut eliminations[at(lane)].seen[i];
                    (seen.arm, seen.gap) = (arm[lane], gap.lane(lane));
                }
            }
        }
        let lowest = (1..N::LANES).fold(lowest.lane(0), |low, lane| low.smaller(lowest.lane(lane)));
        self.outside = lowest < T::lit(-0.5);
    }
}
