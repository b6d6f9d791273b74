//! Where in the vessel a sample belongs.

use super::Prepared;
use crate::catheter::column::Source;
use crate::catheter::simulate::Trajectory;

impl Prepared {
    /// Of every sample \[m\]: of a point on the shape its own place, of all else that of the tip.
    /// Measured as far as it was, else as the nominal model has it.
    pub fn places_m(&self, nominal: &Trajectory) -> Vec<[f64; 3]> {
        let place = |reading: &super::Reading| {
            let row = reading.first();
            let tick =
                (self.index(self.clock.t_s[row]).round() as usize).min(nominal.tip_m.len() - 1);
            let (own, predicted) = match reading.source {
                Source::Shape(point, _) => {
                    let shape = self.inputs.shape_ticks.binary_search(&tick).ok();
                    let shape = shape.and_then(|k| nominal.shapes.get(k)?.get(point).copied());
                    (Some(point), shape)
                }
                _ => (None, None),
            };
            let axis = |k: usize| {
                let source = own.map_or(Source::Tip(k), |point| Source::Shape(point, k));
                let measured = self.column(source).and_then(|column| self.at(&column.rows, row));
                measured.unwrap_or(predicted.unwrap_or(nominal.tip_m[tick])[k])
            };
            [0, 1, 2].map(axis)
        };
        self.readings.iter().map(place).collect()
    }

    /// What a column that has no value in some rows was in one: between its neighbours in time.
    fn at(&self, column: &[(usize, f64)], row: usize) -> Option<f64> {
        let after = column.partition_point(|(own, _)| *own < row);
        let (&(low, a), &(high, b)) =
            (column.get(after.saturating_sub(1))?, column.get(after).or(column.last())?);
        let share = (self.clock.t_s[row] - self.clock.t_s[low])
            / (self.clock.t_s[high] - self.clock.t_s[low]);
        Some(if low < high { a + share.clamp(0.0, 1.0) * (b - a) } else { a })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use crate::catheter::plant::Catheter;
    use crate::plant::{Plant, Quantity};

    #[test]
    fn a_sample_belongs_where_it_was_measured() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let catheter = Catheter::new(&Bundle::open(&example).unwrap()).unwrap();
        let samples = &catheter.trials()[0].samples;
        let places_m = catheter.places_m(0);
        assert_eq!(places_m.len(), samples.len());
        let [mut tip, mut shape, mut force] = [0; 3];
        let mut tips = Vec::new();
        for (sample, place_m) in samples.iter().zip(&places_m) {
            let channel = &catheter.channels()[sample.channel];
            let axis = ["_x_m", "_y_m", "_z_m"].iter().position(|end| channel.name.ends_with(end));
            match (channel.quantity, axis) {
                (Quantity::Tip | Quantity::Shape, Some(axis)) => {
                    assert!((place_m[axis] - sample.value).abs() < 1e-12, "{}", channel.name);
                    *(if channel.quantity == Quantity::Tip { &mut tip } else { &mut shape }) += 1;
                    if channel.quantity == Quantity::Tip {
                        tips.push((sample.t_s, *place_m));
                    }
                }
                _ => force += 1,
            }
        }
        assert!(tip > 100 && shape > 100 && force > 100, "{tip} {shape} {force}");
        // A force belongs between the tips before and after it.
        tips.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (sample, place_m) in samples.iter().zip(&places_m) {
            let after = tips.partition_point(|(t_s, _)| *t_s < sample.t_s - 0.02);
            let is_force = catheter.channels()[sample.channel].quantity.is_force();
            if let (true, Some((t_s, near_m))) = (is_force, tips.get(after))
                && (t_s - sample.t_s).abs() < 0.05
            {
                let far = (0..3).map(|k| (place_m[k] - near_m[k]).powi(2)).sum::<f64>().sqrt();
                assert!(far < 6e-3, "{far} m at {} s", sample.t_s);
            }
        }
    }
}
