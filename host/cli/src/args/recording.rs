//! Arguments of the commands about recordings.

use std::path::PathBuf;

use cathforce_recording::import::{AxisMap, ColumnMap};
use clap::{ArgGroup, Args, Subcommand};

use super::{Changes, positive, positive_seconds};

#[derive(Debug, Args)]
pub struct ExportArguments {
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// One row a tick.
    #[arg(
        long,
        value_name = "FILE.csv",
        required_unless_present_any = ["nodes", "parquet", "candump", "bundle"]
    )]
    pub csv: Option<PathBuf>,
    /// One row a node and shape, 25 shapes a second.
    #[arg(long, value_name = "FILE.csv")]
    pub nodes: Option<PathBuf>,
    /// One row a tick, as Parquet.
    #[arg(long, value_name = "FILE.parquet")]
    pub parquet: Option<PathBuf>,
    /// Every frame, as `candump -l` logs it.
    #[arg(long, value_name = "FILE.log")]
    pub candump: Option<PathBuf>,
    /// Rig, vessel and the trial with what was measured: a trial bundle, in a new folder.
    #[arg(long, value_name = "FOLDER")]
    pub bundle: Option<PathBuf>,
    /// Replace files that are there; a recording and a folder stay.
    #[arg(long)]
    pub overwrite: bool,
}

#[derive(Debug, Args)]
pub struct ImportArguments {
    #[command(subcommand)]
    pub from: ImportSource,
}

#[derive(Debug, Subcommand)]
pub enum ImportSource {
    /// A log of `candump -l`, into a recording.
    Candump(ImportCandumpArguments),
    /// The log of an ATI force/torque sensor, joined with the drive's motion, into a trial.
    Ati(ImportAtiArguments),
    /// A CSV whose columns are named here, into a trial.
    Csv(ImportCsvArguments),
}

#[derive(Debug, Args)]
pub struct ImportCandumpArguments {
    #[arg(value_name = "FILE.log")]
    pub log: PathBuf,
    /// Trial bundle of the rig on which it was logged.
    #[arg(long)]
    pub bundle: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
    /// Recording to write; must not be there yet.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct ImportAtiArguments {
    #[arg(value_name = "FILE")]
    pub log: PathBuf,
    /// Where the drive was: a trial's CSV or a recording.
    #[arg(long, value_name = "FILE")]
    pub motion: PathBuf,
    /// Trial to write, e.g. BUNDLE/trials/004.csv; must not be there yet.
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
    /// Counts, or another unit's, that are one newton, as the sensor's calibration says; 1 for a log in
    /// newtons.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = counts)]
    pub counts_per_n: f64,
    /// The sensor's axes that are the vessel's x, y, z, e.g. `+y,-x,+z`.
    #[arg(long, value_name = "AXES", default_value = "+x,+y,+z", value_parser = AxisMap::parse, allow_hyphen_values = true)]
    pub axes: AxisMap,
    /// Subtract the mean of the log's first seconds, in which nothing touched.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub tare: Option<f64>,
    /// Rows a second, for a log without a column Time.
    #[arg(long, value_name = "HZ", value_parser = hertz)]
    pub rate: Option<f64>,
    /// Time of the motion at which the log begins.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub offset: f64,
}

#[derive(Debug, Args)]
pub struct ImportCsvArguments {
    #[arg(value_name = "FILE.csv")]
    pub table: PathBuf,
    /// Where a column of the trial comes from, e.g. `insertion_m=feed_mm*0.001+0.028`; may be given
    /// more than once. The offset is in the trial's unit. Columns of the trial's own names need none.
    #[arg(
        long = "column",
        value_name = "NAME=THEIRS[*FACTOR[+OFFSET]]",
        value_parser = ColumnMap::parse
    )]
    pub columns: Vec<ColumnMap>,
    /// Trial to write, e.g. BUNDLE/trials/004.csv; must not be there yet.
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct SendArguments {
    /// Recording, or log of `candump -l`.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Bus to play it on, as for `cathforce run`.
    #[arg(long)]
    pub link: String,
    /// Times as fast as it was recorded.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    pub speed: f64,
    /// The master of this log has frames of its own, as these settings say.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Play the device's frames too, for tools that listen, on a bus without a device.
    #[arg(long)]
    pub all: bool,
    /// Play commands too: the device arms when the recorded one did.
    #[arg(long)]
    pub commands: bool,
}

#[derive(Debug, Args)]
pub struct CheckArguments {
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// Accept so many frames and ticks that are missing.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub allow_missing: u64,
    /// Do not replay it.
    #[arg(long)]
    pub no_replay: bool,
}

/// A recording or a bus.
#[derive(Debug, Args)]
#[group(skip)]
#[command(group(ArgGroup::new("source").required(true).args(["recording", "link"])))]
pub struct Source {
    /// Recording; latency needs one that ran free.
    #[arg(value_name = "FILE.mcap")]
    pub recording: Option<PathBuf>,
    /// Listen on this bus; nothing is sent.
    #[arg(long)]
    pub link: Option<String>,
    /// The master on this bus has frames of its own, as these settings say.
    #[arg(long, value_name = "FILE.toml", requires = "link", conflicts_with = "recording")]
    pub settings: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct LatencyArguments {
    #[command(flatten)]
    pub source: Source,
    /// How long to listen on a bus.
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive_seconds)]
    pub duration: f64,
    /// Fail with exit code 6 when 99 % end to end take longer than this.
    #[arg(long, value_name = "MILLISECONDS", value_parser = milliseconds)]
    pub budget: Option<f64>,
}

#[derive(Debug, Args)]
pub struct MonitorArguments {
    #[command(flatten)]
    pub source: Source,
    /// End after so long.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
}

#[derive(Debug, Args)]
pub struct CompletionsArguments {
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder for the pages, one a command.
    pub folder: PathBuf,
}

fn counts(text: &str) -> Result<f64, String> {
    positive(text, "a number of counts above 0")
}

fn hertz(text: &str) -> Result<f64, String> {
    positive(text, "a rate in Hz above 0")
}

fn factor(text: &str) -> Result<f64, String> {
    positive(text, "a factor above 0")
}

fn milliseconds(text: &str) -> Result<f64, String> {
    positive(text, "a number of milliseconds above 0")
}
