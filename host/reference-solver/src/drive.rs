//! Motion of the drive over time.

/// Position of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Unstretched length of instrument past the entry plane \[m\].
    pub insertion_m: f64,
    /// Rotation at the entry plane, right-handed about `direction` \[rad\].
    pub rotation_rad: f64,
}

/// Positions of the drive over time, linearly interpolated.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    knots: Vec<(f64, Drive)>,
}

/// Number of knots in a change of speed.
const RAMP_KNOTS: usize = 20;

impl Schedule {
    /// Begins at rest.
    pub fn starting_at(insertion_m: f64, rotation_rad: f64) -> Self {
        Self { knots: vec![(0.0, Drive { insertion_m, rotation_rad })] }
    }

    /// A schedule from samples (time \[s\], drive) of an encoder. `None` if there are none or if time does
    /// not grow.
    pub fn samples(samples: Vec<(f64, Drive)>) -> Option<Self> {
        let grows = samples.windows(2).all(|pair| pair[0].0 < pair[1].0);
        (grows && !samples.is_empty()).then_some(Self { knots: samples })
    }

    /// The same motion with a constant additional rotation.
    pub fn turned(&self, rotation_rad: f64) -> Self {
        let mut own = self.clone();
        own.knots.iter_mut().for_each(|(_, drive)| drive.rotation_rad += rotation_rad);
        own
    }

    /// Continues for `duration_s` at these speeds, which are reached linearly within `ramp_s`.
    pub fn then(
        mut self,
        duration_s: f64,
        ramp_s: f64,
        feed_m_per_s: f64,
        spin_rad_per_s: f64,
    ) -> Self {
        let (start_s, start) = self.knots[self.knots.len() - 1];
        let before = self.speed();
        let target = [feed_m_per_s, spin_rad_per_s];
        let ramp_s = ramp_s.clamp(0.0, duration_s);
        let moved = |t: f64| -> [f64; 2] {
            let s = t.min(ramp_s);
            let blend = if ramp_s > 0.0 { 0.5 * s * s / ramp_s } else { 0.0 };
            std::array::from_fn(|i| before[i] * (s - blend) + target[i] * (t - s + blend))
        };
        let ramp = (1..=RAMP_KNOTS).map(|k| ramp_s * k as f64 / RAMP_KNOTS as f64);
        let times = ramp.filter(|&t| t > 0.0 && t < duration_s).chain([duration_s]);
        self.knots.extend(times.map(|t| {
            let [feed, spin] = moved(t);
            let drive = Drive {
                insertion_m: start.insertion_m + feed,
                rotation_rad: start.rotation_rad + spin,
            };
            (start_s + t, drive)
        }));
        self
    }

    /// Speeds over the last knots.
    fn speed(&self) -> [f64; 2] {
        let [.., (t0, a), (t1, b)] = &self.knots[..] else { return [0.0; 2] };
        let dt = t1 - t0;
        [(b.insertion_m - a.insertion_m) / dt, (b.rotation_rad - a.rotation_rad) / dt]
    }

    /// When the last knot is \[s\].
    pub fn end_s(&self) -> f64 {
        self.knots[self.knots.len() - 1].0
    }

    /// The drive's position at `t_s`; it rests before the first knot and after the last.
    pub fn at(&self, t_s: f64) -> Drive {
        let after = self.knots.partition_point(|(t, _)| *t <= t_s);
        if after == 0 {
            return self.knots[0].1;
        }
        let (t0, a) = self.knots[after - 1];
        let Some(&(t1, b)) = self.knots.get(after) else { return a };
        let share = (t_s - t0) / (t1 - t0);
        Drive {
            insertion_m: a.insertion_m + (b.insertion_m - a.insertion_m) * share,
            rotation_rad: a.rotation_rad + (b.rotation_rad - a.rotation_rad) * share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_change_over_the_ramp() {
        let schedule =
            Schedule::starting_at(0.01, 0.0).then(2.0, 0.0, 0.01, 0.0).then(1.0, 0.5, -0.01, 1.0);
        assert!((schedule.at(2.0).insertion_m - 0.03).abs() < 1e-12);
        // Half of the ramp lies before the reversal and half after it, so both distances are equal.
        assert!((schedule.at(2.5).insertion_m - 0.03).abs() < 1e-12);
        assert!((schedule.at(9.0).insertion_m - 0.025).abs() < 1e-12);
        assert!((schedule.at(9.0).rotation_rad - 0.75).abs() < 1e-12);
        assert_eq!(schedule.end_s(), 3.0);
    }
}
