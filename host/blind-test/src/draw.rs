//! Cases drawn from a seed: a tenth without any effect, a quarter with one that the library does
//! not have, a quarter with two, the rest with one.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::change::Change;
use crate::deck::{Deck, shuffle};
use crate::stand::Stand;

/// What a case is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    None,
    Single,
    Pair,
    /// An effect that the library does not have.
    Outside,
}

/// A reality to be diagnosed.
#[derive(Clone, Debug)]
pub struct Case {
    pub number: usize,
    pub kind: Kind,
    pub stand: Stand,
    pub changes: Vec<Change>,
    /// From 0 (just to be seen) to 1 (strong).
    pub severity: f64,
    /// Of the noise.
    pub noise_seed: u64,
}

/// Effects of the library that can be drawn.
pub const LIBRARY: [&str; 29] = [
    "contact.friction",
    "contact.stribeck",
    "wall.stiffness",
    "wall.registration",
    "wall.narrowing",
    "wall.motion",
    "instrument.stiffness",
    "instrument.stored_curvature",
    "instrument.tip_precurve",
    "instrument.softening",
    "instrument.weight",
    "entry.drag",
    "entry.guide",
    "drive.ripple",
    "drive.slip",
    "drive.backlash",
    "drive.encoder_scale",
    "drive.latency",
    "sensor.bias",
    "sensor.drift",
    "sensor.gain",
    "sensor.misalignment",
    "sensor.time_constant",
    "wall.hyperelastic",
    "wall.viscoelastic",
    "contact.load_friction",
    "instrument.viscoelastic",
    "instrument.torsional_windup",
    "fluid.drag",
];

/// Effects that it does not have.
pub const OUTSIDE: [&str; 6] = [
    "outside.directed_friction",
    "outside.cable",
    "outside.shaking",
    "outside.hysteresis",
    "outside.jump",
    "outside.rough_piece",
];

/// How far off anybody's mesh may have the edge between two branches \[m\].
const EDGE_DOUBT_M: f64 = 1.5e-4;
/// A quadratic blend takes an edge back by a quarter of what it rounds over.
const BLEND_PER_EDGE: f64 = 4.0;

/// Cases 0 to `count` of a seed on these rigs. The same seed gives the same cases.
pub fn cases(seed: u64, count: usize, stands: &[Stand]) -> Vec<Case> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let kinds = kinds(count, &mut rng);
    // Every effect once before any comes twice.
    let (mut inside, mut outside) = (Deck::of(&LIBRARY), Deck::of(&OUTSIDE));
    let mut stand_deck = Deck::of(stands);
    let case = |(number, kind): (usize, Kind)| {
        let mut stand = stand_deck.draw(&mut rng);
        let severity = rng.random_range(0.0..1.0);
        let ids = match kind {
            Kind::None => Vec::new(),
            Kind::Single => vec![inside.draw(&mut rng)],
            Kind::Outside => vec![outside.draw(&mut rng)],
            Kind::Pair => {
                let first = inside.draw(&mut rng);
                let mut second = inside.draw(&mut rng);
                while second == first {
                    second = inside.draw(&mut rng);
                }
                vec![first, second]
            }
        };
        let changes = ids.iter().filter_map(|id| single(id, severity, &mut rng)).collect();
        let noise_seed = rng.random();
        if stand.rig.blend_m > 0.0 {
            let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
            stand.rig.blend_m = blend_in_doubt_m(stand.rig.blend_m, &mut rng);
        }
        Case { number, kind, stand, changes, severity, noise_seed }
    };
    kinds.into_iter().enumerate().map(case).collect()
}

/// The kinds of `count` cases in their order: their shares are the same for every seed.
pub(crate) fn kinds(count: usize, rng: &mut impl Rng) -> Vec<Kind> {
    let share = |of: usize| (count + of / 2) / of;
    let mut kinds = vec![Kind::None; share(10)];
    kinds.extend(vec![Kind::Outside; share(4)]);
    kinds.extend(vec![Kind::Pair; share(4)]);
    kinds.resize(count, Kind::Single);
    shuffle(&mut kinds, rng);
    kinds
}

/// How a real vessel may divide where its mesh has an edge of `blend_m` \[m\].
pub(crate) fn blend_in_doubt_m(blend_m: f64, rng: &mut impl Rng) -> f64 {
    let back_m = rng.random_range(-EDGE_DOUBT_M..EDGE_DOUBT_M);
    (blend_m + BLEND_PER_EDGE * back_m).max(0.0)
}

/// One effect of that identifier at a severity; `None` when there is none of that name.
pub fn single(id: &str, severity: f64, rng: &mut impl Rng) -> Option<Change> {
    let strong = |weak: f64, strong: f64| weak + (strong - weak) * severity;
    let up = rng.random_bool(0.5);
    let sign = if up { 1.0 } else { -1.0 };
    // Times or divided by.
    let factor = |weak: f64, most: f64| strong(weak, most).powf(sign);
    let towards = |rng: &mut dyn FnMut() -> f64| {
        let z = 2.0 * rng() - 1.0;
        let angle = std::f64::consts::TAU * rng();
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * angle.cos(), across * angle.sin(), z)
    };
    let mut share = || rng.random_range(0.0..1.0);
    Some(match id {
        "contact.friction" => Change::Friction { factor: factor(1.5, 2.5) },
        "contact.stribeck" => {
            Change::Stribeck { excess: strong(0.8, 2.0), speed_m_per_s: 0.006 + 0.01 * share() }
        }
        "wall.stiffness" => Change::WallStiffness { factor: factor(2.5, 6.0) },
        // A diagnosis takes a registration within 0.6 mm and 0.6° an axis for a nuisance.
        "wall.registration" => Change::Registration {
            offset_m: towards(&mut share) * strong(1.5e-3, 3e-3),
            tilt_rad: towards(&mut share) * strong(0.02, 0.04),
        },
        "wall.narrowing" => Change::Narrowing {
            arc_m: 0.045 + 0.02 * share(),
            depth_m: strong(1e-3, 1.8e-3),
            sd_m: 0.004 + 0.003 * share(),
        },
        "wall.motion" => Change::Breathing {
            amplitude_m: towards(&mut share) * strong(0.7e-3, 1.6e-3),
            period_s: 1.2 + 1.5 * share(),
            phase: share(),
        },
        "instrument.stiffness" => {
            let shaft = factor(1.25, 1.7);
            Change::Stiffness { shaft, tip: shaft * (0.9 + 0.2 * share()) }
        }
        "instrument.stored_curvature" => {
            let (size, angle) = (strong(3.0, 8.0), std::f64::consts::TAU * share());
            Change::StoredCurvature { up_per_m: size * angle.cos(), side_per_m: size * angle.sin() }
        }
        "instrument.tip_precurve" => Change::Precurve { factor: 1.0 + sign * strong(0.2, 0.45) },
        "instrument.softening" => {
            Change::Softening { share: strong(0.25, 0.5), time_s: 2.0 + 3.0 * share() }
        }
        "instrument.weight" => Change::Weight { factor: strong(3.5, 7.0) },
        "entry.drag" => Change::EntryDrag {
            coulomb_n: strong(0.012, 0.06),
            viscous_n_s_per_m: 0.6 * share(),
            turn_m: 1e-4 + 2e-4 * share(),
        },
        "entry.guide" => Change::Guide { length_m: strong(4e-3, 0.014) },
        "drive.ripple" => Change::Ripple {
            ratio: strong(0.15, 0.4),
            pitch_m: 8e-3 + 8e-3 * share(),
            phase: share(),
        },
        "drive.slip" => Change::Slip { per_n: strong(1.5, 4.0) },
        "drive.backlash" => Change::Backlash { width_m: strong(0.7e-3, 2.5e-3) },
        "drive.encoder_scale" => Change::EncoderScale {
            insertion: 1.0 + sign * strong(0.03, 0.08),
            rotation: 1.0 + 0.06 * (2.0 * share() - 1.0),
        },
        "drive.latency" => Change::Latency { time_s: strong(0.015, 0.05) },
        "sensor.bias" => Change::Bias { force_n: towards(&mut share) * strong(0.01, 0.03) },
        "sensor.drift" => {
            let time_s = 4.0 + 6.0 * share();
            Change::Drift { end_n: towards(&mut share) * strong(0.015, 0.05), time_s }
        }
        "sensor.gain" => Change::Gain { factor: 1.0 + sign * strong(0.15, 0.35) },
        "sensor.misalignment" => {
            Change::Misalignment { rotation_rad: towards(&mut share) * strong(0.15, 0.35) }
        }
        "sensor.time_constant" => Change::TimeConstant { each_s: strong(0.03, 0.1) },
        "wall.hyperelastic" => Change::Stiffening { per_m: strong(4e3, 2e4) },
        "wall.viscoelastic" => {
            let time_s = 0.3 + 0.4 * share();
            Change::Relaxing { ratio: strong(2.0, 6.0), times_s: [time_s, 5.0 * time_s] }
        }
        "contact.load_friction" => {
            Change::LightFriction { excess: strong(1.5, 4.0), load_n_per_m: 2.0 + 4.0 * share() }
        }
        "instrument.viscoelastic" => Change::Viscous { time_s: strong(0.1, 0.4) },
        "instrument.torsional_windup" => Change::Windup { free_length_m: strong(0.2, 0.8) },
        "fluid.drag" => Change::Stream {
            along_n_per_m: sign * strong(0.03, 0.12),
            pulse: 0.5 + share(),
            period_s: 0.7 + 0.5 * share(),
        },
        "outside.directed_friction" => Change::DirectedFriction { factor: strong(2.5, 4.0) },
        "outside.cable" => {
            // 60 mm of feed.
            Change::Cable { per_m: towards(&mut share) * (strong(0.015, 0.05) / 0.06) }
        }
        "outside.shaking" => Change::Shaking {
            force_n: towards(&mut share) * strong(6e-3, 0.02),
            frequency_hz: 2.0 + 9.0 * share(),
        },
        "outside.hysteresis" => {
            Change::Hysteresis { share: strong(0.5, 1.0), width_n: 6e-3 + 6e-3 * share() }
        }
        "outside.jump" => {
            Change::Jump { at_share: 0.35 + 0.3 * share(), length_m: strong(2e-3, 5e-3) }
        }
        "outside.rough_piece" => {
            let from_m = 0.045 + 0.012 * share();
            Change::RoughPiece { from_m, to_m: from_m + 0.008, factor: strong(3.0, 6.0) }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_stated_shares_and_the_same_cases_again() {
        let stands = Stand::all_own();
        let (drawn, again) = (cases(7, 200, &stands), cases(7, 200, &stands));
        let count = |kind| drawn.iter().filter(|case| case.kind == kind).count();
        let shares = [Kind::None, Kind::Outside, Kind::Pair, Kind::Single].map(count);
        assert_eq!(shares, [20, 50, 50, 80]);
        assert!(drawn.iter().zip(&again).all(|(a, b)| a.changes == b.changes));
        assert!(cases(8, 200, &stands).iter().zip(&drawn).any(|(a, b)| a.changes != b.changes));
        for case in &drawn {
            let wanted = match case.kind {
                Kind::None => 0,
                Kind::Pair => 2,
                Kind::Single | Kind::Outside => 1,
            };
            assert_eq!(case.changes.len(), wanted);
        }
    }

    #[test]
    fn no_two_realities_of_a_vessel_that_divides_have_the_same_edge() {
        let mut stand = Stand::all_own().swap_remove(0);
        let tube = cases(7, 9, &[stand.clone()]);
        assert!(tube.iter().all(|case| case.stand.rig.blend_m == 0.0));
        stand.rig.blend_m = 1e-3;
        let blends: Vec<f64> = cases(7, 9, &[stand]).iter().map(|c| c.stand.rig.blend_m).collect();
        let mean_m = blends.iter().sum::<f64>() / 9.0;
        assert!((mean_m - 1e-3).abs() < 3e-4, "{blends:?}");
        assert!(blends.iter().all(|blend_m| (0.4e-3..1.6e-3).contains(blend_m)), "{blends:?}");
        assert!(blends.windows(2).all(|two| two[0] != two[1]), "{blends:?}");
    }

    #[test]
    fn every_name_is_drawn_as_itself() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for id in LIBRARY.iter().chain(&OUTSIDE) {
            assert_eq!(single(id, 0.5, &mut rng).unwrap().id(), *id);
        }
        assert!(single("contact.nothing", 0.5, &mut rng).is_none());
    }
}
