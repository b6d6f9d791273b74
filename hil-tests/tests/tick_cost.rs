//! P09, P14: what a tick of the model costs on the board, counted; `docs/model.md` "Schedule"
//! says what makes it up. Run with `--nocapture`, this prints the figures.

use cathforce_hil_tests::{Bench, Drive, bundle, encoder, image_with};
use cathforce_link::qemu::Qemu;
use cathforce_mechanics::State;
use cathforce_rig::{ImageOptions, SolverDefaults};

/// The deepest of the example's trials.
const TRIAL: u32 = 2;
/// Links that its deepest insertion takes, so that all 64 are in well before.
const LINKS: f64 = 63.5;
/// Single ticks counted around it.
const TICKS: u16 = 60;
/// Advance and rotation of one of them: the last link stays in.
const FEED_M: f64 = 1e-5;
const TURN_RAD: f64 = 2e-3;

/// Instructions of the worst tick: 2 % above what was reached, and what was aimed at.
const MOST_INSTRUCTIONS_ONE_SOLVE: u32 = 139_000;
const MOST_INSTRUCTIONS_TWO_SOLVES: u32 = 220_000;
/// A tick with that many links cannot be cheaper: a counter that stands still is no pass.
const LEAST_INSTRUCTIONS: u32 = 50_000;
/// Largest deviation from the mean, over it.
const MOST_JITTER: f64 = 0.03;
const MOST_STATE_BYTES: usize = 40_000;
const MOST_TICK_STACK_BYTES: u32 = 4096;

/// The state as the device lays it out. This computer packs vectors of `f32` into registers of
/// four, but not those of the twin, whose numbers and counts are all twice as long.
fn device_state_bytes() -> usize {
    size_of::<State<f64>>() / 2
}

/// Instructions of single ticks with all links in the vessel, and the deepest of their stacks.
fn single_ticks(solves: u8) -> (Vec<u32>, u32) {
    let trial = bundle().trial(TRIAL).expect("in the example");
    let deepest_m = trial.catheter().expect("a catheter's").insertion_m.iter();
    let deepest_m = deepest_m.copied().fold(0.0, f64::max);
    let image = image_with(&ImageOptions {
        link_length_m: Some(deepest_m / LINKS),
        solver: SolverDefaults { solves, ..SolverDefaults::default() },
        ..ImageOptions::default()
    });
    let at = |tick: u16| Drive {
        insertion_m: deepest_m - FEED_M * f64::from(TICKS - tick),
        rotation_rad: TURN_RAD * f64::from(tick),
    };
    let mut bench = Bench::<Qemu>::armed(&image, at(0));
    let mut most_stack = 0;
    let counts = (1..=TICKS).map(|tick| {
        bench.reset_counters();
        bench.play([vec![encoder(at(tick))]]);
        let load = bench.report().load;
        most_stack = load.tick_stack_bytes.max(most_stack);
        load.worst_instructions
    });
    (counts.collect(), most_stack)
}

/// Worst count, checked against `most`; jitter and stack are checked too.
fn assert_cost(solves: u8, most: u32) {
    let (counts, stack_bytes) = single_ticks(solves);
    let worst = counts.iter().copied().max().unwrap_or(0);
    let mean = counts.iter().copied().map(f64::from).sum::<f64>() / counts.len() as f64;
    let deviation = counts.iter().map(|&count| (f64::from(count) / mean - 1.0).abs());
    let jitter = deviation.fold(0.0, f64::max);
    println!(
        "{solves} solves: worst tick {worst} instructions, jitter {:.2} %, tick stack \
         {stack_bytes} bytes, state {} bytes",
        100.0 * jitter,
        device_state_bytes()
    );
    assert!((LEAST_INSTRUCTIONS..=most).contains(&worst), "{worst} instructions, not {most}");
    assert!(jitter <= MOST_JITTER, "{counts:?}");
    assert!((1..=MOST_TICK_STACK_BYTES).contains(&stack_bytes), "{stack_bytes} bytes of stack");
}

#[test]
fn p09_p14_a_tick_with_one_solve_costs_what_is_stated_on_the_board() {
    assert_cost(1, MOST_INSTRUCTIONS_ONE_SOLVE);
}

#[test]
fn p09_p14_a_tick_with_two_solves_costs_what_is_stated_on_the_board() {
    assert_cost(2, MOST_INSTRUCTIONS_TWO_SOLVES);
}

#[test]
fn the_model_s_state_fits_into_what_is_stated() {
    assert!(device_state_bytes() <= MOST_STATE_BYTES, "{} bytes", device_state_bytes());
}
