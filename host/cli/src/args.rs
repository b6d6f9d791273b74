//! The command line.

mod config;
mod link;
mod lumen;
mod recording;

use std::path::PathBuf;

use cathforce_effects::Effect;
use cathforce_rig::tips::Tip;
use clap::{Args, Parser, Subcommand, ValueEnum};

pub use config::{
    ConfigAction, ConfigApplyArguments, ConfigArguments, ConfigDiffArguments, ConfigGetArguments,
    ConfigImageArguments, ConfigImportDbcArguments, ConfigInitArguments, ConfigSaveArguments,
    ConfigSetArguments, ConfigShowArguments, ConfigSource, ConfigValidateArguments,
};
pub use link::{
    DoctorArguments, FaultAction, FaultArguments, FaultClearArguments, LinkAction, LinkArguments,
    LinkServeArguments, LinkUpArguments,
};
pub use lumen::LumenArguments;
pub use recording::{
    CheckArguments, CompletionsArguments, ExportArguments, ImportArguments, ImportAtiArguments,
    ImportCandumpArguments, ImportCsvArguments, ImportSource, LatencyArguments, ManArguments,
    MonitorArguments, SendArguments,
};

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  failed
  2  wrong arguments
  3  a file or bundle is wrong
  4  no link, or the link is lost
  5  the device refused or reported a fault
  6  a figure missed the threshold asked for";

/// Forces between a catheter and the vessel, from the drive's encoders, in real time.
#[derive(Debug, Parser)]
#[command(name = "cathforce", version, after_help = EXIT_CODES)]
pub struct Arguments {
    /// Print data as JSON.
    #[arg(long, global = true, num_args = 0, default_missing_value = "-")]
    pub json: Option<String>,
    /// Print nothing on stderr but warnings and errors.
    #[arg(long, global = true)]
    pub quiet: bool,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Configure and arm a device, play a trial's encoders, record everything.
    Run(RunArguments),
    /// The same in this process, without a device.
    Simulate(SimulateArguments),
    /// Repeat a recording on the host and compare every bit.
    Replay(ReplayArguments),
    /// Say what a recording, a bundle, a device image or a device is.
    Info(InfoArguments),
    /// Settings: list, show, change, compare and check them, give them to a device and back.
    Config(ConfigArguments),
    /// List the CAN interfaces of this computer, bring one up or down, be a device on one.
    Link(LinkArguments),
    /// Check what lies between here and a device, and say what mends it.
    Doctor(DoctorArguments),
    /// What faults mean, which one a device has, and clearing it.
    Fault(FaultArguments),
    /// Build the field of a vessel's wall and say what it costs and how exact it is.
    Lumen(LumenArguments),
    /// List tips of common catheters.
    Tips,
    /// What may lie between model and rig.
    Gap(GapArguments),
    /// Make a web page of a recording.
    Report(ReportArguments),
    /// Say what is in a recording, what is missing and why, and whether it replays.
    Check(CheckArguments),
    /// Write a recording as CSV, Parquet, candump log or trial bundle.
    Export(ExportArguments),
    /// Make a recording or a trial of what other tools measured.
    Import(ImportArguments),
    /// Play a recording's frames on a bus, at their time.
    Play(SendArguments),
    /// Watch a bus: state, age, rates, load, forces, faults.
    Monitor(MonitorArguments),
    /// Say how long it takes from encoder to record, stage by stage.
    Latency(LatencyArguments),
    /// Print the completions of a shell.
    Completions(CompletionsArguments),
    /// Write manual pages.
    Man(ManArguments),
}

/// What to play, and what to keep of it.
#[derive(Debug, Args)]
pub struct PlayArguments {
    /// Trial bundle: a folder with rig.toml, the vessel and trials.
    pub bundle: PathBuf,
    /// Trial to play; the bundle's first one if not given.
    #[arg(long)]
    pub trial: Option<u32>,
    /// Record into this MCAP file.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Whose button the operator holds: the load on this instrument's drive is felt.
    #[arg(long, value_enum, default_value_t = Feel::Catheter)]
    pub feel: Feel,
    /// Play only so many seconds of the trial.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Write the summary into this file.
    #[arg(long, value_name = "FILE.json")]
    pub summary: Option<PathBuf>,
    #[command(flatten)]
    pub changes: Changes,
    /// Fail with exit code 6 when the force error exceeds this share of the peak force.
    #[arg(long, value_name = "PERCENT", value_parser = positive_percent)]
    pub max_error: Option<f64>,
}

/// An instrument with a button of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Feel {
    Catheter,
    Guidewire,
}

/// What differs from the bundle and the defaults.
#[derive(Debug, Args)]
pub struct Changes {
    /// Take the settings of this file first, as `cathforce gap apply` writes it.
    #[arg(long = "settings", value_name = "FILE.toml")]
    pub file: Option<PathBuf>,
    /// Change a setting, a parameter of the rig or one of its effects, e.g. `--set force_gain=2`
    /// or `--set effects.wall.stiffness.factor=0.5`; `cathforce config` lists them.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    pub settings: Vec<(String, f32)>,
    /// Take a common tip instead of the catheter's own; `cathforce tips` lists them.
    #[arg(long, value_name = "NAME", value_parser = tip)]
    pub tip: Option<&'static Tip>,
    /// The same for the guidewire in the catheter.
    #[arg(long, value_name = "NAME", value_parser = tip)]
    pub guidewire_tip: Option<&'static Tip>,
    /// Grid spacing of the vessel's wall; 1 mm if not given. Coarser makes a shorter image.
    #[arg(long, value_name = "MM", value_parser = lumen::cell_mm)]
    pub cell: Option<f64>,
}

#[derive(Debug, Args)]
pub struct RunArguments {
    /// Where the device is: socketcan:can0, slcan:tcp:HOST:PORT, slcan:/dev/ttyACM0, qemu, sim.
    #[arg(long)]
    pub link: String,
    /// Let the device's own clock run its ticks, even where it knows lock step: times are then
    /// real, and the recording cannot be replayed.
    #[arg(long)]
    pub free: bool,
    #[command(flatten)]
    pub play: PlayArguments,
}

#[derive(Debug, Args)]
pub struct SimulateArguments {
    #[command(flatten)]
    pub play: PlayArguments,
}

#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Recording made by `cathforce run`.
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct InfoArguments {
    /// Recording, bundle or device image.
    pub path: Option<PathBuf>,
    /// Device behind this link.
    #[arg(long)]
    pub link: Option<String>,
}

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
    /// Say which effects trials can tell apart, and how large each must be to be seen.
    Isolability(IsolabilityArguments),
    /// Print the motion that a recording should hold, or play it.
    Protocol(ProtocolArguments),
    /// List the effects that can be switched on and diagnosed.
    Effects,
    /// Check the diagnosis blind: on realities whose effect is sealed until every case is answered.
    Challenge(ChallengeArguments),
}

#[derive(Debug, Args)]
pub struct ChallengeArguments {
    #[command(subcommand)]
    pub action: ChallengeAction,
}

#[derive(Debug, Subcommand)]
pub enum ChallengeAction {
    /// Draw cases from a seed and play them on another solver than the device's model.
    Make(ChallengeMakeArguments),
    /// Write the SHA-256 of every label, before anything is diagnosed.
    Seal(ChallengeFolder),
    /// Diagnose every sealed case that has no answer yet, one a core; goes on where it was stopped.
    Run(ChallengeRunArguments),
    /// Check the labels against their seals and show them beside the answers.
    Reveal(ChallengeFolder),
    /// The figures of blind checks, as tables of Markdown.
    Score(ChallengeFolders),
}

#[derive(Debug, Args)]
pub struct ChallengeFolder {
    /// Folder of the challenge.
    pub folder: PathBuf,
}

#[derive(Debug, Args)]
pub struct ChallengeFolders {
    /// Folders of challenges, each scored on its own.
    #[arg(required = true)]
    pub folders: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ChallengeMakeArguments {
    /// Folder to make; must not be there yet.
    pub folder: PathBuf,
    /// Cases: a tenth without an effect, a quarter with one that the library does not have, a
    /// quarter with two.
    #[arg(long, default_value_t = 40)]
    pub cases: usize,
    /// The same seed gives the same cases.
    #[arg(long)]
    pub seed: u64,
}

#[derive(Debug, Args)]
pub struct ChallengeRunArguments {
    /// Folder of the challenge.
    pub folder: PathBuf,
    /// Stop after so many cases; another run goes on.
    #[arg(long)]
    pub most: Option<usize>,
}

#[derive(Debug, Args)]
pub struct ReportArguments {
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// The page, one file that needs nothing else.
    #[arg(long, value_name = "FILE.html")]
    pub html: PathBuf,
}

#[derive(Debug, Args)]
pub struct ApplyArguments {
    /// Trial bundle that was diagnosed, or recording of a run.
    pub bundle: PathBuf,
    #[command(flatten)]
    pub source: ApplySource,
    /// Settings file to change; it is made if it is not there.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Configure this device with the result, and ask it what it uses.
    #[arg(long)]
    pub link: Option<String>,
    /// Show what would change, and change nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// Where effects and their sizes come from.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ApplySource {
    /// Answer of `cathforce gap diagnose BUNDLE --json FILE`.
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
    #[arg(long, default_value = "qemu")]
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
    /// Record the run with the settings into this MCAP file.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Fail with exit code 6 when the force error that is left exceeds this, e.g. `rms_N=0.02`.
    #[arg(long, value_name = "rms_N=X", value_parser = rms_limit)]
    pub fail_above: Option<f64>,
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
    #[arg(long)]
    pub link: Option<String>,
    /// Record that into this MCAP file.
    #[arg(long, value_name = "FILE.mcap", requires = "link")]
    pub out: Option<PathBuf>,
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
    /// Trial bundle, or recording of a run (MCAP).
    pub bundle: PathBuf,
    /// Write the answer as JSON into this file, or to stdout (`-`).
    // The same id as the flag of all commands, which it stands in for.
    #[arg(long, id = "json", value_name = "FILE|-", num_args = 0..=1, default_missing_value = "-")]
    pub json: Option<String>,
    /// Make a web page of the answer, one file that needs nothing else.
    #[arg(long, value_name = "FILE.html")]
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

fn effect(id: &str) -> Result<&'static Effect, String> {
    Effect::find(id)
        .ok_or_else(|| "there is no effect of that name, `cathforce gap effects` lists them".into())
}

fn rms_limit(text: &str) -> Result<f64, String> {
    let value = text.strip_prefix("rms_N=").ok_or("write rms_N=X")?;
    positive(value, "a force in newtons above 0")
}

fn setting(text: &str) -> Result<(String, f32), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is no number"))?;
    Ok((name.trim().to_owned(), value))
}

fn tip(name: &str) -> Result<&'static Tip, String> {
    Tip::find(name)
        .ok_or_else(|| "there is no tip of that name, `cathforce tips` lists them".into())
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    positive(text, "a number of seconds above 0")
}

fn positive_percent(text: &str) -> Result<f64, String> {
    positive(text, "a percentage above 0")
}

fn positive(text: &str, wanted: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    value.ok_or_else(|| format!("give {wanted}"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn json_is_a_flag_everywhere_and_may_name_a_file_in_a_diagnosis() {
        let parse = |line: &[&str]| Arguments::try_parse_from(line).unwrap();
        let inner = |arguments: &Arguments| match &arguments.command {
            Command::Gap(GapArguments { action: GapAction::Diagnose(d) }) => d.json.clone(),
            _ => None,
        };
        let before = parse(&["cathforce", "--json", "gap", "diagnose", "b"]);
        assert_eq!((before.json.as_deref(), inner(&before).as_deref()), (Some("-"), Some("-")));
        let file = parse(&["cathforce", "gap", "diagnose", "b", "--json", "f.json"]);
        assert_eq!(inner(&file).as_deref(), Some("f.json"));
        let stdout = parse(&["cathforce", "gap", "diagnose", "b", "--json", "-"]);
        assert_eq!(inner(&stdout).as_deref(), Some("-"));
        let info = parse(&["cathforce", "info", "--json", "path"]);
        assert_eq!(info.json.as_deref(), Some("-"));
    }

    #[test]
    fn settings_and_durations_are_checked() {
        assert_eq!(setting("force_gain = 2"), Ok(("force_gain".into(), 2.0)));
        assert!(setting("force_gain").is_err());
        assert!(setting("force_gain=much").is_err());
        assert!(positive_seconds("0").is_err() && positive_seconds("NaN").is_err());
        assert_eq!(positive_seconds("2.5"), Ok(2.5));
    }
}
