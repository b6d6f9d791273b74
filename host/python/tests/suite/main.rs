//! The Python package as people use it: its own tests, its types, its notebooks, and the code of the book, in an
//! environment of Python that is made once.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use cathforce_test_fixture::once;

/// `host/python`
fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in Unicode")
}

/// Runs a command to its end.
fn succeeded(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{said}{errors}");
    said
}

/// A Python with the packages of `requirements.txt`. One test makes it, the others wait.
fn python() -> PathBuf {
    environment("python", "tests/requirements.txt")
}

fn environment(name: &str, requirements: &str) -> PathBuf {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let guard = File::create(venv.with_extension("lock")).unwrap();
    guard.lock().unwrap();
    let python = venv.join("bin/python");
    let requirements = folder().join(requirements);
    let wanted = fs::read_to_string(&requirements).unwrap();
    // Written last: an installation that broke off is begun anew.
    let done = venv.join("installed.txt");
    if fs::read_to_string(&done).is_ok_and(|text| text == wanted) {
        return python;
    }
    succeeded(Command::new("python3").args(["-m", "venv", "--clear", text(&venv)]));
    let install = ["-m", "pip", "install", "--quiet", "--timeout", "20", "-r", text(&requirements)];
    succeeded(Command::new(&python).args(install));
    fs::write(done, wanted).unwrap();
    python
}

/// A Python that also learns, with the packages of `learning.txt`.
fn learning_python() -> PathBuf {
    environment("learning", "tests/learning.txt")
}

/// Where cargo puts what it builds for these tests: `target/debug`.
fn built() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    test.parent().and_then(Path::parent).expect("target/PROFILE/deps").to_path_buf()
}

/// Library and program of this build. Cargo builds no library for Python's sake along with a test, so it is asked for
/// it here; of the whole workspace, as the tests are, since of one package it would build the others anew.
fn build() {
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(folder()).args(["build", "--workspace", "--lib", "--bin", "cathforce"]);
    if built().file_name().is_some_and(|profile| profile == "release") {
        build.arg("--release");
    }
    succeeded(&mut build);
}

/// A folder with the package as a wheel installs it.
fn package() -> PathBuf {
    once("python-package", |site| {
        build();
        let own = site.join("cathforce");
        copy(&folder().join("python/cathforce"), &own);
        fs::copy(built().join("lib_cathforce.so"), own.join("_cathforce.abi3.so")).unwrap();
    })
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let goal = to.join(entry.file_name());
        match entry.path() {
            path if path.ends_with("__pycache__") => {}
            path if path.is_dir() => copy(&path, &goal),
            path => drop(fs::copy(path, goal).unwrap()),
        }
    }
}

/// Python with the package, and a folder of its own to work in.
fn with_package(name: &str) -> (Command, PathBuf) {
    let (python, package) = (python(), package());
    let work = once(name, |_| {});
    let mut command = Command::new(python);
    command
        .current_dir(&work)
        .env("PYTHONPATH", &package)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("CATHFORCE_PROGRAM", built().join("cathforce"))
        .env("CATHFORCE_EXAMPLES", folder().join("../../examples").canonicalize().unwrap())
        .env("MPLBACKEND", "agg")
        .env("RAY_ENABLE_UV_RUN_RUNTIME_ENV", "0");
    (command, package)
}

/// Runs tests of `tests/`; says how long the slowest took.
fn pytest(name: &str, files: &[&str], options: &[&str]) {
    let (mut python, _) = with_package(name);
    let files = files.iter().map(|file| folder().join("tests").join(file));
    let words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5", "--rootdir"];
    let said = succeeded(python.args(words).arg(folder()).args(options).args(files));
    println!("{said}");
    assert!(said.contains(" passed") && !said.contains("skipped"), "{said}");
}

#[test]
fn single_catheters_and_batches() {
    pytest("python-simulators", &["test_simulator.py", "test_batch.py"], &[]);
}

#[test]
fn recordings_bundles_diagnoses_and_calibrations() {
    pytest("python-data", &["test_data.py", "test_commands.py"], &[]);
}

#[test]
fn navigation() {
    pytest("python-gym", &["test_gym.py"], &[]);
}

/// The share of safe successes of a policy that knows nothing, and of one that has learned for a minute.
#[test]
#[ignore = "installs PyTorch, which takes gigabytes: cargo nextest run --workspace --run-ignored only -E 'test(learns)'"]
fn a_policy_learns_to_navigate_safely() {
    let (plain, _) = with_package("python-learning");
    let mut learn = Command::new(learning_python());
    learn.envs(plain.get_envs().filter_map(|(name, value)| Some((name, value?))));
    learn.arg(folder().join("examples/learn.py"));
    let said = succeeded(learn.args([
        "--steps",
        "40000",
        "--runs",
        "64",
        "--nominal",
        "--target",
        "left",
    ]));
    println!("{said}");
    let share = |when: &str| {
        let (_, rest) = said.split_once(&format!("\"{when}\": {{")).expect("a figure");
        let (_, rest) = rest.split_once("\"safe_success\": ").expect("a share");
        let number = rest.split([',', '}']).next().expect("a number");
        number.parse::<f64>().expect("a number")
    };
    let (before, after) = (share("before"), share("after"));
    assert!(after >= before + 0.5, "{before} before, {after} after");
}

#[test]
fn a_cluster_of_two_workers() {
    pytest("python-ray", &["test_ray.py"], &[]);
}

#[test]
fn the_code_of_the_book() {
    pytest("python-book", &["test_book.py"], &[]);
}

#[test]
fn notebooks() {
    pytest("python-notebooks", &["../notebooks"], &["--nbmake", "--nbmake-timeout=120"]);
}

#[test]
fn types_are_declared_and_the_stubs_are_those_of_the_library() {
    let (mut python, package) = with_package("python-types");
    let own = package.join("cathforce");
    let config = folder().join("pyproject.toml");
    let strictly = ["-m", "mypy", "--strict", "--no-incremental", "--cache-dir=/dev/null"];
    succeeded(python.args(strictly).args(["--config-file", text(&config)]).arg(&own));
    let (mut python, _) = with_package("python-types");
    let words = ["-m", "mypy.stubtest", "cathforce._cathforce", "--ignore-disjoint-bases"];
    succeeded(python.args(words));
}
