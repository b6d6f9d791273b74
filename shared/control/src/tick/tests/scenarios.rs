//! Random scenarios with a hostile bus, model and memory. The device is mostly treated well, so that it is
//! often armed.

extern crate std;

use crate::Notice;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::{FORCE_HARD_N, GuidewireSample, Reaction, TORQUE_HARD_N_M};

/// One tick of a scenario.
#[derive(Clone, Debug)]
struct Happening {
    inputs: Inputs,
    drive_force_n: f32,
    drive_torque_n_m: f32,
    unresolved: bool,
}

fn any_f32() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

fn encoder() -> impl Strategy<Value = Option<EncoderSample>> {
    let near = (0.1f32..0.1001, 0.0f32..0.01)
        .prop_map(|(insertion_m, rotation_rad)| EncoderSample { insertion_m, rotation_rad });
    let wild = (any_f32(), any_f32())
        .prop_map(|(insertion_m, rotation_rad)| EncoderSample { insertion_m, rotation_rad });
    prop_oneof![60 => near.prop_map(Some), 1 => wild.prop_map(Some), 2 => Just(None)]
}

fn tendon_pair() -> impl Strategy<Value = Option<TendonPair>> {
    let near = (0.0f32..0.0001, -0.0001f32..0.0).prop_map(|(first, second)| [first, second]);
    let wild = (any_f32(), any_f32()).prop_map(|(first, second)| [first, second]);
    prop_oneof![60 => near.prop_map(Some), 1 => wild.prop_map(Some), 2 => Just(None)]
        .prop_map(|pair| pair.map(|displacements_m| TendonPair { displacements_m }))
}

fn command() -> impl Strategy<Value = Option<Command>> {
    let fault = (0..Fault::ALL.len()).prop_map(|i| Fault::ALL[i]);
    prop_oneof![
        20 => Just(None),
        3 => Just(Some(Command::SelfTest)),
        3 => Just(Some(Command::Arm)),
        1 => Just(Some(Command::Disarm)),
        5 => fault.prop_map(|f| Some(Command::ClearFault { token: f.clear_token() })),
        1 => any::<u32>().prop_map(|token| Some(Command::ClearFault { token })),
    ]
}

fn happening() -> impl Strategy<Value = Happening> {
    let rejected = prop_oneof![30 => Just(0u8), 1 => any::<u8>()];
    let notice = prop_oneof![
        200 => Just(None),
        1 => Just(Some(Notice::Overrun)),
        1 => Just(Some(Notice::BusOff)),
    ];
    // Has an effect only in the scenarios with a guidewire.
    let guidewire =
        (encoder(), any::<bool>()).prop_map(|(at, held)| at.map(|at| GuidewireSample { at, held }));
    let grip = |handle_released| Some(Grip { handle_released, ..Grip::default() });
    let grip = prop_oneof![20 => Just(None), 1 => any::<bool>().prop_map(grip)];
    // Likewise with tendons.
    let tendons = [tendon_pair(), tendon_pair()];
    let inputs = (encoder(), guidewire, tendons, grip, rejected, command(), notice).prop_map(
        |(encoder, guidewire, tendons, grip, rejected_frames, command, notice)| Inputs {
            encoder,
            guidewire,
            tendons,
            grip,
            rejected_frames,
            command,
            notice,
        },
    );
    let force = prop_oneof![20 => -20.0f32..20.0, 1 => any_f32()];
    let torque = prop_oneof![20 => -0.2f32..0.2, 1 => any_f32()];
    (inputs, force, torque, any::<bool>()).prop_map(
        |(inputs, drive_force_n, drive_torque_n_m, unresolved)| Happening {
            inputs,
            drive_force_n,
            drive_torque_n_m,
            unresolved,
        },
    )
}

fn scenario() -> impl Strategy<Value = Vec<Happening>> {
    prop::collection::vec(happening(), 1..150)
}

/// The same scenario, in which the encoder is silent from this tick on for a while.
fn falling_silent() -> impl Strategy<Value = (Vec<Happening>, usize)> {
    // Soon: few stay armed for long.
    (scenario(), 0usize..8, 5usize..40).prop_map(|(mut scenario, at, ticks)| {
        let first = at.min(scenario.len() - 1);
        for happening in scenario.iter_mut().skip(first).take(ticks) {
            happening.inputs.encoder = None;
        }
        (scenario, first)
    })
}

impl Bench {
    fn handle_event(&mut self, happening: &Happening) -> Outputs {
        self.fake.answer.drive_force_n = happening.drive_force_n;
        self.fake.answer.drive_torque_n_m = happening.drive_torque_n_m;
        self.fake.answer.guidewire_force_n = -happening.drive_force_n;
        self.fake.answer.guidewire_torque_n_m = -happening.drive_torque_n_m;
        self.fake.answer.unresolved = happening.unresolved;
        self.tick(happening.inputs)
    }
}

/// A cut is the only change of the output that may exceed the slew limit.
fn was_cut(outputs: &Outputs) -> bool {
    let cut = matches!(outputs.mode, Mode::Fault { cause } if cause.reaction() == Reaction::Cut);
    cut && is_zero(outputs)
}

fn all_finite(outputs: &Outputs) -> bool {
    outputs.force_n.is_finite()
        && outputs.torque_n_m.is_finite()
        && outputs_finite(&outputs.contact)
}

proptest! {
    #[test]
    fn p02_no_input_gives_more_than_the_limit_or_the_slew(
        scenario in scenario(),
        from_armed: bool,
        guidewire: bool,
        tendons in 0usize..=4,
    ) {
        let mut bench = if from_armed { Bench::armed() } else { Bench::new() };
        bench.fake.guidewire = guidewire;
        bench.fake.tendons = tendons;
        let s = bench.settings;
        let (mut force_n, mut torque_n_m) = (if from_armed { 1.0 } else { 0.0 }, 0.0);
        if from_armed {
            torque_n_m = bench.memory.torque.limiter.output();
        }
        for happening in &scenario {
            let outputs = bench.handle_event(happening);
            prop_assert!(outputs.force_n.abs() <= s.force_limit_n);
            prop_assert!(outputs.torque_n_m.abs() <= s.torque_limit_n_m);
            if !was_cut(&outputs) {
                prop_assert!((outputs.force_n - force_n).abs() <= s.force_slew_n_per_s * TICK_S);
                let change = (outputs.torque_n_m - torque_n_m).abs();
                prop_assert!(change <= s.torque_slew_n_m_per_s * TICK_S);
            }
            (force_n, torque_n_m) = (outputs.force_n, outputs.torque_n_m);
        }
    }

    #[test]
    fn p01_armed_never_outlives_5_ms_of_silence((scenario, _) in falling_silent()) {
        let mut bench = Bench::armed();
        for happening in &scenario {
            let outputs = bench.handle_event(happening);
            if outputs.encoder_age_ticks >= 5 {
                prop_assert!(outputs.mode != Mode::Armed);
            }
        }
    }

    /// Judged from the outputs alone, independently of the supervisor.
    #[test]
    fn p18_nothing_is_output_before_self_test_encoders_and_arming(scenario in scenario()) {
        let mut bench = Bench::new();
        let (mut tested, mut sampled, mut armed) = (false, false, false);
        let mut mode = Mode::Boot;
        for happening in &scenario {
            let Inputs { encoder, command, .. } = happening.inputs;
            let outputs = bench.handle_event(happening);
            tested |= command == Some(Command::SelfTest);
            sampled |= tested && encoder.is_some();
            armed |= sampled && command == Some(Command::Arm) && mode == Mode::Ready;
            prop_assert!(is_zero(&outputs) || (tested && sampled && armed));
            if outputs.fault.is_some() && is_zero(&outputs) {
                (tested, sampled, armed) = (false, false, false);
            } else if outputs.mode == Mode::Ready {
                armed = false;
            }
            mode = outputs.mode;
        }
    }

    #[test]
    fn p26_limiting_is_always_reported(scenario in scenario()) {
        let mut bench = Bench::armed();
        for happening in &scenario {
            let outputs = bench.handle_event(happening);
            let settings = &bench.settings;
            let wanted = match outputs.mode {
                Mode::Armed => (
                    happening.drive_force_n * settings.force_gain,
                    happening.drive_torque_n_m * settings.torque_gain,
                ),
                _ => (0.0, 0.0),
            };
            let held = outputs.mode == Mode::Armed && happening.unresolved;
            let differs = held || (outputs.force_n, outputs.torque_n_m) != wanted;
            prop_assert_eq!(differs, !outputs.limited.is_empty(), "{:?}", outputs);
        }
    }

    #[test]
    fn p05_any_bits_in_any_word_of_memory_give_finite_limited_outputs(
        scenario in scenario(),
        at in any::<prop::sample::Index>(),
        word in any::<prop::sample::Index>(),
        bits in prop_oneof![
            Just(f32::NAN.to_bits()),
            Just(f32::INFINITY.to_bits()),
            Just(f32::NEG_INFINITY.to_bits()),
            any::<u32>(),
        ],
        guidewire: bool,
        tendons in 0usize..=4,
    ) {
        let mut bench = Bench::armed();
        bench.fake.guidewire = guidewire;
        bench.fake.tendons = tendons;
        let at = at.index(scenario.len());
        for (tick, happening) in scenario.iter().enumerate() {
            if tick == at {
                let mut count = 0;
                bench.memory.visit_memory(&mut |_| count += 1);
                let hit = word.index(count);
                let mut k = 0;
                bench.memory.visit_memory(&mut |word| {
                    if k == hit {
                        word.set_bits(bits);
                    }
                    k += 1;
                });
            }
            let outputs = bench.handle_event(happening);
            prop_assert!(all_finite(&outputs));
            prop_assert!(outputs.force_n.abs() <= bench.settings.force_limit_n);
            prop_assert!(outputs.torque_n_m.abs() <= bench.settings.torque_limit_n_m);
        }
    }

    #[test]
    fn p05_any_settings_give_finite_hard_limited_outputs(
        scenario in scenario(),
        values in prop::collection::vec(any_f32(), SETTING_COUNT),
        kept in any::<u32>(),
        guidewire: bool,
        tendons in 0usize..=4,
    ) {
        // Some settings corrupt, the others as they are, while armed.
        let mut bench = Bench::armed();
        bench.fake.guidewire = guidewire;
        bench.fake.tendons = tendons;
        bench.settings.corrupt(|index, value| {
            if kept >> index & 1 == 1 { value } else { values[index] }
        });
        for happening in &scenario {
            let outputs = bench.handle_event(happening);
            prop_assert!(all_finite(&outputs));
            prop_assert!(outputs.force_n.abs() <= FORCE_HARD_N);
            prop_assert!(outputs.torque_n_m.abs() <= TORQUE_HARD_N_M);
        }
    }
}

const SETTING_COUNT: usize = crate::SETTINGS.len();

/// Checks that the scenarios above do arm from boot.
#[test]
fn scenarios_do_arm() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let [mut armed, mut silenced] = [0; 2];
    for _ in 0..100 {
        let (scenario, silent) = falling_silent().new_tree(&mut runner).unwrap().current();
        let mut bench = Bench::new();
        let output = scenario.iter().any(|h| bench.handle_event(h).force_n != 0.0);
        armed += u32::from(output);
        let mut bench = Bench::armed();
        let before = scenario[..silent].iter().map(|h| bench.handle_event(h).mode).last();
        let lasts = silent + 5 < scenario.len();
        silenced += u32::from(lasts && before.is_none_or(|mode| mode == Mode::Armed));
    }
    assert!(armed >= 20, "{armed} of 100 scenarios gave any output");
    assert!(silenced >= 20, "{silenced} of 100 were armed when the encoder fell silent");
}
