//! Arguments of the commands about the gap between model and measurement.

use std::path::{Path, PathBuf};

use cathforce_effect_catalogue::Effect;
use cathforce_gap::spike::Spike;
use clap::{ArgMatches, Args, Subcommand};

use super::{Changes, JsonFile, link, positive, positive_seconds, unknown};

#[derive(Debug, Args)]
pub struct GapArguments {
    #[command(subcommand)]
    pub action: GapAction,
}

#[derive(Debug, Subcommand)]
pub enum GapAction {
    /// Say where the gap lies, which effect causes it and how far it shrinks.
    Diagnose(DiagnoseArguments),
    /// Switch diagnosed effects on: in a settings file, on a device, or both.
    Apply(ApplyArguments),
    /// Play a fresh trial on the device with its settings, and say what is left of the gap there.
    Verify(VerifyArguments),
    /// Say how many of the forces that were held out lie within the band that is stated for them.
    Coverage(CoverageArguments),
    /// Take each named effect out of a model that has the others, and say whether it is found again.
    Ablation(AblationArguments),
    /// Put known effects into the data of trials, and say whether they are found.
    SpikeIn(SpikeInArguments),
    /// Say which effects trials can tell apart, and how large each must be to be seen.
    Isolability(IsolabilityArguments),
    /// Print the motion that a recording should hold, or play it.
    Protocol(ProtocolArguments),
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
    /// Folder to make, or to go on with where that was broken off.
    pub folder: PathBuf,
    /// Cases: a tenth without an effect, a quarter with one that the library does not have, a
    /// quarter with two.
    #[arg(long, default_value_t = 40)]
    pub cases: usize,
    /// The same seed gives the same cases. Without one it is drawn, and kept in the labels alone: who
    /// knows it can draw the labels again.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Bundle whose rig, motions and noise cases get, in the place of the four own rigs; several
    /// take turns.
    #[arg(long)]
    pub bundle: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub struct BlindTestRunArguments {
    /// Folder of the blind test.
    pub folder: PathBuf,
    /// Stop after so many cases; another run goes on.
    #[arg(long)]
    pub most: Option<usize>,
}

#[derive(Debug, Args)]
pub struct ApplyArguments {
    /// Trial bundle that was diagnosed, or recordings of runs of one rig.
    #[arg(required = true, value_name = "BUNDLE|FILE.mcap")]
    pub bundle: Vec<PathBuf>,
    #[command(flatten)]
    pub source: ApplySource,
    /// Where the verdict names no effect: tell the device only how far its forces may be off.
    #[arg(long)]
    pub band_only: bool,
    /// Settings file to change; it is made if it is not there.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Configure this device with the result, and ask it what it uses.
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
    /// Fit this effect to the bundle instead, and no other; may be given more than once.
    #[arg(long = "effect", value_name = "ID", value_parser = effect)]
    pub effects: Vec<&'static Effect>,
}

#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// Trial bundle: the one that was diagnosed, or a fresh one of the same rig.
    pub bundle: PathBuf,
    /// Where the device is, as for `cathforce run`.
    #[arg(long, default_value = "qemu", value_parser = link::address)]
    pub link: String,
    /// Trial to play; one that the diagnosis has not seen, if there is one.
    #[arg(long)]
    pub trial: Option<u32>,
    /// Answer of the diagnosis: what it promised, and which trials it has seen.
    #[arg(long, value_name = "FILE.json")]
    pub diagnosis: Option<PathBuf>,
    #[command(flatten)]
    pub changes: Changes,
    /// Play only so many seconds of the trial.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Record the run with the settings into this MCAP file, which must not be there yet.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Replace the recording that is there, once the device has its configuration.
    #[arg(long, requires = "out")]
    pub overwrite: bool,
    /// Fail with exit code 6 when the force error that is left exceeds this, e.g. `rms_N=0.02`.
    #[arg(long, value_name = "rms_N=X", value_parser = rms_limit)]
    pub fail_above: Option<f64>,
}

#[derive(Debug, Args)]
pub struct CoverageArguments {
    /// Trial bundles: each is diagnosed.
    #[arg(required = true)]
    pub bundles: Vec<PathBuf>,
    /// Keep this trial from the diagnosis, and count on it alone; may be given more than once.
    /// Without it, every trial is held out in turn.
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
    /// Effects to put in at once, each with the parameters whose switch-on values are not wanted;
    /// may be given more than once, for a bundle each. Without it every effect, one by one.
    #[arg(
        long = "effect",
        value_name = "ID[:PARAMETER=VALUE,...][+ID...]",
        value_parser = spikes
    )]
    pub effects: Vec<Spikes>,
    /// Leave this trial out; may be given more than once.
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
    let id = effect(id)?.id.to_owned();
    let parameter = |text: &str| {
        let (name, value) = text.split_once('=').ok_or("write ID:parameter=value")?;
        let value: f64 = value.parse().map_err(|_| format!("{name}: `{value}` is no number"))?;
        Ok::<_, String>((name.to_owned(), value))
    };
    let parameters = parameters.split(',').filter(|text| !text.is_empty());
    Ok(Spike { id, parameters: parameters.map(parameter).collect::<Result<_, _>>()? })
}

/// Between which insertions a protocol goes.
#[derive(Debug, Args)]
pub struct Way {
    /// Insertion at which the tip is free; where the bundle's trials begin if not given.
    #[arg(long, value_name = "METRES")]
    pub from_m: Option<f64>,
    /// Insertion at which the tip touches; the deepest of the bundle's trials if not given.
    #[arg(long, value_name = "METRES")]
    pub to_m: Option<f64>,
}

#[derive(Debug, Args)]
pub struct IsolabilityArguments {
    /// Trial bundle, one without trials (its rig and vessel), or recording of a run.
    pub bundle: PathBuf,
    /// Take the motion of `cathforce gap protocol`, not that of the bundle's trials.
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
    /// Rows a second.
    #[arg(long, value_name = "HZ", default_value_t = 250.0, value_parser = rate)]
    pub rate: f64,
    /// Write the rows into this file, not to stdout.
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Play it on this device, as `cathforce run` plays a trial.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
    /// Record that into this MCAP file, which must not be there yet.
    #[arg(long, value_name = "FILE.mcap", requires = "link")]
    pub out: Option<PathBuf>,
    /// Replace the recording that is there, once the device has its configuration.
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
pub struct DiagnoseArguments {
    /// Trial bundle, or recordings of runs of one rig (MCAP), each a trial.
    #[arg(required = true, value_name = "BUNDLE|FILE.mcap")]
    pub bundle: Vec<PathBuf>,
    #[command(flatten)]
    pub json_file: JsonFile,
    /// Make a web page of the answer: one file that needs nothing else.
    #[arg(long, alias = "html", value_name = "FILE.html", value_parser = page_file)]
    pub report: Option<PathBuf>,
    /// Fail with exit code 6 when the force error that is left exceeds this, e.g. `rms_N=0.02`.
    #[arg(long, value_name = "rms_N=X", value_parser = rms_limit)]
    pub fail_above: Option<f64>,
    /// Leave this trial out, for `cathforce gap verify` to be fresh; may be given more than once.
    #[arg(long, value_name = "TRIAL")]
    pub hold_back: Vec<u32>,
    /// Fit this effect and no other; may be given more than once.
    #[arg(long = "effect", value_name = "ID", value_parser = effect)]
    pub effects: Vec<&'static Effect>,
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

fn effect(id: &str) -> Result<&'static Effect, String> {
    Effect::find(id).ok_or_else(|| {
        let ids = cathforce_effect_catalogue::all().map(|effect| effect.id).collect::<Vec<_>>();
        unknown("effect", id, &ids, "cathforce gap effects")
    })
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
