//! The device image and the control step.

use std::path::Path;
use std::sync::OnceLock;

use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_bus::service::crc32;
use cathforce_bus::{Command, HapticForce, HapticTorque, Id, Process, Sealer, Status};
use cathforce_config::Settings;
use cathforce_config::image::{self, HEADER_BYTES};
use cathforce_control::{Mode, Reaction, TICK_S};
use cathforce_device::ControlLoop;

use crate::bus::{Bytes, frame};

/// A rig with a wire and one with tendons, of the project's examples.
const EXAMPLES: [&str; 2] = ["bend-guidewire", "two-tendons"];
/// Gains at which the output is often limited.
const GAIN: f32 = 20.0;
/// Ticks of one input.
const MOST_TICKS: u32 = 400;
/// Identifiers of the frames that the device takes.
const FRAMES: [Id; 6] =
    [Id::Sync, Id::Encoder, Id::Guidewire, Id::Tendons(0), Id::Tendons(1), Id::Command];

/// Images of the examples, on a coarse grid.
pub fn images() -> &'static [Vec<u8>; 2] {
    static IMAGES: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    IMAGES.get_or_init(|| {
        EXAMPLES.map(|name| {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name);
            let bundle = Bundle::open(folder).unwrap_or_else(|error| panic!("{error}"));
            let settings = Settings { force_gain: GAIN, torque_gain: GAIN, ..Settings::default() };
            let options = ImageOptions { cell_m: 2e-3, settings, ..ImageOptions::default() };
            device_image(&bundle, &options).unwrap_or_else(|error| panic!("{error}")).0
        })
    })
}

/// The input is laid over the beginning of an image, whose length and checksum are then put right. What is
/// accepted can be ticked: its outputs are finite.
pub fn image(data: &[u8]) {
    let _ = image::decode(data);
    let [which, data @ ..] = data else { return };
    let mut image = images()[usize::from(*which) % 2].clone();
    // The numbers of the description lie in front, and a byte that stays is written as 0xFF.
    for (place, byte) in image[HEADER_BYTES..].iter_mut().zip(data) {
        *place ^= byte;
    }
    let crc = crc32(&image[HEADER_BYTES..]);
    image[HEADER_BYTES - 4..HEADER_BYTES].copy_from_slice(&crc.to_le_bytes());
    let Ok(config) = image::decode(&image) else { return };
    let head = image::decode_head(&image).expect("a part of what was accepted");
    let mut control = ControlLoop::new();
    control.restart(head.master);
    for _ in 0..4 {
        control.tick(Some(&config), None);
        let outputs = control.outputs().expect("configured");
        assert!(outputs.force_n.is_finite() && outputs.torque_n_m.is_finite(), "{outputs:?}");
    }
}

/// The output stays within its limits and its slew, and every number is finite, whatever frames come.
pub fn step(data: &[u8]) {
    let mut bytes = Bytes(data);
    let image = &images()[usize::from(bytes.next()) % 2];
    let config = image::decode(image).expect("our own");
    let settings = config.settings;
    let mut control = ControlLoop::new();
    control.restart(image::decode_head(image).expect("our own").master);
    let mut sealer = Sealer::default();
    let mut before = [0.0_f32; 2];
    let mut ticks = 0;
    while !bytes.is_empty() && ticks < MOST_TICKS {
        let action = bytes.next();
        match action % 16 {
            // The help that an adversary needs to arm it.
            0 => {
                let useful = match control.outputs().map(|outputs| outputs.mode) {
                    Some(Mode::Boot) => Command::SelfTest,
                    Some(Mode::Fault { cause }) => {
                        Command::ClearFault { token: cause.clear_token() }
                    }
                    _ => Command::Arm,
                };
                control.on_frame(&sealer.seal(Process::Command(useful), Status::default()));
            }
            1..=5 => {
                let id = FRAMES[usize::from(action % 16)];
                if let Some(process) = Process::decode(id, bytes.array()) {
                    control.on_frame(&sealer.seal(process, Status::default()));
                }
            }
            6 => {
                if let Some(frame) = frame(&mut bytes) {
                    control.on_frame(&frame);
                }
            }
            // The drive where it was, and a few ticks.
            _ => {
                for _ in 0..=action / 16 {
                    control.tick(Some(&config), None);
                    ticks += 1;
                    before = check(&control, &settings, before);
                }
            }
        }
    }
}

fn check(control: &ControlLoop, settings: &Settings, before: [f32; 2]) -> [f32; 2] {
    let outputs = control.outputs().expect("configured");
    let now = [outputs.force_n, outputs.torque_n_m];
    let cut = outputs.fault.is_some_and(|fault| fault.reaction() == Reaction::Cut);
    let axis = |now: f32, before: f32, limit: f32, slew_per_s: f32, unit: f32| {
        assert!(now.is_finite() && now.abs() <= limit, "{outputs:?}");
        // Rounding to the codes of a frame adds at most one of them.
        let change = (now - before).abs();
        let may = slew_per_s * TICK_S + unit;
        assert!(change <= may || (cut && now == 0.0), "{change} in one tick: {outputs:?}");
    };
    let Settings { force_limit_n, force_slew_n_per_s, .. } = *settings;
    axis(now[0], before[0], force_limit_n, force_slew_n_per_s, HapticForce::UNIT);
    let Settings { torque_limit_n_m, torque_slew_n_m_per_s, .. } = *settings;
    axis(now[1], before[1], torque_limit_n_m, torque_slew_n_m_per_s, HapticTorque::UNIT);
    let model = control.state().mechanics();
    let nodes =
        (0..model.nodes()).flat_map(|node| [model.node_position_m(node), model.node_force_n(node)]);
    assert!(nodes.flatten().flatten().all(f32::is_finite), "{outputs:?}");
    now
}
