//! Arguments of the commands that make trials of a drive bundle from the logs of drives.

use std::path::PathBuf;

use cathforce_recording::import::drive::Column;
use clap::Args;

use super::clock::Clock;
use super::positive;

/// The bundle that the trials go into.
#[derive(Debug, Args)]
pub struct IntoBundle {
    /// Drive bundle to add the trials to. It is made if it does not exist.
    #[arg(long, value_name = "FOLDER")]
    pub bundle: PathBuf,
    /// Inertia of all that moves, for a new bundle of a rotary axis, in kg·m².
    #[arg(long, value_name = "KG_M2", value_parser = above_zero)]
    pub inertia: Option<f64>,
    /// Mass of all that moves, for a new bundle of a linear axis, in kg. A joint with a mass is a prismatic one.
    #[arg(long, value_name = "KG", value_parser = above_zero, conflicts_with = "inertia")]
    pub mass: Option<f64>,
    /// Torque constant of the motor, for amperes and volts, in N·m/A.
    #[arg(long, value_name = "NM_PER_A", value_parser = above_zero)]
    pub torque_constant: Option<f64>,
    /// Turns of the motor for each turn of the axis.
    #[arg(long, value_name = "RATIO", value_parser = above_zero)]
    pub gear: Option<f64>,
    /// Feed of a linear axis in one turn of the screw, in m.
    #[arg(long, value_name = "M", value_parser = above_zero)]
    pub lead: Option<f64>,
    /// Resistance of the winding, for volts, in Ω.
    #[arg(long, value_name = "OHM", value_parser = above_zero)]
    pub resistance: Option<f64>,
    /// Say what was understood and write nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// Make trials from any table of numbers: time, position and command in columns of any names and units.
#[derive(Debug, Args)]
pub struct ImportDriveArguments {
    /// Logs, each a trial: text in columns, separated by commas, semicolons or tabs.
    #[arg(required = true, value_name = "FILE.csv")]
    pub logs: Vec<PathBuf>,
    /// Column of the time and its unit, for example `t_ms` or `"Time:ms"`.
    #[arg(long, value_name = "NAME[:UNIT]", value_parser = Column::parse)]
    pub time: Column,
    /// Column of the position and its unit, for example `"Pos [deg]"` or `q:rad`.
    #[arg(long, value_name = "NAME[:UNIT]", value_parser = Column::parse)]
    pub position: Column,
    /// Column of the force, torque, current or voltage that drives the axis, and its unit, for example `Iq:A`.
    #[arg(long, value_name = "NAME[:UNIT]", value_parser = Column::parse)]
    pub command: Column,
    /// Column of the commanded position.
    #[arg(long, value_name = "NAME[:UNIT]", value_parser = Column::parse)]
    pub setpoint: Option<Column>,
    /// Column of a known load, in a unit of force or torque.
    #[arg(long, value_name = "NAME[:UNIT]", value_parser = Column::parse)]
    pub load: Option<Column>,
    #[command(flatten)]
    pub into: IntoBundle,
}

#[derive(Debug, Args)]
pub struct ImportDynamixelArguments {
    /// Logs as `bam.dynamixel.record` writes them, each a trial.
    #[arg(required = true, value_name = "FILE.json")]
    pub logs: Vec<PathBuf>,
    /// Take the voltage from the error of position instead of `load`: duty cycle for each radian and unit of kp, for
    /// example 0.158 of an MX.
    #[arg(long, value_name = "PER_RAD", value_parser = above_zero)]
    pub error_gain: Option<f64>,
    /// Largest duty cycle, with --error-gain.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = above_zero, requires = "error_gain")]
    pub most_duty: f64,
    /// Inertia of the motor as seen at the axis, beside that of the pendulum, in kg·m².
    #[arg(long, value_name = "KG_M2", value_parser = zero_or_more)]
    pub armature: Option<f64>,
    #[command(flatten)]
    pub into: IntoBundle,
}

#[derive(Debug, Args)]
pub struct ImportOdriveArguments {
    /// Logs, each a trial: a CSV with the paths of properties as its heading, or the log of `candump -l`.
    #[arg(required = true, value_name = "FILE")]
    pub logs: Vec<PathBuf>,
    /// Part of the path of the axis that is meant, for example `axis0`.
    #[arg(long, value_name = "TEXT")]
    pub axis: Option<String>,
    /// Node whose frames are meant, in the log of a bus.
    #[arg(long, value_name = "N")]
    pub node: Option<u32>,
    #[command(flatten)]
    pub into: IntoBundle,
}

#[derive(Debug, Args)]
pub struct ImportMoteusArguments {
    /// Telemetry, each file a trial: a CSV, or a line of JSON for each row.
    #[arg(required = true, value_name = "FILE")]
    pub logs: Vec<PathBuf>,
    #[command(flatten)]
    pub into: IntoBundle,
}

#[derive(Debug, Args)]
pub struct ImportJointArguments {
    /// Bag: a file .mcap or .db3, or the folder of `ros2 bag record`. Each is a trial.
    #[arg(required = true, value_name = "FILE|FOLDER")]
    pub bags: Vec<PathBuf>,
    /// Joint, for example `panda_joint4` or `fr3_joint4`.
    #[arg(long, value_name = "NAME")]
    pub joint: String,
    /// Topic of its states, a JointState with positions and efforts.
    #[arg(long, value_name = "TOPIC", default_value = "/joint_states")]
    pub topic: String,
    /// Time of a message that counts.
    #[arg(long, value_enum, default_value_t = Clock::Stamp)]
    pub clock: Clock,
    #[command(flatten)]
    pub into: IntoBundle,
}

fn above_zero(text: &str) -> Result<f64, String> {
    positive(text, "a number above 0")
}

fn zero_or_more(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    value.ok_or_else(|| "give a number of at least 0".to_owned())
}
