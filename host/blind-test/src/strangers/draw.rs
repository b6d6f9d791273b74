//! Draws a form of a family at a severity.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::form::Form;
use crate::noise::Noise;

/// Severities beyond "just to be seen" (0) and "strong" (1), for motions and sensors that show an effect
/// badly or all too well.
pub const SEVERITIES: [f64; 2] = [-1.5, 2.0];

/// Random numbers of one form.
struct Chance(Noise, ChaCha8Rng);

impl Chance {
    fn share(&mut self) -> f64 {
        use rand::Rng;
        self.1.random_range(0.0..1.0)
    }

    fn sign(&mut self) -> f64 {
        if self.share() < 0.5 { 1.0 } else { -1.0 }
    }

    /// From low to high.
    fn from(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn towards(&mut self) -> Vector3<f64> {
        self.0.vector(1.0).normalize()
    }
}

/// A form of that family; the same seed gives the same form at every severity but for its size. `None` when
/// there is no such family.
pub fn form(family: &str, severity: f64, seed: u64) -> Option<Form> {
    let severity = severity.clamp(SEVERITIES[0], SEVERITIES[1]);
    let mut c = Chance(Noise::of_seed(seed), ChaCha8Rng::seed_from_u64(!seed));
    let size = |weak: f64, strong: f64| weak * (strong / weak).powf(severity);
    let sign = c.sign();
    // Times or divided by.
    let factor = |weak: f64, strong: f64| (sign * size(weak.ln(), strong.ln())).exp();
    // A share never becomes the whole.
    let share_of = |weak: f64, strong: f64| size(weak, strong).min(0.85);
    Some(match family {
        "dahl" => Form::Dahl { factor: factor(1.5, 2.4), tangential_ratio: c.from(0.1, 0.5) },
        // Lubricated polymer: Stribeck's curve falls within some millimetres a second, and the film
        // follows within some hundredths of a second.
        "lugre" => Form::Lugre {
            excess: size(0.6, 1.6),
            speed_m_per_s: c.from(3e-3, 9e-3),
            time_s: c.from(0.03, 0.1),
        },
        "power-of-speed" => Form::PowerOfSpeed {
            excess: size(0.7, 1.8),
            speed_m_per_s: c.from(3e-3, 8e-3),
            exponent: c.from(0.4, 0.8),
        },
        "yielding" => Form::Yielding { factor: factor(2.5, 6.0), per_m: c.from(1e3, 4e3) },
        "bent-phantom" => Form::BentPhantom {
            offset_m: c.towards() * size(1.3e-3, 2.8e-3),
            tilt_rad: c.towards() * size(0.015, 0.035),
            // As far off at 60 mm as one third of the offset.
            sag_per_m: c.towards() * (size(0.4e-3, 1e-3) / 0.06_f64.powi(2)),
        },
        "one-sided" => Form::OneSided {
            arc_m: c.from(0.045, 0.065),
            share: share_of(0.35, 0.65),
            half_m: c.from(6e-3, 1.2e-2),
            angle_rad: TAU * c.share(),
        },
        "tilted" => Form::Tilted {
            arc_m: c.from(0.045, 0.065),
            share: share_of(0.3, 0.6),
            steep_m: c.from(2.5e-3, 4e-3),
            gentle_m: c.from(8e-3, 1.4e-2),
        },
        "breath-and-pulse" => Form::BreathAndPulse {
            breath_m: c.towards() * size(0.6e-3, 1.4e-3),
            breath_s: c.from(1.4, 3.0),
            pulse_m: c.towards() * size(0.15e-3, 0.4e-3),
            pulse_s: c.from(0.5, 0.9),
            phase: c.share(),
        },
        "toe" => Form::Toe { per_m: size(5e3, 2.5e4), toe: c.from(0.5, 0.8) },
        "fractional-wall" => {
            Form::FractionalWall { ratio: size(2.5, 8.0), time_s: c.from(0.2, 0.8) }
        }
        "power-of-load" => Form::PowerOfLoad {
            excess: size(1.5, 4.0),
            load_n_per_m: c.from(0.5, 2.0),
            exponent: c.from(0.33, 0.6),
        },
        "graded" => {
            let shaft = factor(1.25, 1.7);
            Form::Graded { shaft, tip: shaft * c.from(0.85, 1.2), over_m: c.from(0.03, 0.08) }
        }
        "helical" => Form::Helical {
            per_m: size(3.0, 8.0),
            turns_per_m: c.sign() * c.from(3.0, 9.0),
            phase_rad: TAU * c.share(),
        },
        "turned-tip" => Form::TurnedTip {
            factor: 1.0 + sign * size(0.15, 0.4),
            turn_rad: c.sign() * size(0.15, 0.4),
        },
        "stretched" => Form::Stretched { share: share_of(0.25, 0.5), time_s: c.from(1.5, 4.0) },
        "filled" => Form::Filled { shaft: size(3.0, 6.5), tip: size(2.0, 5.0) },
        "standard-solid" => {
            Form::StandardSolid { ratio: size(0.5, 1.6), time_s: c.from(0.15, 0.6) }
        }
        "fractional-bend" => {
            Form::FractionalBend { ratio: size(0.6, 2.0), time_s: c.from(0.1, 0.5) }
        }
        "stribeck-drag" => Form::StribeckDrag {
            coulomb_n: size(0.01, 0.05),
            excess: c.from(0.3, 1.0),
            speed_m_per_s: c.from(2e-3, 8e-3),
            elastic_m: c.from(1e-4, 4e-4),
        },
        "skew-guide" => Form::SkewGuide {
            length_m: size(4e-3, 1.4e-2),
            skew_rad: c.from(-0.03, 0.03),
            side_rad: c.from(-0.03, 0.03),
        },
        "two-harmonics" => Form::TwoHarmonics {
            ratio: share_of(0.14, 0.4),
            second: c.from(0.3, 0.8),
            pitch_m: c.from(7e-3, 1.8e-2),
            phase: c.share(),
        },
        "threshold-slip" => {
            Form::ThresholdSlip { per_n: size(2.5, 7.0), threshold_n: c.from(2e-3, 8e-3) }
        }
        "compliant-backlash" => {
            Form::CompliantBacklash { width_m: size(0.7e-3, 2.5e-3), per_n: c.from(2e-3, 8e-3) }
        }
        "uneven-scale" => Form::UnevenScale {
            insertion: 1.0 + sign * size(0.03, 0.08),
            rotation: 1.0 + c.from(-0.06, 0.06),
            uneven: c.from(0.1, 0.3),
            pitch_m: c.from(0.04, 0.09),
        },
        "sluggish" => {
            let (time_s, share) = (size(0.015, 0.05), c.from(0.2, 0.8));
            Form::Sluggish { dead_s: time_s * share, lag_s: time_s * (1.0 - share) }
        }
        "held-windup" => {
            Form::HeldWindup { free_length_m: size(0.25, 0.9), held_rad: c.from(0.02, 0.08) }
        }
        "square-flow" => Form::SquareFlow {
            // Force goes by the square of the speed.
            velocity_m_per_s: flow(&mut c) * size(0.12, 0.28),
            pulse: c.from(0.2, 0.6),
            frequency_hz: c.from(0.8, 1.8),
        },
        "bias-by-trial" => Form::BiasByTrial {
            force_n: c.towards() * size(0.01, 0.03),
            varies: c.from(0.05, 0.2),
            phase: TAU * c.share(),
        },
        "saturating-drift" => Form::SaturatingDrift {
            end_n: c.towards() * size(0.012, 0.04),
            time_s: c.from(1.5, 4.0),
        },
        "ramp-drift" => {
            let from_s = c.from(0.2, 1.2);
            Form::RampDrift {
                end_n: c.towards() * size(0.01, 0.035),
                from_s,
                to_s: from_s + c.from(1.0, 3.0),
            }
        }
        "cubic-gain" => Form::CubicGain {
            factor: 1.0 + sign * share_of(0.15, 0.35),
            axes: c.0.vector(0.03),
            cubic_per_n2: c.from(-2.0, 2.0),
        },
        "crosstalk" => Form::Crosstalk {
            rotation_rad: c.towards() * size(0.15, 0.35),
            shear: c.sign() * c.from(0.03, 0.1),
        },
        "ringing" => Form::Ringing { time_s: size(0.02, 0.07), damping: c.from(0.35, 0.7) },
        "directed-smoothly" => {
            Form::DirectedSmoothly { factor: 1.0 + size(1.2, 3.0), over_m: c.from(3e-4, 2e-3) }
        }
        "hardening-cable" => Form::HardeningCable {
            per_m: c.towards() * (size(0.012, 0.04) / 0.06),
            hardening_per_m: c.from(5.0, 25.0),
        },
        "beating" => Form::Beating {
            force_n: c.towards() * size(4e-3, 1.5e-2),
            frequency_hz: c.from(3.0, 12.0),
            apart_hz: c.from(0.3, 1.2),
        },
        "dry-sensor" => Form::DrySensor { width_n: size(5e-3, 1.5e-2) },
        "screw" => Form::Screw { m_per_rad: c.sign() * size(1.5e-4, 6e-4) },
        "rotary-ripple" => Form::RotaryRipple {
            ratio: share_of(0.25, 0.6),
            per_turn: c.from(1.0, 4.0),
            phase_rad: TAU * c.share(),
        },
        "kink" => Form::Kink {
            behind_m: c.from(0.02, 0.04),
            length_m: c.from(3e-3, 7e-3),
            factor: c.from(0.08, 0.3),
            bent_rad: c.sign() * size(0.08, 0.3),
        },
        "soft-mount" => Form::SoftMount { m_per_n: size(8e-3, 2.5e-2) },
        "tip-pull" => Form::TipPull { force_n: c.towards() * size(4e-3, 1.5e-2) },
        "presliding" => Form::Presliding { tangential_ratio: 1.0 / size(25.0, 120.0) },
        _ => return None,
    })
}

/// Direction of a flow: mostly inwards or outwards along the entry's axis.
fn flow(c: &mut Chance) -> Vector3<f64> {
    let aside = c.0.vector(0.25);
    (Vector3::x() * c.sign() + aside).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::families::{LIBRARY, OUTSIDE};

    #[test]
    fn every_form_is_drawn_as_itself() {
        for (id, families) in LIBRARY.iter().chain(&OUTSIDE) {
            for family in *families {
                for severity in [SEVERITIES[0], 0.0, 0.5, 1.0, SEVERITIES[1]] {
                    let own = form(family, severity, 7).unwrap();
                    assert_eq!((own.id(), own.family()), (*id, *family));
                    assert_eq!(own, form(family, severity, 7).unwrap());
                    assert_eq!(own.truth(0.3).id, *id);
                }
                assert_ne!(form(family, 0.0, 7), form(family, 1.0, 7), "{family} has a size");
            }
        }
        assert_eq!(form("nothing", 0.5, 1), None);
    }
}
