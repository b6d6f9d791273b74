//! Writes a bundle of six trials of 10 s whose reality has two effects: what a diagnosis of that
//! size takes is measured on it.
//!
//!     cargo run --release -p cathforce-blind-test --example six_trials -- FOLDER

use std::error::Error;
use std::path::PathBuf;

use cathforce_blind_test::{Stand, Trial, play_along, rigs, schedule, single};
use cathforce_reference_solver::Schedule;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const TRIALS: usize = 6;
const LENGTH_S: f64 = 10.0;
const EFFECTS: [&str; 2] = ["instrument.stiffness", "wall.narrowing"];
/// Neither weak nor strong.
const SEVERITY: f64 = 0.5;
const SEED: u64 = 7;

/// A motion of the blind checks, then back and forth once more; the first comes twice.
fn motion(trial: usize, start_m: f64) -> Schedule {
    let ramp_s = 0.1;
    let s = schedule(trial % (TRIALS - 1), start_m);
    let s = s.then(1.0, ramp_s, -0.015, 0.0).then(0.5, ramp_s, 0.0, 0.0);
    let s = s.then(1.0, ramp_s, 0.015, 0.0);
    let left_s = LENGTH_S - s.end_s();
    s.then(left_s, ramp_s, 0.0, 0.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from).ok_or("give a folder")?;
    if folder.exists() {
        return Err(format!("{} is there already", folder.display()).into());
    }
    let rig = rigs().into_iter().next().ok_or("no rig")?;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let changes: Vec<_> = EFFECTS.iter().filter_map(|id| single(id, SEVERITY, &mut rng)).collect();
    let trial = |trial| play_along(&rig, &changes, &motion(trial, rig.start_m));
    let trials: Vec<Trial> = (0..TRIALS).map(trial).collect::<Result<_, _>>()?;
    Stand::own(&rig).write(&folder, "six-trials", &trials, SEED)?;
    for (number, trial) in trials.iter().enumerate() {
        let end_s = trial.last().map_or(0.0, |row| row.t_s);
        println!("{number:03}: {} rows, {end_s:.1} s", trial.len());
    }
    println!("{}: {}", rig.name, EFFECTS.join(" and "));
    Ok(())
}
