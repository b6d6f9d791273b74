//! Measures the device's model against the reference solver and prints the table.

use std::path::PathBuf;

use anyhow::Context;
use cathforce_validation::{
    Accuracy, cases, causes, export, links_table, measure_all, play_on_device, solve, table,
};
use clap::Parser;

#[derive(Parser)]
#[command(about = "The device's model against the reference solver")]
struct Arguments {
    /// Measure only cases whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Write the rows and their summary into this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print how the errors change when one of the device's limits is lifted at a time.
    #[arg(long)]
    causes: bool,
    /// Print how the model converges with the number of its links, compared with 512 links.
    #[arg(long)]
    links: bool,
    /// Write cases and both solutions into this folder; measure nothing.
    #[arg(long, value_name = "FOLDER")]
    export: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let wanted = |name: &str| arguments.only.as_ref().is_none_or(|text| name.contains(&**text));
    let cases: Vec<_> = cases().into_iter().filter(|case| wanted(case.name)).collect();
    if let Some(folder) = &arguments.export {
        for case in &cases {
            let (reference, _) = solve(case).with_context(|| case.name)?;
            let device = play_on_device(case)?;
            export(folder, case, &reference, &device)?;
        }
        println!("written: {} cases in {}", cases.len(), folder.display());
        return Ok(());
    }
    if arguments.causes {
        for case in &cases {
            println!("{}", causes(case).with_context(|| case.name)?);
        }
        return Ok(());
    }
    if arguments.links {
        print!("{}", links_table(&cases)?);
        return Ok(());
    }
    let rows = measure_all(&cases)?;
    print!("{}", table(&rows));
    if let Some(file) = &arguments.json {
        let json = serde_json::json!({ "accuracy": Accuracy::of(&rows), "cases": rows });
        std::fs::write(file, format!("{json:#}\n")).with_context(|| file.display().to_string())?;
    }
    Ok(())
}
