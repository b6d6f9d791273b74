//! Transmissions that are made, so that their truth is known. Nothing here uses the model that is fitted.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_gap::transmission::Transmission;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Between rows \[s\], length of a trial \[s\], number of trials.
const STEP_S: f64 = 5e-3;
const LONG_S: f64 = 30.0;
const TRIALS: u64 = 3;
/// Points between two rows at which the truth is computed.
const FINE: u32 = 4;

/// How input and output are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensors {
    /// Noise of 2e-5 of the range in the output, of 1e-6 of the travel in the input.
    Fine,
    /// Steps of 1/4096 of the range, both.
    TwelveBit,
}

/// How what is lost after a reversal is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lost {
    Nothing,
    /// Width, and share that passes within.
    DeadZone(f64, f64),
    /// Height, length.
    BoucWen(f64, f64),
    /// Height, radius.
    PrandtlIshlinskii(f64, f64),
    /// Friction coefficient, in a sheath that rig.toml describes without friction.
    Sheath(f64),
}

/// A transmission whose travel is 1, times `travel`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Made {
    /// Of the input \[m\].
    pub travel: f64,
    /// As rig.toml states it \[m/m\], and by what share it is off.
    pub gain: f64,
    pub off: f64,
    pub lost: Lost,
    /// Lost output under a load of 1 N, over the range; 0 without a load.
    pub compliance: f64,
    pub lag_s: f64,
}

/// Of the made sheath: bend, tension, spring and stiffness over what the travel needs.
const BEND_RAD: f64 = 4.0;
const PULL_N: f64 = 10.0;

impl Made {
    pub fn plain() -> Self {
        Self { travel: 0.02, gain: 1.0, off: 0.0, lost: Lost::Nothing, compliance: 0.0, lag_s: 0.0 }
    }

    fn is_sheathed(&self) -> bool {
        matches!(self.lost, Lost::Sheath(_))
    }

    /// Stiffness of the tendon and of the spring at its far end \[N/m\].
    fn stiffness(&self) -> [f64; 2] {
        // The pull makes the tendon longer by 5 % of the travel; the spring adds as much over the travel.
        let tendon = PULL_N / (0.05 * self.travel);
        [tendon, 0.8 * PULL_N / self.travel]
    }

    /// What is there: effect, parameter, value.
    pub fn truth(&self) -> Vec<(&'static str, &'static str, f64)> {
        let q = self.travel;
        let mut all = Vec::new();
        if self.off != 0.0 {
            all.push(("transmission.gain", "ratio", self.off));
        }
        match self.lost {
            Lost::Nothing => {}
            Lost::DeadZone(width, _) => {
                all.push(("transmission.dead_zone", "width_m", q * width));
            }
            Lost::BoucWen(height, _) => {
                all.push(("transmission.bouc_wen", "height_m", q * height));
            }
            Lost::PrandtlIshlinskii(height, _) => {
                all.push(("transmission.prandtl_ishlinskii", "height_m", q * height));
            }
            Lost::Sheath(mu) => all.push(("transmission.sheath", "friction_coefficient", mu)),
        }
        if self.compliance != 0.0 {
            let lost = self.compliance * self.gain.abs() * q;
            all.push(("transmission.compliance", "m_per_n", lost));
        }
        if self.lag_s != 0.0 {
            all.push(("transmission.lag", "time_s", self.lag_s));
        }
        all
    }

    /// Outputs for inputs, without noise, load and lag.
    #[allow(dead_code, reason = "the table does not play")]
    pub fn play(&self, inputs: &[f64]) -> Vec<f64> {
        let mut path = Path1::new(self, inputs[0] / self.travel);
        let scale = self.gain * (1.0 + self.off) * self.travel;
        inputs.iter().map(|u| scale * path.next(u / self.travel)).collect()
    }

    pub fn plant(&self, sensors: Sensors, seed: u64) -> Transmission {
        let folder = tempfile::tempdir().unwrap();
        self.write(folder.path(), sensors, seed);
        Transmission::new(&Bundle::open(folder.path()).unwrap()).unwrap()
    }

    pub fn write(&self, folder: &Path, sensors: Sensors, seed: u64) {
        let mut rig = format!(
            "format = \"trial-bundle/1\"\nname = \"made\"\nplant = \"transmission\"\n[transmission]\n\
             gain_m_per_m = {:?}\n",
            self.gain
        );
        if self.is_sheathed() {
            let [tendon, spring] = self.stiffness();
            write!(
                rig,
                "[transmission.sheath]\nbend_rad = {BEND_RAD:?}\nfriction_coefficient = 0.0\n\
                 pull_N = {PULL_N:?}\nreturn_N_per_m = {spring:?}\ntendon_N_per_m = {tendon:?}\n"
            )
            .unwrap();
        }
        std::fs::write(folder.join("rig.toml"), rig).unwrap();
        std::fs::create_dir(folder.join("trials")).unwrap();
        for trial in 0..TRIALS {
            let text = self.trial(sensors, 100 * seed + trial);
            std::fs::write(folder.join(format!("trials/{trial:03}.csv")), text).unwrap();
        }
    }

    fn trial(&self, sensors: Sensors, seed: u64) -> String {
        let rng = &mut ChaCha8Rng::seed_from_u64(1_000_000 + seed);
        let [slow, fast] = [rng.random_range(0.08..0.16), rng.random_range(0.3..0.7)];
        let phase = rng.random_range(0.0..TAU);
        let input = |t_s: f64| {
            // Large strokes with small ones on the way, within −½ and ½.
            let grows = 0.6 + 0.4 * (TAU * 0.031 * t_s + phase).sin();
            0.33 * grows * (TAU * slow * t_s).sin() + 0.17 * (TAU * fast * t_s + phase).sin()
        };
        let load = |t_s: f64| 1.0 + 0.8 * (TAU * 0.11 * t_s + 1.0).sin();
        let is_loaded = self.compliance != 0.0;
        let mut text = String::from("t_s,input_m,output_m");
        text += if is_loaded { ",load_N\n" } else { "\n" };
        let mut path = Path1::new(self, input(0.0));
        let (q, range) = (self.travel, self.travel * self.gain.abs());
        let mut normal = move || (0..4).map(|_| rng.random_range(-0.866..0.866)).sum::<f64>();
        let dt_s = STEP_S / f64::from(FINE);
        let mut late = None;
        for row in 0..(LONG_S / STEP_S) as u32 {
            let mut out = 0.0;
            for k in 0..FINE {
                let t_s = f64::from(row * FINE + k) * dt_s;
                let now = self.gain * (1.0 + self.off) * q * path.next(input(t_s))
                    - self.compliance * range * if is_loaded { load(t_s) } else { 0.0 };
                let share = match self.lag_s {
                    lag if lag > 0.0 => 1.0 - (-dt_s / lag).exp(),
                    _ => 1.0,
                };
                let before = late.unwrap_or(now);
                let followed = before + share * (now - before);
                late = Some(followed);
                if k == 0 {
                    out = followed;
                }
            }
            let t_s = f64::from(row) * STEP_S;
            let u = q * input(t_s);
            let [u, out] = match sensors {
                Sensors::Fine => [u + 1e-6 * q * normal(), out + 2e-5 * range * normal()],
                Sensors::TwelveBit => {
                    let read = |x: f64, range: f64| (x / range * 4096.0).round() * range / 4096.0;
                    [read(u, q), read(out, range)]
                }
            };
            write!(text, "{t_s:.3},{u:e},{out:e}").unwrap();
            if is_loaded {
                write!(text, ",{:.6}", load(t_s)).unwrap();
            }
            text.push('\n');
        }
        text
    }
}

/// What is lost along a path of travel 1.
struct Path1 {
    lost: Lost,
    last: f64,
    held: f64,
    z: f64,
    stops: Vec<f64>,
    /// Tension over stiffness, and spring over stiffness.
    sheath: [f64; 2],
}

impl Path1 {
    /// Stops of a continuous distribution, far finer than the model's.
    const STOPS: usize = 200;

    fn new(made: &Made, start: f64) -> Self {
        let [tendon, spring] = made.stiffness();
        let sheath = [PULL_N / tendon / made.travel, spring / tendon];
        Self {
            lost: made.lost,
            last: start,
            held: start,
            z: 0.0,
            stops: vec![0.0; Self::STOPS],
            sheath,
        }
    }

    fn next(&mut self, u: f64) -> f64 {
        let moved = u - self.last;
        self.last = u;
        match self.lost {
            Lost::Nothing => u,
            Lost::DeadZone(width, follows) => {
                if self.held < u - 0.5 * width {
                    self.held = u - 0.5 * width;
                } else if self.held > u + 0.5 * width {
                    self.held = u + 0.5 * width;
                }
                follows * u + (1.0 - follows) * self.held
            }
            Lost::BoucWen(height, length) => {
                let against = if self.z * moved > 0.0 { self.z.abs() } else { 0.0 };
                self.z += moved / length * (1.0 - against);
                u - height * self.z
            }
            Lost::PrandtlIshlinskii(height, radius) => {
                let n = Self::STOPS as f64;
                let mut lost = 0.0;
                for (k, own) in self.stops.iter_mut().enumerate() {
                    let most = radius * (k as f64 + 0.5) / n;
                    *own = f64::min(most, f64::max(-most, *own + moved));
                    lost += *own;
                }
                u - 2.0 * height / (radius * n) * lost
            }
            Lost::Sheath(mu) => {
                let [stretch, soft] = self.sheath;
                // The tendon's length along the sheath, summed over short pieces of bend.
                let mean = |sign: f64| {
                    let n = 200;
                    let at =
                        |k: i32| (sign * mu * BEND_RAD * (f64::from(k) + 0.5) / f64::from(n)).exp();
                    (0..n).map(at).sum::<f64>() / f64::from(n)
                };
                let end = |mean: f64| (u - stretch * (mean - 1.0)) / (1.0 + soft * mean);
                let (pulled, let_go) = (end(mean(1.0)), end(mean(-1.0)));
                self.held = self.held.max(pulled).min(let_go);
                self.held
            }
        }
    }
}
