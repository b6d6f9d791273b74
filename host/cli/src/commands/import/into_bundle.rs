//! Trials of logs, put into a drive bundle that is there or made with them. All of them are written, or none.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Axis, CommandKind, DriveTrial, Plant};
use cathforce_recording::import::drive::DriveLog;
use cathforce_recording::{make_folder, write_drive, write_whole};
use serde_json::json;

use crate::args::IntoBundle;
use crate::commands::run::temporary_folder;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// The pendulum of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    pub mass_kg: f64,
    pub length_m: f64,
    /// Of the arm, whose middle is at half of the length.
    pub arm_mass_kg: f64,
    pub armature_kg_m2: f64,
}

impl Pendulum {
    /// Of the weight at its end, of the arm as a rod, and of the motor.
    fn inertia_kg_m2(&self) -> f64 {
        (self.mass_kg + self.arm_mass_kg / 3.0) * self.length_m.powi(2) + self.armature_kg_m2
    }

    /// The mass at the end of the pendulum that weighs as much.
    fn hanging_kg(&self) -> f64 {
        self.mass_kg + 0.5 * self.arm_mass_kg
    }
}

/// Says before the logs are read that the bundle cannot take them. Returns the axis of a bundle that is there.
pub fn check(into: &IntoBundle) -> Result<Option<Axis>, Failure> {
    let folder = &into.bundle;
    let stated = [
        ("--inertia", into.inertia.is_some()),
        ("--mass", into.mass.is_some()),
        ("--torque-constant", into.torque_constant.is_some()),
        ("--gear", into.gear.is_some()),
        ("--lead", into.lead.is_some()),
        ("--resistance", into.resistance.is_some()),
    ];
    if !folder.join("rig.toml").exists() {
        if folder.symlink_metadata().is_ok() {
            let message = format!(
                "{}: it is there and no bundle: it has no rig.toml\n  fix: give the folder of a drive bundle, or one that is \
                 not there yet",
                folder.display()
            );
            return Err(Failure::input(message));
        }
        return Ok(None);
    }
    let given: Vec<&str> = stated.iter().filter(|(_, is)| *is).map(|(name, _)| *name).collect();
    if !given.is_empty() {
        let message = format!(
            "{}: it is there already, and its rig.toml states what it is\n  fix: leave out {}, or give a new folder",
            folder.display(),
            given.join(", ")
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let bundle = Bundle::open(folder).map_err(Failure::input)?;
    match bundle.rig.plant {
        Plant::Drive(drive) => Ok(Some(drive.axis)),
        _ => Err(Failure::input(format!(
            "{}: it is no bundle of a drive: rig.toml has no plant = \"drive\"\n  fix: give a new folder",
            folder.display()
        ))),
    }
}

/// Writes the trials; says how many rows each has.
pub fn put(
    ui: &Ui,
    into: &IntoBundle,
    logs: &[(PathBuf, DriveLog)],
    pendulum: Option<&Pendulum>,
) -> Result<(), Failure> {
    let folder = &into.bundle;
    let is_new = !folder.join("rig.toml").exists();
    let trials: Vec<(&Path, &(Vec<f64>, DriveTrial))> = logs
        .iter()
        .flat_map(|(path, log)| log.trials.iter().map(move |own| (path.as_path(), own)))
        .collect();
    let rig = match is_new {
        true => rig_toml(into, &trials[0].1.1, pendulum)?,
        false => crate::open::read_text(&folder.join("rig.toml"))?,
    };
    let first = match is_new {
        true => 0,
        false => {
            let there = Bundle::open(folder).map_err(Failure::input)?;
            there.trials.iter().map(|own| own.number + 1).max().unwrap_or(0)
        }
    };
    let mut written: Vec<(u32, Vec<u8>)> = Vec::new();
    for (number, (_, (t_s, data))) in (first..).zip(&trials) {
        let mut text = Vec::new();
        write_drive(t_s, data, &mut text).map_err(|e| Failure::write(folder, e))?;
        written.push((number, text));
    }
    // What the bundle would be is read before anything is written.
    let tried = temporary_folder()?;
    let fill = |to: &Path, with_rig: bool| -> io::Result<()> {
        if with_rig {
            std::fs::write(to.join("rig.toml"), &rig)?;
        }
        std::fs::create_dir_all(to.join("trials"))?;
        for (number, text) in &written {
            std::fs::write(to.join(format!("trials/{number:03}.csv")), text)?;
        }
        Ok(())
    };
    fill(tried.path(), true).map_err(|e| Failure::write(tried.path(), e))?;
    let read = Bundle::open(tried.path()).map_err(|error| {
        let text = error
            .to_string()
            .replace(&tried.path().display().to_string(), &folder.display().to_string());
        Failure::input(format!("{text}\nnothing is written"))
    })?;
    for warning in &read.warnings {
        ui.warn(
            warning
                .to_string()
                .replace(&tried.path().display().to_string(), &folder.display().to_string()),
        );
    }
    let mut text = String::new();
    for ((number, _), (path, (t_s, _))) in written.iter().zip(&trials) {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "trial {number:03}: {} rows of {}", t_s.len(), path.display());
    }
    let numbers: Vec<u32> = written.iter().map(|(number, _)| *number).collect();
    let rows: Vec<usize> = trials.iter().map(|(_, (t_s, _))| t_s.len()).collect();
    let json = json!({
        "bundle": folder.display().to_string(), "new": is_new, "trials": numbers, "rows": rows,
        "written": !into.dry_run,
    });
    if into.dry_run {
        let rig = if is_new { format!("rig.toml would be:\n{rig}") } else { String::new() };
        return ui.data(&json, format!("{text}{rig}dry run: nothing is written\n"));
    }
    if is_new {
        make_folder(folder, |new| fill(new, true)).map_err(|e| Failure::write(folder, e))?;
    } else {
        std::fs::create_dir_all(folder.join("trials")).map_err(|e| Failure::write(folder, e))?;
        for (number, text) in &written {
            let file = folder.join(format!("trials/{number:03}.csv"));
            write_whole(&file, |out| io::Write::write_all(out, text))
                .map_err(|e| Failure::write(&file, e))?;
        }
    }
    let shown = folder.display();
    ui.data(&json, format!("{text}{shown}: look at it with `cathforce info {shown}`, then `cathforce gap diagnose {shown}`\n"))
}

/// What a new bundle states; refuses what is not known.
fn rig_toml(
    into: &IntoBundle,
    data: &DriveTrial,
    pendulum: Option<&Pendulum>,
) -> Result<String, Failure> {
    let usage =
        |message: &str| Failure::new(Code::Usage, format!("{}: {message}", into.bundle.display()));
    let name = into.bundle.file_name().map_or("drive".into(), |name| name.to_string_lossy());
    let keep = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(keep).collect();
    let mut rig =
        format!("format = \"trial-bundle/1\"\nname = \"{name}\"\nplant = \"drive\"\n\n[drive]\n");
    let stated = match (data.axis, pendulum) {
        (Axis::Rotary, Some(pendulum)) => Some(into.inertia.unwrap_or(pendulum.inertia_kg_m2())),
        (Axis::Rotary, None) => into.inertia,
        (Axis::Linear, _) => into.mass,
    };
    let inertia = stated.ok_or_else(|| {
        usage(match data.axis {
            Axis::Rotary if into.mass.is_some() => {
                "--mass is of a linear axis, and the log's is rotary\n  fix: give --inertia, in kg·m², of all that moves"
            }
            Axis::Linear if into.inertia.is_some() => {
                "--inertia is of a rotary axis, and the log's is linear\n  fix: give --mass, in kg, of all that moves"
            }
            Axis::Rotary => {
                "it is new, and the inertia is not known\n  fix: give --inertia, in kg·m², of all that moves"
            }
            Axis::Linear => "it is new, and the mass is not known\n  fix: give --mass, in kg, of all that moves",
        })
    })?;
    let key = match data.axis {
        Axis::Rotary => "moving_inertia_kg_m2",
        Axis::Linear => "moving_mass_kg",
    };
    // Writing into a string cannot fail.
    let _ = writeln!(rig, "{key} = {inertia:?}");
    if let Some(own) = pendulum {
        let _ = writeln!(
            rig,
            "pendulum = {{ mass_kg = {:?}, length_m = {:?}, hangs_at_rad = 0.0 }}",
            own.hanging_kg(),
            own.length_m
        );
    }
    if data.kind != CommandKind::Force {
        let constant = into.torque_constant.ok_or_else(|| {
            usage("the log has amperes or volts, and the torque constant is not known\n  fix: give --torque-constant, in N·m/A")
        })?;
        let mut motor = format!("torque_constant_Nm_per_A = {constant:?}");
        if let Some(gear) = into.gear {
            let _ = write!(motor, ", gear_ratio = {gear:?}");
        }
        if data.axis == Axis::Linear {
            let lead = into.lead.ok_or_else(|| {
                usage("the axis is linear and its motor turns: the lead is not known\n  fix: give --lead, in m a turn")
            })?;
            let _ = write!(motor, ", lead_m_per_turn = {lead:?}");
        }
        match (data.kind, into.resistance) {
            (CommandKind::Voltage, None) => {
                return Err(usage(
                    "the log has volts, and the resistance is not known\n  fix: give --resistance, in Ω",
                ));
            }
            (_, Some(resistance)) => {
                let _ = write!(motor, ", resistance_ohm = {resistance:?}");
            }
            _ => {}
        }
        let _ = writeln!(rig, "motor = {{ {motor} }}");
    }
    rig += "\n[nominal]\nnote = \"made by cathforce import: check every number\"\n";
    Ok(rig)
}
