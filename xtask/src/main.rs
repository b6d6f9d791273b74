//! `cargo xtask demo` and `cargo xtask test`, and the steps that they are made of.

#![forbid(unsafe_code)]

mod accuracy;
mod bench;
mod build;
mod citations;
mod demo;
mod disk;
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
    /// Measure the model against the reference solver, and write the table into docs/reference/validation.md.
    Accuracy(accuracy::Arguments),
    /// Install what is missing: Rust components, the emulators, a Linux guest.
    Setup(setup::Consent),
}

// One reader of the pages for the tests of both programs.
#[cfg(test)]
#[path = "../../host/cli/tests/support/documented.rs"]
mod documented;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_that_the_pages_print_exist() {
        let all = documented::documented(&["cargo", "xtask"]);
        assert!(all.len() >= 8, "{} commands", all.len());
        for printed in all {
            let words =
                std::iter::once("xtask").chain(printed.words[2..].iter().map(String::as_str));
            let parsed = Arguments::try_parse_from(words);
            assert!(parsed.is_ok(), "{}: {:?}", printed.place, printed.words);
        }
    }

    /// `cargo test -p PACKAGE --test FILE`, `cargo run -p PACKAGE --example FILE`.
    #[test]
    fn the_tests_and_examples_that_the_pages_print_exist() {
        let all = documented::documented(&["cargo"]);
        let mut seen = 0;
        for printed in
            all.iter().filter(|printed| printed.words.get(1).is_some_and(|word| word != "xtask"))
        {
            let after = |option: &str| {
                let at = printed.words.iter().position(|word| word == option)?;
                printed.words.get(at + 1)
            };
            let Some(package) = after("-p") else { continue };
            let name = package.trim_start_matches("cathforce-");
            let folders =
                ["shared", "host", "."].map(|folder| shell::root().join(folder).join(name));
            let cli = shell::root().join("host/cli");
            let folder = match name {
                "cathforce" => Some(&cli),
                _ => folders.iter().find(|folder| folder.join("Cargo.toml").is_file()),
            };
            let folder =
                folder.unwrap_or_else(|| panic!("{}: no package {package}", printed.place));
            for (option, place) in [("--test", "tests"), ("--example", "examples")] {
                let Some(file) = after(option) else { continue };
                let there = [format!("{file}.rs"), format!("{file}/main.rs")];
                let is_there = there.iter().any(|file| folder.join(place).join(file).is_file());
                assert!(is_there, "{}: {place}/{file} of {package}", printed.place);
                seen += 1;
            }
        }
        assert!(seen >= 5, "{seen} tests and examples");
    }
}
