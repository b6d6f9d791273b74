//! The whole tick with the real model: from the self-test to armed and back, twice with the same result.

#[path = "support/wire.rs"]
mod wire;

use cathforce_control::{
    Command, Config, EncoderSample, Inputs, Mode, Outputs, Settings, State, step,
};
use cathforce_mechanics::{BRICK_NODES, Lumen, LumenHeader, MAX_LINKS, Model, NODE_BYTES};
use wire::wire;

const CELL_M: f32 = 1e-3;
const UNIT_M: f32 = 1e-6;
const BRICKS: [u16; 3] = [16, 3, 3];

/// A straight tube of 4 mm radius along x, with all bricks stored.
fn tube() -> (LumenHeader, Vec<u8>) {
    let stored: u16 = BRICKS.iter().product();
    let origin_m = [0.0, -6e-3, -6e-3];
    let header =
        LumenHeader { origin_m, cell_m: CELL_M, distance_unit_m: UNIT_M, bricks: BRICKS, stored };
    let mut bytes: Vec<u8> = (0..stored).flat_map(u16::to_le_bytes).collect();
    for brick in 0..stored {
        let by = brick / BRICKS[0] % BRICKS[1];
        let bz = brick / (BRICKS[0] * BRICKS[1]);
        for node in 0..BRICK_NODES as u16 {
            let y = origin_m[1] + f32::from(4 * by + node / 5 % 5) * CELL_M;
            let z = origin_m[2] + f32::from(4 * bz + node / 25) * CELL_M;
            let radius = y.hypot(z).max(1e-9);
            let distance = ((4e-3 - radius) / UNIT_M) as i16;
            bytes.extend(distance.to_le_bytes());
            bytes.extend([0, (-127.0 * y / radius) as i8 as u8, (-127.0 * z / radius) as i8 as u8]);
            bytes.push(128);
        }
    }
    assert_eq!(bytes.len(), 2 * usize::from(stored) * (1 + BRICK_NODES * NODE_BYTES / 2));
    (header, bytes)
}

fn config(lumen: &(LumenHeader, Vec<u8>)) -> Config<'_> {
    let mut description = wire();
    description.entry.position_m = [4e-3, 0.0, 0.0];
    Config {
        model: Model::new(description).expect("a valid description"),
        lumen: Lumen::new(lumen.0, &lumen.1).expect("a valid lumen"),
        band: None,
        settings: Settings::default(),
    }
}

/// Self-test, settle at 20 mm, arm, feed and turn, disarm.
fn run(config: &Config<'_>) -> (Vec<Outputs>, State) {
    let mut state = State::new();
    let mut outputs = Vec::new();
    let mut at = EncoderSample { insertion_m: 0.020, rotation_rad: 0.0 };
    let mut tick = |at: EncoderSample, command| {
        let inputs = Inputs { encoder: Some(at), command, ..Inputs::default() };
        outputs.push(step(config, &mut state, &inputs));
        outputs.last().expect("just pushed").mode
    };
    tick(at, Some(Command::SelfTest));
    let mut waited = 0;
    while tick(at, None) != Mode::Ready {
        waited += 1;
        assert!(waited < 10_000, "the model does not settle");
    }
    assert_eq!(tick(at, Some(Command::Arm)), Mode::Armed);
    for _ in 0..500 {
        at.insertion_m += 2e-5;
        at.rotation_rad += 1e-3;
        assert_eq!(tick(at, None), Mode::Armed);
    }
    tick(at, Some(Command::Disarm));
    while tick(at, None) != Mode::Ready {}
    (outputs, state)
}

#[test]
fn p22_the_same_inputs_give_the_same_bits() {
    let lumen = tube();
    let config = config(&lumen);
    let ((a, end_a), (b, end_b)) = (run(&config), run(&config));
    assert_eq!(a, b);
    assert!(end_a.mechanics().nodes() > 0 && end_a.mechanics().nodes() <= MAX_LINKS);
    for node in 0..end_a.mechanics().nodes() {
        let (a, b) = (end_a.mechanics(), end_b.mechanics());
        assert_eq!(a.node_position_m(node), b.node_position_m(node));
        assert_eq!(a.node_force_n(node), b.node_force_n(node));
    }
    assert!(a.windows(2).all(|w| w[0].digest != w[1].digest));
    assert!(a.iter().any(|o| o.mode == Mode::Armed && o.contact.links > 0));
}

/// P05 with the real model: each word of the controller's memory is corrupted while armed.
#[test]
fn p05_nan_and_infinity_in_every_word() {
    let lumen = tube();
    let config = config(&lumen);
    let (outputs, mut ready) = run(&config);
    let at = EncoderSample { insertion_m: 0.020 + 500.0 * 2e-5, rotation_rad: 0.5 };
    let inputs = Inputs { encoder: Some(at), ..Inputs::default() };
    step(&config, &mut ready, &Inputs { command: Some(Command::Arm), ..inputs });
    assert_eq!(step(&config, &mut ready, &inputs).mode, Mode::Armed);

    let mut words = 0;
    ready.visit_memory(&mut |_| words += 1);
    assert!(words >= 15 && !outputs.is_empty());
    for hit in 0..words {
        for bits in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(f32::to_bits) {
            let mut state = ready.clone();
            let mut k = 0;
            state.visit_memory(&mut |word| {
                if k == hit {
                    word.set_bits(bits);
                }
                k += 1;
            });
            for _ in 0..10 {
                let o = step(&config, &mut state, &inputs);
                let s = &config.settings;
                assert!(o.force_n.abs() <= s.force_limit_n, "word {hit}: {o:?}");
                assert!(o.torque_n_m.abs() <= s.torque_limit_n_m, "word {hit}: {o:?}");
                let forces = o.contact.force_on_vessel_n;
                assert!(forces.iter().all(|x| x.is_finite()), "word {hit}: {o:?}");
            }
        }
    }
}
