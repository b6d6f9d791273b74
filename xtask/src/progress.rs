//! Long commands that are never silent: what is being done, and since when.

use std::io::{IsTerminal, Read, Write};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};

use crate::shell;

/// Lines in a log come this far apart, and a terminal's line is rewritten this often.
const IN_A_LOG: Duration = Duration::from_secs(4);
const IN_A_TERMINAL: Duration = Duration::from_millis(250);

/// Runs one command as [`shell::run`] does. Where nobody sees cargo's progress bar, lines say how
/// long it has been running.
pub fn run(command: &mut Command) -> anyhow::Result<()> {
    let name = shell::line(command);
    let name = name.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
    with_heartbeat(&name, || shell::run(command))
}

/// Does something, saying every few seconds of a log that it is still being done.
pub fn with_heartbeat<T>(name: &str, work: impl FnOnce() -> T) -> T {
    if std::io::stderr().is_terminal() {
        return work();
    }
    let began = Instant::now();
    let is_done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let beating = scope.spawn(|| {
            while !is_done.load(Ordering::Relaxed) {
                std::thread::park_timeout(IN_A_LOG);
                if !is_done.load(Ordering::Relaxed) {
                    eprintln!("  {} {name} …", seconds(began));
                }
            }
        });
        let result = work();
        is_done.store(true, Ordering::Relaxed);
        beating.thread().unpark();
        result
    })
}

/// Commands that run one after the other, beside other jobs.
pub struct Job {
    name: &'static str,
    steps: Vec<Command>,
    is_aloud: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// What it does now.
    now: String,
    /// What was printed, for whoever wonders why it failed.
    said: String,
    ended: Option<anyhow::Result<()>>,
}

impl Job {
    pub fn new(name: &'static str, steps: impl IntoIterator<Item = Command>) -> Self {
        Self { name, steps: steps.into_iter().collect(), is_aloud: false, state: Mutex::default() }
    }

    /// Whatever it says is printed when it has ended well, too.
    pub fn aloud(self) -> Self {
        Self { is_aloud: true, ..self }
    }
}

/// Runs all jobs at once, one line of progress for all; fails with what a failed one has printed.
pub fn side_by_side(mut jobs: Vec<Job>) -> anyhow::Result<()> {
    let began = Instant::now();
    let is_terminal = std::io::stderr().is_terminal();
    let taken: Vec<_> = jobs.iter_mut().map(|job| std::mem::take(&mut job.steps)).collect();
    for (job, steps) in jobs.iter().zip(&taken) {
        for step in steps {
            eprintln!("▶ {}: {}", job.name, shell::line(step));
        }
    }
    std::thread::scope(|scope| {
        for (job, steps) in jobs.iter().zip(taken) {
            scope.spawn(move || {
                let ended = steps.into_iter().try_for_each(|step| follow(step, &job.state));
                let mut state = job.state.lock().unwrap_or_else(PoisonError::into_inner);
                state.ended = Some(ended);
            });
        }
        watch(&jobs, began, is_terminal);
    });
    for job in jobs {
        let state = job.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(Err(error)) = state.ended {
            return Err(error.context(format!("{}:\n{}", job.name, state.said.trim_end())));
        }
        if job.is_aloud {
            println!("{}", state.said.trim_end());
        }
    }
    Ok(())
}

/// Prints what the jobs do until all have ended.
fn watch(jobs: &[Job], began: Instant, is_terminal: bool) {
    let mut told = vec![false; jobs.len()];
    let mut last = Instant::now();
    let clear = if is_terminal { "\r\x1b[2K" } else { "" };
    loop {
        let mut running = Vec::new();
        for (job, told) in jobs.iter().zip(&mut told) {
            let state = job.state.lock().unwrap_or_else(PoisonError::into_inner);
            match &state.ended {
                None => running.push(format!("{}: {}", job.name, state.now)),
                Some(result) if !*told => {
                    *told = true;
                    let how = if result.is_ok() { "ready" } else { "failed" };
                    eprintln!("{clear}  {} {} {how}", seconds(began), job.name);
                }
                Some(_) => {}
            }
        }
        if running.is_empty() {
            return;
        }
        if is_terminal {
            let line = format!("  {} {}", seconds(began), running.join("  ·  "));
            let line: String = line.chars().take(110).collect();
            eprint!("{clear}{line}");
            let _ = std::io::stderr().flush();
        } else if last.elapsed() >= IN_A_LOG {
            last = Instant::now();
            eprintln!("  {} {}", seconds(began), running.join("  ·  "));
        }
        std::thread::sleep(IN_A_TERMINAL);
    }
}

/// Runs one command to its end, reading what it prints.
fn follow(mut command: Command, state: &Mutex<State>) -> anyhow::Result<()> {
    let line = shell::line(&command);
    // Cargo counts what it builds only where it believes that somebody looks.
    command.env("CARGO_TERM_PROGRESS_WHEN", "always").env("CARGO_TERM_PROGRESS_WIDTH", "120");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| format!("`{line}` cannot be started"))?;
    let (out, err) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        scope.spawn(|| out.map(|pipe| note(pipe, state)));
        if let Some(pipe) = err {
            note(pipe, state);
        }
    });
    let status = child.wait()?;
    if !status.success() {
        bail!("`{line}` failed ({status})");
    }
    Ok(())
}

/// Keeps every line, and the last one as what is being done.
fn note(mut pipe: impl Read, state: &Mutex<State>) {
    let mut buffer = [0; 4096];
    let mut rest = Vec::new();
    while let Ok(n @ 1..) = pipe.read(&mut buffer) {
        rest.extend_from_slice(&buffer[..n]);
        while let Some(end) = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r') {
            let line: Vec<u8> = rest.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line[..end]).into_owned();
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(now) = now(&line) {
                state.now = now;
            }
            if !is_routine(&line) {
                state.said += &line;
                state.said.push('\n');
            }
        }
    }
    let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
    state.said += &String::from_utf8_lossy(&rest);
}

/// What a line of cargo, rustup or apt says is being done.
fn now(line: &str) -> Option<String> {
    let plain = line.trim().trim_start_matches("\x1b[K");
    if plain.is_empty() {
        return None;
    }
    // Building [=====>      ] 55/214: mcap, parquet
    let Some((_, built)) = plain.split_once(']').filter(|_| is_bar(plain)) else {
        return Some(plain.chars().take(60).collect());
    };
    let (count, names) = built.split_once(':').unwrap_or((built, ""));
    let first = names.split(',').next().unwrap_or_default().trim();
    Some(format!("{} {first}", count.trim().replace('/', " of ")).trim_end().to_owned())
}

fn is_bar(line: &str) -> bool {
    ["Building [", "Downloading ["].iter().any(|begin| line.contains(begin))
}

/// Lines that explain no failure.
fn is_routine(line: &str) -> bool {
    const BEGINNINGS: [&str; 7] = [
        "Compiling ",
        "Downloaded ",
        "Downloading ",
        "Blocking ",
        "Fresh ",
        "Updating ",
        "Locking ",
    ];
    is_bar(line) || BEGINNINGS.iter().any(|begin| line.trim_start().starts_with(begin))
}

fn seconds(began: Instant) -> String {
    format!("{:>4.0} s", began.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargos_bar_is_shortened_to_its_count_and_what_it_builds() {
        let bar = "    Building [=======>       ] 55/214: mcap, parquet(build)";
        assert_eq!(now(bar).as_deref(), Some("55 of 214 mcap"));
        assert_eq!(
            now("    Building [====] 213/214: cathforce(bin)...").as_deref(),
            Some("213 of 214 cathforce(bin)...")
        );
        assert_eq!(
            now("info: downloading component").as_deref(),
            Some("info: downloading component")
        );
        assert_eq!(now("  "), None);
    }

    #[test]
    fn what_a_failed_job_has_printed_is_in_its_error() {
        let mut fails = Command::new("sh");
        fails.args(["-c", "echo '   Compiling a v1'; echo 'error: b is broken' >&2; exit 3"]);
        let good = Job::new("good", [Command::new("true"), Command::new("true")]);
        let error = side_by_side(vec![good, Job::new("bad", [fails])]).unwrap_err();
        let text = format!("{error:#}");
        assert!(text.starts_with("bad:\nerror: b is broken: `sh -c"), "{text}");
    }

    #[test]
    fn the_steps_of_a_job_end_with_the_first_that_fails() {
        let folder = std::env::temp_dir().join(format!("xtask-steps-{}", std::process::id()));
        let mut second = Command::new("touch");
        second.arg(&folder);
        assert!(side_by_side(vec![Job::new("one", [Command::new("false"), second])]).is_err());
        assert!(!folder.exists());
    }
}
