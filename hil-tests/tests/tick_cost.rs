//! P09, P14: instructions of a tick on the board. With `--nocapture` the tests print the figures.
//!
//! Ticks with all links in the vessel are counted one by one. The ticks before are counted too, because the
//! shape settles while a run begins.

use cathforce_bundle::bundle::{Plant, RigDrivenTendon};
use cathforce_bundle::{ImageOptions, SolverDefaults, device_image, to_description};
use cathforce_bus::{Displacement, Process, Tendons};
use cathforce_config::image::most_links;
use cathforce_control::{BAND_ROWS, Band, BandRow};
use cathforce_effect_catalogue::{Parameter, all};
use cathforce_hil_tests::{Bench, Drive, bundle, encoder, image_with};
use cathforce_link::qemu::Qemu;
use cathforce_mechanics::{State, parameters};

/// The deepest of the example's trials.
const TRIAL: u32 = 2;
/// Share of the last link that the deepest insertion needs, so that all links are in use well before.
const LAST_LINK: f64 = 0.5;
/// Factor by which the example's wall becomes near-rigid, 16 N/mm².
const NEAR_RIGID: f32 = 20.0;
/// Resolved ticks before a band is stated.
const BAND_WAITS: u16 = 100;
/// Share of an effect's switch-on value. With 0.1, the sum of a viscous instrument, a relaxing and narrowed
/// wall and a stream makes half ticks at a near-rigid wall chatter, and the run ends in a fault.
const MILD: f64 = 0.08;
/// Single ticks counted around it.
const TICKS: u16 = 60;
/// Advance and rotation of one of them: the last link stays in.
const FEED_M: f64 = 1e-5;
const TURN_RAD: f64 = 2e-3;
/// The rotation of a tick at the greatest allowed speed.
const FASTEST_RAD: f64 = 0.0199;

/// Instructions of the worst tick: a little above the measured counts of 136 420 and 220 380, and half of a
/// tick's time. 0.4 % and 0.3 % of them are for indices that cannot panic, the watch over the tasks and the
/// heartbeat.
const MOST_INSTRUCTIONS_ONE_SOLVE: u32 = 137_000;
const MOST_INSTRUCTIONS_TWO_SOLVES: u32 = 221_000;
const MOST_INSTRUCTIONS_HALF_TICKS: u32 = 240_000;
/// Instructions that a band of the forces may add to the worst tick; the band is only looked up.
const MOST_INSTRUCTIONS_BAND: u32 = 200;
/// Least plausible count, so that a counter that stands still fails.
const LEAST_INSTRUCTIONS: u32 = 50_000;
/// Largest deviation from the mean, over it.
const MOST_JITTER: f64 = 0.03;
const MOST_STATE_BYTES: usize = 40_000;
const MOST_TICK_STACK_BYTES: u32 = 4096;

/// Size of the state on the device. This computer packs vectors of `f32` into registers of four, but not
/// those of the twin, whose numbers and counts are all twice as long.
fn device_state_bytes() -> usize {
    size_of::<State<f64>>() / 2
}

/// A band whose half widths change from row to row, so that all of its arithmetic is done.
fn band() -> Band {
    let row = |i: usize| -> BandRow { [1, 2, 3, 4].map(|channel| 100 * channel + i as u16) };
    let rows = std::array::from_fn::<_, BAND_ROWS, _>(row);
    Band { from_m: 0.0, step_m: 0.01, feed: rows, withdrawal: rows }
}

/// Cost of single ticks with all links in the vessel.
struct Cost {
    instructions: Vec<u32>,
    /// The worst tick before the device was armed.
    beginning: u32,
    /// The deepest of their stacks.
    stack_bytes: u32,
    /// BAND frames that stated a force.
    bands: usize,
}

impl Cost {
    fn worst_instructions(&self) -> u32 {
        self.instructions.iter().copied().max().unwrap_or(0)
    }

    fn mean_instructions(&self) -> f64 {
        self.instructions.iter().copied().map(f64::from).sum::<f64>()
            / self.instructions.len() as f64
    }
}

/// How a tick is solved.
#[derive(Clone, Copy, Debug)]
enum Schedule {
    OneSolve,
    TwoSolves,
    /// One solve of each half, at a near-rigid wall.
    HalfTicks,
}

/// Effects that take time in every solve, all at once and with all that they do, beside a tendon that is pulled.
fn laden() -> Vec<(String, f32)> {
    const IDS: [&str; 10] = [
        "contact.stribeck",
        "contact.load_friction",
        "wall.hyperelastic",
        "wall.viscoelastic",
        "wall.motion",
        "wall.narrowing",
        "fluid.drag",
        "instrument.torsional_windup",
        "instrument.viscoelastic",
        "instrument.softening",
    ];
    let beside = [
        ("effects.instrument.viscoelastic.ratio", 0.05),
        ("tendon.pull_m", 1e-4),
        ("tendon.stiffness_n_per_m", 1e3),
        ("tendon.offset_m", 5e-4),
        ("tendon.length_m", 0.03),
        ("effects.tendon.friction.coefficient", 0.1),
    ];
    let nominal = to_description::<f64>(bundle(), &SolverDefaults::default()).expect("trials");
    let effects = all().filter(|effect| IDS.contains(&effect.id));
    let values = effects.flat_map(|effect| effect.start(&nominal, &effect.starts()[0]));
    // Effects are mild, because the cost of resolved ticks is measured.
    let mild = |(parameter, value): (&Parameter, f64)| {
        let info = parameters().find(|info| info.key == parameter.key).expect("in the table");
        let off = info.off.unwrap_or(value);
        (parameter.key.to_owned(), (off + MILD * (value - off)) as f32)
    };
    let values = values.map(mild);
    values.chain(beside.map(|(key, value)| (key.to_owned(), value))).collect()
}

fn single_ticks(schedule: Schedule, effects: Vec<(String, f32)>, band: Option<Band>) -> Cost {
    single_ticks_turning(TURN_RAD, schedule, effects, band)
}

/// The same with this rotation in each tick.
fn single_ticks_turning(
    turn_rad: f64,
    schedule: Schedule,
    effects: Vec<(String, f32)>,
    band: Option<Band>,
) -> Cost {
    let trial = bundle().trial(TRIAL).expect("in the example");
    let deepest_m = trial.catheter().expect("a catheter's").insertion_m.iter();
    let deepest_m = deepest_m.copied().fold(0.0, f64::max);
    let (solves, substeps, wall) = match schedule {
        Schedule::OneSolve => (1, 1, None),
        Schedule::TwoSolves => (2, 1, None),
        Schedule::HalfTicks => (1, 2, Some(NEAR_RIGID)),
    };
    let wall = wall.map(|factor| ("effects.wall.stiffness.factor".to_owned(), factor));
    let links = most_links(solves, substeps, !effects.is_empty());
    let solver = SolverDefaults { solves, substeps, ..SolverDefaults::default() };
    let image = image_with(&ImageOptions {
        link_length_m: Some(solver.link_length_over(deepest_m, links as f64 - LAST_LINK)),
        solver,
        parameters: wall.into_iter().chain(effects).collect(),
        band,
        ..ImageOptions::default()
    });
    let at = |tick: u16| Drive {
        insertion_m: deepest_m - FEED_M * f64::from(TICKS - tick),
        rotation_rad: turn_rad * f64::from(tick),
    };
    let mut bench = Bench::<Qemu>::armed(&image, at(0));
    let beginning = bench.report().load.worst_instructions;
    // The first ticks need not be resolved.
    bench.play((0..2 * BAND_WAITS).map(|_| vec![encoder(at(0))]));
    let (mut stack_bytes, mut bands) = (0, 0);
    let counts = (1..=TICKS).map(|tick| {
        bench.reset_counters();
        let sent = bench.play([vec![encoder(at(tick))]]);
        let stated = |process| matches!(process, Process::Band(band) if band.force.is_some());
        bands += sent.iter().filter_map(|tick| tick.third).filter(|&third| stated(third)).count();
        let load = bench.report().load;
        stack_bytes = load.tick_stack_bytes.max(stack_bytes);
        load.worst_instructions
    });
    let instructions = counts.collect();
    Cost { instructions, beginning, stack_bytes, bands }
}

/// Worst count, checked against `most`; jitter and stack are checked too.
fn assert_cost(schedule: Schedule, effects: Vec<(String, f32)>, band: Option<Band>, most: u32) {
    let laden = if effects.is_empty() { "" } else { " with effects" };
    let with = if band.is_some() { " and a band" } else { "" };
    let cost = single_ticks(schedule, effects, band);
    let (worst, mean) = (cost.worst_instructions(), cost.mean_instructions());
    let Cost { instructions: counts, beginning, stack_bytes, .. } = cost;
    let deviation = counts.iter().map(|&count| (f64::from(count) / mean - 1.0).abs());
    let jitter = deviation.fold(0.0, f64::max);
    println!(
        "{schedule:?}{laden}{with}: worst tick {worst} instructions, until armed {beginning}, \
         jitter {:.2} %, tick stack {stack_bytes} bytes, state {} bytes",
        100.0 * jitter,
        device_state_bytes()
    );
    assert!((LEAST_INSTRUCTIONS..=most).contains(&worst), "{worst} instructions, not {most}");
    assert!(
        (LEAST_INSTRUCTIONS..=most).contains(&beginning),
        "{beginning} instructions until armed"
    );
    assert!(jitter <= MOST_JITTER, "{counts:?}");
    assert!((1..=MOST_TICK_STACK_BYTES).contains(&stack_bytes), "{stack_bytes} bytes of stack");
}

#[test]
fn p09_p14_a_tick_with_one_solve_costs_what_is_stated_on_the_board() {
    assert_cost(Schedule::OneSolve, Vec::new(), None, MOST_INSTRUCTIONS_ONE_SOLVE);
}

#[test]
fn p09_p14_a_tick_with_two_solves_costs_what_is_stated_on_the_board() {
    assert_cost(Schedule::TwoSolves, Vec::new(), Some(band()), MOST_INSTRUCTIONS_TWO_SOLVES);
}

#[test]
fn p09_p14_half_ticks_at_a_near_rigid_wall_take_at_most_half_of_a_tick() {
    assert_cost(Schedule::HalfTicks, Vec::new(), None, MOST_INSTRUCTIONS_HALF_TICKS);
}

#[test]
fn p09_effects_all_at_once_take_at_most_half_of_a_tick() {
    for schedule in [Schedule::OneSolve, Schedule::TwoSolves, Schedule::HalfTicks] {
        assert_cost(schedule, laden(), Some(band()), MOST_INSTRUCTIONS_HALF_TICKS);
    }
}

/// Displacements of four tendons that are pulled and let out against each other.
fn pulled(tick: u16) -> [Process; 2] {
    let at_m = 1e-5 * f64::from(tick);
    let pair = |pair: u8, first_m: f64| {
        let displacements = [first_m, 5e-4 - 0.5 * first_m].map(Displacement::from_m);
        Process::Tendons(Tendons { pair, displacements })
    };
    [pair(0, 2e-4 + at_m), pair(1, 8e-4 - at_m)]
}

#[test]
fn p09_four_tendons_take_at_most_half_of_a_tick() {
    let tendon = |i: u8| RigDrivenTendon {
        angle_rad: f64::from(i) * std::f64::consts::FRAC_PI_2,
        offset_m: 5e-4,
        anchor_m: 2e-3 * f64::from(i % 2),
        stiffness_n_per_m: 1e3,
        slack_m: 1e-4,
        static_friction: 0.2,
        sliding_friction: 0.1,
        bend_behind_rad: 1.0,
    };
    let mut bundle = bundle().clone();
    let Plant::Catheter(rig) = &mut bundle.rig.plant else { panic!("a catheter's") };
    rig.tendons = (0..4).map(tendon).collect();
    let solver = SolverDefaults::default();
    let deepest_m = 0.06;
    let options = ImageOptions {
        link_length_m: Some(solver.link_length_over(deepest_m, 64.0 - LAST_LINK)),
        band: Some(band()),
        ..ImageOptions::default()
    };
    let (image, _) = device_image(&bundle, &options).expect("an image");
    let frames = |tick: u16| {
        let insertion_m = deepest_m - FEED_M * f64::from(TICKS - tick);
        let drive = encoder(Drive { insertion_m, rotation_rad: 0.0 });
        std::iter::once(drive).chain(pulled(tick)).collect::<Vec<_>>()
    };
    let mut bench = Bench::<Qemu>::configured(&image);
    bench.arm_holding(&frames(0));
    let counts = (1..=TICKS).map(|tick| {
        bench.reset_counters();
        bench.play([frames(tick)]);
        let load = bench.report().load;
        (load.worst_instructions, load.tick_stack_bytes)
    });
    let counts: Vec<_> = counts.collect();
    let worst = counts.iter().map(|(count, _)| *count).max().unwrap_or(0);
    let stack_bytes = counts.iter().map(|(_, bytes)| *bytes).max().unwrap_or(0);
    println!("four tendons: worst tick {worst} instructions, tick stack {stack_bytes} bytes");
    assert!((LEAST_INSTRUCTIONS..=MOST_INSTRUCTIONS_HALF_TICKS).contains(&worst), "{worst}");
    assert!((1..=MOST_TICK_STACK_BYTES).contains(&stack_bytes), "{stack_bytes} bytes of stack");
}

#[test]
fn p09_a_tick_costs_the_same_whatever_the_instrument_does_on_the_board() {
    let counts = [0.0, FASTEST_RAD].map(|turn_rad| {
        single_ticks_turning(turn_rad, Schedule::OneSolve, Vec::new(), None).instructions
    });
    let [least, most] = [f64::min, f64::max]
        .map(|pick| counts.iter().flatten().copied().map(f64::from).reduce(pick).unwrap_or(0.0));
    println!("fed, and turned at the fastest: {least} to {most} instructions");
    assert!(least > f64::from(LEAST_INSTRUCTIONS) && most < (1.0 + MOST_JITTER) * least);
}

#[test]
fn p09_a_band_of_the_forces_adds_next_to_nothing_to_a_tick() {
    let [without, with] =
        [None, Some(band())].map(|band| single_ticks(Schedule::OneSolve, Vec::new(), band));
    let (worst, more) = (
        with.worst_instructions(),
        with.worst_instructions().abs_diff(without.worst_instructions()),
    );
    println!(
        "with a band: worst tick {worst} instructions, without {}; on average {:+.0}; {} BAND frames",
        without.worst_instructions(),
        with.mean_instructions() - without.mean_instructions(),
        with.bands
    );
    // One tick in ten, all of them with numbers.
    assert_eq!((with.bands, without.bands), (usize::from(TICKS) / 10, 0));
    assert!(worst <= MOST_INSTRUCTIONS_ONE_SOLVE, "{worst} instructions");
    assert!(more <= MOST_INSTRUCTIONS_BAND, "{more} instructions more");
}

#[test]
fn the_model_s_state_fits_into_what_is_stated() {
    assert!(device_state_bytes() <= MOST_STATE_BYTES, "{} bytes", device_state_bytes());
}
