//! Random parameter sets, 20 s each: whatever the drive does, no number is lost, the energy
//! stays bounded, and a force that jumps out is flagged.
//!
//! The suite runs a sample. `CATHFORCE_RANDOM_SETS=50000 cargo test --release -p
//! cathforce-mechanics --test robustness random_ -- --nocapture` is the long run, so many of each
//! kind; of one kind with more of its test's name, as `random_parameter`. It says how far
//! it is and may be broken off and called again: what has passed on this very tick is not run
//! again. `CATHFORCE_RANDOM_SETS=340..341` runs a part of it.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use cathforce_mechanics::*;

use crate::bent_path;
use crate::passed::Passed;
use crate::random::{Hand, Random, any_description, catheter, finer, laden, short_at_tip};
use crate::wall::{Seen, StoredWall, Vector, plane, tube};

/// Ticks of 1 ms.
const TICKS: usize = 20_000;
const SAMPLE: u64 = 10;
/// As far as a hand goes \[m\].
const REACH_M: f32 = 0.13;
/// Sets from one word of progress to the next.
const PROGRESS: u64 = 100;

/// Vessels around one bent path: tight, wide, with a dead end, with a pocket whose rim catches
/// the tip and lets it go.
fn vessels() -> Vec<StoredWall> {
    let path = bent_path();
    let stored = |radius_m: f64, cell_m: f64, change: &dyn Fn(Vector, Seen) -> Seen| {
        let reach = radius_m + 8e-3;
        let bounds = [[-0.02, -reach, -reach], [0.16, 0.12, reach]];
        let wall = |p| change(p, path.tube(p, radius_m));
        StoredWall::sampled(bounds, cell_m, 3e-3, wall)
    };
    let end = |p| plane(p, [0.09, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    let pocket = |p, seen: Seen| {
        let pocket = tube(p, [0.08, -0.001, 0.0], 5e-3);
        if pocket.0 > seen.0 { pocket } else { seen }
    };
    vec![
        stored(1.5e-3, 5e-4, &|_, seen| seen),
        stored(4e-3, 1e-3, &|_, seen| seen),
        stored(10e-3, 1e-3, &|_, seen| seen),
        stored(4e-3, 1e-3, &|p, seen| nearer(seen, end(p))),
        stored(4e-3, 5e-4, &|p, seen| pocket(p, seen)),
    ]
}

/// The nearer of two walls.
fn nearer(a: Seen, b: Seen) -> Seen {
    if a.0 <= b.0 { a } else { b }
}

/// A family of random sets.
#[derive(Clone, Copy)]
struct Family {
    describe: fn(&mut Random) -> Description<f32>,
    /// So many of its first seeds tell one tick from another.
    told_by: u64,
}

const PLAIN: Family = Family { describe: any_description, told_by: 5 };
const SHORT_AT_TIP: Family = Family { describe: short_at_tip, told_by: 5 };
/// Any one effect is in few of them.
const LADEN: Family = Family { describe: laden, told_by: 40 };
/// The same with shorter links at the tip in one of two.
const FINER: Family = Family { describe: finer, told_by: 40 };

/// A random hand at the catheter, and at the guidewire another.
struct Hands {
    catheter: Hand,
    guidewire: Option<Hand>,
}

impl Hands {
    fn new(seed: u64, model: &Model<f32>) -> Self {
        let reach_m = f64::from(model.reach_m().min(REACH_M));
        let guidewire = model.description().guidewire.is_some();
        Self {
            catheter: Hand::any(seed, reach_m),
            guidewire: guidewire.then(|| Hand::any(!seed, reach_m)),
        }
    }

    fn next(&mut self) -> Drives<f32> {
        let guidewire = self.guidewire.as_mut().map(Hand::next).unwrap_or_default();
        Drives { catheter: self.catheter.next(), guidewire }
    }
}

/// The seeds that are asked for: a number of them, or from one to before another.
fn seeds() -> Range<u64> {
    let Ok(asked) = std::env::var("CATHFORCE_RANDOM_SETS") else { return 0..SAMPLE };
    let number = |text: &str| {
        text.parse().unwrap_or_else(|_| panic!("CATHFORCE_RANDOM_SETS={asked}: not N or N..N"))
    };
    match asked.split_once("..") {
        Some((first, end)) => number(first)..number(end),
        None => 0..number(&asked),
    }
}

/// The bits of some seconds of the tick, that of the first seeds.
fn fingerprint(vessels: &[StoredWall], family: Family) -> u64 {
    const TICKS: usize = 1000;
    let mut bits = DefaultHasher::new();
    for (seed, vessel) in (0..family.told_by).zip(vessels.iter().cycle()) {
        let description = (family.describe)(&mut Random::new(seed));
        let model: Model<f32> = Model::new(description).unwrap();
        let mut state: State<f32> = State::new();
        let mut hands = Hands::new(seed, &model);
        let lumen = vessel.lumen();
        for _ in 0..TICKS {
            let outputs = step(&model, &lumen, &mut state, hands.next());
            outputs.force_on_vessel_n.map(f32::to_bits).hash(&mut bits);
            outputs.drive_force_n.to_bits().hash(&mut bits);
            outputs.lost.hash(&mut bits);
        }
    }
    bits.finish()
}

/// Runs one check over the seeds on all processors and panics with those that failed.
fn over_seeds(
    name: &str,
    family: Family,
    check: impl Fn(u64, &[StoredWall]) -> Result<(), String> + Sync,
) {
    let seeds = seeds();
    let (vessels, failures) = (vessels(), Mutex::new(Vec::new()));
    let asked = std::env::var_os("CATHFORCE_RANDOM_SETS").is_some();
    let passed =
        if asked { Passed::of(name, fingerprint(&vessels, family)) } else { Passed::nothing() };
    let (next, done) = (AtomicU64::new(seeds.start), AtomicU64::new(0));
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return;
            }
            if !passed.has(seed) {
                match check(seed, &vessels) {
                    Ok(()) => passed.add(seed),
                    // At once: a long run may be broken off.
                    Err(found) => {
                        eprintln!("seed {seed}: {found}");
                        failures.lock().unwrap().push(seed);
                    }
                }
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if done.is_multiple_of(PROGRESS) {
                eprintln!("{name}: {done} sets, {} failed", failures.lock().unwrap().len());
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        (0..threads).for_each(|_| {
            scope.spawn(work);
        });
    });
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{} of seeds {seeds:?} failed: {failures:?}", failures.len());
}

/// Energy that no drive gives the instruments: every link stretched to twice its length, every
/// joint bent by a radian, everything at 5 m/s \[J\].
pub fn most_energy_j(description: &Description<f32>, reach_m: f32) -> f32 {
    let Solver { link_length_m, fine_tip_m, .. } = description.solver;
    let h = if fine_tip_m > 0.0 { 0.5 * link_length_m } else { link_length_m };
    let instruments = || [Some(&description.instrument), description.guidewire.as_ref()];
    let largest = |of: fn(&Section<f32>) -> f32| -> f32 {
        let one = |i: &Instrument<f32>| i.sections.iter().map(of).fold(0.0, f32::max);
        instruments().into_iter().flatten().map(one).sum()
    };
    let bending =
        largest(|s| s.bending_stiffness_n_m2).max(largest(|s| s.torsional_stiffness_n_m2));
    // What effects make of it; `softening` may as well harden.
    let effects = &description.effects.instrument;
    let factor = effects.stiffness.shaft_factor.max(effects.stiffness.tip_factor).max(1.0);
    let hardened = 1.0 - effects.softening.share.min(0.0);
    let per_metre = bending * hardened / (h * h) + largest(|s| s.axial_stiffness_n);
    // A tendon that is pulled before what it bends has left the guide.
    let pulled = description.tendon.stiffness_n_per_m * description.tendon.pull_m.powi(2);
    let moving = largest(|s| s.mass_kg_per_m) * 25.0;
    0.5 * (reach_m * (factor * per_metre + moving) + pulled)
}

/// What the state hands on is bounded, and every number is one.
fn stays_bounded(family: Family, seed: u64, vessels: &[StoredWall]) -> Result<(), String> {
    let mut random = Random::new(seed);
    let description = (family.describe)(&mut random);
    let lumen = vessels[random.below(vessels.len())].lumen();
    let model: Model<f32> = Model::new(description.clone()).unwrap();
    let mut state: State<f32> = State::new();
    let most = most_energy_j(&description, model.reach_m().min(REACH_M));
    let mut hands = Hands::new(seed, &model);
    for tick in 0..TICKS {
        let outputs = step(&model, &lumen, &mut state, hands.next());
        let at = || format!("tick {tick}, {:?}: {outputs:?}", hands.catheter.phase);
        // A step hands on no number that is none: it says that it has lost one.
        if outputs.lost {
            return Err(format!("lost a number; {}", at()));
        }
        let energy = state.kinetic_energy_j(&model) + state.elastic_energy_j(&model);
        if !energy.is_finite() || energy > most {
            return Err(format!("{energy:e} J, at most {most:e} J; {}", at()));
        }
    }
    Ok(())
}

#[test]
fn random_parameter_sets_lose_no_number_and_keep_their_energy_bounded() {
    over_seeds("bounded", PLAIN, |seed, vessels| stays_bounded(PLAIN, seed, vessels));
}

#[test]
fn random_sets_with_short_links_at_the_tip_lose_no_number_and_keep_their_energy_bounded() {
    over_seeds("short-at-tip", SHORT_AT_TIP, |seed, vessels| {
        stays_bounded(SHORT_AT_TIP, seed, vessels)
    });
}

#[test]
fn random_effects_guidewires_and_tendons_lose_no_number_and_keep_their_energy_bounded() {
    over_seeds("laden", FINER, |seed, vessels| stays_bounded(FINER, seed, vessels));
}

/// A chain of rubber (0.1 N of axial stiffness) that is drawn out at 0.4 m/s and thrown by one
/// solve to 30 mJ of motion; the step after it must not begin with them.
#[test]
fn a_chain_that_is_thrown_hands_on_a_bounded_energy() {
    stays_bounded(PLAIN, 3811, &vessels()).unwrap();
}

/// A viscous shaft with five metres to wind up behind the guide, withdrawn to its last links: beside
/// the bending at the mouth its twist was lost to rounding.
#[test]
fn a_viscous_shaft_that_winds_up_keeps_its_twist_at_the_mouth() {
    stays_bounded(LADEN, 220, &vessels()).unwrap();
}

/// Walls that stiffen by up to 500 as they are pressed flat (91, 423), that relax too (527), and both
/// round a guidewire (648, 809, 838): stiffer than single precision has numbers for.
#[test]
fn a_wall_that_stiffens_stays_within_the_numbers_that_there_are() {
    let vessels = vessels();
    for seed in [91, 423, 527, 648, 809, 838] {
        stays_bounded(LADEN, seed, &vessels).unwrap();
    }
}

/// A soft shaft of up to five metres that winds up behind a link that has just entered, with a
/// guidewire a thousand times as stiff (808, 840) or without (510): beside the bending at the mouth its
/// twist was lost, viscous or not.
#[test]
fn a_soft_shaft_that_winds_up_keeps_its_twist_beside_a_stiff_joint() {
    let vessels = vessels();
    for seed in [501, 510, 576, 808, 840] {
        stays_bounded(LADEN, seed, &vessels).unwrap();
    }
}

/// A force is a spike when it is more than this many times all others …
const SPIKE: f32 = 2.0;
/// … within this many ticks before and after, but for the nearest.
const AROUND: core::ops::RangeInclusive<usize> = 5..=50;
/// Forces below this do not matter \[N\].
const FLOOR_N: f32 = 5e-3;

/// How many forces jump out, all of them flagged as unresolved or real; else tick and size of the
/// first one that is neither, and the usual force there. Forces below `floor_n` do not matter.
///
/// `real` says whether a force of this tick and size would be there too if the ticks were finer.
pub fn flagged_spikes(
    forces: &[(f32, bool)],
    floor_n: f32,
    mut real: impl FnMut(usize, f32) -> bool,
) -> Result<u64, (usize, f32, f32)> {
    let mut flagged = 0;
    for (tick, &(force_n, unresolved)) in forces.iter().enumerate() {
        let around = AROUND
            .flat_map(|away| [tick.checked_sub(away), Some(tick + away)].into_iter().flatten());
        let others = around.filter_map(|t| forces.get(t)).map(|(force_n, _)| *force_n);
        let usual_n = others.fold(floor_n, f32::max);
        if force_n > SPIKE * usual_n {
            if unresolved {
                flagged += 1;
            } else if !real(tick, force_n) {
                return Err((tick, force_n, usual_n));
            }
        }
    }
    Ok(flagged)
}

/// A run of a random catheter by a steady hand.
struct Steady {
    model: Model<f32>,
    state: State<f32>,
    hand: Hand,
}

impl Steady {
    fn new(seed: u64, description: Description<f32>) -> Self {
        let (model, state) = (Model::new(description).unwrap(), State::new());
        Self { model, state, hand: Hand::steady(seed, 0.125) }
    }

    /// The largest force of the ticks around one, computed in tenths of ticks from the state that the run
    /// has some ticks before.
    fn finer(mut self, lumen: &Lumen<'_>, tick: usize) -> f32 {
        /// Ticks before and after.
        const AWAY: usize = 20;
        const PARTS: usize = 10;
        let mut before = Drive::default();
        for _ in 0..tick.saturating_sub(AWAY) {
            before = self.hand.next();
            step(&self.model, lumen, &mut self.state, before);
        }
        let mut description = self.model.description().clone();
        description.solver.tick_s /= PARTS as f32;
        let model: Model<f32> = Model::new(description).unwrap();
        let mut largest_n = 0.0;
        for _ in 0..2 * AWAY {
            let after = self.hand.next();
            for part in 1..=PARTS {
                let share = part as f32 / PARTS as f32;
                let between = |before: f32, after: f32| before + (after - before) * share;
                let drive = Drive {
                    insertion_m: between(before.insertion_m, after.insertion_m),
                    rotation_rad: between(before.rotation_rad, after.rotation_rad),
                };
                let outputs = step(&model, lumen, &mut self.state, drive);
                largest_n = f32::max(largest_n, force_n(&outputs));
            }
            before = after;
        }
        largest_n
    }
}

fn force_n(outputs: &Outputs<f32>) -> f32 {
    outputs.force_on_vessel_n.map(|f| f * f).iter().sum::<f32>().sqrt()
}

/// Spikes of a random catheter, flagged and real.
fn spikes(seed: u64, vessels: &[StoredWall]) -> Result<[u64; 2], String> {
    let mut random = Random::new(seed);
    let description = catheter(&mut random);
    let lumen = vessels[random.below(vessels.len())].lumen();
    let start = || Steady::new(seed, description.clone());
    let Steady { model, mut state, mut hand } = start();
    let (mut forces, mut phases) = (Vec::new(), Vec::new());
    for _ in 0..TICKS {
        let outputs = step(&model, &lumen, &mut state, hand.next());
        if outputs.lost {
            return Err("lost a number".to_owned());
        }
        forces.push((force_n(&outputs), outputs.unresolved));
        phases.push(hand.phase);
    }
    let mut real = 0;
    // Smaller steps make a force that is real no smaller: a tip that catches on a rim and is let go, or
    // strikes it.
    let flagged = flagged_spikes(&forces, FLOOR_N, |tick, force_n| {
        let felt = start().finer(&lumen, tick) > force_n / SPIKE;
        real += u64::from(felt);
        felt
    });
    match flagged {
        Ok(flagged) => Ok([flagged, real]),
        Err((tick, force_n, usual_n)) => {
            Err(format!("tick {tick}, {:?}: {force_n} N among {usual_n} N", phases[tick]))
        }
    }
}

#[test]
fn random_catheters_flag_every_force_that_jumps_out() {
    let [flagged, real] = [AtomicU64::new(0), AtomicU64::new(0)];
    over_seeds("flagged", PLAIN, |seed, vessels| {
        let found = spikes(seed, vessels)?;
        flagged.fetch_add(found[0], Ordering::Relaxed);
        real.fetch_add(found[1], Ordering::Relaxed);
        Ok(())
    });
    let [flagged, real] = [flagged.into_inner(), real.into_inner()];
    println!("{flagged} ticks jumped out and were flagged, {real} were real");
}

/// Tips that catch on the rim of a pocket for 10 ms and are let go (232, 638), or strike it (594).
#[test]
fn a_force_that_jumps_out_is_flagged_or_real() {
    let vessels = vessels();
    for seed in [232, 594, 638] {
        let [flagged, real] = spikes(seed, &vessels).unwrap();
        println!("{seed}: {flagged} flagged, {real} real");
        assert!(real > 0, "seed {seed}");
    }
}

/// An impact wedges a tip for 6 ms with friction 0.54, where finer ticks let it slide (450).
#[test]
fn what_an_impact_sets_off_is_flagged_with_it() {
    let [flagged, real] = spikes(450, &vessels()).unwrap();
    println!("{flagged} flagged, {real} real");
    assert!(flagged > 0);
}
