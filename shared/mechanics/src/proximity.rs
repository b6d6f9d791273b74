//! The wall near the instrument: looked up for half of the samples in turn, once a step for all
//! of its solves.

use cathforce_scalar::Vector3;

use crate::effects::acting::Law;
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
    pub fn none() -> Self {
        let v = Vector3::zeros();
        let far = T::one();
        Self { arm: v, normal: v, gap: far, stiffness: T::zero(), looked_from: v, distance: far }
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// The wall at the two sample points of each link: its node, and the arc above its middle.
    ///
    /// A sample is looked up every second step, the nodes in one and the middles in the next, or
    /// `both` in each; in between it moves before the plane that it saw.     docs/model.md (10)
    pub(crate) fn look(
        &mut self,
        model: &Model<T, LINKS>,
        lumen: &Lumen<'_>,
        law: &impl Law<T>,
        both: bool,
    ) {
        self.nodes_look = !self.nodes_look;
        let looks = [both || self.nodes_look, both || !self.nodes_look];
        let radius = model.description().instrument.outer_radius_m;
        let count = self.count.min(LINKS);
        let (links, eliminations) = (&self.links[..count], &mut self.eliminations[..count]);
        let proximal_of = |j: usize| links.get(j + 1).unwrap_or(&self.guide);
        let mut lowest = T::one();
        // Beyond the tip the curvature goes on.
        let beyond = |tip: &LinkState<T>| tip.tangent * T::lit(2.0) - proximal_of(0).tangent;
        let mut distal_tangent = links.first().map_or(Vector3::zeros(), beyond);
        for (j, (link, kept)) in links.iter().zip(eliminations).enumerate() {
            // docs/model.md (16)
            let length = link.span.length;
            let sagitta = (proximal_of(j).tangent - distal_tangent) * (length * T::lit(0.0625));
            let half_chord = length * (T::one() + link.strain) * T::lit(0.5);
            let middle = sagitta - link.tangent * half_chord;
            distal_tangent = link.tangent;
            let offsets = [Vector3::zeros(), middle];
            for (i, (seen, offset)) in kept.seen.iter_mut().zip(offsets).enumerate() {
                let radius = law.radius(2 * j + i, radius);
                let position = link.position + offset;
                if looks[i] {
                    let wall = lumen.sample(position);
                    (seen.distance, seen.normal) =
                        law.wall(&position, wall.distance_m, wall.normal);
                    seen.stiffness = wall.stiffness;
                    seen.looked_from = position;
                }
                let moved = position - seen.looked_from;
                let distance = seen.distance + seen.normal.dot(&moved);
                lowest = lowest.smaller(distance);
                seen.arm = offset - seen.normal * radius;
                seen.gap = distance - radius;
            }
        }
        self.outside = lowest < T::lit(-0.5);
    }
}
