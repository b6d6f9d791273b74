//! Where forms make the problem another one in the course of a trial.

use std::f64::consts::TAU;

use cathforce_reference_solver::Problem;
use nalgebra::Vector3;

use super::form::Form;
use crate::world::{Moment, scale};

/// Exponent of a stretched exponential, as of polymers near their glass transition \[1\].
const STRETCH: f64 = 0.5;
/// A soft mount follows the force of the last row, whose part it takes at once: all of it would swing.
const TAKEN: f64 = 0.1;
/// A pulse is a hump of this width in the period, at this place \[1\].
const PULSE: [f64; 2] = [0.11, 0.25];

/// What has become of the problem so far.
#[derive(Clone, Debug)]
pub struct Moving<'a> {
    forms: &'a [Form],
    /// By how much a soft mount has given way \[m\].
    given_m: Vector3<f64>,
    /// From −1 (withdrawal) to 1 (feed).
    turned: f64,
}

impl<'a> Moving<'a> {
    /// At the beginning of a trial.
    pub fn new(forms: &'a [Form]) -> Self {
        Self { forms, given_m: Vector3::zeros(), turned: 1.0 }
    }

    /// Whether any form changes the problem at all.
    pub fn is_moving(&self) -> bool {
        self.forms.iter().any(|form| {
            matches!(
                form,
                Form::BreathAndPulse { .. }
                    | Form::Stretched { .. }
                    | Form::DirectedSmoothly { .. }
                    | Form::SoftMount { .. }
            )
        })
    }

    /// The problem `dt_s` after the last one; `force_n`: of the instrument on the vessel in the last row.
    pub fn at(
        &mut self,
        standing: &Problem,
        moment: &Moment,
        dt_s: f64,
        force_n: Vector3<f64>,
    ) -> Problem {
        let mut problem = standing.clone();
        let mut offset_m = Vector3::zeros();
        for form in self.forms {
            match *form {
                Form::BreathAndPulse { breath_m, breath_s, pulse_m, pulse_s, phase } => {
                    let angle = TAU * (moment.t_s / breath_s + phase);
                    offset_m += breath_m * (angle.sin() + 0.3 * (2.0 * angle).sin());
                    let share = (moment.t_s / pulse_s).rem_euclid(1.0);
                    offset_m += pulse_m * (-((share - PULSE[1]) / PULSE[0]).powi(2)).exp();
                }
                Form::Stretched { share, time_s } => {
                    let left = (-(moment.t_s / time_s).powf(STRETCH)).exp();
                    let factor = 1.0 - share * (1.0 - left);
                    problem.rod.sections.iter_mut().for_each(|section| scale(section, factor));
                }
                Form::DirectedSmoothly { factor, over_m } => {
                    let feed_m = moment.feed_m_per_s * dt_s;
                    let target = if feed_m == 0.0 { self.turned } else { feed_m.signum() };
                    self.turned += (target - self.turned) * (1.0 - (-feed_m.abs() / over_m).exp());
                    let back = 0.5 * (1.0 - self.turned);
                    problem.wall.friction_coefficient *= 1.0 + (factor - 1.0) * back;
                }
                Form::SoftMount { m_per_n } => {
                    self.given_m += (force_n * m_per_n - self.given_m) * TAKEN;
                    offset_m += self.given_m;
                }
                _ => {}
            }
        }
        problem.lumen = problem.lumen.at(offset_m);
        problem
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigs::rigs;
    use cathforce_reference_solver::Drive;

    #[test]
    fn a_soft_mount_gives_way_by_its_compliance_and_friction_turns_with_the_feed() {
        let standing = rigs()[0].problem();
        let moment = |feed_m_per_s: f64| Moment {
            t_s: 0.0,
            drive: Drive::default(),
            feed_m_per_s,
            spin_rad_per_s: 0.0,
        };
        let forms = [
            Form::SoftMount { m_per_n: 0.01 },
            Form::DirectedSmoothly { factor: 3.0, over_m: 1e-3 },
        ];
        let mut moving = Moving::new(&forms);
        assert!(moving.is_moving());
        let force_n = Vector3::new(0.0, 0.05, 0.0);
        let mut at = |speed: f64, steps: usize| {
            let mut last = standing.clone();
            for _ in 0..steps {
                last = moving.at(&standing, &moment(speed), 4e-3, force_n);
            }
            (
                last.lumen.offset_m().y,
                last.wall.friction_coefficient / standing.wall.friction_coefficient,
            )
        };
        let (offset_m, fed) = at(0.02, 200);
        assert!((offset_m - 5e-4).abs() < 1e-9 && (fed - 1.0).abs() < 1e-9);
        let (_, back) = at(-0.02, 200);
        assert!((back - 3.0).abs() < 1e-4, "{back}");
    }
}
