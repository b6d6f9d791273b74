//! Arguments of the commands about recordings.

use std::path::PathBuf;

use cathforce_bus::Placement;
use cathforce_recording::import::{AxisMap, ColumnMap};
use clap::{ArgGroup, Args, Subcommand};

use super::camera::ImportCameraArguments;
use super::clock::Clock;
use super::import_drive::{
    ImportDriveArguments, ImportDynamixelArguments, ImportJointArguments, ImportMoteusArguments,
    ImportOdriveArguments,
};
use super::link::id_base;
use super::material::millimetres;
use super::wall::{Triple, triple};
use super::{Changes, JsonFile, counts, lead, link, positive, positive_seconds};

#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Recording.
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// Write a CSV with one row per tick; `-` is stdout.
    #[arg(
        long,
        value_name = "FILE.csv",
        required_unless_present_any = ["nodes", "parquet", "candump", "bundle"]
    )]
    pub csv: Option<PathBuf>,
    /// Write a CSV with one row per node of the instrument, 25 shapes a second.
    #[arg(long, value_name = "FILE.csv")]
    pub nodes: Option<PathBuf>,
    /// Write a Parquet file with one row per tick and the columns of `--csv`.
    #[arg(long, value_name = "FILE.parquet")]
    pub parquet: Option<PathBuf>,
    /// Write every frame in the format of `candump -l`.
    #[arg(long, value_name = "FILE.log")]
    pub candump: Option<PathBuf>,
    /// Write a trial bundle into a new folder: rig, vessel and the trial with its measurements.
    #[arg(long, value_name = "FOLDER")]
    pub bundle: Option<PathBuf>,
    /// Replace existing exports; recordings and folders are never replaced.
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
    /// Make a recording from a log of a CAN bus; the format is told by the content.
    #[command(visible_alias = "candump")]
    Can(ImportCandumpArguments),
    /// Make a trial from the log of a force/torque sensor (ATI, OptoForce, OnRobot, Bota) and the drive's motion.
    #[command(visible_alias = "force")]
    Ati(ImportAtiArguments),
    /// Make a trial from a CSV with columns of other names.
    Csv(ImportCsvArguments),
    /// Make a trial from a bag of ROS 2: MCAP or SQLite, with joints, wrenches, points and frames.
    Ros(ImportRosArguments),
    /// Make trials of a drive bundle from any table of numbers, whatever its names and units.
    Drive(ImportDriveArguments),
    /// Make trials of a drive bundle from the logs of Dynamixel servos that `bam` records (JSON).
    #[command(visible_alias = "bam")]
    Dynamixel(ImportDynamixelArguments),
    /// Make trials of a drive bundle from the logs of an ODrive: a CSV, or the log of its CAN bus.
    Odrive(ImportOdriveArguments),
    /// Make trials of a drive bundle from the telemetry of a moteus: a CSV, or lines of JSON.
    Moteus(ImportMoteusArguments),
    /// Make trials of a drive bundle from a joint in bags of ROS 2, as those of a Franka arm.
    Joint(ImportJointArguments),
    /// Make the vessel.stl of a bundle from a surface of another tool: VTP, VTU, OBJ, PLY or STL.
    Mesh(ImportMeshArguments),
    /// Make the centreline.csv of a bundle from a line of another tool: VTP, VTU, Slicer's markups or CSV.
    Centreline(ImportCentrelineArguments),
    /// Make a trial from a camera's frames and the drive's motion: the tip and the shape of the catheter.
    Camera(Box<ImportCameraArguments>),
}

#[derive(Debug, Args)]
pub struct ImportCandumpArguments {
    /// Log of candump, Vector (ASC, BLF), PEAK (TRC), SavvyCAN or python-can (CSV), packed by gzip or not.
    #[arg(value_name = "FILE")]
    pub log: PathBuf,
    /// Trial bundle of the rig on which it was logged.
    #[arg(long)]
    pub bundle: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
    /// Channel of the log, if several have frames of ours.
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Base of the identifiers, if they were moved to 29 bits on the logged bus.
    #[arg(long, value_name = "BASE", value_parser = id_base)]
    pub id_base: Option<Placement>,
    /// Take the log although most of its frames do not have our checksum.
    #[arg(long)]
    pub foreign: bool,
    /// New recording.
    #[arg(long, value_name = "FILE.mcap")]
    pub out: PathBuf,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// The unit of a column of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TimeUnit {
    S,
    Ms,
    Us,
    Ns,
}

impl TimeUnit {
    pub fn seconds(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e-3,
            Self::Us => 1e-6,
            Self::Ns => 1e-9,
        }
    }
}

#[derive(Debug, Args)]
pub struct ImportAtiArguments {
    /// Log of the sensor.
    #[arg(value_name = "FILE")]
    pub log: PathBuf,
    /// Motion of the drive: a trial's CSV or a recording.
    #[arg(long, value_name = "FILE")]
    pub motion: PathBuf,
    /// New trial, for example BUNDLE/trials/004.csv.
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
    /// Counts per newton from the sensor's calibration, for a log that does not say it.
    #[arg(long, value_name = "N", value_parser = counts)]
    pub counts_per_n: Option<f64>,
    /// The sensor's axes that point along the vessel's x, y and z, for example `+y,-x,+z`.
    #[arg(long, value_name = "AXES", default_value = "+x,+y,+z", value_parser = AxisMap::parse, allow_hyphen_values = true)]
    pub axes: AxisMap,
    /// Subtract the mean of the first seconds, during which nothing touched the sensor.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub tare: Option<f64>,
    /// Rows per second of a log without a column Time; goes before the log's own rate.
    #[arg(long, value_name = "HZ", value_parser = hertz)]
    pub rate: Option<f64>,
    /// Unit of the column of time, if its name does not say it [default: s]
    #[arg(long, value_enum)]
    pub time_unit: Option<TimeUnit>,
    /// Forces of the unloaded sensor in newtons, which are subtracted; the sensor's axes.
    #[arg(long, value_name = "FX,FY,FZ", value_parser = triple, allow_hyphen_values = true)]
    pub bias: Option<Triple>,
    /// Matrix of three rows of three or six numbers that makes newtons of Fx, Fy, Fz and Tx, Ty, Tz; the log's
    /// own unit does not count then.
    #[arg(long, value_name = "FILE.csv", conflicts_with = "counts_per_n")]
    pub calibration: Option<PathBuf>,
    /// Time of the motion at which the log begins.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub offset: f64,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

#[derive(Debug, Args)]
pub struct ImportCsvArguments {
    /// Table of another tool.
    #[arg(value_name = "FILE.csv")]
    pub table: PathBuf,
    /// Compute a column of the trial from one of the table, for example
    /// `insertion_m=feed_mm*0.001+0.028` with the offset in the trial's unit. May be repeated. A
    /// column that already has the trial's name needs no mapping.
    #[arg(
        long = "column",
        value_name = "NAME=THEIRS[*FACTOR[+OFFSET]]",
        value_parser = ColumnMap::parse
    )]
    pub columns: Vec<ColumnMap>,
    /// New trial, for example BUNDLE/trials/004.csv.
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// A signal is named TOPIC:NAME, for example `/joint_states:feed`; `--list` lists those of a bag.
#[derive(Debug, Args)]
pub struct ImportRosArguments {
    /// Bag: a file .mcap or .db3, or the folder of `ros2 bag record`.
    #[arg(value_name = "FILE|FOLDER")]
    pub bag: PathBuf,
    /// Compute a column of the trial from a signal, for example
    /// `insertion_m=/joint_states:feed*0.001+0.028` with the offset in the trial's unit. May be repeated.
    #[arg(
        long = "column",
        value_name = "NAME=SIGNAL[*FACTOR[+OFFSET]]",
        value_parser = ColumnMap::parse
    )]
    pub columns: Vec<ColumnMap>,
    /// Millimetres of feed in one turn, for a joint of the insertion that is in radians.
    #[arg(long, value_name = "MM", value_parser = lead, allow_negative_numbers = true)]
    pub lead: Option<f64>,
    /// Topic of the force sensor, a WrenchStamped.
    #[arg(long, value_name = "TOPIC")]
    pub force: Option<String>,
    /// The sensor's axes that point along the vessel's x, y and z, for example `+y,-x,+z`.
    #[arg(long, value_name = "AXES", default_value = "+x,+y,+z", value_parser = AxisMap::parse, allow_hyphen_values = true, requires = "force")]
    pub axes: AxisMap,
    /// Subtract the mean force of the first seconds, during which nothing touched the sensor.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub tare: Option<f64>,
    /// Tip in metres in the vessel's frame: the topic of a PointStamped or PoseStamped, or a topic of tf and
    /// the frame, like `/tf:tip`.
    #[arg(long, value_name = "TOPIC[:FRAME]")]
    pub tip: Option<String>,
    /// Time of a message that counts.
    #[arg(long, value_enum, default_value_t = Clock::Stamp)]
    pub clock: Clock,
    /// New trial, for example BUNDLE/trials/004.csv.
    #[arg(long, value_name = "FILE.csv", required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// List topics and signals, and write nothing.
    #[arg(long)]
    pub list: bool,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// The unit of a file that does not name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum MeshUnit {
    Um,
    Mm,
    Cm,
    M,
    Inch,
}

#[cfg(feature = "meshes")]
impl MeshUnit {
    pub fn metres(self) -> f64 {
        match self {
            Self::Um => 1e-6,
            Self::Mm => 1e-3,
            Self::Cm => 1e-2,
            Self::M => 1.0,
            Self::Inch => 0.0254,
        }
    }
}

#[derive(Debug, Args)]
pub struct ImportMeshArguments {
    /// Surface of the lumen; the format is told by the content.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// New file, for example BUNDLE/vessel.stl.
    #[arg(long, value_name = "FILE.stl")]
    pub out: PathBuf,
    /// Unit of the file, if it does not name one [default: mm]
    #[arg(long, value_enum)]
    pub unit: Option<MeshUnit>,
    /// Cut a capped surface open at the ends of this centre line of a bundle.
    #[arg(long, value_name = "FILE.csv")]
    pub open_at: Option<PathBuf>,
    /// Write the surface without the small defects that are found: triangles without area, doubled ones,
    /// fins, ones that face the wrong way, corners on the edges of others.
    #[arg(long)]
    pub repair: bool,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

#[derive(Debug, Args)]
pub struct ImportCentrelineArguments {
    /// Centre line; the format is told by the content.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// New file, for example BUNDLE/centreline.csv.
    #[arg(long, value_name = "FILE.csv")]
    pub out: PathBuf,
    /// Unit of the file, if it does not name one [default: mm]
    #[arg(long, value_enum)]
    pub unit: Option<MeshUnit>,
    /// Array of the file that is the radius of the lumen [default: the one that is named so]
    #[arg(long, value_name = "NAME")]
    pub radius_array: Option<String>,
    /// Radius in millimetres of a file without radii.
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub radius: Option<f64>,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

#[derive(Debug, Args)]
pub struct SendArguments {
    /// Recording, or log of a bus as `cathforce import can` reads it.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Bus to play it on.
    #[arg(long, value_parser = link::address)]
    pub link: String,
    /// Play it faster by this factor.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    pub speed: f64,
    /// Settings that describe the frames of this log's master.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Play the device's frames as well, for tools that listen on a bus without a device.
    #[arg(long)]
    pub all: bool,
    /// Play commands as well; the device then arms when the recorded one did.
    #[arg(long)]
    pub commands: bool,
    /// Channel of a log, if several have frames of ours.
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Base of the identifiers, if they were moved to 29 bits on the logged bus.
    #[arg(long, value_name = "BASE", value_parser = id_base)]
    pub id_base: Option<Placement>,
    /// Play a log although most of its frames do not have our checksum.
    #[arg(long)]
    pub foreign: bool,
}

#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Recording.
    #[arg(value_name = "FILE.mcap")]
    pub recording: PathBuf,
    /// Accept this many missing frames and ticks.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub allow_missing: u64,
    /// Do not replay the recording.
    #[arg(long)]
    pub no_replay: bool,
    #[command(flatten)]
    pub json_file: JsonFile,
}

/// A recording or a bus.
#[derive(Debug, Args)]
#[group(skip)]
#[command(group(ArgGroup::new("source").required(true).args(["recording", "link"])))]
pub struct Source {
    /// Recording.
    #[arg(value_name = "FILE.mcap")]
    pub recording: Option<PathBuf>,
    /// Listen on this bus, and send nothing.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
    /// Settings that describe the frames of this bus's master.
    #[arg(long, value_name = "FILE.toml", requires = "link", conflicts_with = "recording")]
    pub settings: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct LatencyArguments {
    #[command(flatten)]
    pub source: Source,
    /// Time to listen on a bus.
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive_seconds)]
    pub duration: f64,
    /// Fail with exit code 6 when the 99th percentile from end to end exceeds this.
    #[arg(long, value_name = "MILLISECONDS", value_parser = milliseconds)]
    pub budget: Option<f64>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct MonitorArguments {
    #[command(flatten)]
    pub source: Source,
    /// Stop after this time.
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Place that the operator has to reach with the tip, in millimetres from the entry in the vessel's
    /// frame. May be repeated; the places follow each other.
    #[arg(long = "target", value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub targets: Vec<Triple>,
    /// Distance from a target at which it is reached.
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = millimetres)]
    pub within_mm: f64,
}

#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// Shell to write the script for.
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder for the pages, one for each command.
    pub folder: PathBuf,
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
