//! The handle of a master and the hand that holds it, along one axis.

use serde::Serialize;

/// Steps of the integration in a tick: the stiffest hand of the maps swings at 21 Hz, and so a step is a thousandth of
/// its period.
const STEPS: usize = 20;
pub(crate) const TICK_S: f64 = 1e-3;

/// The axis of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Insertion: m, N.
    Linear,
    /// Rotation: rad, N·m.
    Rotary,
}

/// What moves with the operator's fingers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Handle {
    /// \[kg\], or kg·m² of a rotary axis.
    pub inertia: f64,
    /// Viscous friction of the bearing and the motor \[N·s/m\], or N·m·s/rad.
    pub viscous: f64,
    /// Dry friction \[N\], or N·m.
    pub coulomb: f64,
}

/// Fingers as a spring and a damper between the handle and where the operator means to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hand {
    /// \[N/m\], or N·m/rad.
    pub stiffness: f64,
    /// Share of the critical damping with this handle.
    pub damping_ratio: f64,
}

/// The handle while it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Held {
    handle: Handle,
    hand: Hand,
    damping: f64,
    pub position: f64,
    pub velocity: f64,
}

impl Handle {
    /// A slide of 150 g, or a knob of the same mass with a radius of 15 mm, on ball bearings. The published
    /// masters of this kind are of that size; none states its friction.
    pub const fn of(axis: Axis) -> Self {
        match axis {
            Axis::Linear => Self { inertia: 0.15, viscous: 0.5, coulomb: 0.05 },
            Axis::Rotary => Self { inertia: 1.7e-5, viscous: 2e-5, coulomb: 3e-4 },
        }
    }
}

impl Held {
    pub fn new(handle: Handle, hand: Hand, position: f64) -> Self {
        let damping = 2.0 * hand.damping_ratio * (hand.stiffness * handle.inertia).sqrt();
        Self { handle, hand, damping, position, velocity: 0.0 }
    }

    /// One millisecond. `wanted` and `wanted_velocity`: where the operator means to be; `motor`: the force
    /// against positive motion.
    ///
    /// > m ẍ = k (x_w − x) + d (ẋ_w − ẋ) − c ẋ − F_c tanh(ẋ/v₀) − F
    ///
    /// See docs/explanation/haptics.md (H1).
    pub fn advance(&mut self, wanted: f64, wanted_velocity: f64, motor: f64) {
        let Handle { inertia, viscous, coulomb } = self.handle;
        let step_s = TICK_S / STEPS as f64;
        // Dry friction turns over so slowly that a step does not overshoot.
        let turnover = 4.0 * coulomb * step_s / inertia;
        for k in 0..STEPS {
            let ahead = wanted + wanted_velocity * step_s * k as f64;
            let hand = self.hand.stiffness * (ahead - self.position)
                + self.damping * (wanted_velocity - self.velocity);
            let dry = if coulomb > 0.0 { coulomb * (self.velocity / turnover).tanh() } else { 0.0 };
            let force = hand - viscous * self.velocity - dry - motor;
            self.velocity += force / inertia * step_s;
            self.position += self.velocity * step_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAND: Hand = Hand { stiffness: 300.0, damping_ratio: 0.3 };

    #[test]
    fn a_hand_brings_the_handle_to_where_it_means_to_be() {
        let mut held = Held::new(Handle::of(Axis::Linear), HAND, 0.0);
        for _ in 0..2000 {
            held.advance(0.01, 0.0, 0.0);
        }
        // Dry friction holds it within its force over the hand's stiffness.
        assert!((held.position - 0.01).abs() < 0.05 / 300.0 + 1e-5, "{}", held.position);
    }

    #[test]
    fn a_motor_pushes_the_handle_back_by_its_force_over_the_stiffness_of_the_hand() {
        let handle = Handle { coulomb: 0.0, ..Handle::of(Axis::Linear) };
        let mut held = Held::new(handle, HAND, 0.0);
        for _ in 0..4000 {
            held.advance(0.0, 0.0, 0.9);
        }
        assert!((held.position + 0.9 / 300.0).abs() < 1e-6, "{}", held.position);
    }

    #[test]
    fn without_friction_and_damping_its_energy_stays() {
        let handle = Handle { viscous: 0.0, coulomb: 0.0, ..Handle::of(Axis::Linear) };
        let mut held = Held::new(handle, Hand { damping_ratio: 0.0, ..HAND }, 0.01);
        let energy = |held: &Held| {
            0.5 * handle.inertia * held.velocity.powi(2) + 150.0 * held.position.powi(2)
        };
        let before = energy(&held);
        for _ in 0..5000 {
            held.advance(0.0, 0.0, 0.0);
        }
        assert!((energy(&held) / before - 1.0).abs() < 0.01, "{}", energy(&held) / before);
    }
}
