//! Ranges of the numbers of a [`Description`].

use crate::{Description, Drag, Instrument, Real, parameters};

/// The first thing wrong with a [`Description`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DescriptionError {
    /// This field is not finite or out of its range.
    Range(&'static str),
    /// The instrument has no section.
    NoSections,
    /// `entry.direction` and `entry.up` are not orthonormal.
    EntryFrame,
}

impl<T: Real> Instrument<T> {
    fn validate(&self) -> Result<(), DescriptionError> {
        if self.sections.is_empty() {
            return Err(DescriptionError::NoSections);
        }
        within("instrument.outer_radius_m", self.outer_radius_m, 1e-5, 1e-2)?;
        for s in &self.sections {
            within("section.length_m", s.length_m, 1e-4, 10.0)?;
            within("section.bending_stiffness_n_m2", s.bending_stiffness_n_m2, 1e-9, 1.0)?;
            within("section.torsional_stiffness_n_m2", s.torsional_stiffness_n_m2, 1e-9, 1.0)?;
            within("section.axial_stiffness_n", s.axial_stiffness_n, 0.1, 1e8)?;
            within("section.mass_kg_per_m", s.mass_kg_per_m, 1e-6, 1.0)?;
        }
        for p in &self.precurve {
            within("precurve.length_m", p.length_m, 0.0, 1.0)?;
            within("precurve.curvature_per_m", p.curvature_per_m, -1000.0, 1000.0)?;
            within("precurve.lateral_curvature_per_m", p.lateral_curvature_per_m, -1000.0, 1000.0)?;
            within("precurve.torsion_per_m", p.torsion_per_m, -1000.0, 1000.0)?;
        }
        Ok(())
    }
}

impl<T: Real> Description<T> {
    /// Checks every number. Returns the first error.
    pub fn validate(&self) -> Result<(), DescriptionError> {
        use DescriptionError::EntryFrame;
        self.instrument.validate()?;
        if let Some(wire) = &self.guidewire {
            // The catheter's bore is not described, so its outside is the limit.
            let outside = self.instrument.outer_radius_m.to_f64();
            within("guidewire.outer_radius_m", wire.outer_radius_m, 1e-5, outside)?;
            wire.validate()?;
        }
        for x in self.entry.position_m {
            within("entry.position_m", x, -10.0, 10.0)?;
        }
        let (d, u) = (self.entry.direction, self.entry.up);
        let dot = |a: [T; 3], b: [T; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let near = |x: T, y: f64| (x - T::lit(y)).abs() <= T::lit(1e-4);
        if !(near(dot(d, d), 1.0) && near(dot(u, u), 1.0) && near(dot(d, u), 0.0)) {
            return Err(EntryFrame);
        }
        let w = &self.wall;
        within("wall.line_stiffness_n_per_m2", w.line_stiffness_n_per_m2, 1.0, 1e9)?;
        within("wall.end_stiffness_n_per_m", w.end_stiffness_n_per_m, 0.0, 1e7)?;
        within("wall.tangential_ratio", w.tangential_ratio, 0.0, 100.0)?;
        within("wall.onset_m", w.onset_m, 1e-7, 1e-3)?;
        within("wall.damping_s", w.damping_s, 0.0, 1.0)?;
        for info in parameters() {
            // Every key has a number.
            let value = self.parameter(info.key).unwrap_or(T::zero());
            within(info.key, value, info.min, info.max)?;
        }
        for tendon in &self.tendons {
            let radius_m = self.instrument.outer_radius_m.to_f64();
            within("tendons.angle_rad", tendon.angle_rad, -7.0, 7.0)?;
            within("tendons.offset_m", tendon.offset_m, 0.0, radius_m)?;
            within("tendons.anchor_m", tendon.anchor_m, 0.0, 10.0)?;
            within("tendons.stiffness_n_per_m", tendon.stiffness_n_per_m, 1.0, 1e6)?;
            within("tendons.slack_m", tendon.slack_m, 0.0, 0.02)?;
            within("tendons.static_friction", tendon.static_friction, 0.0, 2.0)?;
            let at_most = tendon.static_friction.to_f64();
            within("tendons.sliding_friction", tendon.sliding_friction, 0.0, at_most)?;
            // exp(4) is the largest ratio of tensions by the bends behind the entry plane.
            let most_rad = if at_most > 0.0 { (4.0 / at_most).min(30.0) } else { 30.0 };
            within("tendons.bend_behind_rad", tendon.bend_behind_rad, 0.0, most_rad)?;
        }
        for g in self.gravity_m_per_s2 {
            within("gravity_m_per_s2", g, -100.0, 100.0)?;
        }
        let s = &self.solver;
        within("solver.link_length_m", s.link_length_m, 2e-4, 2e-2)?;
        within("solver.fine_tip_m", s.fine_tip_m, 0.0, 10.0)?;
        within("solver.tick_s", s.tick_s, 1e-4, 1e-2)?;
        within("solver.substeps", T::int(i32::from(s.substeps)), 1.0, 4.0)?;
        within("solver.predictor_gain", s.predictor_gain, 0.0, 1.0)?;
        within("solver.bending_damping_s", s.bending_damping_s, 0.0, 1.0)?;
        let Drag { at_rest_n_s_per_m2, swift_n_s_per_m2, swift_m_per_s } = s.drag;
        within("solver.drag.swift_n_s_per_m2", swift_n_s_per_m2, 0.0, 1e3)?;
        let at_most = swift_n_s_per_m2.to_f64();
        within("solver.drag.at_rest_n_s_per_m2", at_rest_n_s_per_m2, 0.0, at_most)?;
        within("solver.drag.swift_m_per_s", swift_m_per_s, 1e-3, 1e3)
    }
}

fn within<T: Real>(name: &'static str, x: T, low: f64, high: f64) -> Result<(), DescriptionError> {
    // In this form, NaN is refused.
    if x >= T::lit(low) && x <= T::lit(high) { Ok(()) } else { Err(DescriptionError::Range(name)) }
}
