//! What the sensors make of forces and positions.

use nalgebra::{Rotation3, Vector3};

use crate::change::Change;

/// The force sensor under the phantom and what pulls at it, and the introducer's friction.
#[derive(Clone, Debug)]
pub struct Sensor<'a> {
    changes: &'a [Change],
    lags: [Vector3<f64>; 2],
    loops: Vector3<f64>,
    before: Vector3<f64>,
    /// Turn of the introducer's friction, from −1 to 1.
    turn: f64,
    started: bool,
}

impl<'a> Sensor<'a> {
    pub fn new(changes: &'a [Change]) -> Self {
        let zero = Vector3::zeros();
        Self { changes, lags: [zero; 2], loops: zero, before: zero, turn: 0.0, started: false }
    }

    /// Reading of a force `dt_s` after the last one; `fed_m`: feed since the trial began.
    pub fn read(&mut self, t_s: f64, dt_s: f64, fed_m: f64, force: Vector3<f64>) -> Vector3<f64> {
        if !self.started {
            (self.lags, self.before, self.started) = ([force; 2], force, true);
        }
        let mut reading = force;
        for change in self.changes {
            match *change {
                Change::TimeConstant { each_s } => {
                    let share = 1.0 - (-dt_s / each_s).exp();
                    self.lags[0] += (reading - self.lags[0]) * share;
                    self.lags[1] += (self.lags[0] - self.lags[1]) * share;
                    reading = self.lags[1];
                }
                Change::Misalignment { rotation_rad } => {
                    reading = Rotation3::new(rotation_rad).inverse() * reading;
                }
                Change::Gain { factor } => {
                    /// Force at which a hundredth is missing \[N\].
                    const FALL_N: f64 = 1.0;
                    reading *= factor * (1.0 - 0.01 * reading.norm() / FALL_N);
                }
                Change::Hysteresis { share, width_n } => {
                    let step = force - self.before;
                    for k in 0..3 {
                        // Solved over the step, which may be longer than the loop is wide.
                        let end = width_n * step[k].signum();
                        self.loops[k] =
                            end + (self.loops[k] - end) * (-step[k].abs() / width_n).exp();
                    }
                    reading += self.loops * share;
                }
                Change::Bias { force_n } => reading += force_n,
                Change::Drift { end_n, time_s } => reading += end_n * (1.0 - (-t_s / time_s).exp()),
                Change::Cable { per_m } => reading += per_m * fed_m,
                Change::Shaking { force_n, frequency_hz } => {
                    let share = (frequency_hz * t_s).rem_euclid(1.0);
                    // A sawtooth with rounded ends.
                    reading +=
                        force_n * (2.5 * (2.0 * share - 1.0) * (1.0 - (2.0 * share - 1.0).powi(2)));
                }
                _ => {}
            }
        }
        self.before = force;
        reading
    }

    /// Force behind the introducer, of the one past it; `feed_m`: of this step.
    pub fn behind(&mut self, drive_force_n: f64, feed_m: f64, dt_s: f64) -> f64 {
        let mut reading = drive_force_n;
        for change in self.changes {
            if let Change::EntryDrag { coulomb_n, viscous_n_s_per_m, turn_m } = *change {
                let target = if feed_m == 0.0 { self.turn } else { feed_m.signum() };
                self.turn += (target - self.turn) * (feed_m.abs() / turn_m).tanh();
                reading += coulomb_n * self.turn + viscous_n_s_per_m * feed_m / dt_s;
            }
        }
        reading
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_as_wide_as_it_is_told_however_far_a_force_jumps() {
        let (share, width_n) = (0.5, 0.01);
        let changes = [Change::Hysteresis { share, width_n }];
        let mut sensor = Sensor::new(&changes);
        let mut read = |force_n: f64| sensor.read(0.0, 4e-3, 0.0, Vector3::x() * force_n).x;
        assert_eq!(read(0.0), 0.0);
        assert!((read(1.0) - (1.0 + share * width_n)).abs() < 1e-12);
        assert!((read(-1.0) - (-1.0 - share * width_n)).abs() < 1e-12);
        // A small way back goes a small way through the loop.
        let back = read(-1.0 + 1e-4) + 1.0 - 1e-4;
        assert!((back + share * (width_n - 2e-4)).abs() < 2e-6, "{back:e}");
    }
}
