//! `cargo xtask bench --environments`: steps a second of the environment for Gymnasium beside every other
//! endovascular environment that pip installs, each in an environment of Python that is thrown away.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use serde_json::Value;

use crate::arguments::Given;
use crate::consent::Consent;
use crate::shell::{command, root, run, target_folder};
use crate::wheel;

/// Control rate at which this environment is measured if no other one sets it \[Hz\].
const USUAL_HZ: f64 = 20.0;

/// An environment that pip installs.
struct Peer {
    name: &'static str,
    requirement: &'static str,
    script: &'static str,
}

/// CathSim is in no registry; pip takes it from its repository.
const PEERS: [Peer; 1] = [Peer {
    name: "CathSim",
    requirement: "cathsim @ git+https://github.com/robotvision-ai/cathsim",
    script: "host/bench/environments/cathsim_steps.py",
}];

/// Environments that pip does not install.
const OTHERS: [(&str, &str); 2] = [
    ("stEVE", "it needs a build of SOFA with plugins, which no package of pip holds"),
    ("Lumen", "no registry has a package of it; its authors state 79.7 steps a second"),
];

/// Steps a second at a control rate.
struct Rate {
    control_hz: f64,
    steps_per_s: f64,
}

/// What a script has measured.
struct Measured {
    version: String,
    rates: Vec<Rate>,
    answer: Value,
}

/// Measures everything in one run and prints the tables. `Err` if no other environment could be measured, so
/// that nobody takes the figures for a comparison.
pub fn measure(given: &Given) -> anyhow::Result<()> {
    let consent = Consent::of(given);
    let wheel = match given.path("wheel")? {
        Some(wheel) if !wheel.is_file() => {
            bail!("--wheel {}: there is no such file", wheel.display())
        }
        Some(wheel) => wheel,
        None => wheel::build(consent)?,
    };
    let wheel = wheel.to_str().context("the path of the wheel is not Unicode")?;
    consent.to(
        "pip install of the wheel and of each other environment, in folders that are removed",
    )?;
    let mut peers = Vec::new();
    let mut absent: Vec<(&str, String)> = Vec::new();
    for peer in &PEERS {
        match in_venv(peer.name, &[peer.requirement], peer.script, &[]) {
            Ok(measured) => peers.push((peer.name, measured)),
            Err(error) => absent.push((peer.name, format!("{error:#}"))),
        }
    }
    let mut rates: Vec<f64> = peers.iter().flat_map(|(_, own)| own.hertz()).collect();
    if rates.is_empty() {
        rates.push(USUAL_HZ);
    }
    let words: Vec<String> =
        rates.iter().flat_map(|rate| ["--control-hz".into(), rate.to_string()]).collect();
    let needed = [wheel, "gymnasium==1.4.0"];
    let own = in_venv("Cathforce", &needed, "host/bench/environments/ours.py", &words)?;
    print!("{}", table(&own, &peers)?);
    for (name, why) in &absent {
        println!("\n{name} is not measured: {why}");
    }
    for (name, why) in OTHERS {
        println!("\n{name} is not measured: {why}.");
    }
    if peers.is_empty() {
        bail!("no other environment could be measured, so there is nothing to compare with");
    }
    Ok(())
}

/// Installs packages, runs a script with them and removes them.
fn in_venv(
    name: &str,
    packages: &[&str],
    script: &str,
    words: &[String],
) -> anyhow::Result<Measured> {
    let venv = target_folder().join("bench/environments").join(name);
    let found = measured_in(&venv, packages, script, words);
    match std::fs::remove_dir_all(&venv) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| venv.display().to_string())
        }
        _ => found,
    }
}

fn measured_in(
    venv: &Path,
    packages: &[&str],
    script: &str,
    words: &[String],
) -> anyhow::Result<Measured> {
    run(command("python3").args(["-m", "venv", "--clear"]).arg(venv))?;
    let python: PathBuf = venv.join("bin/python");
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--timeout", "20"];
    printed(command(&python).args(pip).args(packages))
        .with_context(|| format!("pip could not install {}", packages.join(", ")))?;
    let answer = printed(command(&python).arg(root().join(script)).args(words))
        .with_context(|| format!("{script} failed"))?;
    let answer: Value = serde_json::from_str(answer.trim()).context("its answer is no JSON")?;
    Measured::of(answer)
}

/// What a command prints on its standard output; the error is the line that tells why it failed.
fn printed(command: &mut Command) -> anyhow::Result<String> {
    eprintln!("\n▶ {}", crate::shell::line(command));
    let output = command.output()?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    bail!("{}", cause(&said))
}

/// The line that tells most of why a command failed: Git's own, else the first error, else the last line.
fn cause(said: &str) -> &str {
    let with = |word: &str| said.lines().find(|line| line.to_lowercase().contains(word));
    let last = || said.lines().rfind(|line| !line.trim().is_empty());
    with("fatal:").or_else(|| with("error")).or_else(last).unwrap_or("it said nothing").trim()
}

impl Measured {
    fn of(answer: Value) -> anyhow::Result<Self> {
        let number = |of: &Value, name: &str| {
            of.get(name).and_then(Value::as_f64).with_context(|| format!("no number `{name}`"))
        };
        let rates = answer.get("rates").and_then(Value::as_array).context("no list `rates`")?;
        let rates = rates.iter().map(|row| {
            let (control_hz, steps_per_s) =
                (number(row, "control_hz")?, number(row, "steps_per_s")?);
            Ok(Rate { control_hz, steps_per_s })
        });
        let rates = rates.collect::<anyhow::Result<Vec<_>>>()?;
        let version = answer.get("version").and_then(Value::as_str).context("no version")?;
        Ok(Self { version: version.to_owned(), rates, answer })
    }

    fn hertz(&self) -> impl Iterator<Item = f64> {
        self.rates.iter().map(|rate| rate.control_hz)
    }
}

/// The environments at equal control rates, then the batch by its size.
fn table(own: &Measured, peers: &[(&str, Measured)]) -> anyhow::Result<String> {
    let mut text = String::from(
        "\n| environment | control rate | steps a second | Cathforce has |\n| --- | --- | --- | --- |\n",
    );
    for rate in &own.rates {
        let Rate { control_hz, steps_per_s } = rate;
        text +=
            &format!("| Cathforce {} | {control_hz:.0} Hz | {steps_per_s:.0} | |\n", own.version);
        for (name, peer) in peers {
            for theirs in peer.rates.iter().filter(|theirs| theirs.control_hz == *control_hz) {
                let ratio = steps_per_s / theirs.steps_per_s;
                text += &format!(
                    "| {name} {} | {control_hz:.0} Hz | {:.1} | {ratio:.0} × |\n",
                    peer.version, theirs.steps_per_s
                );
            }
        }
    }
    text += "\n| catheters of 64 links in a batch | catheter-milliseconds a second | growth of the time | \
             processor time of each |\n| --- | --- | --- | --- |\n";
    let batches =
        own.answer.get("batches").and_then(Value::as_array).context("no list `batches`")?;
    let mut before: Option<(f64, f64)> = None;
    for row in batches {
        let number = |name: &str| row.get(name).and_then(Value::as_f64);
        let (n, rate) =
            number("n").zip(number("catheter_ms_per_s")).context("a row of `batches`")?;
        let growth = before.filter(|(other, _)| n == 2.0 * other);
        let growth =
            growth.map_or(String::new(), |(_, other)| format!("× {:.2}", 2.0 * other / rate));
        let processor_us = number("processor_us").context("no number `processor_us`")?;
        text += &format!("| {n} | {rate:.0} | {growth} | {processor_us:.2} µs |\n");
        before = Some((n, rate));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn measured(version: &str, steps_per_s: f64) -> Measured {
        let answer = json!({
            "version": version,
            "rates": [{ "control_hz": 20.0, "steps_per_s": steps_per_s }],
            "batches": [
                { "n": 16, "catheter_ms_per_s": 5e5, "processor_us": 3.0 },
                { "n": 32, "catheter_ms_per_s": 4e5, "processor_us": 3.5 },
            ],
        });
        Measured::of(answer).unwrap()
    }

    #[test]
    fn figures_of_one_control_rate_are_compared() {
        let text = table(&measured("1.0", 4000.0), &[("Other", measured("2.0", 10.0))]).unwrap();
        for expected in [
            "| Cathforce 1.0 | 20 Hz | 4000 | |",
            "| Other 2.0 | 20 Hz | 10.0 | 400 × |",
            "| 16 | 500000 |  | 3.00 µs |",
            "| 32 | 400000 | × 2.50 | 3.50 µs |",
        ] {
            assert!(text.contains(expected), "`{expected}` is not in:\n{text}");
        }
    }

    #[test]
    fn the_line_is_shown_that_tells_why() {
        let said =
            "  error: subprocess-exited-with-error\n  fatal: unable to access it\nSee above.\n";
        assert_eq!(cause(said), "fatal: unable to access it");
        assert_eq!(cause("ERROR: no such package\nnote: see\n"), "ERROR: no such package");
        assert_eq!(cause("\n"), "it said nothing");
    }

    #[test]
    fn an_answer_without_a_figure_is_refused_by_name() {
        let answer = json!({ "version": "1", "rates": [{ "control_hz": 20.0 }] });
        let error = Measured::of(answer).err().map(|error| error.to_string());
        assert_eq!(error.as_deref(), Some("no number `steps_per_s`"));
    }
}
