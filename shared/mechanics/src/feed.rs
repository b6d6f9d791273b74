//! Feed and rotation at the drive: links are born at the guide and dropped there, and the
//! state is carried to the predictor of the next solve.

use nalgebra::Vector3;

use crate::algebra::{Bend, dot};
use crate::model::{maximum, minimum};
use crate::state::{LinkState, State};
use crate::{Drive, Model, Real};

/// Turns the predictor by at most this much a solve \[rad\]; beyond, it is no prediction.
const LARGEST_PREDICTED_TURN: f64 = 0.2;

/// Shortest base link, over the link length, that the guide's joint and the stretch see:
/// a link enters the vessel rigid and softens as it grows.
pub(crate) const SHORTEST_BASE: f64 = 0.001;

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Arc that the guide's joint stands for: half of the base link \[m\].
    pub(crate) fn guide_cell_m(&self, model: &Model<T, LINKS>) -> T {
        let shortest = model.description().solver.link_length_m * T::lit(SHORTEST_BASE);
        maximum(self.base_length_m, shortest) * T::lit(0.5)
    }

    /// Keeps every joint's curvature at the start of a step, for viscous bending.
    pub(crate) fn remember_curvature(&mut self, model: &Model<T, LINKS>) {
        let mut near = self.guide.rotation;
        let mut cell = self.guide_cell_m(model);
        for j in (0..self.count.min(LINKS)).rev() {
            let link = &mut self.links[j];
            link.curvature = Bend::between(&near, &link.rotation).angle * (T::one() / cell);
            near = link.rotation;
            cell =
                (self.length_m(model, j) + model.description().solver.link_length_m) * T::lit(0.5);
        }
    }

    /// Moves the drive to `target`, within what the links can reach.     docs/model.md (2)
    ///
    /// A link is born a little late, so that a drive that rests on a whole number of links
    /// does not bear and drop one in turn with its last bit.
    pub(crate) fn feed(&mut self, model: &Model<T, LINKS>, target: Drive<T>) {
        let h = model.description().solver.link_length_m;
        let insertion = minimum(maximum(target.insertion_m, T::zero()), model.reach_m());
        self.fed_m = insertion - self.drive.insertion_m;
        self.drive = Drive { insertion_m: insertion, rotation_rad: target.rotation_rad };
        self.guide.rotation = model.guide_turned(target.rotation_rad + self.effects.wound_rad);
        self.guide.tangent = self.guide.rotation.tangent();
        let full = T::int(self.count.saturating_sub(1) as i32) * h;
        self.base_length_m = insertion - full;
        let longest = h * T::lit(1.0 + SHORTEST_BASE);
        while self.count < LINKS && (self.count == 0 || self.base_length_m > longest) {
            if self.count > 0 {
                self.base_length_m -= h;
            } else if insertion <= T::zero() {
                return;
            }
            self.give_birth();
        }
        while self.count > 0 && self.base_length_m <= T::zero() {
            self.count -= 1;
            if self.count > 0 {
                self.base_length_m += h;
            }
        }
    }

    /// A new base link: straight, along the guide, at rest in the material's frame.
    fn give_birth(&mut self) {
        let strain = self.count.checked_sub(1).map_or(T::zero(), |base| self.links[base].strain);
        if let Some(link) = self.links.get_mut(self.count) {
            *link = LinkState {
                rotation: self.guide.rotation,
                tangent: self.guide.tangent,
                strain,
                position: self.effects.mouth,
                ..LinkState::new()
            };
            self.count += 1;
        }
    }

    /// Rotations by the filtered rates, positions from the base.     docs/model.md (3)
    ///
    /// Only the initial guess of the solve; `dt_s` = 0 predicts no rotation.
    pub(crate) fn predict(&mut self, model: &Model<T, LINKS>, dt_s: T) {
        let half_dt = dt_s * T::lit(0.5);
        let largest = T::lit(0.25 * LARGEST_PREDICTED_TURN * LARGEST_PREDICTED_TURN);
        let mut position = self.effects.mouth;
        for j in (0..self.count.min(LINKS)).rev() {
            let length = self.length_m(model, j);
            let link = &mut self.links[j];
            let half = link.rate * half_dt;
            if dot(&half, &half) < largest {
                link.rotation = link.rotation.turned(&half);
                link.turn = link.rate * dt_s;
            } else {
                link.rate = Vector3::zeros();
                link.turn = Vector3::zeros();
            }
            link.tangent = link.rotation.tangent();
            position += link.tangent * (length * (T::one() + link.strain));
            link.displacement = position - link.position;
            link.position = position;
        }
    }
}
