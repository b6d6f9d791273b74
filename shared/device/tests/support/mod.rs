//! A small device image: a bare wire in a wide, empty vessel.

#![allow(dead_code)]

#[path = "../../../control/tests/support/wire.rs"]
mod wire;

use cathforce_config::{ImageHead, Settings, image};
use cathforce_mechanics::{Description, DrivenTendon, FREE, LumenHeader};
use wire::wire;

/// An image with a second, thinner wire inside the first.
pub fn image_with_guidewire() -> Vec<u8> {
    let mut description = wire();
    let mut guidewire = description.instrument.clone();
    guidewire.outer_radius_m *= 0.5;
    for section in &mut guidewire.sections {
        section.bending_stiffness_n_m2 *= 0.2;
        section.torsional_stiffness_n_m2 *= 0.2;
    }
    description.guidewire = Some(guidewire);
    // Two are refused beside a guidewire: a tick would take too long.
    description.solver.solves = 1;
    image_of(description)
}

/// An image of a wire with this number of tendons, a quarter turn from one to the next.
pub fn image_with_tendons(count: usize) -> Vec<u8> {
    let mut description = wire();
    // Two are refused with tendons: a tick would take too long.
    description.solver.solves = 1;
    for i in 0..count {
        let tendon = DrivenTendon {
            angle_rad: core::f32::consts::FRAC_PI_2 * i as f32,
            offset_m: 4e-4,
            anchor_m: 0.0,
            stiffness_n_per_m: 2000.0,
            slack_m: 0.0,
            static_friction: 0.2,
            sliding_friction: 0.1,
            bend_behind_rad: 1.0,
        };
        description.tendons.push(tendon).unwrap();
    }
    image_of(description)
}

/// An image of a wire that is dragged at where it enters: what is fed is felt.
pub fn image_with_drag() -> Vec<u8> {
    let mut description = wire();
    description.set_parameter("effects.entry.drag.coulomb_n", 1.0).unwrap();
    image_of(description)
}

/// An image whose lumen is 64 kB, all of it free space.
pub fn image() -> Vec<u8> {
    image_of(wire())
}

fn image_of(description: Description<f32>) -> Vec<u8> {
    let lumen = LumenHeader {
        origin_m: [-1e-3, -64e-3, -64e-3],
        cell_m: 1e-3,
        distance_unit_m: 1e-6,
        bricks: [32; 3],
        stored: 0,
    };
    let head = ImageHead {
        description,
        lumen,
        settings: Settings::default(),
        master: Default::default(),
        band: None,
    };
    let bytes = FREE.to_le_bytes().repeat(32 * 32 * 32);
    let mut image = vec![0; image::encoded_len(&head, &bytes).unwrap()];
    image::encode(&head, &bytes, &mut image).unwrap();
    image
}
