//! Makes a set of strangers and says what it is like: cases without a balance, time a case, and how far
//! the gaps of every effect are above the floor.
//!
//!     cargo run --release -p cathforce-blind-test --example strangers -- FOLDER tuning|sealed [CASES [SEED [KIND]]]
//!
//! KIND: `none`, `single`, `pair` or `outside` of the library; without it, all of them in their shares.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use cathforce_blind_test::{BlindTest, Kind, Label, Set};

/// Bounds of the histogram, in floors.
const BOUNDS: [f64; 6] = [1.1, 1.5, 2.0, 4.0, 10.0, 20.0];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, set, rest @ ..] = &arguments[..] else {
        return Err("give a folder, and tuning or sealed".into());
    };
    let set = match set.as_str() {
        "tuning" => Set::Tuning,
        "sealed" => Set::Sealed,
        _ => return Err("the set is tuning or sealed".into()),
    };
    let count = rest.first().map_or(Ok(40), |cases| cases.parse())?;
    let seed: u64 = rest.get(1).map_or(Ok(1), |seed| seed.parse())?;
    let kind = |name: &String| match name.as_str() {
        "none" => Ok(Kind::None),
        "single" => Ok(Kind::Single),
        "pair" => Ok(Kind::Pair),
        "outside" => Ok(Kind::Outside),
        _ => Err("the kind is none, single, pair or outside"),
    };
    let only = rest.get(2).map(kind).transpose()?;
    let folder = PathBuf::from(folder);
    let begun = Instant::now();
    // Whoever looks at the labels needs no salt that nobody knows.
    let left_out =
        BlindTest::at(&folder).make_strangers(set, only, Some(seed), count, seed, &|| {})?;
    let time_s = begun.elapsed().as_secs_f64();
    for (case, error) in &left_out {
        println!("case {case:03} has no balance: {error}");
    }
    println!(
        "{} of {count} cases have no balance; {:.1} s a case on {} threads",
        left_out.len(),
        time_s / count as f64,
        std::thread::available_parallelism().map_or(1, usize::from)
    );
    let mut gaps: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut add = |name: String, gap: f64| gaps.entry(name).or_default().push(gap);
    for entry in std::fs::read_dir(folder.join("labels"))? {
        let label: Label = serde_json::from_str(&std::fs::read_to_string(entry?.path())?)?;
        let families = label.stranger.map(|own| own.families).unwrap_or_default();
        let gap = label.gap_over_floor.unwrap_or_default();
        match label.kind {
            Kind::None => add("none".to_owned(), gap),
            Kind::Single | Kind::Outside => add(families.concat(), gap),
            Kind::Pair => {
                add("pairs".to_owned(), gap);
                for (family, added) in families.iter().zip(&label.added_over_floor) {
                    add(format!("{family}, in a pair"), *added);
                }
            }
        }
        if label.kind == Kind::Single {
            add("all singles".to_owned(), gap);
        }
    }
    let bounds: Vec<String> = BOUNDS.iter().map(|bound| format!("{bound:>5}")).collect();
    println!("{:<34} below {}  above; each", "gap over the floor", bounds.join(" "));
    for (name, mut own) in gaps {
        own.sort_by(f64::total_cmp);
        let mut counts = vec![0; BOUNDS.len() + 1];
        own.iter().for_each(|gap| counts[BOUNDS.partition_point(|bound| bound <= gap)] += 1);
        let counts: Vec<String> = counts.iter().map(|count| format!("{count:>5}")).collect();
        let own: Vec<String> = own.iter().map(|gap| format!("{gap:.1}")).collect();
        println!("{name:<34}       {}   {}", counts.join(" "), own.join(" "));
    }
    Ok(())
}
