//! Measures the device's model against the reference solver and prints the table.

use std::path::PathBuf;

use anyhow::Context;
use cathforce_accuracy::{Accuracy, cases, export, measure_all, solve, table};
use cathforce_rig::SolverDefaults;
use clap::Parser;

#[derive(Parser)]
#[command(about = "The device's model against the reference solver")]
struct Arguments {
    /// Only cases whose name has this in it.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Write the rows and their summary here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Instead of measuring, write cases and their reference solutions into this folder.
    #[arg(long, value_name = "FOLDER")]
    export: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let wanted = |name: &str| arguments.only.as_ref().is_none_or(|text| name.contains(&**text));
    let cases: Vec<_> = cases().into_iter().filter(|case| wanted(case.name)).collect();
    if let Some(folder) = &arguments.export {
        for case in &cases {
            let (solution, _) = solve(case).with_context(|| case.name)?;
            export(folder, case, &solution)?;
        }
        println!("written: {} cases in {}", cases.len(), folder.display());
        return Ok(());
    }
    let rows = measure_all(&cases, &SolverDefaults::default())?;
    print!("{}", table(&rows));
    if let Some(file) = &arguments.json {
        let json = serde_json::json!({ "accuracy": Accuracy::of(&rows), "cases": rows });
        std::fs::write(file, format!("{json:#}\n")).with_context(|| file.display().to_string())?;
    }
    Ok(())
}
