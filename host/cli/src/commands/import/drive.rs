//! `cathforce import drive`, `dynamixel`, `odrive`, `moteus` and `joint`: logs of drives become trials of a bundle.

use std::io::Read;
use std::path::{Path, PathBuf};

use cathforce_bundle::bundle::{Axis, CommandKind};
use cathforce_recording::import::drive::{
    BamOptions, DriveLog, Wanted, read_bam, read_columns, read_moteus, read_odrive, read_odrive_can,
};
use cathforce_recording::import::{ColumnMap, ImportError, ImportedTrial, read_ros};

use super::into_bundle::{Pendulum, check, put};
use super::ros::files;
use super::trial::{at, open, say_all, warn_all};
use crate::args::{
    ImportDriveArguments, ImportDynamixelArguments, ImportJointArguments, ImportMoteusArguments,
    ImportOdriveArguments,
};
use crate::failure::Failure;
use crate::ui::Ui;

pub fn table(ui: &Ui, arguments: &ImportDriveArguments) -> Result<(), Failure> {
    check(&arguments.into)?;
    let wanted = Wanted {
        time: arguments.time.clone(),
        position: arguments.position.clone(),
        command: arguments.command.clone(),
        setpoint: arguments.setpoint.clone(),
        load: arguments.load.clone(),
    };
    let logs = read_all(ui, &arguments.logs, |file| read_columns(file, &wanted))?;
    put(ui, &arguments.into, &logs, None)
}

pub fn odrive(ui: &Ui, arguments: &ImportOdriveArguments) -> Result<(), Failure> {
    check(&arguments.into)?;
    let logs = read_all(ui, &arguments.logs, |mut file| {
        let mut text = String::new();
        if file.read_to_string(&mut text).is_err() {
            // Whatever is wrong with it is told by the reader of a table.
            return read_odrive(file, arguments.axis.as_deref());
        }
        match text.trim_start().starts_with('(') {
            true => read_odrive_can(text.as_bytes(), arguments.node),
            false => read_odrive(text.as_bytes(), arguments.axis.as_deref()),
        }
    })?;
    put(ui, &arguments.into, &logs, None)
}

pub fn moteus(ui: &Ui, arguments: &ImportMoteusArguments) -> Result<(), Failure> {
    check(&arguments.into)?;
    let logs = read_all(ui, &arguments.logs, read_moteus)?;
    put(ui, &arguments.into, &logs, None)
}

pub fn dynamixel(ui: &Ui, arguments: &ImportDynamixelArguments) -> Result<(), Failure> {
    check(&arguments.into)?;
    let options = BamOptions { error_gain: arguments.error_gain, most_duty: arguments.most_duty };
    let mut logs = Vec::new();
    let mut pendulum: Option<(&Path, Pendulum)> = None;
    for path in &arguments.logs {
        let own = read_bam(open(path)?, &options).map_err(|e| at(path, &e))?;
        say_all(ui, path, &own.log.understood);
        warn_all(ui, path, &own.log.remarks);
        let hangs = Pendulum {
            mass_kg: own.mass_kg,
            length_m: own.length_m,
            arm_mass_kg: own.arm_mass_kg,
            armature_kg_m2: arguments.armature.unwrap_or(0.0),
        };
        // The pendulum stands in rig.toml, for all trials alike.
        match &pendulum {
            Some((first, known)) if *known != hangs => {
                return Err(Failure::input(format!(
                    "{}: its pendulum is another one than that of {}\n  fix: import the logs of each pendulum into a \
                     bundle of its own",
                    path.display(),
                    first.display()
                )));
            }
            Some(_) => {}
            None => pendulum = Some((path.as_path(), hangs)),
        }
        logs.push((path.clone(), own.log));
    }
    put(ui, &arguments.into, &logs, pendulum.map(|(_, own)| own).as_ref())
}

pub fn joint(ui: &Ui, arguments: &ImportJointArguments) -> Result<(), Failure> {
    // A message does not say whether its joint turns or slides.
    let own = if arguments.into.mass.is_some() { Axis::Linear } else { Axis::Rotary };
    let axis = check(&arguments.into)?.unwrap_or(own);
    let signal = |to: &str, field: &str| ColumnMap {
        to: to.to_owned(),
        from: format!("{}:{}.{field}", arguments.topic, arguments.joint),
        factor: 1.0,
        offset: 0.0,
    };
    let (position, effort) = match axis {
        Axis::Linear => ("position_m", "drive_command_N"),
        Axis::Rotary => ("position_rad", "drive_command_Nm"),
    };
    let maps = [signal(position, "position"), signal(effort, "effort")];
    let mut logs = Vec::new();
    for path in &arguments.bags {
        let bag =
            read_ros(&files(path)?, &maps, arguments.clock.into()).map_err(|e| at(path, &e))?;
        say_all(ui, path, &bag.understood);
        warn_all(ui, path, &bag.table.remarks);
        let ImportedTrial::Drive(t_s, data) = bag.table.trial else {
            return Err(Failure::input(format!("{}: it holds no drive", path.display())));
        };
        if data.command.iter().all(|effort| *effort == 0.0) {
            return Err(Failure::input(format!(
                "{}: every effort of {} is 0: its driver reports none\n  fix: record a topic with measured torques, as \
                 /franka_robot_state_broadcaster/measured_joint_states, and give it with --topic",
                path.display(),
                arguments.joint
            )));
        }
        let log =
            DriveLog { trials: vec![(t_s, data)], understood: Vec::new(), remarks: Vec::new() };
        logs.push((path.clone(), log));
    }
    put(ui, &arguments.into, &logs, None)
}

/// Reads every log and says what was understood.
fn read_all(
    ui: &Ui,
    paths: &[PathBuf],
    read: impl Fn(std::fs::File) -> Result<DriveLog, ImportError>,
) -> Result<Vec<(PathBuf, DriveLog)>, Failure> {
    let mut logs: Vec<(PathBuf, DriveLog)> = Vec::new();
    for path in paths {
        let log = read(open(path)?).map_err(|e| at(path, &e))?;
        say_all(ui, path, &log.understood);
        warn_all(ui, path, &log.remarks);
        logs.push((path.clone(), log));
    }
    let kinds: Vec<(Axis, CommandKind)> = logs
        .iter()
        .flat_map(|(_, log)| log.trials.iter().map(|(_, data)| (data.axis, data.kind)))
        .collect();
    if kinds.windows(2).any(|pair| pair[0].0 != pair[1].0) {
        let message = "the logs are of linear and of rotary axes, and a bundle has one\n  fix: import them into two bundles";
        return Err(Failure::input(message));
    }
    Ok(logs)
}
