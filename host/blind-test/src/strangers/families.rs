//! Which families of shapes there are for every effect, and which motions show them.

use super::motions::MotionKind;

/// Effects of the library, each with its families.
pub const LIBRARY: [(&str, &[&str]); 29] = [
    ("contact.friction", &["dahl"]),
    ("contact.stribeck", &["lugre", "power-of-speed"]),
    ("contact.load_friction", &["power-of-load"]),
    ("wall.stiffness", &["yielding"]),
    ("wall.registration", &["bent-phantom"]),
    ("wall.narrowing", &["one-sided", "tilted"]),
    ("wall.motion", &["breath-and-pulse"]),
    ("wall.hyperelastic", &["toe"]),
    ("wall.viscoelastic", &["fractional-wall"]),
    ("instrument.stiffness", &["graded"]),
    ("instrument.stored_curvature", &["helical"]),
    ("instrument.tip_precurve", &["turned-tip"]),
    ("instrument.softening", &["stretched"]),
    ("instrument.weight", &["filled"]),
    ("instrument.viscoelastic", &["standard-solid", "fractional-bend"]),
    ("instrument.torsional_windup", &["held-windup"]),
    ("entry.drag", &["stribeck-drag"]),
    ("entry.guide", &["skew-guide"]),
    ("drive.ripple", &["two-harmonics"]),
    ("drive.slip", &["threshold-slip"]),
    ("drive.backlash", &["compliant-backlash"]),
    ("drive.encoder_scale", &["uneven-scale"]),
    ("drive.latency", &["sluggish"]),
    ("sensor.bias", &["bias-by-trial"]),
    ("sensor.drift", &["saturating-drift", "ramp-drift"]),
    ("sensor.gain", &["cubic-gain"]),
    ("sensor.misalignment", &["crosstalk"]),
    ("sensor.time_constant", &["ringing"]),
    ("fluid.drag", &["square-flow"]),
];

/// Causes that the library does not have.
pub const OUTSIDE: [(&str, &[&str]); 10] = [
    ("outside.directed_friction", &["directed-smoothly"]),
    ("outside.cable", &["hardening-cable"]),
    ("outside.shaking", &["beating"]),
    ("outside.hysteresis", &["dry-sensor"]),
    ("outside.screw", &["screw"]),
    ("outside.rotary_ripple", &["rotary-ripple"]),
    ("outside.kink", &["kink"]),
    ("outside.soft_mount", &["soft-mount"]),
    ("outside.tip_pull", &["tip-pull"]),
    ("outside.presliding", &["presliding"]),
];

/// Whether a motion can show a family at all: a dead zone needs a reversal, a screw a turn.
pub fn shows(family: &str, motion: MotionKind) -> bool {
    use MotionKind::{Dwells, Hand, OneSpeed, Rotation};
    match family {
        "compliant-backlash" | "directed-smoothly" | "presliding" => {
            !matches!(motion, OneSpeed | Dwells)
        }
        "screw" | "rotary-ripple" | "held-windup" => matches!(motion, Hand | Rotation),
        // The feed of the others is too short for a period, or for a roller to turn.
        "two-harmonics" | "uneven-scale" => motion != Rotation,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw;

    #[test]
    fn strangers_have_every_effect_of_the_library_and_new_causes() {
        let ids: Vec<&str> = LIBRARY.iter().map(|(id, _)| *id).collect();
        assert!(draw::LIBRARY.iter().all(|id| ids.contains(id)));
        let new = OUTSIDE.iter().filter(|(id, _)| !draw::OUTSIDE.contains(id));
        assert_eq!(new.count(), 6);
    }
}
