//! What the drive does: four trials that excite feed at three speeds, dwells, reversals and
//! rotation, and a fifth that mixes them otherwise, which no diagnosis sees.

use cathforce_reference_solver::Schedule;

/// Trials of every case.
pub const TRIALS: usize = 5;

/// Time between rows, and of a step of the solver \[s\].
pub const STEP_S: f64 = 4e-3;

/// Changes of speed take so long \[s\].
const RAMP_S: f64 = 0.1;

/// Encoder positions of one trial from `start_m` on.
pub fn schedule(trial: usize, start_m: f64) -> Schedule {
    let begin =
        |rotation_rad| Schedule::starting_at(start_m, rotation_rad).then(0.3, 0.0, 0.0, 0.0);
    let feed = |s: Schedule, speed: f64, time_s: f64| s.then(time_s, RAMP_S, speed, 0.0);
    let spin = |s: Schedule, speed: f64, time_s: f64| s.then(time_s, RAMP_S, 0.0, speed);
    let rest = |s: Schedule, time_s: f64| s.then(time_s, RAMP_S, 0.0, 0.0);
    match trial {
        0 | 2 => {
            let s = feed(begin(if trial == 0 { 0.0 } else { 1.2 }), 0.02, 2.2);
            let s = feed(rest(s, 0.6), -0.02, 0.8);
            rest(feed(s, 0.02, 1.0), 0.3)
        }
        1 => {
            let s = rest(feed(begin(0.0), 0.012, 2.5), 0.4);
            let s = spin(spin(s, 2.0, 0.7), -2.0, 0.7);
            feed(rest(s, 0.2), -0.012, 0.8)
        }
        3 => {
            let s = rest(feed(begin(0.6), 0.03, 1.4), 0.4);
            let s = spin(spin(s, -2.0, 0.6), 2.0, 0.6);
            feed(feed(rest(s, 0.2), -0.012, 0.8), 0.012, 0.8)
        }
        _ => {
            let s = spin(feed(begin(0.3), 0.025, 1.2), 2.0, 0.5);
            let s = feed(feed(rest(s, 0.4), 0.015, 0.8), -0.025, 0.7);
            rest(feed(s, 0.02, 0.9), 0.3)
        }
    }
}
