//! The parameters that can be identified: units, limits, and how each is measured without a search.

use crate::pulse::FlowValues;
use crate::rod::RodValues;
use crate::tendon::TendonValues;

/// What is known of a parameter beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    pub name: &'static str,
    pub unit: &'static str,
    /// Values beyond these are taken for a slip, such as another unit.
    pub least: f64,
    pub most: f64,
    /// How it is measured on its own, so that its value can be given.
    pub alone: &'static str,
    /// What makes records of this kind tell it, or tell it better.
    pub more: &'static str,
}

const fn quantity(
    name: &'static str,
    unit: &'static str,
    [least, most]: [f64; 2],
    alone: &'static str,
    more: &'static str,
) -> Quantity {
    Quantity { name, unit, least, most, alone, more }
}

/// Of a release, in the order of [`RodValues`]. The rod is the solid one that bends like the catheter,
/// which is thinner than it, so that its density and modulus are larger than those of any material in it.
pub const OF_RELEASE: [Quantity; 5] = [
    quantity(
        RodValues::NAMES[0],
        "kg/m³",
        [100.0, 1e6],
        "weigh a cut piece, and divide its mass per length by the cross-section of `bending_diameter_m`",
        "release from a longer free length, whose own mass counts more beside the tip's",
    ),
    quantity(
        RodValues::NAMES[1],
        "Pa",
        [1e5, 1e13],
        "hang a weight at rest, and compute the modulus from the deflection",
        "hang heavier weights",
    ),
    quantity(
        RodValues::NAMES[2],
        "kg/m²",
        [0.0, 10.0],
        "compute it as half of the air's density, times the diameter, times a drag coefficient near 1",
        "let it swing faster and farther: heavier weights, a longer free length",
    ),
    quantity(
        RodValues::NAMES[3],
        "N·m²·s",
        [0.0, 1.0],
        "compute it from how fast the swing fades",
        "sample faster, and record until the swing has faded",
    ),
    quantity(
        RodValues::NAMES[4],
        "kg",
        [0.0, 0.1],
        "weigh the tip's sensor on a scale",
        "release heavier weights, and repeat with a known mass added to the tip",
    ),
];

/// Of a loop, in the order of [`TendonValues`]; the limits are the device's.
pub const OF_LOOP: [Quantity; 3] = [
    quantity(
        TendonValues::NAMES[0],
        "1",
        [0.0, 2.0],
        "pull the tendon through its lumen around a known bend with a force gauge, from standstill",
        "pull to larger amplitudes, and hold still at the ends",
    ),
    quantity(
        TendonValues::NAMES[1],
        "1",
        [0.0, 1.0],
        "pull the tendon through its lumen around a known bend with a force gauge, in motion",
        "pull to larger amplitudes, slowly enough for ten samples within the dead zone",
    ),
    quantity(
        TendonValues::NAMES[2],
        "m",
        [0.0, 0.02],
        "turn the straight catheter's drive until the tip begins to move",
        "pull to smaller amplitudes, and sample faster while the drive turns round",
    ),
];

/// Of a record in flow, in the order of [`FlowValues`].
pub const OF_FLOW: [Quantity; 4] = [
    quantity(
        FlowValues::NAMES[0],
        "1",
        [0.0, 5.0],
        "measure the flow's velocity over a beat",
        "record more beats, at a larger flow",
    ),
    quantity(
        FlowValues::NAMES[1],
        "rad",
        [-10.0, 10.0],
        "take the pump's trigger for the clock of `t_s`",
        "record more beats, at a larger pulse",
    ),
    quantity(
        FlowValues::NAMES[2],
        "1",
        [0.0, 1e4],
        "take it from a cylinder in a steady flow of the same Reynolds number",
        "record at a larger flow, and `rest_m` more exactly",
    ),
    quantity(
        FlowValues::NAMES[3],
        "m/s",
        [1e-4, 10.0],
        "measure it with a flow meter or by Doppler ultrasound",
        "record at a larger flow",
    ),
];
