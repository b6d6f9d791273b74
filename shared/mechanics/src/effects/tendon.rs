//! The tendon of a steerable instrument.     docs/explanation/model.md (29), (30)

use cathforce_scalar::Vector3;

use crate::grid::Grid;
use crate::math::{maximum, minimum, sin_cos};
use crate::overlap::Overlap;
use crate::tables::Joint;
use crate::{Description, Real, Tendon};

/// State of the tendon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonState<T: Real> {
    /// Tension at the handle \[N\].
    tension_n: T,
    /// Tension at the handle over the tension at the tip \[1\].
    capstan_factor: T,
    /// Bend of the cell at the guide's mouth by the tendon, material axes \[rad\].
    pub at_mouth: Vector3<T>,
}

impl<T: Real> TendonState<T> {
    pub const fn new() -> Self {
        Self { tension_n: T::ZERO, capstan_factor: T::ONE, at_mouth: T::ORIGIN }
    }
}

/// The tendon in one pass of the recursion from the tip to the guide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonBend<T: Real> {
    geometry: Tendon<T>,
    friction: T,
    slack_m: T,
    /// Axis about which it bends the instrument, material axes.
    axis: Vector3<T>,
    grid: Grid<T>,
    /// Arcs from the anchor to the distal end of the next joint's cell and to the tendon's end
    /// \[link lengths\].
    begins: T,
    ends: T,
    /// Tension at the present joint \[N\], and its ratio to the tension at the tip \[1\].
    tension_n: T,
    capstan_factor: T,
    /// Bend of the last cell by the tendon \[rad\].
    last_bend: Vector3<T>,
    /// Accumulated bend towards the tendon \[rad\].
    bend: T,
    /// Accumulated bend of the free instrument per tension \[rad/N\].
    compliance: T,
}

impl<T: Real> TendonBend<T> {
    /// `None` without a tendon, or with one that cannot bend the instrument.
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

    /// Adds the tendon's bend to the unloaded rotation of joint `index`.
    /// docs/explanation/model.md (29)
    ///
    /// `bend`: present rotation of the joint, material axes \[rad\].
    pub fn bend_joint(&mut self, index: usize, bend: &Vector3<T>, joint: &mut Joint<T>) {
        let cell = self.grid.cell(index);
        let per_cell = T::one() / cell;
        let begins = self.begins;
        self.begins += cell;
        // The tip lies within one cell, the tendon's end within another: each covers only a share.
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

    /// Updates the tension for the next solve by a Newton step. The step is exact for the free instrument
    /// and conservative for one that is held.     docs/explanation/model.md (30)
    pub fn finish(&self, memory: &mut TendonState<T>) {
        let Tendon { pull_m, stiffness_n_per_m, offset_m, .. } = self.geometry;
        let stretched = maximum(pull_m - self.slack_m - offset_m * self.bend, T::zero());
        let gain = stiffness_n_per_m * offset_m * self.compliance;
        memory.tension_n += (stiffness_n_per_m * stretched - memory.tension_n) / (T::one() + gain);
        memory.capstan_factor = self.capstan_factor;
        memory.at_mouth = self.last_bend;
    }
}
