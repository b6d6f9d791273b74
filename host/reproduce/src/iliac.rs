//! The insertion of Li 2023 and Pescio et al. 2025: left iliac artery to aorta.
//!
//! Printed are the diameters (19 mm and 31 mm), the box (300 mm × 230 mm), the catheter, the speeds,
//! their ripple and the friction. Lengths and angles of the vessels are not. Here the artery runs
//! straight for 60 mm at 25° to the aorta and meets it in an arc of 60 mm radius, and the catheter is
//! fed by 160 mm, so that at 13 mm/s half of the insertion lies behind the excluded 6.1 s.

use cathforce_reference_solver::{
    Beyond, Entry, Integrator, Lumen, Numerics, Problem, Rod, TipLoad, TubePath, WallLaw,
};
use nalgebra::Vector3;

use crate::errors::{ByAxis, by_axis, error, proximal_frechet_m};
use crate::experiment::{Experiment, Trace, feed, sample_times};
use crate::instruments::Instrument;
use crate::noise::Noise;

/// Printed dimensions \[m\].
const ILIAC_RADIUS_M: f64 = 9.5e-3;
const AORTA_RADIUS_M: f64 = 15.5e-3;
/// Not printed: see above.
const ILIAC_M: f64 = 0.06;
const ANGLE_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;
const BEND_M: f64 = 0.06;
/// Where the aorta begins, halfway between the two radii.
const JUNCTION_RADIUS_M: f64 = 12e-3;

/// Coulomb's coefficient, printed.
pub const FRICTION: f64 = 0.62;
/// Stiffness of the wall that stands for a rigid one \[N/m²\]: 0.5 N on 5 mm press it in by 12 µm.
const RIGID_N_PER_M2: f64 = 8e6;

/// Insertion at the beginning and at the end \[m\].
const FROM_M: f64 = 5e-3;
pub const TO_M: f64 = 0.165;
/// Rest before the feed \[s\].
const REST_S: f64 = 0.3;
/// Time left out at 13 mm/s, in which the guide holds the direction \[s\]; at other speeds the same
/// length is left out.
const EXCLUDED_S: f64 = 6.1;
const EXCLUDED_AT_M_PER_S: f64 = 0.013;
/// Time between compared shapes \[s\]: one frame a second was selected.
const FRAME_S: f64 = 1.0;
/// Error of a point in a frame \[m\]: the printed image resolution is 0.3 to 0.5 mm.
const POINT_M: f64 = 0.4e-3;
/// Ripple of the speed \[m/s\], printed.
pub const RIPPLE_M_PER_S: f64 = 0.002;

/// Young's modulus of the reference configuration, printed as 600 "GPa" \[Pa\].
pub const REFERENCE_PA: f64 = 600e6;
/// Its density \[kg/m³\].
pub const REFERENCE_KG_PER_M3: f64 = 1550.0;
/// How the printed unit is read.
pub const GPA_READ: &str =
    "\"GPa\" is read as MPa: 600 GPa would be three times the stiffness of steel";

/// What is not printed, for the rows.
pub const ASSUMED: &str = "not printed and assumed: left iliac artery straight for 60 mm at 25° to the aorta, \
                           bend of 60 mm radius, 160 mm of feed, hook in the plane of the vessels, ripple at \
                           0.7 and 1.9 Hz, moving average of 0.25 s";

/// The modified hook.
pub fn catheter(youngs_pa: f64, density_kg_per_m3: f64) -> Rod {
    let own = Instrument::find("48038MHK-H").unwrap_or(&crate::instruments::INSTRUMENTS[0]);
    own.rod(youngs_pa, youngs_pa, density_kg_per_m3)
}

/// Length of the hook \[m\].
pub fn hook_m() -> f64 {
    Instrument::find("48038MHK-H").map_or(0.0, Instrument::tip_length_m)
}

/// How the drive moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    pub speed_m_per_s: f64,
    pub ripple_m_per_s: f64,
    pub to_m: f64,
}

impl Motion {
    /// At constant speed, as the simulations of the publications were fed.
    pub fn even(speed_m_per_s: f64) -> Self {
        Self { speed_m_per_s, ripple_m_per_s: 0.0, to_m: TO_M }
    }

    /// With the ripple of the drive.
    pub fn rippled(speed_m_per_s: f64) -> Self {
        Self { ripple_m_per_s: RIPPLE_M_PER_S, ..Self::even(speed_m_per_s) }
    }

    /// When scoring begins \[s\].
    pub fn scored_from_s(&self) -> f64 {
        REST_S + EXCLUDED_S * EXCLUDED_AT_M_PER_S / self.speed_m_per_s
    }
}

/// Seed of the drive's phases, of the sensor's noise and of the camera's.
const SEED: u64 = 2023;

/// The experiment with a catheter.
pub fn experiment(rod: Rod, motion: Motion) -> Experiment {
    let mut noise = Noise::of_seed(SEED);
    let phases = [noise.phase(), noise.phase()];
    let Motion { speed_m_per_s, ripple_m_per_s, to_m } = motion;
    let schedule = feed(FROM_M, to_m, REST_S, speed_m_per_s, ripple_m_per_s, phases);
    let frames = (schedule.end_s() / FRAME_S) as usize;
    Experiment {
        problem: problem(rod),
        drag_n_s_per_m2: None,
        frames_s: (1..=frames).map(|k| FRAME_S * k as f64).collect(),
        schedule,
    }
}

/// x across the aorta, y up, z along the aorta.
fn problem(rod: Rod) -> Problem {
    let (sin, cos) = ANGLE_RAD.sin_cos();
    Problem {
        rod,
        entry: Entry {
            position_m: Vector3::zeros(),
            direction: Vector3::new(sin, 0.0, cos),
            // The roll of the hook is not printed; here it lies in the plane of the vessels and looks
            // away from the right iliac artery.
            up: Vector3::new(-cos, 0.0, sin),
        },
        lumen: lumen(),
        wall: WallLaw {
            line_stiffness_n_per_m2: RIGID_N_PER_M2,
            // Half a contact point of 5 mm.
            end_stiffness_n_per_m: 0.5 * 5e-3 * RIGID_N_PER_M2,
            tangential_ratio: 3.0,
            friction_coefficient: FRICTION,
        },
        beyond: Beyond::default(),
        gravity_m_per_s2: Vector3::y() * -9.81,
        drag_n_s_per_m2: 0.02,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            spacing_m: 1e-3,
            step_s: 2e-3,
            integrator: Integrator::Bdf2,
            tolerance_n: 1e-7,
        },
    }
}

/// Both iliac arteries and the aorta.
fn lumen() -> Lumen {
    let (sin, cos) = ANGLE_RAD.sin_cos();
    let artery = |from: Vector3<f64>, side: f64| {
        TubePath::from(from, Vector3::new(side * sin, 0.0, cos), ILIAC_RADIUS_M)
            .straight(ILIAC_M, ILIAC_RADIUS_M)
            .arc(BEND_M, ANGLE_RAD, Vector3::x() * -side, JUNCTION_RADIUS_M)
    };
    // The aorta lies as far to the side of the left artery as that runs and bends.
    let aside_m = ILIAC_M * sin + BEND_M * (1.0 - cos);
    let left =
        artery(Vector3::zeros(), 1.0).straight(0.02, AORTA_RADIUS_M).straight(0.1, AORTA_RADIUS_M);
    // The right one ends in the aorta.
    let right = artery(Vector3::x() * (2.0 * aside_m), -1.0).tube().with_open_ends([true, false]);
    Lumen::union(vec![left.tube(), right], 1e-3)
}

/// Unit vector along which the camera looks.
const VIEW: Vector3<f64> = Vector3::new(0.0, 1.0, 0.0);

/// Everything that the publications compare.
#[derive(Clone, Copy, Debug)]
pub struct Scores {
    pub force: ByAxis,
    /// Error of the magnitude of the moment \[N·m\], against the sensor-free truth.
    pub moment_n_m: f64,
    pub moment_relative: f64,
    /// Mean distance of the tip \[m\].
    pub tip_m: f64,
    /// Mean Fréchet distance of what lies behind the hook \[m\].
    pub frechet_m: f64,
    /// Share of ticks that the model flagged \[1\].
    pub unresolved: f64,
}

/// Scores the model against the truth as its sensor (`measured`) and its camera saw it.
pub fn scores(truth: &Trace, measured: &[Vector3<f64>], ours: &Trace, motion: Motion) -> Scores {
    let from_s = motion.scored_from_s();
    let times: Vec<f64> = sample_times(truth).collect();
    let first = times.partition_point(|t| *t < from_s);
    let estimated: Vec<_> = times[first..].iter().map(|t| ours.force_at(*t)).collect();
    let moments = |trace: &Trace| {
        times[first..].iter().map(|t| trace.moment_at(*t).norm()).collect::<Vec<_>>()
    };
    let (true_moments, own_moments) = (moments(truth), moments(ours));
    let moment = error(true_moments.into_iter(), own_moments.into_iter());
    let (tip_m, frechet_m) = shape_errors(truth, ours, from_s);
    Scores {
        force: by_axis(&measured[first..], &estimated),
        moment_n_m: moment.mean,
        moment_relative: moment.relative,
        tip_m,
        frechet_m,
        unresolved: ours.unresolved,
    }
}

/// Mean distance of the tip and mean Fréchet distance over the scored frames, in the camera's plane.
fn shape_errors(truth: &Trace, ours: &Trace, from_s: f64) -> (f64, f64) {
    let mut noise = Noise::of_seed(SEED + 1);
    let (mut tips, mut frechets, mut count) = (0.0, 0.0, 0.0);
    for (k, (seen, own)) in truth.frames.iter().zip(&ours.frames).enumerate() {
        let mut point =
            |p: &Vector3<f64>| p + Vector3::new(noise.normal(), 0.0, noise.normal()) * POINT_M;
        let seen: Vec<_> = seen.iter().step_by(5).map(&mut point).collect();
        if FRAME_S * ((k + 1) as f64) < from_s {
            continue;
        }
        let (Some(a), Some(b)) = (seen.first(), own.first()) else { continue };
        let Some(frechet) = proximal_frechet_m(&seen, own, hook_m(), &VIEW) else { continue };
        tips += ((a - b) - VIEW * VIEW.dot(&(a - b))).norm();
        frechets += frechet;
        count += 1.0;
    }
    (tips / count, frechets / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vessels_have_the_printed_diameters() {
        let lumen = lumen();
        let (sin, cos) = ANGLE_RAD.sin_cos();
        let iliac = lumen.sample(&(Vector3::new(sin, 0.0, cos) * 0.03)).distance_m;
        assert!((iliac - ILIAC_RADIUS_M).abs() < 1e-6, "{iliac}");
        let aside_m = ILIAC_M * sin + BEND_M * (1.0 - cos);
        let aorta = lumen.sample(&Vector3::new(aside_m, 0.0, 0.16)).distance_m;
        assert!((aorta - AORTA_RADIUS_M).abs() < 1e-6, "{aorta}");
        let right = lumen.sample(&Vector3::new(2.0 * aside_m - 0.03 * sin, 0.0, 0.03 * cos));
        assert!((right.distance_m - ILIAC_RADIUS_M).abs() < 1e-6, "{right:?}");
    }

    #[test]
    fn half_of_the_insertion_at_13_mm_per_second_is_scored() {
        let motion = Motion::even(0.013);
        let schedule = experiment(catheter(REFERENCE_PA, REFERENCE_KG_PER_M3), motion).schedule;
        let at_m = schedule.at(motion.scored_from_s()).insertion_m;
        assert!((at_m - 0.5 * (FROM_M + TO_M)).abs() < 2e-3, "{at_m}");
    }
}
