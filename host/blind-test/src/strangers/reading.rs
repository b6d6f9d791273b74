//! What is read of one trial.

use nalgebra::Vector3;
use rand::Rng;

use super::electronics::{DropOuts, Electronics, Filter};
use crate::motion::STEP_S;
use crate::noise::Noise;

/// One row as it is written; `None` where the field is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    pub force_n: Option<Vector3<f64>>,
    pub drive_n: Option<f64>,
    pub tip_m: Option<Vector3<f64>>,
}

impl Electronics {
    /// Readings of one trial, from the forces \[N\], drive forces \[N\] and tips \[m\] without noise.
    pub fn read(
        &self,
        rows: &[(Vector3<f64>, f64, Vector3<f64>)],
        noise: &mut Noise,
        rng: &mut impl Rng,
    ) -> Vec<Reading> {
        let mut channels: [Vec<f64>; 4] = Default::default();
        for (force_n, drive_n, _) in rows {
            let noisy = force_n + noise.vector(self.force_noise_n);
            let own = [noisy.x, noisy.y, noisy.z, {
                drive_n + noise.normal() * self.drive_noise_n.unwrap_or(0.0)
            }];
            channels.iter_mut().zip(own).for_each(|(channel, value)| channel.push(value));
        }
        let channels = channels.map(|channel| self.quantised(self.filtered(channel)));
        let is_empty = self.gaps(rows.len(), rng);
        let missing = self.drop_outs.map_or(0.0, |own| own.frames);
        let reading = |(k, (_, _, tip_m)): (usize, &(Vector3<f64>, f64, Vector3<f64>))| {
            let is_frame = k % self.tip_every == 0 && rng.random_range(0.0..1.0) >= missing;
            let [x, y, z, drive_n] = channels.each_ref().map(|channel| channel[k]);
            let is_there = !is_empty[k];
            Reading {
                force_n: is_there.then(|| Vector3::new(x, y, z)),
                drive_n: self.drive_noise_n.filter(|_| is_there).map(|_| drive_n),
                tip_m: self.tip_noise_m.filter(|_| is_frame).map(|sd| tip_m + noise.vector(sd)),
            }
        };
        rows.iter().enumerate().map(reading).collect()
    }

    fn filtered(&self, channel: Vec<f64>) -> Vec<f64> {
        match self.filter {
            Filter::None => channel,
            Filter::FirstOrder { time_s } => {
                let share = 1.0 - (-STEP_S / time_s).exp();
                let mut state = channel.first().copied().unwrap_or_default();
                let follow = |value: f64| {
                    state += (value - state) * share;
                    state
                };
                channel.into_iter().map(follow).collect()
            }
            Filter::MovingAverage { rows } => {
                let mean = |k: usize| {
                    let own = &channel[(k + 1).saturating_sub(rows)..=k];
                    own.iter().sum::<f64>() / own.len() as f64
                };
                (0..channel.len()).map(mean).collect()
            }
        }
    }

    fn quantised(&self, channel: Vec<f64>) -> Vec<f64> {
        match self.force_step_n {
            Some(step_n) => channel.into_iter().map(|n| (n / step_n).round() * step_n).collect(),
            None => channel,
        }
    }

    /// Whether each row has no force.
    fn gaps(&self, rows: usize, rng: &mut impl Rng) -> Vec<bool> {
        let mut is_empty = vec![false; rows];
        let Some(DropOuts { per_s, longest, .. }) = self.drop_outs else { return is_empty };
        let mut at = 0;
        while at < rows {
            if rng.random_bool((per_s * STEP_S).min(1.0)) {
                let end = (at + rng.random_range(1..=longest)).min(rows);
                is_empty[at..end].fill(true);
                at = end;
            }
            at += 1;
        }
        is_empty
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::electronics::Stated;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const PLAIN: Electronics = Electronics {
        force_noise_n: 2e-3,
        drive_noise_n: Some(3e-3),
        tip_noise_m: Some(2e-4),
        tip_every: 10,
        filter: Filter::None,
        force_step_n: None,
        drop_outs: None,
        stated: Stated { force_n: Some(2e-3), drive_n: Some(3e-3), tip_m: Some(2e-4) },
    };

    /// Readings of a force that is there from row 2000 on.
    fn read(sensors: &Electronics) -> Vec<Reading> {
        let force = |k: usize| if k < 2000 { 0.0 } else { 0.1 };
        let row = |k: usize| (Vector3::new(force(k), 0.0, 0.0), 0.0, Vector3::zeros());
        let rows: Vec<_> = (0..4000).map(row).collect();
        sensors.read(&rows, &mut Noise::of_seed(3), &mut ChaCha8Rng::seed_from_u64(3))
    }

    fn sd(values: impl Iterator<Item = f64>) -> f64 {
        let values: Vec<f64> = values.collect();
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn plain_sensors_have_their_noise_and_a_camera_its_rate() {
        assert_eq!(PLAIN.kinds(), ["plain"]);
        let rows = read(&PLAIN);
        let noise_n = sd(rows.iter().map(|row| row.force_n.unwrap().y));
        assert!((noise_n / 2e-3 - 1.0).abs() < 0.05, "{noise_n}");
        let noise_n = sd(rows.iter().map(|row| row.drive_n.unwrap()));
        assert!((noise_n / 3e-3 - 1.0).abs() < 0.05, "{noise_n}");
        assert_eq!(rows.iter().filter(|row| row.tip_m.is_some()).count(), 400);
        assert!(rows[20].tip_m.is_some() && rows[21].tip_m.is_none());
    }

    #[test]
    fn what_a_label_says_of_sensors_shows_in_their_readings() {
        let coarse = Electronics { force_step_n: Some(4e-3), ..PLAIN };
        assert_eq!(coarse.kinds(), ["quantised"]);
        let is_step = |n: f64| ((n / 4e-3).round() * 4e-3 - n).abs() < 1e-12;
        assert!(read(&coarse).iter().all(|row| is_step(row.force_n.unwrap().x)));
        assert!(coarse.accuracy().force_n > 2.2e-3);

        let late = Electronics { filter: Filter::FirstOrder { time_s: 6e-3 }, ..PLAIN };
        let mean = Electronics { filter: Filter::MovingAverage { rows: 4 }, ..PLAIN };
        for own in [late, mean] {
            assert_eq!(own.kinds(), ["filtered"]);
            let rows = read(&own);
            assert!(sd(rows[1000..2000].iter().map(|row| row.force_n.unwrap().y)) < 1.5e-3);
            let at = |k: usize| rows[k].force_n.unwrap().x;
            assert!(at(2000) < 0.07 && at(2010) > 0.08, "{} {}", at(2000), at(2010));
        }

        let gaps = DropOuts { per_s: 1.0, longest: 50, frames: 0.3 };
        let gaps = Electronics { drop_outs: Some(gaps), ..PLAIN };
        assert_eq!(gaps.kinds(), ["drop-outs"]);
        let rows = read(&gaps);
        let empty = rows.iter().filter(|row| row.force_n.is_none()).count();
        assert!((100..1200).contains(&empty), "{empty}");
        assert!(rows.iter().all(|row| row.force_n.is_none() == row.drive_n.is_none()));
        assert!(rows.iter().filter(|row| row.tip_m.is_some()).count() < 340);

        let blind = Electronics { tip_noise_m: None, drive_noise_n: None, ..PLAIN };
        assert_eq!(&blind.kinds()[..2], ["no tip", "no drive force"]);
        assert!(read(&blind).iter().all(|row| row.tip_m.is_none() && row.drive_n.is_none()));
        assert!(blind.accuracy().tip_m.is_infinite() && blind.accuracy().drive_n.is_infinite());

        let silent = Stated { force_n: None, drive_n: None, tip_m: None };
        let silent = Electronics { stated: silent, ..PLAIN };
        assert_eq!(silent.kinds(), ["noise unstated"]);
        let wrong = Stated { force_n: Some(3.5e-3), ..PLAIN.stated };
        assert_eq!(Electronics { stated: wrong, ..PLAIN }.kinds(), ["noise misstated"]);
    }
}
