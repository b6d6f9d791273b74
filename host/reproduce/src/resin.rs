//! The rigid phantom of the CathBot thesis.
//!
//! Printed are its length (98 mm), its bore (10 mm narrowing to 6 mm), one entry and two exits, and
//! that the actuator takes about 5 s. The angle of the exits, the friction and the tip's roll are not.

use cathforce_reference_solver::{
    Beyond, Entry, Integrator, Lumen, Numerics, Problem, TipLoad, TubePath, WallLaw,
};
use nalgebra::Vector3;

use crate::experiment::{Experiment, feed};
use crate::instruments::{INSTRUMENTS, Instrument};
use crate::noise::Noise;

/// Young's moduli of the tip and of the shaft \[Pa\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    pub tip_pa: f64,
    pub shaft_pa: f64,
}

/// How an experiment is set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Offset of the entry across the phantom \[m\].
    pub aside_m: [f64; 2],
    /// Roll of the tip \[rad\].
    pub roll_rad: f64,
    pub speed_m_per_s: f64,
    pub friction: f64,
    /// Insertion at the end \[m\].
    pub to_m: f64,
}

/// Insertion at the beginning \[m\].
const FROM_M: f64 = 4e-3;
/// Rest before the feed \[s\].
const REST_S: f64 = 0.1;
/// Printed length of the phantom \[m\].
const LENGTH_M: f64 = 0.098;
/// Not printed: resin against a hydrophilic coating.
const FRICTION: f64 = 0.3;
/// Of the wall that stands for a rigid one \[N/m²\]: 0.5 N on 5 mm press it in by 12 µm.
const RIGID_N_PER_M2: f64 = 8e6;
/// The printed weight of 0.35 g does not fit the printed density; a polymer's is taken \[kg/m³\].
const DENSITY_KG_PER_M3: f64 = 1100.0;

impl Setup {
    /// As intended: the whole phantom in 5 s.
    pub const NOMINAL: Self = Self {
        aside_m: [0.0; 2],
        roll_rad: 0.0,
        speed_m_per_s: (LENGTH_M - FROM_M) / 4.9,
        friction: FRICTION,
        to_m: LENGTH_M,
    };

    /// One of the repeats, whose variations are not printed: see the rows.
    pub fn of_repeat(repeat: u64) -> Self {
        let mut noise = Noise::of_seed(1000 + repeat);
        let nominal = Self::NOMINAL;
        Self {
            aside_m: std::array::from_fn(|_| 0.2e-3 * noise.normal()),
            roll_rad: 5f64.to_radians() * noise.normal(),
            speed_m_per_s: nominal.speed_m_per_s * (1.0 + 0.02 * noise.normal()),
            friction: (nominal.friction + 0.03 * noise.normal()).max(0.0),
            ..nominal
        }
    }
}

/// The rim, which the experiments used.
fn rim() -> &'static Instrument {
    Instrument::find("56535RIM").unwrap_or(&INSTRUMENTS[0])
}

/// Length of its curved tip \[m\].
pub fn tip_m() -> f64 {
    rim().tip_length_m()
}

/// The experiment with the rim.
pub fn experiment(moduli: Moduli, setup: &Setup) -> Experiment {
    with_instrument(rim(), moduli, setup)
}

/// The experiment with any instrument. x along the insertion, y up, z towards one exit, as in the
/// thesis.
pub fn with_instrument(own: &Instrument, moduli: Moduli, setup: &Setup) -> Experiment {
    let Setup { aside_m, roll_rad, speed_m_per_s, friction, to_m } = *setup;
    let schedule = feed(FROM_M, to_m, REST_S, speed_m_per_s, 0.0, [0.0; 2]).turned(roll_rad);
    let problem = Problem {
        rod: own.rod(moduli.tip_pa, moduli.shaft_pa, DENSITY_KG_PER_M3),
        entry: Entry {
            position_m: Vector3::new(0.0, aside_m[0], aside_m[1]),
            direction: Vector3::x(),
            up: Vector3::z(),
        },
        lumen: lumen(),
        wall: WallLaw {
            line_stiffness_n_per_m2: RIGID_N_PER_M2,
            // Half a contact point of 5 mm.
            end_stiffness_n_per_m: 0.5 * 5e-3 * RIGID_N_PER_M2,
            tangential_ratio: 3.0,
            friction_coefficient: friction,
        },
        beyond: Beyond::default(),
        gravity_m_per_s2: Vector3::y() * -9.81,
        drag_n_s_per_m2: 0.02,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            // Half of what the insertion of the other systems takes: 31 repeats take their time.
            spacing_m: 1.5e-3,
            step_s: 4e-3,
            integrator: Integrator::Bdf2,
            tolerance_n: 1e-7,
        },
    };
    let frames_s = vec![schedule.end_s() - 4e-3];
    Experiment { problem, schedule, frames_s, drag_n_s_per_m2: None }
}

/// A trunk of 45 mm and two branches at 35°, 98 mm along either centre line.
fn lumen() -> Lumen {
    const TRUNK_M: f64 = 0.045;
    const BEND_M: f64 = 0.04;
    let angle_rad = 35f64.to_radians();
    let rest_m = LENGTH_M - TRUNK_M - BEND_M * angle_rad;
    // The radius falls evenly with the arc from 5 to 3 mm.
    let radius_at = |arc_m: f64| 5e-3 - 2e-3 * arc_m / LENGTH_M;
    let branch = |towards: Vector3<f64>| {
        TubePath::from(Vector3::zeros(), Vector3::x(), radius_at(0.0))
            .straight(TRUNK_M, radius_at(TRUNK_M))
            .arc(BEND_M, angle_rad, towards, radius_at(TRUNK_M + BEND_M * angle_rad))
            .straight(rest_m, radius_at(LENGTH_M))
            .tube()
    };
    // Both branches share the trunk, where a blend would widen it by a quarter of its width.
    Lumen::union(vec![branch(Vector3::z()), branch(-Vector3::z())], 0.4e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phantom_has_the_printed_bore() {
        let lumen = lumen();
        let start = lumen.sample(&Vector3::new(1e-3, 0.0, 0.0)).distance_m;
        assert!((start - 5e-3).abs() < 0.15e-3, "{start}");
        let angle = 35f64.to_radians();
        let rest = LENGTH_M - 0.045 - 0.04 * angle;
        let end = Vector3::new(
            0.045 + 0.04 * angle.sin() + rest * angle.cos(),
            0.0,
            0.04 * (1.0 - angle.cos()) + rest * angle.sin(),
        );
        for side in [1.0, -1.0] {
            let exit = lumen.sample(&Vector3::new(end.x, 0.0, side * end.z)).distance_m;
            assert!((exit - 3e-3).abs() < 0.05e-3, "{exit}");
        }
    }

    #[test]
    fn repeats_differ_and_come_again() {
        assert_eq!(Setup::of_repeat(3), Setup::of_repeat(3));
        assert_ne!(Setup::of_repeat(3), Setup::of_repeat(4));
    }
}
