//! Random parameter sets, 20 s each. Whatever the drives do, every result is finite, the energy stays
//! bounded, and a spike of the force is flagged.
//!
//! The suite runs a sample. The long run is `CATHFORCE_RANDOM_SETS=50000 cargo test --release -p
//! cathforce-mechanics --test robustness random_ -- --nocapture`, with that many sets of each kind. More
//! of a test's name, such as `random_parameter`, selects one kind. The run prints its progress and may be
//! interrupted: sets that have passed on the same tick are not run again.
//! `CATHFORCE_RANDOM_SETS=340..341` runs a part of it.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use cathforce_mechanics::*;

use crate::bent_path;
use crate::passed::Passed;
use crate::random::{Hand, Random, any_description, catheter, finer, laden, short_at_tip, steered};
use crate::wall::{Seen, StoredWall, Vector, plane, tube};

/// Ticks of 1 ms.
const TICKS: usize = 20_000;
const SAMPLE: u64 = 10;
/// Largest insertion of the random drive \[m\].
const REACH_M: f32 = 0.13;
/// Sets between two lines of progress.
const PROGRESS: u64 = 100;

/// Vessels around one bent path: tight, wide, with a dead end, and with a pocket whose rim catches and
/// releases the tip.
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
    /// Number of its first seeds whose results identify the tick.
    told_by: u64,
}

const PLAIN: Family = Family { describe: any_description, told_by: 5 };
const SHORT_AT_TIP: Family = Family { describe: short_at_tip, told_by: 5 };
/// Sets with effects, guidewires and tendons. Each single effect is in few of them.
const LADEN: Family = Family { describe: laden, told_by: 40 };
/// Likewise, with shorter links at the tip in half of them.
const FINER: Family = Family { describe: finer, told_by: 40 };

/// Sets with tendons that drives pull.
const STEERED: Family = Family { describe: steered, told_by: 5 };

/// A random drive of the catheter, and other ones of the guidewire and of the tendons.
struct Hands {
    catheter: Hand,
    guidewire: Option<Hand>,
    /// With the largest displacement of each \[m\].
    tendons: Vec<(Hand, f32)>,
}

impl Hands {
    fn new(seed: u64, model: &Model<f32>) -> Self {
        let reach_m = f64::from(model.reach_m().min(REACH_M));
        let guidewire = model.description().guidewire.is_some();
        Self {
            catheter: Hand::any(seed, reach_m),
            guidewire: guidewire.then(|| Hand::any(!seed, reach_m)),
            tendons: (1..)
                .zip(&model.description().tendons)
                .map(|(i, tendon)| {
                    let most_m = most_pulled_m(tendon);
                    (Hand::any(seed.wrapping_add(1000 * i), 1.25 * f64::from(most_m)), most_m)
                })
                .collect(),
        }
    }

    fn next(&mut self) -> Drives<f32> {
        let guidewire = self.guidewire.as_mut().map(Hand::next).unwrap_or_default();
        let mut tendons_m = [0.0; MAX_TENDONS];
        for (place, (hand, most_m)) in tendons_m.iter_mut().zip(&mut self.tendons) {
            // A part of the time it is slack.
            *place = hand.next().insertion_m - 0.25 * *most_m;
        }
        Drives { catheter: self.catheter.next(), guidewire, tendons_m }
    }
}

/// A pull that bends the free tip by at most a full turn \[m\].
fn most_pulled_m(tendon: &DrivenTendon<f32>) -> f32 {
    tendon.offset_m * core::f32::consts::TAU
}

/// The requested seeds: a number of them, or a range.
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

/// Fingerprint of the tick: hash of the results of the first seeds over some seconds.
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

/// Runs one check over the seeds on all processors. Panics with the seeds that failed.
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
                    // Written at once, because a long run may be interrupted.
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

/// Bound on the energy \[J\], which no drive reaches: every link stretched to twice its length, every
/// joint bent by 1 rad, and all nodes at 5 m/s.
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
    // Stiffness and mass including the effects; `softening` may also stiffen.
    let effects = &description.effects.instrument;
    let factor = effects.stiffness.shaft_factor.max(effects.stiffness.tip_factor).max(1.0);
    let hardened = 1.0 - effects.softening.share.min(0.0);
    let per_metre = bending * hardened / (h * h) + largest(|s| s.axial_stiffness_n);
    // A tendon may be pulled while the part that it bends is still in the guide.
    let pulled = description.tendon.stiffness_n_per_m * description.tendon.pull_m.powi(2);
    // Both ways, each tendon gives what stretches it between the ends of its drive's way.
    let driven = |tendon: &DrivenTendon<f32>| {
        tendon.stiffness_n_per_m * (2.0 * most_pulled_m(tendon)).powi(2)
    };
    let pulled = pulled + description.tendons.iter().map(driven).sum::<f32>();
    let moving = largest(|s| s.mass_kg_per_m) * 25.0;
    0.5 * (reach_m * (factor * per_metre + moving) + pulled)
}

/// Checks that the state is bounded and finite.
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
        // A step never leaves a number that is not finite; it reports the loss.
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

#[test]
fn random_tendons_that_drives_pull_lose_no_number_and_keep_their_energy_bounded() {
    over_seeds("steered", STEERED, |seed, vessels| stays_bounded(STEERED, seed, vessels));
}

/// A very soft chain (0.1 N of axial stiffness) is pulled out at 0.4 m/s. One linear solve gives it 30 mJ
/// of kinetic energy, which the next step must not take over.
#[test]
fn a_chain_that_is_thrown_hands_on_a_bounded_energy() {
    stays_bounded(PLAIN, 3811, &vessels()).unwrap();
}

/// A viscous shaft with 5 m of free length behind the guide is withdrawn to its last links. Its torsional
/// stiffness at the mouth is so small beside the bending stiffness that rounding could erase it.
#[test]
fn a_viscous_shaft_that_winds_up_keeps_its_twist_at_the_mouth() {
    stays_bounded(LADEN, 220, &vessels()).unwrap();
}

/// Walls that stiffen up to 500 times under compression, some of which also relax, around a catheter or a
/// catheter with guidewire. Without a limit, they exceed what single precision can resolve.
#[test]
fn a_wall_that_stiffens_stays_within_the_numbers_that_there_are() {
    let vessels = vessels();
    for seed in [91, 423, 527, 648, 809, 838] {
        stays_bounded(LADEN, seed, &vessels).unwrap();
    }
}

/// A soft shaft of up to 5 m winds up behind a link that has just entered, with or without a guidewire
/// that is a thousand times as stiff. Its torsional stiffness must survive beside the bending stiffness at
/// the mouth, with and without viscosity.
#[test]
fn a_soft_shaft_that_winds_up_keeps_its_twist_beside_a_stiff_joint() {
    let vessels = vessels();
    for seed in [501, 510, 576, 808, 840] {
        stays_bounded(LADEN, seed, &vessels).unwrap();
    }
}

/// A force is a spike if it is more than this many times all others …
const SPIKE: f32 = 2.0;
/// … within these numbers of ticks before and after; the nearest ticks are left out.
const AROUND: core::ops::RangeInclusive<usize> = 5..=50;
/// Forces below this are ignored \[N\].
const FLOOR_N: f32 = 5e-3;

/// Counts spikes that are flagged as unresolved, and spikes that are real. The error is the first spike
/// that is neither: its tick and force, and the usual force there. Forces below `floor_n` are ignored.
///
/// `real` tells whether a spike of this tick and force also occurs with finer ticks.
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

/// A run of a random catheter with the motion of an operator.
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

    /// Largest force in the ticks around one, computed with tenths of ticks from the state some ticks
    /// earlier.
    fn finer(mut self, lumen: &Lumen<'_>, tick: usize) -> f32 {
        /// Number of ticks before and after.
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

/// Numbers of flagged and of real spikes of a random catheter.
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
    // A real force does not decrease with finer steps: a tip catches on a rim and is released, or strikes
    // it.
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

/// Tips that catch on the rim of a pocket for 10 ms and are released, or strike it.
#[test]
fn a_force_that_jumps_out_is_flagged_or_real() {
    let vessels = vessels();
    for seed in [232, 594, 638] {
        let [flagged, real] = spikes(seed, &vessels).unwrap();
        println!("{seed}: {flagged} flagged, {real} real");
        assert!(real > 0, "seed {seed}");
    }
}

/// An impact wedges a tip for 6 ms at a friction of 0.54; with finer ticks it slides.
#[test]
fn what_an_impact_sets_off_is_flagged_with_it() {
    let [flagged, real] = spikes(450, &vessels()).unwrap();
    println!("{flagged} flagged, {real} real");
    assert!(flagged > 0);
}
