//! The force sensor, from the force on the vessel to its reading.     docs/explanation/model.md (47)

use cathforce_scalar::Vector3;

use super::SensorEffects;
use crate::Real;
use crate::algebra::Rotation;

/// State of the force sensor.
#[derive(Clone, Debug)]
pub struct Measurement<T: Real> {
    /// Time since the first reading \[s\], and the filtered force \[N\].
    last: Option<(T, Vector3<T>)>,
}

impl<T: Real> Default for Measurement<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Measurement<T> {
    /// Nothing has been read.
    pub fn new() -> Self {
        Self { last: None }
    }

    /// The sensor's reading \[N\] for a force on the vessel \[N\], `dt_s` after the last reading.
    ///
    /// With every effect off it is the force to the bit. Drift starts at the first reading.
    pub fn read(&mut self, effects: &SensorEffects<T>, dt_s: T, force_n: [T; 3]) -> [T; 3] {
        if effects.is_off() {
            return force_n;
        }
        let turn = &effects.misalignment;
        let half = Vector3::new(turn.x_rad, turn.y_rad, turn.z_rad) * T::lit(0.5);
        let sensor = Rotation::identity().turned(&half);
        // In the axes of a rotated sensor, the force is rotated the other way.
        let axes = Rotation { w: sensor.w, v: -sensor.v };
        let seen = axes.rotate(&Vector3::from(force_n)) * effects.gain.factor;
        let (time_s, followed) = match self.last {
            None => (T::zero(), seen),
            Some((time_s, last)) => {
                let share = dt_s / (dt_s + effects.time_constant.time_s);
                let followed = if share < T::one() { last + (seen - last) * share } else { seen };
                (time_s + dt_s, followed)
            }
        };
        self.last = Some((time_s, followed));
        let (bias, drift) = (&effects.bias, &effects.drift);
        let offset = Vector3::new(bias.x_n, bias.y_n, bias.z_n);
        let growth = Vector3::new(drift.x_n_per_s, drift.y_n_per_s, drift.z_n_per_s);
        (followed + offset + growth * time_s).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORCE: [f64; 3] = [0.3, -0.2, 0.1];

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    fn effects(change: impl Fn(&mut SensorEffects<f64>)) -> SensorEffects<f64> {
        let mut effects = SensorEffects::off();
        change(&mut effects);
        effects
    }

    #[test]
    fn off_reads_the_force() {
        assert_eq!(Measurement::new().read(&SensorEffects::off(), 1e-3, FORCE), FORCE);
    }

    #[test]
    fn bias_drift_and_gain_add_up() {
        let wrong = effects(|e| {
            e.bias.x_n = 0.05;
            e.drift.y_n_per_s = 0.01;
            e.gain.factor = 2.0;
        });
        let mut sensor = Measurement::new();
        assert!(near(sensor.read(&wrong, 4e-3, FORCE), [0.65, -0.4, 0.2]));
        for _ in 0..999 {
            sensor.read(&wrong, 4e-3, FORCE);
        }
        let after_4_s = sensor.read(&wrong, 4e-3, FORCE);
        assert!((after_4_s[1] + 0.4 - 0.04).abs() < 1e-9, "{after_4_s:?}");
    }

    #[test]
    fn a_turned_sensor_sees_the_force_turned_the_other_way() {
        // (1, tan(angle/2)) is the rotation that `turned` makes of an angle.
        let angle = 2.0 * 0.1_f64.atan();
        let turned = effects(|e| e.misalignment.z_rad = 0.2);
        let [x, y, z] = Measurement::new().read(&turned, 1e-3, [1.0, 0.0, 0.5]);
        assert!(near([x, y, z], [angle.cos(), -angle.sin(), 0.5]), "{x} {y} {z}");
    }

    #[test]
    fn a_slow_sensor_reaches_63_percent_after_its_time() {
        let slow = effects(|e| e.time_constant.time_s = 0.1);
        let mut sensor = Measurement::new();
        sensor.read(&slow, 1e-4, [0.0; 3]);
        let mut reading = [0.0; 3];
        for _ in 0..1000 {
            reading = sensor.read(&slow, 1e-4, [1.0, 0.0, 0.0]);
        }
        assert!((reading[0] - 0.632).abs() < 1e-3, "{reading:?}");
    }
}
