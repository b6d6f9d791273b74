//! What the sensors make of forces.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};

use super::form::Form;

/// Steps into which a row is divided where a sensor rings.
const PARTS: u32 = 16;

/// One row as the sensors meet it.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    pub t_s: f64,
    /// Time since the last row \[s\].
    pub dt_s: f64,
    /// Feed since the trial began, and since the last row \[m\].
    pub fed_m: f64,
    pub feed_m: f64,
}

/// The force sensor under the phantom, what pulls at it, and the introducer.
#[derive(Clone, Debug)]
pub struct Sensing<'a> {
    forms: &'a [Form],
    /// Number of the trial.
    trial: usize,
    /// A ringing sensor's reading, and its rate by second.
    ringing: Option<(Vector3<f64>, Vector3<f64>)>,
    /// A dry sensor's reading.
    dry: Option<Vector3<f64>>,
    /// Elastic displacement of the introducer, from −1 to 1.
    turn: f64,
}

impl<'a> Sensing<'a> {
    /// At the beginning of that trial.
    pub fn new(forms: &'a [Form], trial: usize) -> Self {
        Self { forms, trial, ringing: None, dry: None, turn: 0.0 }
    }

    /// Reading of a force on the vessel \[N\].
    pub fn read(&mut self, met: &Met, force_n: Vector3<f64>) -> Vector3<f64> {
        let mut reading = force_n;
        for form in self.forms {
            match *form {
                Form::Ringing { time_s, damping } => {
                    reading = self.ring(reading, met.dt_s, time_s, damping);
                }
                Form::DrySensor { width_n } => {
                    // From its last reading it goes only as far as it must.
                    let last = self.dry.unwrap_or(reading);
                    let held = reading
                        .zip_map(&last, |own, last| last.clamp(own - width_n, own + width_n));
                    self.dry = Some(held);
                    reading = held;
                }
                Form::Crosstalk { rotation_rad, shear } => {
                    reading = Rotation3::new(rotation_rad).inverse() * reading;
                    reading.x += shear * reading.y;
                }
                Form::CubicGain { factor, axes, cubic_per_n2 } => {
                    let cubic = 1.0 + cubic_per_n2 * reading.norm_squared();
                    reading.component_mul_assign(&axes.add_scalar(1.0));
                    reading *= factor * cubic;
                }
                Form::BiasByTrial { force_n, varies, phase } => {
                    // Angles of 2.4 rad, the golden one, never come back to the first.
                    let own = varies * (2.4 * self.trial as f64 + phase).cos();
                    reading += force_n * (1.0 + own);
                }
                Form::SaturatingDrift { end_n, time_s } => {
                    reading += end_n * (met.t_s / time_s).tanh();
                }
                Form::RampDrift { end_n, from_s, to_s } => {
                    reading += end_n * ((met.t_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
                }
                Form::HardeningCable { per_m, hardening_per_m } => {
                    reading += per_m * (met.fed_m * (1.0 + hardening_per_m * met.fed_m.abs()));
                }
                Form::Beating { force_n, frequency_hz, apart_hz } => {
                    let tone = |hz: f64| (TAU * hz * met.t_s).sin();
                    reading += force_n * (tone(frequency_hz) + tone(frequency_hz + apart_hz));
                }
                _ => {}
            }
        }
        reading
    }

    /// Force behind the introducer, of the one past it \[N\].
    pub fn behind(&mut self, met: &Met, drive_force_n: f64) -> f64 {
        let mut reading = drive_force_n;
        for form in self.forms {
            if let Form::StribeckDrag { coulomb_n, excess, speed_m_per_s, elastic_m } = *form {
                self.turn = (self.turn + met.feed_m / elastic_m).clamp(-1.0, 1.0);
                let x = met.feed_m / met.dt_s / speed_m_per_s;
                reading += coulomb_n * (1.0 + excess * (-x * x).exp()) * self.turn;
            }
        }
        reading
    }

    /// τ² ẍ + 2 D τ ẋ + x = force.
    fn ring(&mut self, force: Vector3<f64>, dt_s: f64, time_s: f64, damping: f64) -> Vector3<f64> {
        let (mut x, mut rate) = self.ringing.unwrap_or((force, Vector3::zeros()));
        let part_s = dt_s / f64::from(PARTS);
        for _ in 0..PARTS {
            rate += (force - x - rate * (2.0 * damping * time_s)) * (part_s / (time_s * time_s));
            x += rate * part_s;
        }
        self.ringing = Some((x, rate));
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MET: Met = Met { t_s: 0.0, dt_s: 4e-3, fed_m: 0.0, feed_m: 0.0 };

    #[test]
    fn a_sensor_that_rings_overshoots_as_its_damping_says() {
        let forms = [Form::Ringing { time_s: 0.05, damping: 0.4 }];
        let mut sensing = Sensing::new(&forms, 0);
        sensing.read(&MET, Vector3::zeros());
        let readings: Vec<f64> = (0..500).map(|_| sensing.read(&MET, Vector3::x()).x).collect();
        let most = readings.iter().copied().fold(0.0, f64::max);
        // 1 + exp(−π D/√(1 − D²))
        assert!((most - 1.254).abs() < 0.01, "{most}");
        assert!((readings[499] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_dry_sensor_lags_by_its_width_and_a_drift_ends_where_it_says() {
        let forms = [Form::DrySensor { width_n: 0.01 }];
        let mut sensing = Sensing::new(&forms, 0);
        let mut read = |n: f64| sensing.read(&MET, Vector3::x() * n).x;
        assert_eq!(read(0.0), 0.0);
        assert!((read(0.05) - 0.04).abs() < 1e-12);
        assert!((read(0.045) - 0.04).abs() < 1e-12, "it stays");
        assert!((read(0.0) - 0.01).abs() < 1e-12);

        let end_n = Vector3::new(0.0, 0.02, 0.0);
        let forms = [Form::RampDrift { end_n, from_s: 1.0, to_s: 2.0 }];
        let mut sensing = Sensing::new(&forms, 0);
        let mut at = |t_s: f64| sensing.read(&Met { t_s, ..MET }, Vector3::zeros()).y;
        assert!([at(0.5), at(1.5), at(3.0)] == [0.0, 0.01, 0.02]);
    }

    #[test]
    fn an_introducer_holds_more_at_rest_than_in_motion() {
        let forms = [Form::StribeckDrag {
            coulomb_n: 0.02,
            excess: 1.0,
            speed_m_per_s: 3e-3,
            elastic_m: 2e-4,
        }];
        let mut sensing = Sensing::new(&forms, 0);
        let mut fed = |feed_m: f64| sensing.behind(&Met { feed_m, ..MET }, 0.0);
        let fast_n = (0..50).map(|_| fed(8e-5)).last().unwrap();
        assert!((fast_n - 0.02).abs() < 1e-6);
        assert!((fed(0.0) - 0.04).abs() < 1e-9);
        let back_n = (0..50).map(|_| fed(-8e-5)).last().unwrap();
        assert!((back_n + 0.02).abs() < 1e-6);
    }
}
