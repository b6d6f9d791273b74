//! The springs that relax, before and after a solve.     docs/explanation/model.md (55), (56)

use crate::algebra::RelativeRotation;
use crate::effects::relaxation::{relaxes, strained};
use crate::math::{maximum, minimum};
use crate::scheme::Scheme;
use crate::{Model, Real, State};

/// Length of a step; `None` on the way to rest, where all springs have relaxed.
fn step_s<T: Real>(scheme: &Scheme<T>) -> Option<T> {
    (scheme.inertia > T::zero()).then_some(scheme.dt_s)
}

// Frames of their own: the solve's is the deepest of a tick.
impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Prepares the springs for a solve.
    #[inline(never)]
    pub(crate) fn prepare_springs(&mut self, model: &Model<T, LINKS>, scheme: &Scheme<T>) {
        let effect = &model.description().effects.instrument.viscoelastic;
        self.springs.prepare(effect, step_s(scheme));
    }

    /// Relaxes the springs of the joints after the last solve of a step.
    #[inline(never)]
    pub(crate) fn relax_springs(&mut self, model: &Model<T, LINKS>, scheme: &Scheme<T>) {
        if !(self.springs.act && scheme.last) {
            return;
        }
        let effect = &model.description().effects.instrument.viscoelastic;
        let (grid, half, zero, one) = (&model.grid, T::lit(0.5), T::zero(), T::one());
        let count = self.count.min(LINKS);
        let guide_cell_m = self.guide_cell_m(model);
        // Half of what is fed enters each of the two cells at the base link.
        let fed_m = maximum(self.fed_m, zero) * half;
        let relaxes = step_s(scheme).map(|dt_s| relaxes(effect, dt_s));
        let Self { links, guide, springs, coaxial_tables, base_length_m, .. } = self;
        let has_wire = model.guidewire.is_some();
        let tables = if has_wire { &*coaxial_tables } else { &model.tables };
        let links = &links[..count];
        for (j, (relaxed, joint)) in springs.relaxed.iter_mut().zip(&tables.joints).enumerate() {
            let [up, side, _] = joint.unloaded.into();
            // In the guide it is as straight as it was packed.
            let in_guide = |unloaded: T| unloaded - unloaded * effect.packed_share;
            let Some(distal) = links.get(j) else {
                // The next one to enter.
                *relaxed = [up, side].map(in_guide);
                break;
            };
            let proximal = links.get(j + 1).unwrap_or(guide);
            let cell_m = match count - j {
                1 => guide_cell_m,
                2 => (grid.link_m(j) + *base_length_m) * half,
                _ => grid.cell_m(j),
            };
            let is_at_base = count - j <= 2;
            let bend = RelativeRotation::between(&proximal.rotation, &distal.rotation).angle
                * (grid.cell_m(j) / cell_m);
            let now = |before: T, bend: T, unloaded: T| match relaxes {
                Some(relaxes) => {
                    let relaxed = before + (bend - before) * relaxes;
                    if is_at_base {
                        relaxed + (in_guide(unloaded) - relaxed) * minimum(fed_m / cell_m, one)
                    } else {
                        relaxed
                    }
                }
                None => bend - unloaded * strained(effect),
            };
            let [before_up, before_side] = *relaxed;
            *relaxed = [now(before_up, bend.x(), up), now(before_side, bend.y(), side)];
        }
    }
}
