//! `cargo xtask test`: everything, what fails fastest first.

use std::process::Command;
use std::time::Instant;

use crate::build::{FIRMWARE_VARIABLE, NUCLEO_FIRMWARE_VARIABLE};
use crate::consent::Consent;
use crate::progress::{Job, side_by_side};
use crate::setup;
use crate::shell::{cargo, command, output, root, run, target_folder};
use crate::{browser, build, citations, demo, disk, emulator, gates, guest, layers, promises};

/// Lints are errors.
const DENY_WARNINGS: [&str; 3] = ["--", "-D", "warnings"];

pub fn run_all(consent: Consent) -> anyhow::Result<()> {
    let mut phases = Phases::default();
    disk::warn();
    phases.time("install what is missing", || install(consent))?;
    phases.time("format, layers, promises, citations", || {
        run(&mut cargo(&["fmt", "--all", "--check"]))?;
        layers::check(&build::metadata()?)?;
        promises::check(root())?;
        citations::check(root())
    })?;
    // Cargo keeps the firmware in a folder of its own, so neither job waits for the other.
    phases.time("lints, firmware, program", || {
        let host = Job::new("host", [lints(), lints_of_the_demo(), program_as_tested()]);
        let firmware = [
            build::firmware_command(),
            lints_of_firmware(),
            build::nucleo_firmware_command(),
            lints_of_nucleo_firmware(),
        ];
        let firmware = Job::new("firmware", firmware);
        side_by_side(vec![host, firmware])
    })?;
    let elf = build::firmware_elf();
    // The gates take the program that the tests run; they do not need a faster one.
    let program = target_folder().join("debug/cathforce");
    let out = target_folder().join("demo");
    std::fs::create_dir_all(&out)?;
    emulator::ensure(&program, &elf, consent)?;
    let runner = runner();
    // Frames on the emulated board leave time for the compiler.
    let summary = phases.time("tests are built, the example runs on the board", || {
        let (example, summary) = demo::example(&program, &elf, &out);
        let mut build = cargo(runner.words());
        build.arg("--no-run");
        side_by_side(vec![Job::new("tests", [build]), Job::new("example", [example]).aloud()])?;
        guest::give(&program)?;
        Ok(summary)
    })?;
    gates::check(&summary)?;
    let tests = phases.time("tests", || {
        let mut tests = runner.tests();
        tests.env(NUCLEO_FIRMWARE_VARIABLE, build::nucleo_firmware_elf());
        run(tests.arg("--no-fail-fast").env(FIRMWARE_VARIABLE, elf))
    });
    phases.print();
    tests
}

fn install(consent: Consent) -> anyhow::Result<()> {
    setup::suite_components(consent)?;
    setup::firmware_target(consent)?;
    if let Some(mut install) = emulator::missing(consent)? {
        run(&mut install)?;
    }
    browser::ensure(consent)?;
    guest::prepare(consent)
}

fn lints() -> Command {
    let mut clippy = cargo(&["clippy", "--workspace", "--all-targets"]);
    clippy.args(DENY_WARNINGS);
    clippy
}

/// The program as the demo builds it, without the features that are on by default. Of the whole workspace,
/// because for one package cargo would check the libraries of others anew.
fn lints_of_the_demo() -> Command {
    let mut clippy = cargo(&["clippy", "--workspace", "--no-default-features"]);
    clippy.args(DENY_WARNINGS);
    clippy
}

fn lints_of_firmware() -> Command {
    let mut clippy = cargo(&["clippy"]);
    clippy.args(build::FIRMWARE).args(DENY_WARNINGS).env_remove("RUSTFLAGS");
    clippy
}

fn lints_of_nucleo_firmware() -> Command {
    let mut clippy = cargo(&["clippy"]);
    clippy.args(build::FIRMWARE).args(build::NUCLEO).args(DENY_WARNINGS).env_remove("RUSTFLAGS");
    clippy
}

/// Of the whole workspace, as for its tests: of one package cargo may build it anew. The libraries, because that
/// of the Python package is built for no test.
fn program_as_tested() -> Command {
    cargo(&["build", "--workspace", "--lib", "--bin", "cathforce"])
}

/// What runs the tests.
enum Runner {
    Nextest,
    Cargo,
}

fn runner() -> Runner {
    match output(command("cargo").args(["nextest", "--version"])) {
        Some(_) => Runner::Nextest,
        None => Runner::Cargo,
    }
}

impl Runner {
    fn words(&self) -> &'static [&'static str] {
        match self {
            Self::Nextest => &["nextest", "run", "--workspace"],
            Self::Cargo => &["test", "--workspace"],
        }
    }

    /// Tests of the emulated board are tests like any other.
    fn tests(&self) -> Command {
        let mut tests = cargo(self.words());
        if let Self::Nextest = self {
            // Tests of the emulated board and of the buses wait for frames; another one uses that time.
            let processors = std::thread::available_parallelism().map_or(1, usize::from);
            tests.args(["--test-threads", &(processors + 1).to_string()]);
        }
        tests
    }
}

/// How long each part took.
#[derive(Default)]
struct Phases(Vec<(&'static str, f64)>);

impl Phases {
    fn time<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let began = Instant::now();
        let result = work();
        self.0.push((name, began.elapsed().as_secs_f64()));
        result
    }

    fn print(&self) {
        eprintln!();
        for (name, seconds) in &self.0 {
            eprintln!("{seconds:>6.0} s  {name}");
        }
        eprintln!("{:>6.0} s  in all", self.0.iter().map(|(_, seconds)| seconds).sum::<f64>());
    }
}
