//! The tendon of a steerable instrument.     docs/model.md (34), (35)

use cathforce_scalar::Vector3;

use crate::coaxial::Overlap;
use crate::grid::Grid;
use crate::model::{maximum, minimum, sin_cos};
use crate::tables::Joint;
use crate::{Description, Real, Tendon};

/// What the tendon remembers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonState<T: Real> {
    /// Tension at the handle \[N\].
    tension_n: T,
    /// Of the tension at the handle, one over the share that reaches the tip.
    capstan_factor: T,
    /// How it bends the cell at the guide's mouth, material axes \[rad\].
    pub at_mouth: Vector3<T>,
}

impl<T: Real> TendonState<T> {
    pub const fn new() -> Self {
        Self { tension_n: T::ZERO, capstan_factor: T::ONE, at_mouth: T::ORIGIN }
    }
}

/// The tendon in one sweep from the tip to the guide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonBend<T: Real> {
    geometry: Tendon<T>,
    friction: T,
    slack_m: T,
    /// Axis about which it bends the instrument, material.
    axis: Vector3<T>,
    grid: Grid<T>,
    /// From the anchor to where the next joint's cell begins and to the tendon's end, over the link
    /// length.
    begins: T,
    ends: T,
    /// Tension where the sweep is \[N\], and one over its share at the tip.
    tension_n: T,
    capstan_factor: T,
    /// How it bends the last cell \[rad\].
    last_bend: Vector3<T>,
    /// Bend towards the tendon so far \[rad\].
    bend: T,
    /// Bend per tension of the free instrument so far \[rad/N\].
    compliance: T,
}

impl<T: Real> TendonBend<T> {
    /// `None` without a tendon that bends anything.
    pub fn new(
        description: &Description<T>,
        grid: &Grid<T>,
        overlap: &Overlap<T>,
        memory: &TendonState<T>,
    ) -> Option<Self> {
        let (tendon, zero) = (description.tendon, T::zero());
        let lever = tendon.offset_m * tendon.stiffness_n_per_m * tendon.length_m;
        (lever > zero).then(|| {
            let (sin, cos) = sin_cos(tendon.angle_rad);
            Self {
                geometry: tendon,
                friction: description.effects.tendon.friction.coefficient,
                slack_m: description.effects.tendon.slack.length_m,
                axis: Vector3::new(-sin, cos, zero),
                begins: grid.middle(0) - overlap.catheter.behind_m / grid.link_length_m,
                ends: description.tendon.length_m / grid.link_length_m,
                grid: *grid,
                tension_n: memory.tension_n / memory.capstan_factor,
                capstan_factor: T::one(),
                last_bend: Vector3::zeros(),
                bend: zero,
                compliance: zero,
            }
        })
    }

    /// Adds to the unloaded bend of joint `index` what the tendon does there; `bend` is the
    /// joint's rotation \[rad\].     docs/model.md (34)
    pub fn bend_joint(&mut self, index: usize, bend: &Vector3<T>, joint: &mut Joint<T>) {
        let cell = self.grid.cell(index);
        let per_cell = T::one() / cell;
        let begins = self.begins;
        self.begins += cell;
        // The tendon ends within the one cell, and stops bending within the other.
        let within = |length: T| minimum(maximum(length, T::zero()), cell) * per_cell;
        let inside = within(self.begins);
        let share = minimum(within(self.ends - begins), inside);
        let turned = bend.dot(bend).root() * inside;
        let step = T::one() + self.friction * turned;
        self.capstan_factor *= step;
        self.tension_n *= step;
        let per_tension = self.geometry.offset_m * share / joint.bending;
        self.last_bend = self.axis * (self.tension_n * per_tension);
        joint.unloaded += self.last_bend;
        self.bend += bend.dot(&self.axis) * share;
        self.compliance += per_tension;
    }

    /// After the sweep: the tension of the next one, a Newton step that is exact for the free
    /// instrument and too short for one that is held.     docs/model.md (35)
    pub fn finish(&self, memory: &mut TendonState<T>) {
        let Tendon { pull_m, stiffness_n_per_m, offset_m, .. } = self.geometry;
        let stretched = maximum(pull_m - self.slack_m - offset_m * self.bend, T::zero());
        let gain = stiffness_n_per_m * offset_m * self.compliance;
        memory.tension_n += (stiffness_n_per_m * stretched - memory.tension_n) / (T::one() + gain);
        memory.capstan_factor = self.capstan_factor;
        memory.at_mouth = self.last_bend;
    }
}
