//! The insertion in other simulators, each a Python script beside this crate.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, bail, ensure};
use serde::{Deserialize, Serialize};

use super::{Insertion, Score, Series};

/// The peers' scripts and their largest insertion \[m\]; the explicit solver is fed only through the bend.
const SCRIPTS: [(&str, f64); 2] = [("mujoco_rod.py", 0.150), ("pyelastica_rod.py", 0.100)];

/// Time and accuracy of one simulator.
#[derive(Debug, Serialize)]
pub struct Peer {
    pub name: String,
    pub version: String,
    /// How it was set up.
    pub remark: String,
    /// How far it was fed \[m\].
    pub to_m: f64,
    pub step_s: f64,
    pub us_per_step: f64,
    pub real_time_factor: f64,
    #[serde(flatten)]
    pub score: Score,
}

/// Output of a script.
#[derive(Deserialize)]
struct Answer {
    name: String,
    version: String,
    remark: String,
    step_s: f64,
    us_per_step: f64,
    samples: Vec<[f64; 4]>,
}

/// Plays the insertion `runs` times in every peer; the fastest run of each counts.
///
/// `python`: an interpreter with the packages of `peers/requirements.txt`.
pub fn measure(
    insertion: &Insertion,
    reference: &Series,
    python: &Path,
    runs: usize,
) -> anyhow::Result<Vec<Peer>> {
    SCRIPTS
        .iter()
        .map(|&(script, end_m)| {
            let part = Insertion { end_m, ..*insertion };
            let run = |_| peer(&part, reference, python, script);
            let runs = (0..runs).map(run).collect::<anyhow::Result<Vec<Peer>>>();
            let runs = runs.with_context(|| format!("peer {script}"))?;
            let fastest = runs.into_iter().min_by(|a, b| a.us_per_step.total_cmp(&b.us_per_step));
            fastest.context("no run was asked for")
        })
        .collect()
}

fn peer(
    insertion: &Insertion,
    reference: &Series,
    python: &Path,
    script: &str,
) -> anyhow::Result<Peer> {
    eprintln!("▶ {script}, fed to {:.0} mm", 1e3 * insertion.end_m);
    let answer: Answer = serde_json::from_slice(&ask(insertion, python, script)?)
        .context("its answer is not the JSON that `peers/insertion.py` writes")?;
    ensure!(answer.samples.iter().flatten().all(|x| x.is_finite()), "its forces are not finite");
    let series: Series = answer.samples.iter().map(|&[x, f @ ..]| (x, f)).collect();
    let score = Score::of(&series, reference).context("it ends before the instrument touches")?;
    Ok(Peer {
        name: answer.name,
        version: answer.version,
        remark: answer.remark,
        to_m: insertion.end_m,
        step_s: answer.step_s,
        us_per_step: answer.us_per_step,
        real_time_factor: 1e6 * answer.step_s / answer.us_per_step,
        score,
    })
}

/// Runs a script with the insertion on its standard input; gives what it prints.
fn ask(insertion: &Insertion, python: &Path, script: &str) -> anyhow::Result<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers");
    let mut child = Command::new(python)
        .arg(script)
        .current_dir(folder)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        // Peers get one thread, because the comparison is by core.
        .envs([("OMP_NUM_THREADS", "1"), ("NUMBA_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("{} cannot be started", python.display()))?;
    let job = serde_json::to_vec(insertion)?;
    child.stdin.take().context("no standard input")?.write_all(&job)?;
    let output = child.wait_with_output()?;
    if !output.status.success() {
        bail!("it failed ({}); its own message stands above", output.status);
    }
    Ok(output.stdout)
}
