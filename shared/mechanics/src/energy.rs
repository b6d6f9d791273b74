//! Energies of the instrument, for tests that they stay bounded.

use crate::algebra::RelativeRotation;
use crate::{Model, Real, State};

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Kinetic energy of the nodes that the next step takes over \[J\]. It is less than all of it after a
    /// solve that turned a link too far for the linear model.     docs/explanation/model.md (21)
    pub fn kinetic_energy_j(&self, model: &Model<T, LINKS>) -> T {
        let half = T::lit(0.5);
        let tables = self.tables(model);
        let (mut sum, mut distal_mass) = (T::zero(), T::zero());
        for (link, table) in self.links.iter().zip(&tables.links).take(self.count) {
            let mass = table.mass * link.span.share;
            sum += half * (half * (mass + distal_mass)) * link.velocity.norm_squared();
            distal_mass = mass;
        }
        sum * self.momentum_share * self.momentum_share
    }

    /// Elastic energy of bending, twist and stretch inside the vessel and of a shaft that winds up
    /// behind it \[J\].     docs/explanation/model.md (8), (17), (44)
    ///
    /// The energies of the wall and of a tendon are not included. Softening and straightening,
    /// docs/explanation/model.md (43), are ignored.
    pub fn elastic_energy_j(&self, model: &Model<T, LINKS>) -> T {
        let half = T::lit(0.5);
        let tables = self.tables(model);
        let (mut sum, mut proximal) = (T::zero(), self.guide.rotation);
        for j in (0..self.count.min(LINKS)).rev() {
            let (link, joint) = (&self.links[j], &tables.joints[j]);
            let full = model.grid.cell_m(j);
            let length = link.span.length;
            let cell = if j + 1 == self.count {
                self.guide_cell_m(model)
            } else {
                half * (length + self.links[j + 1].span.length)
            };
            let strain = RelativeRotation::between(&proximal, &link.rotation).angle
                - joint.unloaded * (cell / full);
            let bend = strain.x() * strain.x() + strain.y() * strain.y();
            let (mut torsion, mut twist) = (joint.torsion, strain.z());
            if j + 1 == self.count {
                // The shaft is in series. A new link is almost rigid, so the shaft takes all the twist.
                torsion /= T::one() + torsion * (full / cell) * model.windup_rad_per_n_m;
                twist += self.effects.wound_rad;
            }
            let turn = joint.bending * bend + torsion * twist * twist;
            let stretch = length * link.strain;
            let pull = tables.links[j].axial * link.span.inverse_length * stretch * stretch;
            sum += half * (turn * (full / cell) + pull);
            proximal = link.rotation;
        }
        sum
    }
}
