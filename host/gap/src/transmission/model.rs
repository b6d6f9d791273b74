//! What comes out of a transmission for what is put in.
//!
//! With the input u, the motion passes one after the other
//!
//! > x ← clamp(x, x₊(u), x₋(u))                      a tendon in a sheath
//! > v = r x + (1 − r) p,   p ← clamp(p, x − b/2, x + b/2)   a dead zone of width b
//! > w = v − h z − Σ w_i s_i                           hysteresis
//! > y = g (1 + δ) (w + η (w − w₀)²/(2 q)) − C L + y₀ + ẏ₀ t
//!
//! g is the stated gain, L the load at the output, q the travel and w₀ its middle. The output may follow with a
//! time constant. Nothing but that time constant depends on the rate.
//!
//! Sheath. By the capstan equation the far end has the tension of the near end times exp(∓μθ), where the tendon
//! slides through a bend θ, the one sign pulled and the other let go (Euler 1769; of sheaths Kaneko, Yamashita and
//! Tanie 1991). With the far end's tension T = T₀ + k x the tendon of stiffness K is longer by T φ(±μθ)/K,
//! φ(a) = (eᵃ − 1)/a, than without tension, so that
//!
//! > x± = (u − T₀ (φ(±μθ) − 1)/K) / (1 + k φ(±μθ)/K).
//!
//! Between the two the friction turns round along the sheath and the far end rests. It never rests lower than where
//! the tendon goes slack, x = −T₀/k.
//!
//! Hysteresis. The model of Bouc (1967) and Wen (1976) with β = γ, scaled so that |z| ≤ 1:
//!
//! > dz/dv = (1 − |z|ⁿ (1 + sgn(z dv))/2) / l.
//!
//! That of Prandtl and Ishlinskii has stops s_i with radii r_i, s_i ← clamp(s_i + dv, −r_i, r_i), here of equal weight
//! and with radii spread evenly up to R, so that they lose h together.

use cathforce_bundle::bundle::{RigSheath, TransmissionRig};

/// Stops of the model of Prandtl and Ishlinskii: with so many, a branch is off that of stops without number by 0.025 % of the
/// width of the loop, as a parabola is off its chords.
pub const STOPS: usize = 32;
/// Largest step of the model of Bouc and Wen, in its length: the midpoint rule is exact to 1e-4 of the height then.
const LONGEST_STEP: f64 = 0.1;
/// Most of such steps between two points: farther than this, z has its limit.
const MOST_STEPS: f64 = 200.0;

/// A transmission with all its parameters, in the units of its input and output.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Output for each unit of the input.
    pub gain: f64,
    /// Change of the gain along the travel, as a share of it.
    pub curvature: f64,
    pub middle: f64,
    pub travel: f64,
    pub offset: f64,
    pub drift_per_s: f64,
    /// Lost output for each unit of the load.
    pub compliance: f64,
    pub dead_zone: f64,
    /// Share of the motion that passes within the dead zone.
    pub follows: f64,
    pub sheath: Option<RigSheath>,
    /// Height, length and exponent.
    pub bouc_wen: [f64; 3],
    /// Height and radius.
    pub prandtl_ishlinskii: [f64; 2],
    pub time_constant_s: f64,
    pub latency_s: f64,
}

/// What a transmission remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    far_end: f64,
    held: f64,
    last: f64,
    z: f64,
    stops: [f64; STOPS],
}

/// Radius of a stop over the largest one, and its weight for a height and a radius of 1.
fn stop(i: usize) -> f64 {
    (i as f64 + 0.5) / STOPS as f64
}

impl Model {
    /// As rig.toml states it. `range`: of the input, from and to.
    pub fn stated(rig: &TransmissionRig, [low, high]: [f64; 2]) -> Self {
        let travel = high - low;
        Self {
            gain: rig.gain,
            curvature: 0.0,
            middle: 0.5 * (low + high),
            travel,
            offset: 0.0,
            drift_per_s: 0.0,
            compliance: rig.compliance,
            dead_zone: rig.dead_zone,
            follows: rig.dead_zone_follows,
            sheath: rig.sheath,
            bouc_wen: rig
                .bouc_wen
                .map_or([0.0, 0.02 * travel, 1.0], |own| [own.height, own.length, own.sharpness]),
            prandtl_ishlinskii: rig
                .prandtl_ishlinskii
                .map_or([0.0, 0.1 * travel], |own| [own.height, own.radius]),
            time_constant_s: rig.time_constant_s,
            latency_s: 0.0,
        }
    }

    /// In the middle of everything that is lost, at an input.
    pub fn start(&self, input: f64, bend_rad: Option<f64>) -> State {
        let [low, high] = self.far_ends(input, bend_rad);
        let far_end = 0.5 * (low + high);
        State { far_end, held: far_end, last: far_end, z: 0.0, stops: [0.0; STOPS] }
    }

    /// Where the far end of the tendon is while it is pulled and while it is let go.
    fn far_ends(&self, input: f64, bend_rad: Option<f64>) -> [f64; 2] {
        let Some(own) = &self.sheath else { return [input; 2] };
        let angle = own.friction_coefficient * bend_rad.unwrap_or(own.bend_rad);
        let slack = match own.return_n_per_m > 0.0 {
            true => -own.pull_n / own.return_n_per_m,
            false => f64::NEG_INFINITY,
        };
        [angle, -angle].map(|a| {
            // Mean tension along the sheath over that of the far end.
            let mean = if a.abs() < 1e-9 { 1.0 + 0.5 * a } else { a.exp_m1() / a };
            let longer = own.pull_n * (mean - 1.0) / own.tendon_n_per_m;
            let follows = 1.0 + own.return_n_per_m * mean / own.tendon_n_per_m;
            ((input - longer) / follows).max(slack)
        })
    }

    /// The output at the next input, without time constant, offset and drift.
    pub fn step(&self, state: &mut State, input: f64, load: f64, bend_rad: Option<f64>) -> f64 {
        let [pulled, let_go] = self.far_ends(input, bend_rad);
        state.far_end = state.far_end.max(pulled).min(let_go.max(pulled));
        let half = 0.5 * self.dead_zone;
        state.held = state.held.clamp(state.far_end - half, state.far_end + half);
        let through = self.follows * state.far_end + (1.0 - self.follows) * state.held;
        let moved = through - state.last;
        state.last = through;
        let mut out = through;
        let [height, length, exponent] = self.bouc_wen;
        if height != 0.0 {
            state.z = turned(state.z, moved / length, exponent);
            out -= height * state.z;
        }
        let [height, radius] = self.prandtl_ishlinskii;
        if height != 0.0 {
            let weight = 2.0 * height / (radius * STOPS as f64);
            for (i, own) in state.stops.iter_mut().enumerate() {
                let most = radius * stop(i);
                *own = (*own + moved).clamp(-most, most);
                out -= weight * *own;
            }
        }
        self.gained(out) - self.compliance * load
    }

    /// The output of what hysteresis leaves.
    fn gained(&self, out: f64) -> f64 {
        let from_middle = out - self.middle;
        self.gain * (out + 0.5 * self.curvature * from_middle * from_middle / self.travel)
    }
}

/// z after a motion in lengths of the model of Bouc and Wen.
fn turned(mut z: f64, moved: f64, exponent: f64) -> f64 {
    let steps = (moved.abs() / LONGEST_STEP).ceil().clamp(1.0, MOST_STEPS);
    let by = moved / steps;
    let slope = |z: f64| {
        let against = if z * by > 0.0 { 1.0 } else { 0.0 };
        1.0 - z.abs().powf(exponent) * against
    };
    for _ in 0..steps as usize {
        let half = z + 0.5 * by * slope(z);
        z = (z + by * slope(half)).clamp(-1.0, 1.0);
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;
    use cathforce_bundle::bundle::Axis;

    fn model() -> Model {
        let rig = TransmissionRig {
            input: Axis::Linear,
            output: Axis::Linear,
            gain: 2.0,
            dead_zone: 0.0,
            dead_zone_follows: 0.0,
            compliance: 0.0,
            time_constant_s: 0.0,
            sheath: None,
            bouc_wen: None,
            prandtl_ishlinskii: None,
        };
        Model::stated(&rig, [-1.0, 1.0])
    }

    /// Up to 1, down to −1 and up to 1 again, in small steps; the last two of these.
    fn loop_of(model: &Model) -> [Vec<(f64, f64)>; 2] {
        let mut state = model.start(0.0, None);
        let steps = 2000;
        let mut branch = |from: f64, to: f64| -> Vec<(f64, f64)> {
            let at = |k: i32| from + (to - from) * f64::from(k) / f64::from(steps);
            (1..=steps).map(|k| (at(k), model.step(&mut state, at(k), 0.0, None))).collect()
        };
        branch(0.0, 1.0);
        [branch(1.0, -1.0), branch(-1.0, 1.0)]
    }

    /// Widths of the loop at the middle, along the input.
    fn width(model: &Model) -> f64 {
        let [down, up] = loop_of(model);
        let at_zero = |branch: &[(f64, f64)]| {
            branch.iter().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).unwrap().1
        };
        (at_zero(&down) - at_zero(&up)) / model.gain
    }

    #[test]
    fn without_slack_the_output_is_the_gain_times_the_input() {
        let model = model();
        for branch in loop_of(&model) {
            assert!(branch.iter().all(|(u, y)| (y - 2.0 * u).abs() < 1e-12));
        }
    }

    #[test]
    fn each_loop_is_as_wide_as_its_parameters_say() {
        let dead = Model { dead_zone: 0.1, ..model() };
        assert!((width(&dead) - 0.1).abs() < 1e-9);
        let soft = Model { dead_zone: 0.1, follows: 0.25, ..model() };
        assert!((width(&soft) - 0.075).abs() < 1e-9);
        let bouc_wen = Model { bouc_wen: [0.03, 0.05, 1.0], ..model() };
        assert!((width(&bouc_wen) - 0.06).abs() < 1e-6, "{}", width(&bouc_wen));
        let prandtl = Model { prandtl_ishlinskii: [0.03, 0.2], ..model() };
        assert!((width(&prandtl) - 0.06).abs() < 1e-9);
    }

    /// After a reversal a motion of a is lost as 1 − (1 − a/(2R))² of twice the height, for stops without end.
    #[test]
    fn the_stops_turn_round_as_their_limit_does() {
        let model = Model { prandtl_ishlinskii: [0.03, 0.2], ..model() };
        let [down, _] = loop_of(&model);
        let lost = |y: f64, u: f64| u - y / 2.0;
        for (u, y) in down {
            let a = 1.0 - u;
            let turned = if a < 0.4 { 1.0 - (1.0 - a / 0.4).powi(2) } else { 1.0 };
            let limit = 0.03 * (1.0 - 2.0 * turned);
            assert!((lost(y, u) - limit).abs() < 2.6e-4 * 0.06, "{a} {} {limit}", lost(y, u));
        }
    }

    #[test]
    fn the_exponential_branch_of_bouc_and_wen_is_exact() {
        // z from 0 with the motion: z = 1 − exp(−a) for an exponent of 1.
        for a in [0.05, 0.4, 3.0] {
            assert!((turned(0.0, a, 1.0) - (1.0 - f64::exp(-a))).abs() < 1e-3);
        }
        assert!((turned(1.0, -0.5, 1.0) - 0.5).abs() < 1e-9, "against the motion z falls evenly");
    }

    #[test]
    fn a_tendon_loses_what_the_capstan_equation_says() {
        let sheath = RigSheath {
            bend_rad: 3.0,
            friction_coefficient: 0.2,
            pull_n: 10.0,
            return_n_per_m: 0.0,
            tendon_n_per_m: 1000.0,
        };
        let model = Model { sheath: Some(sheath), ..model() };
        // Mean tension along the sheath, integrated: pulled from 10 N to 10 exp(0.6) N, let go to 10 exp(−0.6) N.
        let mean = |sign: f64| {
            let n = 100_000;
            let at = |k: i32| (sign * 0.6 * (f64::from(k) + 0.5) / f64::from(n)).exp();
            (0..n).map(at).sum::<f64>() / f64::from(n)
        };
        let expected = 10.0 * (mean(1.0) - mean(-1.0)) / 1000.0;
        assert!((width(&model) - expected).abs() < 1e-6);
        // Against a spring the loop is wider where the tension is larger.
        let sprung = RigSheath { return_n_per_m: 9.0, ..sheath };
        let [down, up] = loop_of(&Model { sheath: Some(sprung), ..model });
        let at = |branch: &[(f64, f64)], u: f64| {
            branch.iter().min_by(|a, b| (a.0 - u).abs().total_cmp(&(b.0 - u).abs())).unwrap().1
        };
        let wide = |u: f64| at(&down, u) - at(&up, u);
        assert!(wide(0.8) > 1.5 * wide(-0.8), "{} {}", wide(0.8), wide(-0.8));
    }
}
