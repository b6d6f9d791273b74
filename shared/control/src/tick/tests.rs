//! Promises of the tick, over an estimator whose answers the tests choose.

extern crate std;

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::{FORCE_HARD_N, Reaction, TICK_S, TORQUE_HARD_N_M};

/// An estimator that answers as it is told.
#[derive(Clone)]
struct Fake {
    answer: mechanics::Outputs<f32>,
    settle_calls: u32,
    settle_after: u32,
    rebuilt: u32,
    node: [f32; 6],
}

impl Fake {
    fn new() -> Self {
        let answer =
            mechanics::Outputs { drive_force_n: 1.0, drive_torque_n_m: 0.01, ..Default::default() };
        Self { answer, settle_calls: 0, settle_after: 3, rebuilt: 0, node: [0.0; 6] }
    }
}

impl Estimator for Fake {
    fn tick_s(&self) -> f32 {
        TICK_S
    }
    fn reach_m(&self) -> f32 {
        0.5
    }
    fn step(&mut self, drive: mechanics::Drive<f32>) -> mechanics::Outputs<f32> {
        assert!(drive.insertion_m.is_finite() && drive.rotation_rad.is_finite());
        self.answer
    }
    fn settle(&mut self, drive: mechanics::Drive<f32>) -> bool {
        assert!(drive.insertion_m.is_finite() && drive.rotation_rad.is_finite());
        self.settle_calls += 1;
        self.settle_calls >= self.settle_after
    }
    fn rebuild(&mut self) {
        self.rebuilt += 1;
        self.settle_calls = 0;
        self.node = [0.0; 6];
    }
    fn nodes(&self) -> impl Iterator<Item = [f32; 6]> {
        [self.node].into_iter()
    }
}

/// A device under test.
#[derive(Clone)]
struct Bench {
    settings: Settings,
    memory: Memory,
    fake: Fake,
    at: EncoderSample,
}

fn is_zero(outputs: &Outputs) -> bool {
    outputs.force_n == 0.0 && outputs.torque_n_m == 0.0
}

impl Bench {
    fn new() -> Self {
        Self {
            settings: Settings::default(),
            memory: Memory::new(),
            fake: Fake::new(),
            at: EncoderSample { insertion_m: 0.1, rotation_rad: 0.2 },
        }
    }

    /// Armed, with the output where the model wants it.
    fn armed() -> Self {
        let mut bench = Self::new();
        bench.command(Command::SelfTest);
        assert_eq!(bench.memory.mode, Mode::Idle);
        for _ in 0..4 {
            bench.sample();
        }
        assert_eq!(bench.memory.mode, Mode::Ready);
        bench.command(Command::Arm);
        for _ in 0..30 {
            bench.sample();
        }
        let outputs = bench.sample();
        assert_eq!((outputs.mode, outputs.force_n), (Mode::Armed, 1.0));
        bench
    }

    fn tick(&mut self, inputs: Inputs) -> Outputs {
        self.memory.tick(&self.settings, &mut self.fake, &inputs)
    }

    fn sample(&mut self) -> Outputs {
        self.tick(Inputs { encoder: Some(self.at), ..Inputs::default() })
    }

    fn silence(&mut self) -> Outputs {
        self.tick(Inputs::default())
    }

    fn command(&mut self, command: Command) -> Outputs {
        self.tick(Inputs {
            encoder: (command != Command::SelfTest).then_some(self.at),
            command: Some(command),
            ..Inputs::default()
        })
    }
}

#[test]
fn p01_encoder_silence_ramps_at_5_ms_to_zero_by_25_ms() {
    // The phase changes where rounding and the settings' own motion stand.
    for phase in 0..1000 {
        let mut bench = Bench::armed();
        for k in 0..phase % 50 {
            bench.at.insertion_m += 9e-5 * (k % 3) as f32;
            bench.fake.answer.drive_force_n = 0.01 * phase as f32;
            bench.sample();
        }
        for silent in 1..=25 {
            let outputs = bench.silence();
            if silent < 5 {
                assert_eq!(outputs.mode, Mode::Armed);
            } else {
                assert_eq!(outputs.fault, Some(Fault::EncoderLost), "phase {phase}");
            }
            if silent == 25 {
                assert!(is_zero(&outputs), "phase {phase}: {outputs:?}");
                assert_eq!(outputs.mode, Mode::Fault { cause: Fault::EncoderLost });
            }
        }
    }
}

#[test]
fn a_gap_shorter_than_the_timeout_changes_nothing() {
    let mut bench = Bench::armed();
    for _ in 0..4 {
        assert_eq!(bench.silence().force_n, 1.0);
    }
    assert_eq!(bench.sample().mode, Mode::Armed);
}

#[test]
fn p04_more_than_3_bad_frames_in_10_ramp() {
    let bad = |bench: &mut Bench| {
        let encoder = Some(bench.at);
        bench.tick(Inputs { encoder, rejected_frames: 1, ..Inputs::default() })
    };
    let mut bench = Bench::armed();
    for _ in 0..3 {
        assert_eq!(bad(&mut bench).mode, Mode::Armed);
    }
    assert_eq!(bad(&mut bench).fault, Some(Fault::BadFrames));

    let mut bench = Bench::armed();
    for _ in 0..20 {
        // One bad among four good ones is a bad bus, but no fault.
        assert_eq!(bad(&mut bench).mode, Mode::Armed);
        for _ in 0..3 {
            assert_eq!(bench.sample().mode, Mode::Armed);
        }
    }
}

#[test]
fn p07_three_jumps_ramp_and_none_is_believed() {
    let mut bench = Bench::armed();
    let far = EncoderSample { insertion_m: bench.at.insertion_m + 0.002, ..bench.at };
    let jump = Inputs { encoder: Some(far), ..Inputs::default() };
    for k in 1..=2 {
        let outputs = bench.tick(jump);
        assert_eq!((outputs.mode, outputs.encoder_age_ticks), (Mode::Armed, k));
    }
    assert_eq!(bench.tick(jump).fault, Some(Fault::EncoderJump));

    let mut bench = Bench::armed();
    let nan = EncoderSample { rotation_rad: f32::NAN, ..bench.at };
    let jump = Inputs { encoder: Some(nan), ..Inputs::default() };
    bench.tick(jump);
    bench.tick(jump);
    assert_eq!(bench.tick(jump).fault, Some(Fault::EncoderJump));
}

#[test]
fn p07_motion_within_the_speed_limit_is_believed_after_a_gap() {
    let mut bench = Bench::armed();
    for _ in 0..3 {
        bench.silence();
    }
    bench.at.insertion_m += 3.9 * bench.settings.max_insertion_speed_m_per_s * TICK_S;
    assert_eq!(bench.sample().encoder_age_ticks, 0);
}

#[test]
fn p06_a_model_that_is_not_finite_is_cut_and_rebuilt() {
    for (nan_in_node, nan_in_output) in [(true, false), (false, true)] {
        let mut bench = Bench::armed();
        if nan_in_node {
            bench.fake.node[4] = f32::INFINITY;
        }
        if nan_in_output {
            bench.fake.answer.moment_on_vessel_n_m[1] = f32::NAN;
        }
        let outputs = bench.sample();
        assert_eq!(outputs.mode, Mode::Fault { cause: Fault::ModelNotFinite });
        assert!(is_zero(&outputs));
        assert_eq!(outputs.contact, mechanics::Outputs::default());
        assert_eq!(bench.fake.rebuilt, 1);

        // Cleared, it settles again from the empty guide before it can be armed.
        bench.fake.answer = Fake::new().answer;
        let token = Fault::ModelNotFinite.clear_token();
        assert_eq!(bench.command(Command::ClearFault { token }).mode, Mode::Boot);
        bench.command(Command::SelfTest);
        assert_eq!(bench.sample().mode, Mode::Settling);
        assert_eq!(bench.command(Command::Arm).mode, Mode::Settling);
        assert_eq!(bench.sample().mode, Mode::Ready);
    }
}

#[test]
fn p06_a_model_unresolved_for_too_long_is_cut_and_rebuilt() {
    let mut bench = Bench::armed();
    bench.fake.answer.unresolved = true;
    bench.fake.answer.drive_force_n = 500.0;
    for _ in 0..bench.settings.unresolved_limit_ticks {
        let outputs = bench.sample();
        assert_eq!((outputs.mode, outputs.force_n), (Mode::Armed, 1.0));
        assert_eq!(outputs.limited, LimitFlags::HELD);
    }
    let outputs = bench.sample();
    assert_eq!(outputs.mode, Mode::Fault { cause: Fault::ModelUnresolved });
    assert!(is_zero(&outputs) && bench.fake.rebuilt == 1);
}

#[test]
fn a_model_that_never_settles_is_a_fault() {
    let mut bench = Bench::new();
    bench.fake.settle_after = u32::MAX;
    bench.command(Command::SelfTest);
    for _ in 0..bench.settings.settle_timeout_ticks {
        assert_eq!(bench.sample().mode, Mode::Settling);
    }
    assert_eq!(bench.sample().fault, Some(Fault::SettleTimeout));
}

#[test]
fn faults_latch_until_cleared_by_name() {
    let mut bench = Bench::armed();
    let notice = Some(Notice::Overrun);
    let outputs = bench.tick(Inputs { notice, ..Inputs::default() });
    assert!(is_zero(&outputs));
    let latched = Mode::Fault { cause: Fault::Overrun };
    assert_eq!(outputs.mode, latched);
    for command in [Command::SelfTest, Command::Arm, Command::Disarm] {
        assert_eq!(bench.command(command).mode, latched);
    }
    for token in [0, u32::MAX, Fault::EncoderLost.clear_token()] {
        assert_eq!(bench.command(Command::ClearFault { token }).mode, latched);
    }
    let token = Fault::Overrun.clear_token();
    assert_eq!(bench.command(Command::ClearFault { token }).mode, Mode::Boot);
}

#[test]
fn a_fault_cannot_be_cleared_in_the_tick_that_raises_it() {
    let mut bench = Bench::armed();
    let outputs = bench.tick(Inputs {
        encoder: Some(bench.at),
        command: Some(Command::ClearFault { token: Fault::Overrun.clear_token() }),
        notice: Some(Notice::Overrun),
        ..Inputs::default()
    });
    assert_eq!(outputs.mode, Mode::Fault { cause: Fault::Overrun });
}

#[test]
fn disarming_ramps_and_leaves_the_model_tracking() {
    let mut bench = Bench::armed();
    let mut last = bench.command(Command::Disarm);
    assert_eq!(last.mode, Mode::Ramp { cause: RampCause::Disarm });
    let mut ticks = 1;
    while last.mode != Mode::Ready {
        assert!(last.limited.contains(LimitFlags::FORCE_SLEW));
        last = bench.sample();
        ticks += 1;
    }
    assert!(ticks <= bench.settings.ramp_time_ticks);
    assert!(is_zero(&last) && last.contact.drive_force_n == 1.0);
    bench.command(Command::Arm);
    assert!(bench.sample().force_n > 0.0);
}

#[test]
fn losing_encoders_before_arming_waits_for_them_again() {
    let mut bench = Bench::new();
    bench.command(Command::SelfTest);
    for _ in 0..4 {
        bench.sample();
    }
    for _ in 0..5 {
        bench.silence();
    }
    assert_eq!(bench.memory.mode, Mode::Idle);
    bench.fake.settle_calls = 0;
    assert_eq!(bench.command(Command::Arm).mode, Mode::Settling);
}

#[test]
fn a_failed_self_test_locks_arming() {
    let mut bench = Bench::new();
    bench.settings.force_slew_n_per_s = f32::NAN;
    assert_eq!(bench.command(Command::SelfTest).fault, Some(Fault::SelfTest));
    assert_eq!(bench.command(Command::Arm).fault, Some(Fault::SelfTest));
}

#[test]
fn a_full_record_of_outputs_gives_the_same_digest_only_if_equal() {
    let (mut a, mut b) = (Bench::armed(), Bench::armed());
    assert_eq!(a.sample().digest, b.sample().digest);
    b.fake.node[5] = f32::from_bits(1);
    let (x, y) = (a.sample(), b.sample());
    assert_eq!(x.words(), y.words());
    assert_ne!(x.digest, y.digest);
    b.fake.node[5] = 0.0;
    assert_ne!(a.sample().digest, b.sample().digest);
}

// Random scenarios: a device that is mostly treated well, so that it often is armed, by a
// hostile bus, model and memory.

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
    let inputs = (encoder(), rejected, command(), notice).prop_map(
        |(encoder, rejected_frames, command, notice)| Inputs {
            encoder,
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

impl Bench {
    fn happens(&mut self, happening: &Happening) -> Outputs {
        self.fake.answer.drive_force_n = happening.drive_force_n;
        self.fake.answer.drive_torque_n_m = happening.drive_torque_n_m;
        self.fake.answer.unresolved = happening.unresolved;
        self.tick(happening.inputs)
    }
}

/// CUT: the one change of the output that the slew limit does not bind.
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
    ) {
        let mut bench = if from_armed { Bench::armed() } else { Bench::new() };
        let s = bench.settings;
        let (mut force_n, mut torque_n_m) = (if from_armed { 1.0 } else { 0.0 }, 0.0);
        if from_armed {
            torque_n_m = bench.memory.torque.limiter.output();
        }
        for happening in &scenario {
            let outputs = bench.happens(happening);
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
    fn p01_armed_never_outlives_5_ms_of_silence(scenario in scenario()) {
        let mut bench = Bench::armed();
        for happening in &scenario {
            let outputs = bench.happens(happening);
            if outputs.encoder_age_ticks >= 5 {
                prop_assert!(outputs.mode != Mode::Armed);
            }
        }
    }

    /// Told from the frames alone, by a reader that knows nothing of the supervisor.
    #[test]
    fn p18_nothing_is_output_before_self_test_encoders_and_arming(scenario in scenario()) {
        let mut bench = Bench::new();
        let (mut tested, mut sampled, mut armed) = (false, false, false);
        let mut mode = Mode::Boot;
        for happening in &scenario {
            let Inputs { encoder, command, .. } = happening.inputs;
            let outputs = bench.happens(happening);
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
            let outputs = bench.happens(happening);
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
    ) {
        let mut bench = Bench::armed();
        let at = at.index(scenario.len());
        for (tick, happening) in scenario.iter().enumerate() {
            if tick == at {
                let mut count = 0;
                bench.memory.words(&mut |_| count += 1);
                let hit = word.index(count);
                let mut k = 0;
                bench.memory.words(&mut |word| {
                    if k == hit {
                        word.set_bits(bits);
                    }
                    k += 1;
                });
            }
            let outputs = bench.happens(happening);
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
    ) {
        // Some settings corrupt, the others as they are, while armed.
        let mut bench = Bench::armed();
        bench.settings.corrupt(|index, value| {
            if kept >> index & 1 == 1 { value } else { values[index] }
        });
        for happening in &scenario {
            let outputs = bench.happens(happening);
            prop_assert!(all_finite(&outputs));
            prop_assert!(outputs.force_n.abs() <= FORCE_HARD_N);
            prop_assert!(outputs.torque_n_m.abs() <= TORQUE_HARD_N_M);
        }
    }
}

const SETTING_COUNT: usize = crate::SETTINGS.len();

/// The scenarios above would show nothing if they never armed from boot.
#[test]
fn scenarios_do_arm() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let mut armed = 0;
    for _ in 0..100 {
        let scenario = scenario().new_tree(&mut runner).unwrap().current();
        let mut bench = Bench::new();
        let output = scenario.iter().any(|h| bench.happens(h).force_n != 0.0);
        armed += u32::from(output);
    }
    assert!(armed >= 20, "{armed} of 100 scenarios gave any output");
}
