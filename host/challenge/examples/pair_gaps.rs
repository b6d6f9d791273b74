//! How visible each of two effects is beside the other, and which pairs were found, in a challenge
//! that has been answered. The gap that an effect adds is that between both and the other alone.
//!
//!     cargo run --release -p cathforce-challenge --example pair_gaps -- FOLDER

use std::error::Error;
use std::path::PathBuf;

use cathforce_challenge::{
    Case, Challenge, Change, Kind, SMALLEST_GAP, TRIALS, cases, gap_over_noise, play, score,
};
use rayon::prelude::*;

/// What each effect adds to the others, over the noise.
fn added(case: &Case) -> Result<Vec<f64>, String> {
    let all = |changes: &[Change]| -> Result<Vec<_>, String> {
        let trial = |trial| play(&case.rig, changes, trial).map_err(|error| error.to_string());
        (0..TRIALS).map(trial).collect()
    };
    let both = all(&case.changes)?;
    let without = |k: usize| {
        let mut others = case.changes.clone();
        others.remove(k);
        Ok(gap_over_noise(&both, &all(&others)?))
    };
    (0..case.changes.len()).map(without).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from).ok_or("give a folder")?;
    let revealed = Challenge::at(&folder).reveal()?;
    let last = &revealed.last().ok_or("no cases")?.0;
    // Cases without a solution are left out of a challenge, but were drawn.
    let drawn = cases(last.seed, last.case.parse::<usize>()? + 1);
    let answers = score(&revealed).answers;
    let answered = |case: Case| {
        let name = format!("{:03}", case.number);
        answers.iter().find(|a| a.case == name).map(|answer| (case, answer))
    };
    let pairs: Vec<_> = drawn
        .into_iter()
        .filter_map(answered)
        .filter(|(_, a)| a.kind == Kind::Pair && a.gap_over_noise >= SMALLEST_GAP)
        .collect();
    let gaps: Vec<_> = pairs.par_iter().map(|(case, _)| added(case)).collect::<Result<_, _>>()?;
    let (mut found, mut seen) = (0, 0);
    for ((case, answer), gaps) in pairs.iter().zip(gaps) {
        let ids: Vec<_> = case.changes.iter().map(Change::id).collect();
        if answer.truth != ids {
            return Err(format!("case {}: this program draws other effects", answer.case).into());
        }
        let parts = ids.iter().zip(&gaps).map(|(id, gap)| format!("{id} {gap:.1}"));
        let parts = parts.collect::<Vec<_>>().join(" + ");
        println!("{}  {}  {parts}", answer.case, if answer.right { "found" } else { "     " });
        if gaps.iter().all(|gap| *gap >= SMALLEST_GAP) {
            (seen, found) = (seen + 1, found + usize::from(answer.right));
        }
    }
    println!(
        "{} pairs; in {seen} each effect adds at least {SMALLEST_GAP} times the noise to the other: \
         {found} of these found",
        pairs.len()
    );
    Ok(())
}
