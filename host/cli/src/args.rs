//! The command line.
//!
//! Conventions, which a test holds every command to:
//! the thing that a command is about comes first (a bundle, a recording, a settings file), and the
//! file that it takes or writes comes second; `--link` says which device; `--json` prints the result
//! as JSON; `--out` names the file that is written; every argument has a help text.

mod bundle;
mod calibrate;
mod camera;
mod clock;
mod config;
mod dash;
mod filter;
mod gap;
mod haptics;
mod identify;
mod import_drive;
mod installed;
mod link;
mod lumen;
mod material;
mod names;
mod recording;
mod reproduce;
mod ultrasound;
mod wall;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::LazyLock;

use cathforce_bundle::tips::{TIPS, Tip};
use cathforce_bus::service::PROTOCOL_HASH;
use cathforce_config::image::schema_hash;
use cathforce_recording::import::AxisMap;
use cathforce_recording::sensor::SensorAddress;
use clap::{
    Arg, ArgAction, ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum,
};

pub use crate::output::JsonFile;
pub use bundle::{BundleAction, BundleArguments, BundleInitArguments, Plant};
pub use calibrate::{Asked, CalibrateArguments};
pub use camera::ImportCameraArguments;
#[cfg(feature = "camera")]
pub use camera::{CalibrationArguments, CatheterColour};
pub use config::{
    ConfigAction, ConfigApplyArguments, ConfigArguments, ConfigDiffArguments, ConfigGetArguments,
    ConfigImageArguments, ConfigImportDbcArguments, ConfigInitArguments, ConfigListArguments,
    ConfigSaveArguments, ConfigSetArguments, ConfigShowArguments, ConfigValidateArguments,
};
pub use dash::DashArguments;
pub use filter::FilterArguments;
pub use gap::{
    AblationArguments, ApplyArguments, BlindTestAction, BlindTestArguments, BlindTestFolder,
    BlindTestFolders, BlindTestMakeArguments, BlindTestRunArguments, CompensateArguments,
    CoverageArguments, DiagnoseArguments, GapAction, GapArguments, IsolabilityArguments,
    ProtocolArguments, SpikeInArguments, Strangers, VerifyArguments, Way,
};
pub use haptics::{HapticsArguments, OperatorAxis};
pub use identify::{
    IdentifyAction, IdentifyArguments, IdentifyExampleArguments, IdentifyFitArguments,
};
pub use import_drive::{
    ImportDriveArguments, ImportDynamixelArguments, ImportJointArguments, ImportMoteusArguments,
    ImportOdriveArguments, IntoBundle,
};
pub use installed::{DemoArguments, FlashArguments, Programmer};
#[cfg(feature = "dash")]
pub use link::address as link_address;
pub use link::{
    DoctorArguments, FaultAction, FaultArguments, FaultClearArguments, LinkAction, LinkArguments,
    LinkBridgeArguments, LinkServeArguments, LinkUpArguments,
};
pub use lumen::LumenArguments;
pub use material::MaterialArguments;
#[cfg(feature = "wall")]
pub use material::{FormName, LawName, MaterialAction, MaterialFitArguments, Stress};
#[cfg(feature = "meshes")]
pub use recording::MeshUnit;
pub use recording::{
    CheckArguments, CompletionsArguments, ExportArguments, ImportArguments, ImportAtiArguments,
    ImportCandumpArguments, ImportCentrelineArguments, ImportCsvArguments, ImportMeshArguments,
    ImportRosArguments, ImportSource, LatencyArguments, ManArguments, MonitorArguments,
    SendArguments, TimeUnit,
};
pub use reproduce::ReproduceArguments;
pub use ultrasound::UltrasoundArguments;
#[cfg(feature = "wall")]
pub use ultrasound::{UltrasoundAction, UltrasoundFitArguments, UltrasoundRenderArguments};
pub use wall::WallArguments;
#[cfg(feature = "wall")]
pub use wall::{
    ElementArguments, LawArgument, WallAction, WallLoadArguments, WallPhantomArguments,
    WallReduceArguments,
};

const EXIT_CODES: &str = "\
Exit codes:
  0  the command did what it was asked to do
  1  the command failed
  2  the arguments are wrong
  3  a file or a bundle is wrong
  4  there is no link, or the link was lost
  5  the device refused, or it reported a fault
  6  a figure missed the threshold that was asked for";

/// Estimate the forces between a catheter and the vessel in real time from the drive's encoders.
#[derive(Debug, Parser)]
#[command(name = "cathforce", version, long_version = long_version(), after_help = EXIT_CODES)]
pub struct Arguments {
    /// Print the result as JSON.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print only warnings and errors on stderr.
    #[arg(long, global = true)]
    pub quiet: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// The version, and what a firmware must agree with.
fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let (version, schema) = (env!("CARGO_PKG_VERSION"), schema_hash());
        format!("{version}\nprotocol {PROTOCOL_HASH:016x}\nimage schema {schema:08x}")
    });
    &TEXT
}

impl Arguments {
    /// Reads the command line. Exits where it is wrong.
    pub fn read() -> Self {
        let matches = with_negative_numbers(Self::command()).get_matches();
        Self::understood(&matches).unwrap_or_else(|error| error.exit())
    }

    /// `gap diagnose BUNDLE --json FILE` and `reproduce --json FILE` are published spellings of
    /// `--json --out FILE`.
    fn understood(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut arguments = Self::from_arg_matches(matches)?;
        if let Command::Gap(GapArguments { action: GapAction::Diagnose(diagnose) }) =
            &mut arguments.command
            && let Some(matches) = matches.subcommand_matches("gap")
            && let Some(matches) = matches.subcommand_matches("diagnose")
        {
            diagnose.take_file_of_json(matches);
        }
        if let Command::Reproduce(reproduce) = &mut arguments.command
            && let Some(matches) = matches.subcommand_matches("reproduce")
        {
            reproduce.take_file_of_json(matches);
        }
        Ok(arguments)
    }
}

/// Lets every option take a negative number, so that a value below its range is called just that and
/// is not taken for an option.
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
    /// Configure and arm a device, play a trial's encoders to it and record everything.
    Run(RunArguments),
    /// Play a trial on the device's code in this process, without hardware.
    Simulate(SimulateArguments),
    /// Compute a recording again on this computer and compare every bit.
    Replay(ReplayArguments),
    /// Describe a recording, a bundle, a device image, a firmware or a device.
    Info(InfoArguments),
    /// List, show, change, compare and check settings, and exchange them with a device.
    Config(ConfigArguments),
    /// List the CAN interfaces and serial ports of this computer, bring an interface up or down, be a
    /// device on a bus.
    Link(LinkArguments),
    /// Check everything between this computer and a device, and say how to repair what is wrong.
    Doctor(DoctorArguments),
    /// Insert a catheter for 10 s on the emulated board, with a table and a folder of results.
    Demo(DemoArguments),
    /// Load a firmware into a board.
    Flash(FlashArguments),
    /// Explain faults, show the one that a device has, and clear it.
    Fault(FaultArguments),
    /// Write a trial bundle to begin with.
    Bundle(BundleArguments),
    /// Build the distance field of a vessel's wall, and report its size and accuracy.
    Lumen(LumenArguments),
    /// Fit the laws of a wall's material to a tensile test.
    Material(MaterialArguments),
    /// Load a vessel's wall in finite elements, and reduce it to what the device runs.
    Wall(WallArguments),
    /// Find the stiffness of tissue from ultrasound images of a vessel under the probe.
    Ultrasound(UltrasoundArguments),
    /// Find the parameters of a steerable catheter from dynamic experiments.
    Identify(IdentifyArguments),
    /// Close the operator's loop with a simulated master and hand, and map where it is stable.
    Haptics(HapticsArguments),
    /// List the tip shapes of common catheters.
    Tips,
    /// Find the cause of a gap between model and measurement, and close it.
    Gap(GapArguments),
    /// Fit settings that you name to measured trials.
    Calibrate(CalibrateArguments),
    /// Compute the figures of published systems again and print them beside the printed ones.
    Reproduce(ReproduceArguments),
    /// Make a web page of a recording.
    Report(ReportArguments),
    /// Report what a recording holds, what is missing and why, and whether it replays.
    Check(CheckArguments),
    /// Write a recording as CSV, Parquet, candump log or trial bundle.
    Export(ExportArguments),
    /// Make a recording or a trial from the files of other tools.
    Import(ImportArguments),
    /// Play the frames of a recording on a bus, each at its time.
    Play(SendArguments),
    /// Replace outliers and take noise out of what sensors measured.
    Filter(FilterArguments),
    /// Watch a bus: state, age, rates, load, forces and faults.
    Monitor(MonitorArguments),
    /// Show a device, a recording or a diagnosis in a browser.
    Dash(DashArguments),
    /// Measure the time from encoder to record, stage by stage.
    Latency(LatencyArguments),
    /// Print the completion script of a shell.
    Completions(CompletionsArguments),
    /// Write manual pages.
    Man(ManArguments),
}

/// What to play, and what to keep of it.
#[derive(Debug, Args)]
pub struct PlayArguments {
    /// Trial bundle: a folder with rig.toml, the vessel and trials.
    pub bundle: PathBuf,
    /// Number of the trial to play [default: the first trial of the bundle]
    #[arg(long)]
    pub trial: Option<u32>,
    /// Record into this new file.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: Option<PathBuf>,
    /// Replace an existing recording, once the device has its configuration.
    #[arg(long, requires = "out")]
    pub overwrite: bool,
    /// Instrument whose button the operator holds; the operator feels the load on its drive.
    #[arg(long, value_enum, default_value_t = Feel::Catheter)]
    pub feel: Feel,
    /// Play only the first seconds of the trial.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Write the figures of the run as JSON into this file.
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
    /// The catheter.
    Catheter,
    /// The guidewire.
    Guidewire,
}

/// What differs from the bundle and the defaults.
#[derive(Debug, Args)]
pub struct Changes {
    /// Take the settings of this file first; `cathforce gap apply` writes such a file.
    #[arg(long = "settings", value_name = "FILE.toml")]
    pub file: Option<PathBuf>,
    /// Change a setting, a parameter of the rig or one of its effects, for example `force_gain=2` or
    /// `effects.wall.stiffness.factor=0.5`; `cathforce config list` lists them. May be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = known_setting)]
    pub settings: Vec<(String, f32)>,
    /// Replace the catheter's tip by a common one; `cathforce tips` lists them.
    #[arg(long, value_name = "NAME", value_parser = tip)]
    pub tip: Option<&'static Tip>,
    /// Replace the guidewire's tip by a common one.
    #[arg(long, value_name = "NAME", value_parser = tip)]
    pub guidewire_tip: Option<&'static Tip>,
    /// Grid spacing of the vessel's wall [default: 1]; a coarser grid makes a smaller image.
    #[arg(long, value_name = "MM", value_parser = lumen::cell_mm)]
    pub cell: Option<f64>,
}

#[derive(Debug, Args)]
pub struct RunArguments {
    /// Where the device is: socketcan:can0, slcan:/dev/ttyACM0, slcan:tcp:HOST:PORT,
    /// slcan:listen:PORT, qemu, sim; `cathforce link list` lists what there is.
    #[arg(long, value_parser = link::address)]
    pub link: String,
    /// Let the device's own clock run its ticks: times are real, but the recording cannot be
    /// replayed.
    #[arg(long)]
    pub free: bool,
    /// Show the run in a browser while it lasts, at this address and port [default: 127.0.0.1:7410].
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true,
          default_missing_value = "127.0.0.1:7410")]
    pub dash: Option<SocketAddr>,
    #[command(flatten)]
    pub sensor: SensorArguments,
    #[command(flatten)]
    pub play: PlayArguments,
}

/// A force sensor beside the device.
#[derive(Debug, Args)]
pub struct SensorArguments {
    /// Measure the force during the run, in place of the trial's: netft:HOST or netft:HOST:PORT, a Net F/T or
    /// an Ethernet Axia of ATI, or an OnRobot that sends its protocol RDT.
    #[arg(long, value_name = "netft:HOST", value_parser = SensorAddress::parse)]
    pub sensor: Option<SensorAddress>,
    /// Counts of one newton, for a sensor without a web server that says it.
    #[arg(long, value_name = "N", value_parser = counts, requires = "sensor")]
    pub counts_per_n: Option<f64>,
    /// The sensor's axes that point along the vessel's x, y and z, for example `+y,-x,+z`.
    #[arg(long, value_name = "AXES", default_value = "+x,+y,+z", value_parser = AxisMap::parse, allow_hyphen_values = true, requires = "sensor")]
    pub axes: AxisMap,
    /// Subtract the mean force of the trial's first seconds, during which nothing touches the sensor.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, requires = "sensor")]
    pub tare: Option<f64>,
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
    /// Recording made by `cathforce run` or `cathforce simulate`.
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct InfoArguments {
    #[command(flatten)]
    pub source: InfoSource,
    #[command(flatten)]
    pub json_file: JsonFile,
}

/// What is described.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct InfoSource {
    /// Recording, trial bundle, device image or firmware.
    pub path: Option<PathBuf>,
    /// Describe the device behind this link.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Recording made by `cathforce run` or `cathforce simulate`.
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// Write the page into this file [default: the recording's name with the ending .html]
    #[arg(long, value_name = "FILE.html", alias = "html")]
    pub out: Option<PathBuf>,
    /// Replace a web page that cathforce did not make.
    #[arg(long)]
    pub overwrite: bool,
}

fn setting(text: &str) -> Result<(String, f32), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.trim().to_owned(), value))
}

/// A setting whose name exists and whose value is allowed.
fn known_setting(text: &str) -> Result<(String, f32), String> {
    let (name, value) = setting(text)?;
    match crate::settings::entry::check(&name, value) {
        Ok(()) => Ok((name, value)),
        Err((message, fix)) => {
            Err(format!("{message}: {fix}; `cathforce config list` lists names and ranges"))
        }
    }
}

fn tip(name: &str) -> Result<&'static Tip, String> {
    Tip::find(name).ok_or_else(|| {
        let known = TIPS.iter().map(|tip| tip.name).collect::<Vec<_>>();
        names::unknown("tip", name, &known, "cathforce tips")
    })
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    const WANTED: &str = "a number of seconds above 0, at most a year";
    const YEAR_S: f64 = 365.0 * 86400.0;
    positive(text, WANTED)
        .and_then(|s| if s <= YEAR_S { Ok(s) } else { Err(format!("give {WANTED}")) })
}

fn lead(text: &str) -> Result<f64, String> {
    let found = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x != 0.0);
    found.ok_or_else(|| format!("`{text}` is no lead in mm; a left-handed screw has one below 0"))
}

fn counts(text: &str) -> Result<f64, String> {
    positive(text, "a number of counts above 0")
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
        let mut wrong = Vec::new();
        for printed in all {
            // Values that are left to the reader.
            let mut words = printed.words.clone();
            for at in 0..words.len() {
                let is_link = at > 0 && words[at - 1] == "--link";
                words[at] = match words[at].as_str() {
                    "N" | "M" => "1".into(),
                    "NAME" => "EncoderLost".into(),
                    "rms_N=X" => "rms_N=1".into(),
                    "LINK" | "L" | "…" if is_link => "sim".into(),
                    "…" if at > 0 && words[at - 1] == "--set" => "force_gain=1".into(),
                    _ => continue,
                };
            }
            let Err(error) = Arguments::try_parse_from(words) else { continue };
            if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
                continue;
            }
            let missing = [
                ErrorKind::MissingRequiredArgument,
                ErrorKind::MissingSubcommand,
                ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand,
            ];
            let is_part = printed.abridged || !printed.in_block;
            if !(is_part && missing.contains(&error.kind())) {
                wrong.push(format!("{}: {}\n{error}", printed.place, printed.words.join(" ")));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    fn parse(line: &[&str]) -> Arguments {
        let matches = Arguments::command().try_get_matches_from(line).unwrap();
        Arguments::understood(&matches).unwrap()
    }

    #[test]
    fn json_is_a_switch_everywhere() {
        for line in [
            &["cathforce", "--json", "gap", "diagnose", "b"][..],
            &["cathforce", "gap", "diagnose", "b", "--json"],
            &["cathforce", "gap", "diagnose", "--json", "b"],
            &["cathforce", "info", "--json", "path"],
        ] {
            assert!(parse(line).json, "{line:?}");
        }
    }

    /// The spelling of the published format of a diagnosis.
    #[test]
    fn a_file_after_json_is_where_a_diagnosis_goes() {
        let diagnose = |words: &[&str]| {
            let all = parse(&[&["cathforce", "gap", "diagnose"], words].concat());
            let Command::Gap(GapArguments { action: GapAction::Diagnose(found) }) = all.command
            else {
                panic!("a diagnosis")
            };
            let bundles = found.bundle.iter().map(|path| path.display().to_string());
            let bundles = bundles.collect::<Vec<_>>().join(" ");
            (all.json, bundles, found.json_file.out.map(|path| path.display().to_string()))
        };
        let bundle = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
        for (words, bundles, out) in [
            (&["b", "--json", "f.json"][..], "b", Some("f.json")),
            (&["--json", "f.json", "b"], "b", Some("f.json")),
            (&["b", "--json", "answer"], "b", Some("answer")),
            (&["b", "--json", "-"], "b", None),
            (&["b", "--json"], "b", None),
            (&["--json", "b"], "b", None),
            (&["b", "--json", "--out", "f.json"], "b", Some("f.json")),
            (&["a.mcap", "--json", "b.mcap"], "a.mcap b.mcap", None),
            (&["a.mcap", "--json", bundle], &format!("a.mcap {bundle}"), None),
        ] {
            assert_eq!(
                diagnose(words),
                (true, bundles.into(), out.map(str::to_owned)),
                "{words:?}"
            );
        }
        let (json, _, out) = diagnose(&["b", "--out", "f.json"]);
        assert_eq!((json, out.as_deref()), (false, Some("f.json")));
    }

    #[test]
    fn a_file_after_json_is_where_the_reproduced_figures_go() {
        let reproduce = |words: &[&str]| {
            let all = parse(&[&["cathforce", "reproduce"], words].concat());
            let Command::Reproduce(found) = all.command else { panic!("reproduced figures") };
            let out = found.json_file.out.map(|path| path.display().to_string());
            (all.json, found.systems.join(" "), out)
        };
        let out = Some("f.json".to_owned());
        assert_eq!(reproduce(&["--json", "f.json"]), (true, String::new(), out.clone()));
        assert_eq!(reproduce(&["li", "--json", "f.json"]), (true, "li".into(), out.clone()));
        assert_eq!(reproduce(&["--json", "li"]), (true, "li".into(), None));
        assert_eq!(reproduce(&["li", "--out", "f.json"]), (false, "li".into(), out));
    }

    #[test]
    fn settings_and_durations_are_checked() {
        assert_eq!(setting("force_gain = 2"), Ok(("force_gain".into(), 2.0)));
        assert!(setting("force_gain").is_err());
        assert!(setting("force_gain=much").is_err());
        let tip = |name| super::tip(name).unwrap_err();
        assert!(tip("cobra2").contains("did you mean `cobra-2`?"), "{}", tip("cobra2"));
        assert_eq!(tip("bogus"), "there is no tip `bogus`; `cathforce tips` lists them");
        assert!(positive_seconds("0").is_err() && positive_seconds("NaN").is_err());
        assert_eq!(positive_seconds("2.5"), Ok(2.5));
    }
}
