//! `cargo xtask demo` and `cargo xtask test`, and the steps that they are made of.

#![forbid(unsafe_code)]

mod accuracy;
mod bench;
mod build;
mod demo;
mod emulator;
mod figures;
mod gates;
mod guest;
mod layers;
mod promises;
mod setup;
mod shell;
mod test;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(bin_name = "cargo xtask", about = "Builds, tests and shows Cathforce")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// A 10 s insertion on the emulated board, with a table and a folder of results.
    Demo(demo::Arguments),
    /// Everything: format, lints, unit tests, firmware, tests on the emulated board.
    Test(setup::Consent),
    /// Build the firmware and say how large it is.
    Firmware,
    /// Measure the figures that README and docs quote, and write them there.
    Figures(setup::Consent),
    /// Measure cost and accuracy, beside other simulators, and write docs/benchmarks.md.
    Bench(bench::Arguments),
    /// Measure the model against the reference solver, and write the table into docs/model.md.
    Accuracy(accuracy::Arguments),
    /// Install what is missing: Rust components, the emulators, a Linux guest.
    Setup(setup::Consent),
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().task {
        Task::Demo(arguments) => demo::run(&arguments),
        Task::Test(consent) => test::run_all(consent),
        Task::Firmware => {
            setup::rust(setup::Consent::default())?;
            build::firmware().map(drop)
        }
        Task::Figures(consent) => figures::write(consent),
        Task::Bench(arguments) => bench::measure(&arguments),
        Task::Accuracy(arguments) => accuracy::write(&arguments),
        Task::Setup(consent) => {
            setup::everything(consent)?;
            guest::ensure(consent)
        }
    }
}
