//! How two instruments on one centre line share force and torque behind the guide.
//!
//! The load of one drive follows from virtual work: the instrument slides or turns in the chain while
//! the centre line is held, and its drive supplies the gain in energy and the work of friction. The
//! other drive carries the rest of the total.     docs/explanation/model.md (26)–(28)

use cathforce_scalar::Vector3;

use crate::algebra::RelativeRotation;
use crate::math::minimum;
use crate::segments::{Density, InstrumentRole, Walk};
use crate::{Model, Real, State};

/// Load on a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DriveLoad<T> {
    /// Axial force, positive when pushing \[N\].
    pub force_n: T,
    /// Torque about the direction of insertion \[N·m\].
    pub torque_n_m: T,
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// The guidewire's share of the load `whole`; `None` without a guidewire in the vessel.
    pub(crate) fn guidewire_share(
        &self,
        model: &Model<T, LINKS>,
        whole: DriveLoad<T>,
    ) -> Option<DriveLoad<T>> {
        let walk = self.walk(model, model.guidewire.as_ref()?);
        if self.count == 0 {
            return None;
        }
        let follower = self.overlap.follower();
        let (sliding_n, rolling_n_m) = self.energy_gradient(model, walk, follower);
        let (dragged_n, twisted_n_m) = self.sliding_resistance(model);
        let force_n = match follower {
            InstrumentRole::Guidewire => sliding_n,
            InstrumentRole::Catheter => whole.force_n - sliding_n - dragged_n,
        };
        Some(DriveLoad { force_n, torque_n_m: rolling_n_m + twisted_n_m })
    }

    /// Energy that the chain gains per feed of the follower \[N\], and per rotation of the guidewire
    /// \[N·m\].     docs/explanation/model.md (26), (28)
    fn energy_gradient(
        &self,
        model: &Model<T, LINKS>,
        mut walk: Walk<'_, T>,
        follower: InstrumentRole,
    ) -> (T, T) {
        let softness = self.effects.softness(model);
        let (mut force, mut torque) = (T::zero(), T::zero());
        // Distal to the first joint's cell there is no moment.
        for cell in core::iter::once(None).chain((0..self.count.min(LINKS)).map(Some)) {
            let high_m = self.cell_end_m(model, cell);
            let mut moment = None;
            loop {
                let to_m = minimum(walk.end_m, high_m);
                let own = walk.segment(InstrumentRole::Guidewire);
                if own.unloaded.x() != T::zero() || own.unloaded.y() != T::zero() {
                    let moment = moment.get_or_insert_with(|| self.joint_moment(model, cell));
                    let curvature = walk.density.curvature(&(*moment * (T::one() / softness)));
                    let turning =
                        own.unloaded.x() * curvature.y() - own.unloaded.y() * curvature.x();
                    torque -= own.bending * softness * turning * (to_m - walk.at_m);
                }
                walk.at_m = to_m;
                if walk.end_m >= high_m {
                    break;
                }
                let distal = walk.clone();
                if walk.advance() == follower {
                    let moment = moment.get_or_insert_with(|| self.joint_moment(model, cell));
                    let x = self.point_at(model, to_m) - self.effects.mouth;
                    let lifted = model.gravity.dot(&x);
                    let level = |walk: &Walk<'_, T>| {
                        walk.free_energy(moment, softness) - walk.density.mass * lifted
                    };
                    force += level(&walk) - level(&distal);
                }
            }
        }
        // The guide straightens the instrument: its bending energy is supplied behind the mouth.
        let behind = walk.segment(follower);
        let (u, half) = (&behind.unloaded, T::lit(0.5));
        let bent =
            behind.bending * (u.x() * u.x() + u.y() * u.y()) + behind.torsion * u.z() * u.z();
        (force - half * softness * bent, torque)
    }

    /// Resistance to sliding: of friction, the fluid and the catheter's end against the feed of a
    /// following catheter \[N\], and of friction against rotation of the guidewire \[N·m\].
    /// docs/explanation/model.md (27), (28)
    fn sliding_resistance(&self, model: &Model<T, LINKS>) -> (T, T) {
        let (one, zero) = (T::one(), T::zero());
        let description = model.description();
        let half_m = description.solver.link_length_m * T::lit(0.5);
        let catheter_m = description.instrument.outer_radius_m;
        let wire_m = description.guidewire.as_ref().map_or(catheter_m, |wire| wire.outer_radius_m);
        let (mut dragged, mut twisted) = (zero, zero);
        let stream = self.effects.fluid_force(model);
        let mut distal_m = zero;
        let links = self.links.iter().zip(&self.eliminations).take(self.count);
        for (j, (link, elimination)) in links.enumerate() {
            let half_length_m = link.span.length * T::lit(0.5);
            let arc_m = half_length_m + core::mem::replace(&mut distal_m, half_length_m);
            if let Some(stream) = &stream {
                let covered = self.overlap.catheter_coverage(2 * j, &model.grid);
                let radius_m = wire_m + (catheter_m - wire_m) * covered;
                let per_length =
                    stream.force(&link.tangent, elimination.proximity[0].gap + radius_m);
                dragged -= covered * arc_m * per_length.dot(&link.tangent);
            }
            for (i, memory) in link.memory.iter().enumerate() {
                let (seen, touch) = (&elimination.proximity[i], &elimination.contacts[i]);
                let covered = self.overlap.catheter_coverage(2 * j + i, &model.grid);
                let friction = memory.slip * -touch.sticking_stiffness;
                dragged -= covered * friction.dot(&link.tangent);
                // The cone at the catheter's end is lifted by the wall that the guidewire lies on.
                if covered > zero && covered < one {
                    dragged += memory.normal_n * ((catheter_m - wire_m) / half_m);
                }
                let about = (seen.normal * -wire_m).cross(&friction);
                twisted -= (one - covered) * about.dot(&link.tangent);
            }
        }
        (dragged, twisted)
    }

    /// Proximal end of a joint's cell, as an arc from the chain's tip \[m\]; `None`: where the first
    /// cell begins.
    fn cell_end_m(&self, model: &Model<T, LINKS>, joint: Option<usize>) -> T {
        let (grid, half) = (&model.grid, T::lit(0.5));
        match joint {
            None => minimum(grid.link_length_m * grid.middle(0), self.insertion_m),
            Some(j) if j + 1 == self.count => self.insertion_m,
            Some(j) if j + 2 == self.count => self.insertion_m - self.base_length_m * half,
            Some(j) => grid.link_length_m * grid.middle(j + 1),
        }
    }

    /// Elastic moment of a joint, material axes \[N·m\]; 0 without a joint.     docs/explanation/model.md (8)
    fn joint_moment(&self, model: &Model<T, LINKS>, joint: Option<usize>) -> Vector3<T> {
        let Some((j, link)) = joint.and_then(|j| Some((j, self.links.get(j)?))) else {
            return Vector3::zeros();
        };
        let base = j + 1 >= self.count;
        let proximal =
            if base { &self.guide } else { self.links.get(j + 1).unwrap_or(&self.guide) };
        let full_m = model.grid.cell_m(j);
        let cell_m = match () {
            () if base => self.guide_cell_m(model),
            () if j + 2 == self.count => (model.grid.link_m(j) + self.base_length_m) * T::lit(0.5),
            () => full_m,
        };
        let joint = &self.tables(model).joints[j];
        let bent = RelativeRotation::between(&proximal.rotation, &link.rotation).angle
            * (full_m / cell_m)
            - joint.unloaded;
        let softness = self.effects.softness(model);
        let (bending, torsion) = (joint.bending * softness, joint.torsion * softness);
        Vector3::new(bent.x() * bending, bent.y() * bending, bent.z() * torsion)
    }

    /// Position of the point of the chain at an arc from its tip \[m\].
    fn point_at(&self, model: &Model<T, LINKS>, arc_m: T) -> Vector3<T> {
        let grid = &model.grid;
        let node = grid.link_at(arc_m).min(self.count.max(1) - 1);
        self.links.get(node).map_or(self.effects.mouth, |link| {
            link.position - link.tangent * (arc_m - grid.link_length_m * grid.node(node))
        })
    }
}

impl<T: Real> Density<T> {
    /// Curvature and twist under a moment, material axes \[rad/m\].
    fn curvature(&self, moment: &Vector3<T>) -> Vector3<T> {
        self.unloaded
            + Vector3::new(
                moment.x() * self.bending_compliance,
                moment.y() * self.bending_compliance,
                moment.z() * self.torsion_compliance,
            )
    }
}

impl<T: Real> Walk<'_, T> {
    /// Elastic energy per length minus moment times curvature \[N\]: the free energy per length under a
    /// given moment.
    fn free_energy(&self, moment: &Vector3<T>, softness: T) -> T {
        let curvature = self.density.curvature(&(moment * (T::one() / softness)));
        let stored = |which| {
            let piece = self.segment(which);
            let bent = curvature - piece.unloaded;
            piece.bending * (bent.x() * bent.x() + bent.y() * bent.y())
                + piece.torsion * bent.z() * bent.z()
        };
        let both = stored(InstrumentRole::Catheter) + stored(InstrumentRole::Guidewire);
        T::lit(0.5) * softness * both - moment.dot(&curvature)
    }
}
