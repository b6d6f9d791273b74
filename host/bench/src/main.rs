//! Measures the figures of the page on benchmarks and prints them as JSON; `cargo xtask bench` installs what it
//! needs and runs it.

#![forbid(unsafe_code)]

mod clock;
mod device;
mod insertion;
mod machine;
mod throughput;

use std::path::PathBuf;

use anyhow::Context;
use cathforce_mechanics::Lumen;
use cathforce_validation::Accuracy;
use clap::Parser;
use serde::Serialize;

use device::Device;
use insertion::{INSERTION, Insertion, Peer, Score, Series};
use machine::Machine;
use throughput::Throughput;

/// Largest number of links of the model; in the insertion it uses as many as a peer has nodes.
const LINKS: usize = 64;
/// Number of runs, of which the fastest counts.
const RUNS: usize = 3;

#[derive(Parser)]
#[command(about = "Measures cost and accuracy; prints JSON")]
struct Arguments {
    /// Python interpreter with the packages of `host/bench/peers/requirements.txt`; without it no peers are
    /// measured.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    device: Device,
    host: Throughput,
    accuracy: Accuracy,
    insertion: Insertion,
    /// RMS of the reference's force about its own moving mean, the least that a model can have.
    reference_noise: f64,
    cathforce: Ours,
    peers: Vec<Peer>,
}

/// The model of this project in the insertion.
#[derive(Serialize)]
struct Ours {
    us_per_step: f64,
    real_time_factor: f64,
    #[serde(flatten)]
    score: Score,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    eprintln!("▶ the emulated board: a trial with one solve a tick, and with two");
    let device = device::measure()?;
    eprintln!("▶ throughput of the host");
    let host = throughput::measure()?;
    eprintln!("▶ accuracy of feeding, reversal and rotation");
    let rows = cathforce_validation::measure_all(&cathforce_validation::cases())?;
    eprintln!("▶ insertion: reference");
    let reference = insertion::reference(&INSERTION)?;
    let itself = Score::of(&reference, &reference).context("the reference touches nothing")?;
    eprintln!("▶ insertion: cathforce");
    let cathforce = ours(&reference)?;
    let peers = match &arguments.python {
        Some(python) => insertion::play_in_peers(&INSERTION, &reference, python, RUNS)?,
        None => Vec::new(),
    };
    let report = Report {
        machine: Machine::this(),
        device,
        host,
        accuracy: Accuracy::of(&rows),
        insertion: INSERTION,
        reference_noise: itself.force_noise,
        cathforce,
        peers,
    };
    println!("{}", serde_json::to_string_pretty(&report)?);
    Ok(())
}

/// The insertion in f32 with as many links as lie between the peers' nodes.
fn ours(reference: &Series) -> anyhow::Result<Ours> {
    let built = INSERTION.lumen(cathforce_bundle::CELL_M)?;
    let lumen = Lumen::new(built.header, &built.bytes)
        .map_err(|error| anyhow::anyhow!("the tube's lumen: {error:?}"))?;
    let link_length_m = INSERTION.link_length_m();
    let run = || insertion::play::<f32, LINKS>(&INSERTION, link_length_m, &lumen);
    let (series, mut fastest) = run()?;
    for _ in 1..RUNS {
        fastest = fastest.min(run()?.1);
    }
    let us_per_step = 1e6 * fastest.as_secs_f64() / series.force_n.len() as f64;
    Ok(Ours {
        us_per_step,
        real_time_factor: 1e6 * INSERTION.sample_s / us_per_step,
        score: Score::of(&series, reference).context("the model touches nothing")?,
    })
}
