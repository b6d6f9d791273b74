//! The command line.

mod bundle;
mod config;
mod gap;
mod link;
mod lumen;
mod recording;

use std::path::PathBuf;

use cathforce_bundle::tips::{TIPS, Tip};
use clap::{Arg, ArgAction, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

pub use bundle::{BundleAction, BundleArguments, BundleInitArguments, Plant};
pub use config::{
    ConfigAction, ConfigApplyArguments, ConfigArguments, ConfigDiffArguments, ConfigGetArguments,
    ConfigImageArguments, ConfigImportDbcArguments, ConfigInitArguments, ConfigSaveArguments,
    ConfigSetArguments, ConfigShowArguments, ConfigSource, ConfigValidateArguments,
};
pub use gap::{
    AblationArguments, ApplyArguments, ChallengeAction, ChallengeArguments, ChallengeFolder,
    ChallengeFolders, ChallengeMakeArguments, ChallengeRunArguments, CoverageArguments,
    DiagnoseArguments, GapAction, GapArguments, IsolabilityArguments, ProtocolArguments,
    SpikeInArguments, VerifyArguments, Way,
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

impl Arguments {
    /// From the command line; exits where it is wrong.
    pub fn read() -> Self {
        let matches = with_negative_numbers(Self::command()).get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }
}

/// Values may be negative numbers, in all commands: that they are out of range is said of the value,
/// not of an option that nobody has given.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes_number = |arg: &Arg| {
        let takes_value = arg.get_num_args().is_none_or(|number| number.takes_values());
        let sets = matches!(arg.get_action(), ArgAction::Set | ArgAction::Append);
        sets && takes_value && !arg.is_positional()
    };
    command
        .mut_args(|arg| if takes_number(&arg) { arg.allow_negative_numbers(true) } else { arg })
        .mut_subcommands(with_negative_numbers)
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
    /// List the CAN interfaces and serial ports of this computer, bring an interface up or down, be a
    /// device on a bus.
    Link(LinkArguments),
    /// Check what lies between here and a device, and say what mends it.
    Doctor(DoctorArguments),
    /// What faults mean, which one a device has, and clearing it.
    Fault(FaultArguments),
    /// Write a trial bundle to begin with.
    Bundle(BundleArguments),
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
    /// Record into this MCAP file, which must not be there yet.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Replace the recording that is there, once the device has its configuration.
    #[arg(long, requires = "out")]
    pub overwrite: bool,
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
    /// Where the device is: socketcan:can0, slcan:/dev/ttyACM0, slcan:tcp:HOST:PORT,
    /// slcan:listen:PORT, qemu, sim; `cathforce link list` lists what there is.
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
    /// Write what the rig's sensors would have measured as the next trial of the bundle in this
    /// folder. A folder that is not there is made, with the same rig and vessel; without a name it
    /// is that of the bundle with `-simulated`.
    #[arg(long, value_name = "FOLDER")]
    pub as_trial: Option<Option<PathBuf>>,
    /// Add the noise that rig.toml states for each sensor.
    #[arg(long, requires = "as_trial")]
    pub noise: bool,
    /// Take other noise; the same number gives the same noise.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "noise")]
    pub seed: u64,
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
pub struct ReportArguments {
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// The page, one file that needs nothing else.
    #[arg(long, value_name = "FILE.html")]
    pub html: PathBuf,
}

fn setting(text: &str) -> Result<(String, f32), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is no number"))?;
    Ok((name.trim().to_owned(), value))
}

fn tip(name: &str) -> Result<&'static Tip, String> {
    Tip::find(name).ok_or_else(|| {
        let names = TIPS.iter().map(|tip| tip.name).collect::<Vec<_>>();
        let nearest = cathforce_bundle::nearest(name, &names);
        let hint = nearest.map_or(String::new(), |name| format!(", the nearest is {name}"));
        format!("there is no tip of that name{hint}; `cathforce tips` lists them")
    })
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    const WANTED: &str = "a number of seconds above 0, at most a year";
    const YEAR_S: f64 = 365.0 * 86400.0;
    positive(text, WANTED)
        .and_then(|s| if s <= YEAR_S { Ok(s) } else { Err(format!("give {WANTED}")) })
}

fn positive_percent(text: &str) -> Result<f64, String> {
    positive(text, "a percentage above 0")
}

fn positive(text: &str, wanted: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    value.ok_or_else(|| format!("give {wanted}"))
}

// One reader of the pages for all tests of what they print.
#[cfg(test)]
#[path = "../tests/support/documented.rs"]
mod documented;

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        with_negative_numbers(Arguments::command()).debug_assert();
    }

    /// Every subcommand, option and number of arguments that a page prints exists.
    #[test]
    fn what_the_pages_print_is_understood() {
        let all = documented::documented(&["cathforce"]);
        assert!(all.len() > 60, "{} commands", all.len());
        for printed in all {
            // A number that is left to the reader.
            let words = printed.words.iter().map(|word| match &word[..] {
                "N" | "M" => "1",
                "rms_N=X" => "rms_N=1",
                word => word,
            });
            let Err(error) = Arguments::try_parse_from(words) else { continue };
            let missing = [
                ErrorKind::MissingRequiredArgument,
                ErrorKind::MissingSubcommand,
                ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand,
            ];
            let is_part = printed.abridged || !printed.in_block;
            let is_fine = is_part && missing.contains(&error.kind());
            assert!(is_fine, "{}: {}\n{error}", printed.place, printed.words.join(" "));
        }
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
        let tip = |name| super::tip(name).unwrap_err();
        assert!(tip("cobra2").contains("the nearest is cobra-2"), "{}", tip("cobra2"));
        assert!(tip("bogus").starts_with("there is no tip of that name; "), "{}", tip("bogus"));
        assert!(positive_seconds("0").is_err() && positive_seconds("NaN").is_err());
        assert_eq!(positive_seconds("2.5"), Ok(2.5));
    }
}
