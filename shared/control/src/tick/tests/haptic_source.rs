//! The haptic source: whose load the operator feels.

use super::*;
use crate::{Grip, GuidewireSample};
use proptest::prelude::*;

/// Both drives where the bench is, with the guidewire's button held or not.
fn inputs(bench: &Bench, held: bool) -> Inputs {
    let guidewire = Some(GuidewireSample { at: bench.at, held });
    Inputs { encoder: Some(bench.at), guidewire, ..Inputs::default() }
}

/// Armed with a guidewire: 1 N on the catheter's drive, −0.5 N on the wire's.
fn armed() -> Bench {
    let mut bench = Bench::new();
    bench.fake.guidewire = true;
    bench.fake.answer.guidewire_force_n = -0.5;
    bench.fake.answer.guidewire_torque_n_m = -0.004;
    bench.command(Command::SelfTest);
    for _ in 0..4 {
        bench.tick(inputs(&bench, false));
    }
    bench.tick(Inputs { command: Some(Command::Arm), ..inputs(&bench, false) });
    for _ in 0..30 {
        bench.tick(inputs(&bench, false));
    }
    let outputs = bench.tick(inputs(&bench, false));
    assert_eq!((outputs.mode, outputs.haptic_source), (Mode::Armed, HapticSource::Catheter));
    assert_eq!((outputs.force_n, outputs.torque_n_m), (1.0, 0.01));
    bench
}

#[test]
fn p02_from_one_load_to_the_other_the_output_slews() {
    let mut bench = armed();
    let step_n = bench.settings.force_slew_n_per_s * TICK_S;
    let step_n_m = bench.settings.torque_slew_n_m_per_s * TICK_S;
    let mut last = (1.0, 0.01);
    for held in [true, false] {
        for tick in 0..30 {
            let outputs = bench.tick(inputs(&bench, held));
            assert!((outputs.force_n - last.0).abs() <= step_n, "tick {tick}: {outputs:?}");
            assert!((outputs.torque_n_m - last.1).abs() <= step_n_m, "tick {tick}: {outputs:?}");
            assert!(tick > 0 || outputs.limited.contains(LimitFlags::FORCE_SLEW));
            last = (outputs.force_n, outputs.torque_n_m);
        }
        assert_eq!(last, if held { (-0.5, -0.004) } else { (1.0, 0.01) });
    }
}

#[test]
fn the_button_stays_as_it_was_while_its_frame_is_missing() {
    let mut bench = armed();
    for _ in 0..30 {
        bench.tick(inputs(&bench, true));
    }
    for _ in 1..bench.settings.encoder_timeout_ticks {
        let outputs = bench.sample();
        assert_eq!((outputs.haptic_source, outputs.force_n), (HapticSource::Guidewire, -0.5));
    }
    assert_eq!(bench.tick(inputs(&bench, false)).haptic_source, HapticSource::Catheter);
}

#[test]
fn p02_p26_a_handle_that_is_let_go_slews_to_zero_and_says_so_and_back() {
    let mut bench = armed();
    let step_n = bench.settings.force_slew_n_per_s * TICK_S;
    let mut last_n = 1.0;
    for (released, end_n) in [(true, 0.0), (false, 1.0)] {
        for tick in 0..30 {
            // Said once; afterwards it is as it was.
            let grip = Grip { handle_released: released, ..Grip::default() };
            let said = (tick == 0).then_some(grip);
            let outputs = bench.tick(Inputs { grip: said, ..inputs(&bench, false) });
            assert_eq!(outputs.mode, Mode::Armed);
            assert_eq!(outputs.limited.contains(LimitFlags::RELEASED), released);
            assert!((outputs.force_n - last_n).abs() <= step_n, "tick {tick}: {outputs:?}");
            last_n = outputs.force_n;
        }
        assert_eq!(last_n, end_n);
    }
}

#[test]
fn without_a_guidewire_there_is_nothing_to_choose() {
    let mut bench = Bench::armed();
    bench.fake.answer.guidewire_force_n = -0.5;
    for _ in 0..30 {
        let outputs = bench.tick(inputs(&bench, true));
        assert_eq!((outputs.haptic_source, outputs.force_n), (HapticSource::Catheter, 1.0));
    }
}

/// The last trusted load of the guidewire is held, and not the catheter's.
#[test]
fn in_an_unresolved_tick_the_held_load_is_that_of_what_is_felt() {
    let mut bench = armed();
    bench.fake.answer.unresolved = true;
    bench.fake.answer.guidewire_force_n = 70.0;
    let mut outputs = bench.tick(inputs(&bench, true));
    for _ in 0..30 {
        outputs = bench.tick(inputs(&bench, true));
    }
    assert_eq!((outputs.force_n, outputs.mode), (-0.5, Mode::Armed));
    assert!(outputs.limited.contains(LimitFlags::HELD));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// P08: the operator's axis moves with the drive that is felt, whatever the other one does. However often
    /// the button changes, and with samples missing, each axis delivers no more energy than its budget.
    #[test]
    fn p08_changing_the_drive_gives_out_no_more_energy(
        strokes in prop::collection::vec((any::<bool>(), 0u8..3, 0.0f32..1.0), 100..250),
        loads in prop::collection::vec(-3.0f32..3.0, 1..8),
    ) {
        let mut bench = armed();
        bench.settings.energy_limit_j = 0.004;
        let budget_j = 0.002f64;
        // A new account.
        bench.command_both(Command::Disarm);
        while bench.tick(inputs(&bench, false)).mode != Mode::Ready {}
        bench.command_both(Command::Arm);
        let fastest_m = bench.settings.max_insertion_speed_m_per_s * TICK_S;
        let (mut catheter, mut wire) = (bench.at, bench.at);
        let (mut held, mut energy_j, mut force_n) = (false, 0.0f64, 0.0f32);
        for (n, (change, missing, share)) in strokes.into_iter().enumerate() {
            let load = loads[n % loads.len()];
            bench.fake.answer.drive_force_n = load;
            bench.fake.answer.guidewire_force_n = -load;
            // The operator yields to the rendered force, and the other drive does the opposite. The speed is
            // constant while samples are missing.
            let forwards = if force_n < 0.0 { 1.0 } else { -1.0 };
            let a_tick_m = forwards * share * 0.99 * fastest_m;
            for k in 0..=missing {
                let (felt, other) =
                    if held { (&mut wire, &mut catheter) } else { (&mut catheter, &mut wire) };
                felt.insertion_m += a_tick_m;
                other.insertion_m -= a_tick_m;
                energy_j += f64::from(force_n) * f64::from(a_tick_m);
                prop_assert!(energy_j >= -budget_j - 1e-6, "{energy_j} J in stroke {n}");
                let outputs = if k < missing {
                    bench.silence()
                } else {
                    // The catheter's motion may be unknown when its button is released.
                    let unheard = change && !held && missing == 1;
                    let encoder = (!unheard).then_some(catheter);
                    held ^= change;
                    let guidewire = Some(GuidewireSample { at: wire, held });
                    bench.tick(Inputs { encoder, guidewire, ..Inputs::default() })
                };
                prop_assert_eq!(outputs.mode, Mode::Armed);
                force_n = outputs.force_n;
            }
        }
    }
}

impl Bench {
    fn command_both(&mut self, command: Command) -> Outputs {
        self.tick(Inputs { command: Some(command), ..inputs(self, false) })
    }
}
