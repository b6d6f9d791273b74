//! P18: nothing is output before self-test, fresh encoders and explicit arming.

use cathforce_bus::{Command, Process};
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::{Bench, Chance, Drive, OutputReader, Rig, Tick, encoder, strong_image};
use cathforce_link::Sim;
use cathforce_link::qemu::Qemu;

/// A short insertion, so that settling ends soon.
const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };

/// A host that acts in random order, often enough in the right one.
struct Confused {
    chance: Chance,
    at: Drive,
    silent_for: u64,
}

impl Confused {
    fn next(&mut self) -> Vec<Process> {
        let chance = &mut self.chance;
        let mut sent = Vec::new();
        if self.silent_for > 0 {
            self.silent_for -= 1;
        } else {
            self.at.insertion_m += 10e-6;
            sent.push(encoder(self.at));
            self.silent_for = if chance.once_in(900) { 1 + chance.below(40) } else { 0 };
        }
        let command = match chance.below(400) {
            0..60 => Some(Command::SelfTest),
            60..70 => Some(Command::Arm),
            70 => Some(Command::Disarm),
            71..80 => {
                let fault = chance.pick(Fault::ALL);
                Some(Command::ClearFault { token: fault.clear_token() })
            }
            80 => Some(Command::ClearFault { token: chance.bits() as u32 }),
            _ => None,
        };
        sent.extend(command.map(Process::Command));
        sent
    }
}

/// Boots and plays the random host without and with an image. Returns the number of ticks in each mode, and
/// the number of ticks with output.
fn boot_and_confuse<R: Rig>(seed: u64, ticks: usize) -> ([usize; 8], usize) {
    let mut host = Confused { chance: Chance::new(seed), at: START, silent_for: 0 };
    let mut reader = OutputReader::default();
    let mut bench = Bench::<R>::booted();
    let (mut modes, mut output) = ([0; 8], 0);
    let mut play = |bench: &mut Bench<R>, ticks| {
        let steps: Vec<_> = (0..ticks).map(|_| host.next()).collect();
        let seen: Vec<Tick> = bench.play(steps.iter().cloned());
        for (sent, tick) in steps.iter().zip(&seen) {
            reader.check(sent, tick);
            modes[usize::from(tick.haptic.mode)] += 1;
            output += usize::from(!tick.is_silent());
        }
        seen
    };
    let unconfigured = play(&mut bench, 100);
    assert!(unconfigured.iter().all(|tick| tick.mode().is_none()));
    bench.upload(strong_image()).expect("nothing is armed");
    assert_eq!(play(&mut bench, 1).len(), 1);
    play(&mut bench, ticks);
    (modes, output)
}

#[test]
fn p18_at_boot_nothing_is_output_before_it_may_be_on_the_board() {
    let (modes, output) = boot_and_confuse::<Qemu>(3, 4000);
    assert!(output > 100, "{output} ticks with output, modes {modes:?}");
}

#[test]
fn p18_at_boot_nothing_is_output_before_it_may_be_in_many_orders() {
    let mut all = [0; 8];
    let mut output = 0;
    for seed in 0..12 {
        let (modes, with_output) = boot_and_confuse::<Sim>(seed, 4000);
        all.iter_mut().zip(modes).for_each(|(sum, n)| *sum += n);
        output += with_output;
    }
    assert!(output > 1000 && all.iter().all(|&n| n > 0), "{output}, {all:?}");
}

/// The same step by step, on the board.
#[test]
fn p18_arming_needs_each_step_on_the_board() {
    let mut bench = Bench::<Qemu>::configured(strong_image());
    let mode = |ticks: Vec<Tick>| ticks.last().and_then(Tick::mode);
    let command = |command| vec![Process::Command(command), encoder(START)];
    assert_eq!(mode(bench.play([command(Command::Arm)])), Some(Mode::Boot));
    assert_eq!(mode(bench.play([vec![Process::Command(Command::SelfTest)]])), Some(Mode::Idle));
    assert_eq!(mode(bench.play([vec![Process::Command(Command::Arm)]])), Some(Mode::Idle));
    assert_eq!(mode(bench.play([command(Command::Arm)])), Some(Mode::Settling));
    let settling =
        (0..100).map(|_| mode(bench.play(std::iter::repeat_n(vec![encoder(START)], 50))));
    assert!({ settling }.any(|mode| mode == Some(Mode::Ready)), "never ready");
    // A ready device stays disarmed for any time.
    let ready = bench.play(std::iter::repeat_n(vec![encoder(START)], 50));
    assert!(ready.iter().all(|tick| tick.is_silent() && tick.mode() == Some(Mode::Ready)));
    assert_eq!(mode(bench.play([command(Command::Arm)])), Some(Mode::Armed));
}
