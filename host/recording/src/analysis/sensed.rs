//! The reading of a force sensor for the model's force.

use cathforce_mechanics::Measurement;
use cathforce_mechanics::effects::SensorEffects;

use crate::format::trial::Estimate;

/// Turns the estimated forces into readings of a sensor with these effects.
///
/// `estimates`: sorted by time. With every effect off they do not change.
pub fn as_sensed(estimates: &mut [Estimate], sensor: &SensorEffects<f32>) {
    let mut measurement = Measurement::new();
    let mut last_s = estimates.first().map_or(0.0, |first| first.t_s);
    for estimate in estimates {
        let force_n = estimate.force_n.map(|x| x as f32);
        let dt_s = (estimate.t_s - last_s) as f32;
        last_s = estimate.t_s;
        estimate.force_n = measurement.read(sensor, dt_s, force_n).map(f64::from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimates() -> Vec<Estimate> {
        let at = |i: u8| Estimate {
            t_s: 0.5 + f64::from(i) * 1e-3,
            force_n: [0.25, -0.5, 0.125],
            ..Estimate::default()
        };
        (0..=100).map(at).collect()
    }

    #[test]
    fn a_good_sensor_reads_the_force() {
        let mut sensed = estimates();
        as_sensed(&mut sensed, &SensorEffects::off());
        assert_eq!(sensed, estimates());
    }

    #[test]
    fn drift_counts_from_the_first_estimate() {
        let mut sensor = SensorEffects::off();
        sensor.bias.x_n = 0.5;
        sensor.drift.y_n_per_s = 1.0;
        let mut sensed = estimates();
        as_sensed(&mut sensed, &sensor);
        assert_eq!(sensed[0].force_n, [0.75, -0.5, 0.125]);
        assert!((sensed[100].force_n[1] + 0.4).abs() < 1e-6, "{:?}", sensed[100]);
    }
}
