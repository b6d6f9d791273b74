//! Promises of the tick, over an estimator whose answers the tests choose.

use super::*;
use crate::Notice;
use crate::TICK_S;

mod haptic_source;
mod scenarios;

/// An estimator that answers as it is told.
#[derive(Clone)]
struct Fake {
    answer: mechanics::Outputs<f32>,
    settle_calls: u32,
    settle_after: u32,
    rebuilt: u32,
    node: [f32; 6],
    guidewire: bool,
    tendons: usize,
    /// What the last step was told of the tendons.
    tendons_m: [f32; 4],
}

fn assert_finite(drives: &mechanics::Drives<f32>) {
    for drive in [drives.catheter, drives.guidewire] {
        assert!(drive.insertion_m.is_finite() && drive.rotation_rad.is_finite());
    }
    assert!(drives.tendons_m.iter().all(|x| x.is_finite()));
}

impl Fake {
    fn new() -> Self {
        let answer =
            mechanics::Outputs { drive_force_n: 1.0, drive_torque_n_m: 0.01, ..Default::default() };
        Self {
            answer,
            settle_calls: 0,
            settle_after: 3,
            rebuilt: 0,
            node: [0.0; 6],
            guidewire: false,
            tendons: 0,
            tendons_m: [0.0; 4],
        }
    }
}

impl Estimator for Fake {
    fn tick_s(&self) -> f32 {
        TICK_S
    }
    fn reach_m(&self) -> f32 {
        0.5
    }
    fn has_guidewire(&self) -> bool {
        self.guidewire
    }
    fn tendons(&self) -> usize {
        self.tendons
    }
    fn step(&mut self, drives: mechanics::Drives<f32>) -> mechanics::Outputs<f32> {
        assert_finite(&drives);
        self.tendons_m = drives.tendons_m;
        self.answer
    }
    fn settle(&mut self, drives: mechanics::Drives<f32>) -> bool {
        assert_finite(&drives);
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
fn with_a_guidewire_both_drives_must_be_heard() {
    let mut bench = Bench::new();
    bench.fake.guidewire = true;
    bench.command(Command::SelfTest);
    for _ in 0..10 {
        assert_eq!(bench.sample().mode, Mode::Idle, "settling without the guidewire");
    }
    let guidewire = Some(crate::GuidewireSample { at: bench.at, held: false });
    let both = Inputs { encoder: Some(bench.at), guidewire, ..Inputs::default() };
    for _ in 0..4 {
        bench.tick(both);
    }
    assert_eq!(bench.memory.mode, Mode::Ready);
    bench.tick(Inputs { command: Some(Command::Arm), ..both });
    for _ in 0..30 {
        bench.tick(both);
    }
    assert_eq!(bench.tick(both).mode, Mode::Armed);
    let timeout = bench.settings.encoder_timeout_ticks;
    for age in 1..timeout {
        let outputs = bench.sample();
        assert_eq!((outputs.mode, outputs.encoder_age_ticks), (Mode::Armed, 0));
        assert_eq!(u16::from(outputs.guidewire_age_ticks), age);
    }
    let lost = bench.sample();
    assert_eq!(lost.mode, Mode::Ramp { cause: RampCause::Fault(Fault::EncoderLost) });
}

#[test]
fn with_tendons_every_pair_of_them_must_be_heard() {
    let mut bench = Bench::new();
    bench.fake.tendons = 3;
    bench.command(Command::SelfTest);
    let pair = |first_m, second_m| Some(TendonPair { displacements_m: [first_m, second_m] });
    let of =
        |bench: &Bench, tendons| Inputs { encoder: Some(bench.at), tendons, ..Inputs::default() };
    for _ in 0..10 {
        let first_alone = of(&bench, [pair(1e-3, -2e-3), None]);
        assert_eq!(bench.tick(first_alone).mode, Mode::Idle, "settling without the third tendon");
    }
    let all = of(&bench, [pair(1e-3, -2e-3), pair(3e-3, 0.0)]);
    for _ in 0..4 {
        bench.tick(all);
    }
    assert_eq!(bench.memory.mode, Mode::Ready);
    assert_eq!(bench.fake.tendons_m, [1e-3, -2e-3, 3e-3, 0.0]);
    bench.tick(Inputs { command: Some(Command::Arm), ..all });
    for _ in 0..30 {
        bench.tick(all);
    }
    assert_eq!(bench.tick(all).mode, Mode::Armed);
    let mut jumping = bench.clone();
    for _ in 1..bench.settings.encoder_timeout_ticks {
        let second_alone = of(&bench, [None, pair(3e-3, 0.0)]);
        assert_eq!(bench.tick(second_alone).mode, Mode::Armed);
    }
    let lost = bench.sample();
    assert_eq!(lost.mode, Mode::Ramp { cause: RampCause::Fault(Fault::TendonLost) });

    let jump = of(&jumping, [pair(0.04, -2e-3), pair(3e-3, 0.0)]);
    for _ in 0..2 {
        assert_eq!(jumping.tick(jump).mode, Mode::Armed);
        // What is refused is not believed.
        assert_eq!(jumping.fake.tendons_m[0], 1e-3);
    }
    let jumped = jumping.tick(jump).mode;
    assert_eq!(jumped, Mode::Ramp { cause: RampCause::Fault(Fault::TendonJump) });
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
    for (nan_in_node, nan_in_output, lost) in
        [(true, false, false), (false, true, false), (false, false, true)]
    {
        let mut bench = Bench::armed();
        bench.fake.answer.lost = lost;
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
fn arming_waits_for_a_tick_that_the_model_resolved() {
    let mut bench = Bench::armed();
    bench.command(Command::Disarm);
    while bench.sample().mode != Mode::Ready {}
    bench.fake.answer.unresolved = true;
    bench.sample();
    assert_eq!(bench.command(Command::Arm).mode, Mode::Ready);
    bench.fake.answer.unresolved = false;
    bench.sample();
    assert_eq!(bench.command(Command::Arm).mode, Mode::Armed);
}

#[test]
fn p08_an_axis_that_gives_out_its_energy_fades_and_says_so() {
    let mut bench = Bench::armed();
    bench.settings.energy_limit_j = 0.02;
    // For each axis: half.
    let budget_j = 0.01;
    for _ in 0..2 {
        let (mut given_out_j, mut said) = (0.0, false);
        // The instrument pushes its operator all the way back.
        for _ in 0..600 {
            let outputs = bench.sample();
            assert_eq!(outputs.mode, Mode::Armed);
            said |= outputs.limited.contains(LimitFlags::ENERGY);
            given_out_j += outputs.force_n * 1e-4;
            bench.at.insertion_m -= 1e-4;
        }
        assert!(said && given_out_j <= budget_j && given_out_j > 0.5 * budget_j, "{given_out_j}");

        // Arming is explicit, and starts a new account.
        bench.command(Command::Disarm);
        while bench.sample().mode != Mode::Ready {}
        bench.at.insertion_m = 0.1;
        bench.fake.settle_calls = 0;
        for _ in 0..10 {
            bench.sample();
        }
        bench.command(Command::Arm);
        for _ in 0..30 {
            bench.sample();
        }
    }
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
    assert_eq!(x.digest_words(), y.digest_words());
    assert_ne!(x.digest, y.digest);
    b.fake.node[5] = 0.0;
    assert_ne!(a.sample().digest, b.sample().digest);
}
