//! The wall near the instrument: looked up once a step, for all of its solves.

use nalgebra::Vector3;

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
}

impl<T: Real> Proximity<T> {
    pub fn none() -> Self {
        let v = Vector3::zeros();
        Self { arm: v, normal: v, gap: T::one(), stiffness: T::zero() }
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Looks up the wall at the two sample points of each link: its node, and the arc above its
    /// middle.
    pub(crate) fn look(&mut self, model: &Model<T, LINKS>, lumen: &Lumen<'_>, law: &impl Law<T>) {
        let solver = &model.description().solver;
        let radius = model.description().instrument.outer_radius_m;
        let count = self.count.min(LINKS);
        let (links, eliminations) = (&self.links[..count], &mut self.eliminations[..count]);
        let proximal_of = |j: usize| links.get(j + 1).unwrap_or(&self.guide);
        let mut lowest = T::one();
        // Beyond the tip the curvature goes on.
        let beyond = |tip: &LinkState<T>| tip.tangent * T::lit(2.0) - proximal_of(0).tangent;
        let mut distal_tangent = links.first().map_or(Vector3::zeros(), beyond);
        for (j, (link, kept)) in links.iter().zip(eliminations).enumerate() {
            let base = j + 1 == count;
            let length = if base { self.base_length_m } else { solver.link_length_m };
            // docs/model.md (16)
            let sagitta = (proximal_of(j).tangent - distal_tangent) * (length * T::lit(0.0625));
            let half_chord = length * (T::one() + link.strain) * T::lit(0.5);
            let middle = sagitta - link.tangent * half_chord;
            distal_tangent = link.tangent;
            let offsets = [Vector3::zeros(), middle];
            for (i, (seen, offset)) in kept.seen.iter_mut().zip(offsets).enumerate() {
                let radius = law.radius(2 * j + i, radius);
                let position = link.position + offset;
                let wall = lumen.sample(&position);
                lowest = lowest.smaller(wall.distance_m);
                let (distance, normal) = law.wall(&position, wall.distance_m, wall.normal);
                seen.arm = offset - normal * radius;
                seen.normal = normal;
                seen.gap = distance - radius;
                seen.stiffness = wall.stiffness;
            }
        }
        self.outside = lowest < T::lit(-0.5);
    }
}
