//! Names of the columns of a trial, for readers and writers.

use crate::axis::{Axis, CommandKind};

/// Time since the trial began \[s\].
pub const TIME: &str = "t_s";
/// Of the drive \[m\].
pub const INSERTION: &str = "insertion_m";
/// Of the drive \[rad\].
pub const ROTATION: &str = "rotation_rad";
/// Of the instrument on the phantom, vessel frame \[N\].
pub const FORCE: [&str; 3] = ["fx_N", "fy_N", "fz_N"];
/// Axial, behind the guide \[N\].
pub const DRIVE_FORCE: &str = "drive_fx_N";
/// End of the centre line, vessel frame \[m\].
pub const TIP: [&str; 3] = ["tip_x_m", "tip_y_m", "tip_z_m"];
/// As [`INSERTION`], of the guidewire's drive.
pub const GUIDEWIRE_INSERTION: &str = "guidewire_insertion_m";
/// As [`ROTATION`], of the guidewire's drive.
pub const GUIDEWIRE_ROTATION: &str = "guidewire_rotation_rad";
/// As [`DRIVE_FORCE`], of the guidewire's drive.
pub const GUIDEWIRE_DRIVE_FORCE: &str = "guidewire_drive_fx_N";

/// Displacements of the drives of the tendons, in the order of `[[tendons]]` \[m\].
pub const TENDONS: [&str; 4] = ["tendon_1_m", "tendon_2_m", "tendon_3_m", "tendon_4_m"];

/// Those that every trial has.
pub const REQUIRED: [&str; 3] = [TIME, INSERTION, ROTATION];
/// All but those of shape points.
pub const ALL: [&str; 17] = [
    TIME,
    INSERTION,
    ROTATION,
    FORCE[0],
    FORCE[1],
    FORCE[2],
    DRIVE_FORCE,
    TIP[0],
    TIP[1],
    TIP[2],
    GUIDEWIRE_INSERTION,
    GUIDEWIRE_ROTATION,
    GUIDEWIRE_DRIVE_FORCE,
    TENDONS[0],
    TENDONS[1],
    TENDONS[2],
    TENDONS[3],
];

/// Of a trial of a drive on its own: its position \[m\] or \[rad\].
pub const POSITION: &str = "position_m";
pub const POSITION_RAD: &str = "position_rad";
/// The whole force \[N\] or torque \[N·m\] that is applied to it.
pub const COMMAND: &str = "drive_command_N";
pub const COMMAND_NM: &str = "drive_command_Nm";
/// Or what its motor is given \[A\], \[V\].
pub const CURRENT: &str = "motor_current_A";
pub const VOLTAGE: &str = "motor_voltage_V";
/// Where it was to be \[m\] or \[rad\].
pub const SETPOINT: &str = "setpoint_m";
pub const SETPOINT_RAD: &str = "setpoint_rad";
/// What it takes to hold it against a load that is known \[N\] or \[N·m\].
pub const LOAD: &str = "load_N";
pub const LOAD_NM: &str = "load_Nm";
/// Those of commands, of which a drive's trial has one.
pub const COMMANDS: [&str; 4] = [COMMAND, COMMAND_NM, CURRENT, VOLTAGE];
/// Those of a drive's trial: the time, a position and a command, and perhaps a set-point and a load.
pub const OF_DRIVE: [&str; 11] = [
    TIME,
    POSITION,
    COMMAND,
    SETPOINT,
    LOAD,
    POSITION_RAD,
    COMMAND_NM,
    SETPOINT_RAD,
    LOAD_NM,
    CURRENT,
    VOLTAGE,
];

/// Names of the columns of an axis' position, set-point and known load.
pub fn of_axis(axis: Axis) -> [&'static str; 3] {
    match axis {
        Axis::Linear => [POSITION, SETPOINT, LOAD],
        Axis::Rotary => [POSITION_RAD, SETPOINT_RAD, LOAD_NM],
    }
}

/// Name of the column of its command.
pub fn of_command(kind: CommandKind, axis: Axis) -> &'static str {
    match (kind, axis) {
        (CommandKind::Force, Axis::Linear) => COMMAND,
        (CommandKind::Force, Axis::Rotary) => COMMAND_NM,
        (CommandKind::Current, _) => CURRENT,
        (CommandKind::Voltage, _) => VOLTAGE,
    }
}

/// Of a transmission's trial: where it is driven, and where its output is \[m\] or \[rad\].
pub const INPUTS: [&str; 2] = ["input_m", "input_rad"];
pub const OUTPUTS: [&str; 2] = ["output_m", "output_rad"];
/// Sum of the angles by which its sheath bends \[rad\].
pub const BEND: &str = "bend_rad";
/// All that a transmission's trial may have.
pub const OF_TRANSMISSION: [&str; 8] =
    [TIME, INPUTS[0], INPUTS[1], OUTPUTS[0], OUTPUTS[1], LOAD, LOAD_NM, BEND];

/// Names of the columns of a transmission's input, output, and load at the output.
pub fn of_transmission(input: Axis, output: Axis) -> [&'static str; 3] {
    let input = match input {
        Axis::Linear => INPUTS[0],
        Axis::Rotary => INPUTS[1],
    };
    match output {
        Axis::Linear => [input, OUTPUTS[0], LOAD],
        Axis::Rotary => [input, OUTPUTS[1], LOAD_NM],
    }
}

/// Columns of a shape point, counted from the tip, vessel frame \[m\].
pub fn shape_point(k: usize) -> [String; 3] {
    ["x", "y", "z"].map(|axis| format!("p{k:02}_{axis}_m"))
}

/// The k of a column `pNN_x_m`.
pub(super) fn shape_index(name: &str) -> Option<usize> {
    let rest = name.strip_prefix('p')?;
    let (digits, axis) = rest.split_once('_')?;
    let two_or_more = digits.len() >= 2 && digits.bytes().all(|byte| byte.is_ascii_digit());
    // The format's names are those that `p{k:02}` gives.
    let k = digits.parse::<usize>().ok().filter(|k| *k < 10_000 && format!("{k:02}") == digits)?;
    (two_or_more && matches!(axis, "x_m" | "y_m" | "z_m")).then_some(k)
}
