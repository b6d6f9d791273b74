//! Arguments of the commands about the gap between model and measurement.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use cathforce_gap::spike::Spike;
use clap::{ArgMatches, Args, Subcommand, ValueEnum};

use super::{Changes, JsonFile, link, positive, positive_seconds};

#[derive(Debug, Args)]
pub struct GapArguments {
    #[command(subcommand)]
    pub action: GapAction,
}

#[derive(Debug, Subcommand)]
pub enum GapAction {
    /// Diagnose the gap: where it lies, which effect causes it, and how far the effect closes it.
    Diagnose(DiagnoseArguments),
    /// Switch diagnosed effects on, in a settings file, on a device, or both.
    Apply(ApplyArguments),
    /// Play a fresh trial on the device with the settings, and measure the gap that is left there.
    Verify(VerifyArguments),
    /// Count the held-out forces that lie within their stated band.
    Coverage(CoverageArguments),
    /// Remove each named effect from the model in turn, and test whether the diagnosis finds it again.
    Ablation(AblationArguments),
    /// Put known effects into measured data, and test whether the diagnosis finds them.
    SpikeIn(SpikeInArguments),
    /// Compute which effects the trials can tell apart, and how large each must be to be seen.
    Isolability(IsolabilityArguments),
    /// Print the motion that a recording should contain, or play it.
    Protocol(ProtocolArguments),
    /// Write the table that compensates for a transmission: the input for each desired output.
    Compensate(CompensateArguments),
    /// List the effects that can be switched on and diagnosed.
    Effects(JsonFile),
    /// Test the diagnosis blind, on cases whose true effects stay sealed until every case is answered.
    #[command(alias = "challenge")]
    BlindTest(BlindTestArguments),
}

#[derive(Debug, Args)]
pub struct BlindTestArguments {
    #[command(subcommand)]
    pub action: BlindTestAction,
}

#[derive(Debug, Subcommand)]
pub enum BlindTestAction {
    /// Draw cases from a seed and simulate them with a solver that is not the device's model.
    Make(BlindTestMakeArguments),
    /// Write the SHA-256 of every label and every case, before anything is diagnosed.
    Seal(BlindTestFolder),
    /// Diagnose every sealed case that has no answer yet, one case on each core. Resumes an interrupted run.
    Run(BlindTestRunArguments),
    /// Check the labels against their seals and show them beside the answers.
    Reveal(BlindTestFolder),
    /// Score the answers: every figure with its target and its 95 % interval.
    Score(BlindTestFolders),
}

#[derive(Debug, Args)]
pub struct BlindTestFolder {
    /// Folder of the blind test.
    pub folder: PathBuf,
}

#[derive(Debug, Args)]
pub struct BlindTestFolders {
    /// Folders of blind tests; each is scored on its own.
    #[arg(required = true)]
    pub folders: Vec<PathBuf>,
    /// Day on which the seal was published, for the record of the score.
    #[arg(long, value_name = "YYYY-MM-DD")]
    pub date: Option<String>,
    /// Commit that published the seal, for the record of the score.
    #[arg(long, value_name = "COMMIT")]
    pub sealed_in: Option<String>,
    /// Commit of the program that answered, for the record of the score.
    #[arg(long, value_name = "COMMIT")]
    pub program_commit: Option<String>,
}

#[derive(Debug, Args)]
pub struct BlindTestMakeArguments {
    /// Folder to make, or to continue after an interruption.
    pub folder: PathBuf,
    /// Number of cases: 10 % without an effect, 25 % with an effect outside the library, 25 % with
    /// two effects, the rest with one.
    #[arg(long, default_value_t = 40)]
    pub cases: usize,
    /// Seed: the same seed gives the same cases. Without this option a seed is drawn and kept in the
    /// labels only, because anybody who knows it can draw the labels again.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Use the rig, motions and noise of this bundle instead of the four own rigs. If given several
    /// times, the bundles take turns.
    #[arg(long)]
    pub bundle: Vec<PathBuf>,
    /// Draw strangers: rigs, motions, sensors, nuisances and shapes of effects on which the diagnosis was
    /// not tuned. The vessels and instruments of `tuning` are in no case of `sealed`.
    #[arg(long, value_name = "SET", conflicts_with = "bundle")]
    pub strangers: Option<Strangers>,
}

/// A set of strangers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Strangers {
    /// To be looked at while the diagnosis is developed.
    Tuning,
    /// To be answered once.
    Sealed,
}

#[derive(Debug, Args)]
pub struct BlindTestRunArguments {
    /// Folder of the blind test.
    pub folder: PathBuf,
    /// Stop after this many cases. Another run continues.
    #[arg(long)]
    pub most: Option<usize>,
    /// Diagnose only this case, so that several computers can share a blind test. May be given several
    /// times.
    #[arg(long = "case", value_name = "CASE")]
    pub cases: Vec<String>,
}

#[derive(Debug, Args)]
pub struct ApplyArguments {
    /// Trial bundle that was diagnosed, or recordings of runs of one rig.
    #[arg(required = true, value_name = "BUNDLE|FILE.mcap")]
    pub bundle: Vec<PathBuf>,
    #[command(flatten)]
    pub source: ApplySource,
    /// Set only the error band of the forces, where the verdict names no effect.
    #[arg(long)]
    pub band_only: bool,
    /// Settings file to change. It is created if it does not exist.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Configure this device with the result, and read back what it uses.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
    /// Show what would change, and change nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// Where effects and their sizes come from.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ApplySource {
    /// Answer of `cathforce gap diagnose BUNDLE --out FILE.json`.
    #[arg(long, value_name = "FILE.json")]
    pub diagnosis: Option<PathBuf>,
    /// Fit this effect to the bundle instead, and no other. May be given several times.
    #[arg(long = "effect", value_name = "ID")]
    pub effects: Vec<String>,
}

#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// Trial bundle: the one that was diagnosed, or a fresh one of the same rig.
    pub bundle: PathBuf,
    /// Where the device is, as for `cathforce run`.
    #[arg(long, default_value = "qemu", value_parser = link::address)]
    pub link: String,
    /// Trial to play. The default is one that the diagnosis has not seen, if there is one.
    #[arg(long)]
    pub trial: Option<u32>,
    /// Answer of the diagnosis: the shrink that it predicts, and the trials that it has seen.
    #[arg(long, value_name = "FILE.json")]
    pub diagnosis: Option<PathBuf>,
    #[command(flatten)]
    pub changes: Changes,
    /// Play only this many seconds of the trial.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Record the run with the settings into this MCAP file, which must not exist yet.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Replace an existing recording, once the device has its configuration.
    #[arg(long, requires = "out")]
    pub overwrite: bool,
    /// Fail with exit code 6 if the force error that is left exceeds this, e.g. `rms_N=0.02`.
    #[arg(long, value_name = "rms_N=X", value_parser = rms_limit)]
    pub fail_above: Option<f64>,
}

#[derive(Debug, Args)]
pub struct CoverageArguments {
    /// Trial bundles: each is diagnosed.
    #[arg(required = true)]
    pub bundles: Vec<PathBuf>,
    /// Withhold this trial from the diagnosis, and count on withheld trials only. May be given several
    /// times. Without this option, every trial is held out in turn.
    #[arg(long, value_name = "TRIAL")]
    pub hold_back: Vec<u32>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct AblationArguments {
    /// Trial bundle, or recording.
    pub bundle: PathBuf,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct SpikeInArguments {
    /// Trial bundle.
    pub bundle: PathBuf,
    /// Effects to put in together, each with the parameters that differ from its switch-on values. May
    /// be given several times, once for each bundle. Without this option, every effect is put in by itself.
    #[arg(
        long = "effect",
        value_name = "ID[:PARAMETER=VALUE,...][+ID...]",
        value_parser = spikes
    )]
    pub effects: Vec<Spikes>,
    /// Leave this trial out. May be given several times.
    #[arg(long, value_name = "TRIAL")]
    pub hold_back: Vec<u32>,
    /// Write the bundle with the effects into this folder, and diagnose nothing.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
}

/// Effects of one bundle.
#[derive(Clone, Debug)]
pub struct Spikes(pub Vec<Spike>);

fn spikes(text: &str) -> Result<Spikes, String> {
    text.split('+').map(spike).collect::<Result<_, _>>().map(Spikes)
}

fn spike(text: &str) -> Result<Spike, String> {
    let (id, parameters) = text.split_once(':').unwrap_or((text, ""));
    let parameter = |text: &str| {
        let (name, value) = text.split_once('=').ok_or("write ID:parameter=value")?;
        let value: f64 = value.parse().map_err(|_| format!("{name}: `{value}` is no number"))?;
        Ok::<_, String>((name.to_owned(), value))
    };
    let parameters = parameters.split(',').filter(|text| !text.is_empty());
    Ok(Spike {
        id: id.to_owned(),
        parameters: parameters.map(parameter).collect::<Result<_, _>>()?,
    })
}

/// Between which insertions a protocol goes.
#[derive(Debug, Args)]
pub struct Way {
    /// Insertion at which the tip is free. The default is where the trials of the bundle begin.
    #[arg(long, value_name = "METRES")]
    pub from_m: Option<f64>,
    /// Insertion at which the tip touches. The default is the deepest of the trials of the bundle.
    #[arg(long, value_name = "METRES")]
    pub to_m: Option<f64>,
}

#[derive(Debug, Args)]
pub struct IsolabilityArguments {
    /// Trial bundle, one without trials (its rig and vessel), or recording of a run.
    pub bundle: PathBuf,
    /// Use the motion of `cathforce gap protocol` instead of that of the trials.
    #[arg(long)]
    pub protocol: bool,
    #[command(flatten)]
    pub way: Way,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct ProtocolArguments {
    /// Trial bundle, or one without trials: its rig and vessel.
    pub bundle: PathBuf,
    #[command(flatten)]
    pub way: Way,
    /// Rows per second.
    #[arg(long, value_name = "HZ", default_value_t = 250.0, value_parser = rate)]
    pub rate: f64,
    /// Write the rows into this file instead of stdout.
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Play it on this device, as `cathforce run` plays a trial.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
    /// Record it into this MCAP file, which must not exist yet.
    #[arg(long, value_name = "FILE.mcap", requires = "link")]
    pub out: Option<PathBuf>,
    /// Replace an existing recording, once the device has its configuration.
    #[arg(long, requires = "out")]
    pub overwrite: bool,
    #[command(flatten)]
    pub changes: Changes,
}

fn rate(text: &str) -> Result<f64, String> {
    let wanted = "a rate from 1 to 1000 Hz";
    positive(text, wanted).and_then(|hz| {
        if (1.0..=1000.0).contains(&hz) { Ok(hz) } else { Err(format!("give {wanted}")) }
    })
}

#[derive(Debug, Args)]
pub struct CompensateArguments {
    /// Trial bundle of a transmission.
    pub bundle: PathBuf,
    /// Answer of `cathforce gap diagnose BUNDLE --out FILE.json`. Without this option, the bundle is diagnosed.
    #[arg(long, value_name = "FILE.json")]
    pub diagnosis: Option<PathBuf>,
    /// Rows of the table.
    #[arg(long, default_value_t = 201, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub rows: u32,
    /// Load at the output, in N or N·m. The default is the mean of the trials.
    #[arg(long, allow_hyphen_values = true, value_parser = finite)]
    pub load: Option<f64>,
    /// Desired outputs, in columns `t_s` and `output_m` or `output_rad`: write the input for each row, by the model with
    /// what it remembers, instead of the table.
    #[arg(long, value_name = "FILE.csv")]
    pub along: Option<PathBuf>,
    /// Write the rows into this file instead of stdout.
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
    number.ok_or_else(|| "give a number".to_owned())
}

#[derive(Debug, Args)]
pub struct DiagnoseArguments {
    /// Trial bundle, or recordings of runs of one rig (MCAP), each a trial.
    #[arg(required = true, value_name = "BUNDLE|FILE.mcap")]
    pub bundle: Vec<PathBuf>,
    #[command(flatten)]
    pub json_file: JsonFile,
    /// Write the answer as a self-contained web page.
    #[arg(long, alias = "html", value_name = "FILE.html", value_parser = page_file)]
    pub report: Option<PathBuf>,
    /// Fail with exit code 6 if the force error that is left exceeds this, e.g. `rms_N=0.02`.
    #[arg(long, value_name = "rms_N=X", value_parser = rms_limit)]
    pub fail_above: Option<f64>,
    /// Leave this trial out, so that `cathforce gap verify` can use it as fresh data. May be given several times.
    #[arg(long, value_name = "TRIAL")]
    pub hold_back: Vec<u32>,
    /// Fit this effect and no other. May be given several times.
    #[arg(long = "effect", value_name = "ID")]
    pub effects: Vec<String>,
    /// End after this time with the best answer so far, e.g. `120s` or `2min`; the answer says that it was
    /// cut. Ctrl-C does the same at any time.
    #[arg(long, value_name = "TIME", value_parser = time_budget)]
    pub budget: Option<Duration>,
    /// Show the diagnosis in a browser while it runs, and its answer until Ctrl-C, at this address and port
    /// [default: 127.0.0.1:7410].
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true,
          default_missing_value = "127.0.0.1:7410")]
    pub dash: Option<SocketAddr>,
}

impl DiagnoseArguments {
    /// What follows `--json` directly is the file of the answer, unless it can be diagnosed itself.
    pub fn take_file_of_json(&mut self, matches: &ArgMatches) {
        let after = matches.index_of("json").map(|index| index + 1);
        let mut indices = matches.indices_of("bundle").into_iter().flatten();
        let Some(at) = after.and_then(|after| indices.position(|index| index == after)) else {
            return;
        };
        let path = &self.bundle[at];
        let is_source = path.is_dir() || path.extension().is_some_and(|ending| ending == "mcap");
        if is_source || self.bundle.len() < 2 || self.json_file.out.is_some() {
            return;
        }
        let path = self.bundle.remove(at);
        self.json_file.out = (path != Path::new("-")).then_some(path);
    }
}

/// A time as `90`, `90s`, `1.5min` or `2m`.
fn time_budget(text: &str) -> Result<Duration, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let seconds = match &text[digits.len()..] {
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        other => return Err(format!("`{other}` is no unit of time; write 120s or 2min")),
    };
    let number: f64 = digits.parse().map_err(|_| "write a time such as 120s or 2min".to_owned())?;
    match Duration::try_from_secs_f64(seconds * number) {
        Ok(time) if time > Duration::ZERO => Ok(time),
        _ => Err("the time must be above 0".to_owned()),
    }
}

/// A page is for a browser, and stdout is the answer's.
fn page_file(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => {
            Err("a page goes into a file, as in --report page.html; `--json` prints the answer on \
                    stdout"
                .into())
        }
        file => Ok(file.into()),
    }
}

fn rms_limit(text: &str) -> Result<f64, String> {
    let value = text.strip_prefix("rms_N=").ok_or("write rms_N=X")?;
    positive(value, "a force in newtons above 0")
}
