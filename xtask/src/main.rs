//! `cargo xtask demo` and `cargo xtask test`, and the steps that they are made of.

#![forbid(unsafe_code)]

mod arguments;
mod audit;
mod bench;
mod book;
mod browser;
mod build;
mod citations;
mod consent;
mod demo;
mod disk;
mod dist;
mod emulator;
mod figures;
mod firmware;
mod fuzz;
mod gates;
mod guest;
mod layers;
mod packages;
#[cfg(test)]
mod pages;
mod progress;
mod promises;
mod setup;
mod shell;
mod test;
mod validation;
mod wheel;

use std::process::ExitCode;

use arguments::{Asked, Task};
use consent::Consent;

// One reader of the pages for the tests of both programs.
#[cfg(test)]
#[path = "../../host/cli/tests/support/documented.rs"]
mod documented;

/// What `cargo xtask` can do.
static TASKS: [Task; 14] = [
    Task {
        name: "demo",
        former: None,
        about: "A 10 s insertion on the emulated board, with a table and a folder of results.",
        options: &demo::OPTIONS,
        run: demo::run,
    },
    Task {
        name: "test",
        former: None,
        about: "Everything: format, lints, unit tests, firmware, tests on the emulated board.",
        options: &[consent::YES],
        run: |given| test::run_all(Consent::of(given)),
    },
    Task {
        name: "promises",
        former: None,
        about: "Run the tests behind the promises, and print what is kept with which figure.",
        options: &promises::OPTIONS,
        run: promises::run,
    },
    Task {
        name: "firmware",
        former: None,
        about: "Build the firmware of both boards and say how large it is.",
        options: &firmware::OPTIONS,
        run: firmware::build,
    },
    Task {
        name: "figures",
        former: None,
        about: "Measure the figures that README and docs quote, and write them there.",
        options: &[consent::YES],
        run: |given| figures::write(Consent::of(given)),
    },
    Task {
        name: "bench",
        former: None,
        about: "Measure cost and accuracy, beside other simulators, and write the benchmarks' page.",
        options: &bench::OPTIONS,
        run: bench::measure,
    },
    Task {
        name: "validation",
        former: Some("accuracy"),
        about: "Measure the model against the reference solver, and write the table into docs/reference/validation.md.",
        options: &validation::OPTIONS,
        run: validation::write,
    },
    Task {
        name: "dist",
        former: None,
        about: "Build everything to install: static program, Debian package, firmware, SBOM, checksums.",
        options: &dist::OPTIONS,
        run: dist::run_task,
    },
    Task {
        name: "fuzz",
        former: None,
        about: "Search for inputs that break a decoder, an importer, the control step or the store.",
        options: &fuzz::OPTIONS,
        run: fuzz::search,
    },
    Task {
        name: "miri",
        former: None,
        about: "Run tests of the shared crates in Miri, with a nightly compiler.",
        options: &fuzz::MIRI_OPTIONS,
        run: fuzz::miri,
    },
    Task {
        name: "wheel",
        former: None,
        about: "Build the Python package as a wheel, with the program in it.",
        options: &[consent::YES],
        run: |given| wheel::build(Consent::of(given)).map(|_| ()),
    },
    Task {
        name: "audit",
        former: None,
        about: "Check the licences, sources and known vulnerabilities of all dependencies.",
        options: &[consent::YES],
        run: |given| audit::run(Consent::of(given)),
    },
    Task {
        name: "book",
        former: None,
        about: "Build the book of docs/ with mdBook, into target/book.",
        options: &[consent::YES],
        run: |given| book::build(Consent::of(given)),
    },
    Task {
        name: "setup",
        former: None,
        about: "Install what is missing: Rust components, the emulators, a Linux guest.",
        options: &[consent::YES],
        run: |given| setup::all(Consent::of(given)),
    },
];

fn main() -> ExitCode {
    let result = match arguments::parse(&TASKS, std::env::args_os().skip(1)) {
        Ok(Asked::Help(text)) => {
            print!("{text}");
            return ExitCode::SUCCESS;
        }
        Ok(Asked::Run(task, given)) => (task.run)(&given),
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
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
            let parsed = arguments::parse(&TASKS, &printed.words[2..]);
            let problem = parsed.err().map(|error| error.to_string());
            assert_eq!(problem, None, "{}: {:?}", printed.place, printed.words);
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
