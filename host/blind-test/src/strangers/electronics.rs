//! What sensors and cameras do to a reading, and what a rig states of them.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::stand::Accuracy;

/// What an amplifier does to force and drive force, noise included. Its delay stays within the prior of a
/// time shift: a slower one would be `sensor.time_constant`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    #[default]
    None,
    /// Of first order \[s\].
    FirstOrder { time_s: f64 },
    /// Mean of the last rows.
    MovingAverage { rows: usize },
}

/// Rows without force and drive force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DropOuts {
    /// Gaps a second \[1/s\].
    pub per_s: f64,
    /// Longest gap in rows.
    pub longest: usize,
    /// Share of the camera's frames that are missing \[1\].
    pub frames: f64,
}

/// Standard deviations of white noise as rig.toml states them; `None` where it says nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    pub force_n: Option<f64>,
    pub drive_n: Option<f64>,
    pub tip_m: Option<f64>,
}

/// The sensors of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Electronics {
    /// White noise before the filter \[N\].
    pub force_noise_n: f64,
    /// `None` without that channel \[N\].
    pub drive_noise_n: Option<f64>,
    /// `None` without a camera \[m\].
    pub tip_noise_m: Option<f64>,
    /// Rows between two frames of the camera.
    pub tip_every: usize,
    pub filter: Filter,
    /// Step between two readings of force and drive force \[N\].
    pub force_step_n: Option<f64>,
    pub drop_outs: Option<DropOuts>,
    pub stated: Stated,
}

/// A number whose logarithm is evenly distributed; `share` gives numbers from 0 to 1.
fn between(share: &mut dyn FnMut() -> f64, low: f64, high: f64) -> f64 {
    low * (high / low).powf(share())
}

impl Electronics {
    /// The sensors of one case.
    pub fn draw(rng: &mut impl Rng) -> Self {
        let mut share = || rng.random_range(0.0..1.0);
        let force_noise_n = between(&mut share, 1.2e-3, 4e-3);
        let drive_noise_n = between(&mut share, 1.0, 2.5) * force_noise_n;
        let tip_noise_m = between(&mut share, 1e-4, 3.5e-4);
        // Neither camera nor drive force: too little for any diagnosis, and no rig is like that.
        let lacking = share();
        let drive_noise_n = (lacking > 0.18).then_some(drive_noise_n);
        let tip_noise_m = (lacking < 0.82).then_some(tip_noise_m);
        let filter = match share() {
            x if x < 0.6 => Filter::None,
            x if x < 0.8 => Filter::FirstOrder { time_s: between(&mut share, 2.5e-3, 6e-3) },
            _ => Filter::MovingAverage { rows: 2 + (3.0 * share()) as usize },
        };
        let force_step_n = (share() < 0.3).then(|| between(&mut share, 1e-3, 5e-3));
        let drop_outs = (share() < 0.3).then(|| DropOuts {
            per_s: 0.3 + share(),
            longest: 5 + (45.0 * share()) as usize,
            frames: 0.3 * share(),
        });
        // A camera of 30 to 10 frames a second.
        let tip_every = 8 + (18.0 * share()) as usize;
        let honest =
            Stated { force_n: Some(force_noise_n), drive_n: drive_noise_n, tip_m: tip_noise_m };
        let stated = match share() {
            x if x < 0.55 => honest,
            x if x < 0.75 => Stated { force_n: None, drive_n: None, tip_m: None },
            _ => {
                // Off by a factor of 1.4 to 2 either way.
                let mut off = |value: Option<f64>| {
                    let factor = between(&mut share, 1.4, 2.0);
                    let factor = if share() < 0.5 { factor } else { 1.0 / factor };
                    value.map(|value| value * factor)
                };
                let Stated { force_n, drive_n, tip_m } = honest;
                Stated { force_n: off(force_n), drive_n: off(drive_n), tip_m: off(tip_m) }
            }
        };
        Self {
            force_noise_n,
            drive_noise_n,
            tip_noise_m,
            tip_every,
            filter,
            force_step_n,
            drop_outs,
            stated,
        }
    }

    /// What is unusual about them, in the words of a score; `plain` if nothing is.
    pub fn kinds(&self) -> Vec<&'static str> {
        let honest = Stated {
            force_n: Some(self.force_noise_n),
            drive_n: self.drive_noise_n,
            tip_m: self.tip_noise_m,
        };
        let unusual = [
            (self.force_step_n.is_some(), "quantised"),
            (self.filter != Filter::None, "filtered"),
            (self.drop_outs.is_some(), "drop-outs"),
            (self.tip_noise_m.is_none(), "no tip"),
            (self.drive_noise_n.is_none(), "no drive force"),
            (self.stated.force_n.is_none(), "noise unstated"),
            (self.stated.force_n.is_some() && self.stated != honest, "noise misstated"),
        ];
        let kinds: Vec<_> = unusual.iter().filter(|(is, _)| *is).map(|(_, kind)| *kind).collect();
        if kinds.is_empty() { vec!["plain"] } else { kinds }
    }

    /// Standard deviations of what is really between a reading and the truth, as a gap is measured in. A
    /// channel that is not there sees nothing.
    pub fn accuracy(&self) -> Accuracy {
        // An even distribution over a step.
        let step_n = self.force_step_n.unwrap_or(0.0) / 12f64.sqrt();
        Accuracy {
            force_n: self.force_noise_n.hypot(step_n),
            drive_n: self.drive_noise_n.map_or(f64::INFINITY, |own| own.hypot(step_n)),
            tip_m: self.tip_noise_m.unwrap_or(f64::INFINITY),
            shape_m: None,
            tip_every: self.tip_every,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn every_kind_is_drawn_in_some_cases_alone() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let drawn: Vec<Electronics> = (0..400).map(|_| Electronics::draw(&mut rng)).collect();
        for (kind, least, most) in [
            ("quantised", 0.22, 0.38),
            ("filtered", 0.3, 0.5),
            ("drop-outs", 0.22, 0.38),
            ("no tip", 0.1, 0.26),
            ("no drive force", 0.1, 0.26),
            ("noise unstated", 0.13, 0.27),
            ("noise misstated", 0.17, 0.33),
            ("plain", 0.04, 0.25),
        ] {
            let is = |own: &&Electronics| own.kinds().contains(&kind);
            let share = drawn.iter().filter(is).count() as f64 / 400.0;
            assert!((least..most).contains(&share), "{kind}: {share}");
        }
        for own in &drawn {
            assert!((8..=25).contains(&own.tip_every), "10 to 31 frames a second");
            assert!(own.tip_noise_m.is_some() || own.drive_noise_n.is_some());
            if let (Some(stated), true) =
                (own.stated.force_n, own.kinds().contains(&"noise misstated"))
            {
                let off = (stated / own.force_noise_n).ln().abs();
                assert!((1.39_f64.ln()..=2.01_f64.ln()).contains(&off), "{off}");
            }
        }
    }
}
