//! Writes the evidence of every set of effects of a bundle, from which the priors are learned.
//!
//! `evidence BUNDLE HELD_BACK OUT.json`; HELD_BACK: the number of a trial that is left out.

use std::path::Path;
use std::process::ExitCode;

use cathforce_bundle::Bundle;
use cathforce_gap::catheter::Catheter;
use cathforce_gap::drive::Drive;
use cathforce_gap::plant::Plant;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, held_back, out] = &arguments[..] else {
        eprintln!("evidence BUNDLE HELD_BACK OUT.json");
        return ExitCode::from(2);
    };
    match write(Path::new(bundle), held_back, Path::new(out)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{bundle}: {why}");
            ExitCode::FAILURE
        }
    }
}

fn write(path: &Path, held_back: &str, out: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let held_back: u32 = held_back.parse()?;
    let mut bundle = Bundle::open(path)?;
    bundle.trials.retain(|trial| trial.number != held_back);
    let plant: Box<dyn Plant + '_> = match Catheter::new(&bundle) {
        Ok(catheter) => Box::new(catheter),
        Err(_) => Box::new(Drive::new(&bundle)?),
    };
    let answer = cathforce_gap::diagnose(plant.as_ref(), "evidence", &cathforce_gap::unwatched);
    let value = serde_json::json!({ "answer": answer, "sets": answer.details.sets });
    std::fs::write(out, value.to_string())?;
    println!(
        "{}: {:.0} s, {} simulations of {} expected, {}",
        path.display(),
        answer.seconds,
        answer.details.simulations,
        cathforce_gap::expected_simulations(plant.as_ref()),
        answer.sentence
    );
    Ok(())
}
