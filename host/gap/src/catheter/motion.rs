//! Motion of the drive at each tick: its phase (dwell, feed, reversal …) and its regime of speed.

use super::simulate::Inputs;
use crate::signal::{Gaussian, slope};

pub const PHASES: [&str; 8] =
    ["entry", "free", "first contact", "sliding", "dwell", "reversal", "rotation", "withdrawal"];

/// Smoothing of the encoders before they are differentiated, in ticks.
const SMOOTHING_TICKS: f64 = 20.0;
/// Slower than this the drive stands \[m/s\], \[rad/s\].
const STANDING_M_PER_S: f64 = 5e-4;
const STANDING_RAD_PER_S: f64 = 0.05;
/// Speeds that divide regimes \[m/s\].
const SPEEDS_M_PER_S: [f64; 3] = [8e-3, 18e-3, 40e-3];
/// Time around a change of direction that belongs to the reversal \[s\].
const REVERSAL_S: f64 = 0.2;
/// Time after it that belongs to the first contact \[s\].
const FIRST_CONTACT_S: f64 = 0.5;

/// Speeds, one a tick.
#[derive(Clone, Debug)]
pub struct Motion {
    tick_s: f64,
    pub feed_m_per_s: Vec<f64>,
    turn_rad_per_s: Vec<f64>,
}

impl Motion {
    pub fn of(inputs: &Inputs) -> Self {
        let smooth = Gaussian::new(SMOOTHING_TICKS);
        let speed = |positions: &[f64]| slope(&smooth.smooth(positions), inputs.tick_s);
        Self {
            tick_s: inputs.tick_s,
            feed_m_per_s: speed(&inputs.insertion_m),
            turn_rad_per_s: speed(&inputs.rotation_rad),
        }
    }
}

/// Index into [`PHASES`]. `contact`: the tick of the first contact; `in_mouth`: whether the tip's bend
/// is not out of the guide yet, or in it again.
pub fn phase(motion: &Motion, tick: usize, contact: &Option<usize>, in_mouth: bool) -> usize {
    let feed = motion.feed_m_per_s[tick];
    let reach = (REVERSAL_S / motion.tick_s) as usize;
    let speeds = &motion.feed_m_per_s;
    let around = &speeds[tick.saturating_sub(reach)..(tick + reach).min(speeds.len())];
    let turns = around.iter().any(|v| *v > STANDING_M_PER_S)
        && around.iter().any(|v| *v < -STANDING_M_PER_S);
    let since = contact.and_then(|first| tick.checked_sub(first));
    let standing = feed.abs() < STANDING_M_PER_S;
    match since {
        _ if in_mouth => 0,
        _ if turns => 5,
        _ if motion.turn_rad_per_s[tick].abs() > STANDING_RAD_PER_S => 6,
        None => 1,
        Some(ticks) if (ticks as f64) * motion.tick_s < FIRST_CONTACT_S => 2,
        Some(_) if standing => 4,
        Some(_) if feed < 0.0 => 7,
        Some(_) => 3,
    }
}

/// Names of all regimes, in the order of [`regime`].
pub fn regimes() -> Vec<String> {
    let mm = SPEEDS_M_PER_S.map(|v| 1e3 * v);
    let speeds = [
        format!("below {:.0} mm/s", mm[0]),
        format!("{:.0} to {:.0} mm/s", mm[0], mm[1]),
        format!("{:.0} to {:.0} mm/s", mm[1], mm[2]),
        format!("above {:.0} mm/s", mm[2]),
    ];
    let mut names = vec!["standing".to_owned()];
    for direction in ["forward", "backward"] {
        names.extend(speeds.iter().map(|speed| format!("{direction}, {speed}")));
    }
    let rotating: Vec<String> = names.iter().map(|name| format!("{name}, rotating")).collect();
    names.extend(rotating);
    names
}

/// Index into [`regimes`].
pub fn regime(motion: &Motion, tick: usize) -> usize {
    let feed = motion.feed_m_per_s[tick];
    let speed = SPEEDS_M_PER_S.iter().filter(|limit| feed.abs() > **limit).count();
    let directions = SPEEDS_M_PER_S.len() + 1;
    let linear = if feed.abs() < STANDING_M_PER_S {
        0
    } else {
        1 + usize::from(feed < 0.0) * directions + speed
    };
    let rotating = motion.turn_rad_per_s[tick].abs() > STANDING_RAD_PER_S;
    linear + usize::from(rotating) * (1 + 2 * directions)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 4e-3;

    /// Phases of a feed at one speed to 60 mm, a pause and the way back, with the first contact at
    /// 30 mm and a bend of 10 mm, one a tick.
    fn phases() -> (Vec<f64>, Vec<&'static str>) {
        let insertion_m: Vec<f64> = (0..1500)
            .map(|tick| match tick {
                0..500 => 0.06 * tick as f64 / 500.0,
                500..1000 => 0.06,
                _ => 0.06 - 0.06 * (tick - 1000) as f64 / 500.0,
            })
            .collect();
        let ticks = insertion_m.len();
        let inputs = Inputs {
            tick_s: TICK_S,
            rotation_rad: vec![0.0; ticks],
            guidewire: None,
            tendons_m: Vec::new(),
            shape_ticks: Vec::new(),
            shape_points: 0,
            insertion_m,
        };
        let motion = Motion::of(&inputs);
        let at =
            |tick: usize| PHASES[phase(&motion, tick, &Some(250), inputs.insertion_m[tick] < 0.01)];
        let phases = (0..ticks).map(at).collect();
        (inputs.insertion_m, phases)
    }

    #[test]
    fn a_run_goes_through_its_phases_in_turn_and_ends_where_it_began() {
        let (insertion_m, phases) = phases();
        let mut turns = phases.clone();
        turns.dedup();
        let expected =
            ["entry", "free", "first contact", "sliding", "dwell", "withdrawal", "entry"];
        assert_eq!(turns, expected);
        for (insertion_m, phase) in insertion_m.iter().zip(phases) {
            assert_eq!(*insertion_m < 0.01, phase == "entry", "{insertion_m}");
        }
    }
}
