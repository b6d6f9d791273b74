//! `cathforce import ati`.

use std::path::Path;

use cathforce_bundle::bundle::LONGEST_GAP_S;
use cathforce_recording::import::{
    AtiOptions, ForceCalibration, ImportedTrial, Joined, join, read_ati,
};
use serde_json::json;

use super::motion::motion;
use super::trial::{at, open, say_all, warn_all, write};
use crate::args::{ImportAtiArguments, TimeUnit};
use crate::failure::Failure;
use crate::open::read_text;
use crate::output::{check_new, shown};
use crate::ui::Ui;

/// Share of the log's rows that may lie outside the motion without a warning: the two are started
/// by hand, one after the other.
const MOST_OUTSIDE: f64 = 0.1;

pub fn run(ui: &Ui, arguments: &ImportAtiArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.log, &arguments.out);
    check_new(out)?;
    let options = AtiOptions {
        counts_per_n: arguments.counts_per_n,
        axes: arguments.axes,
        tare_s: arguments.tare.unwrap_or(0.0),
        rate_hz: arguments.rate,
        time_unit_s: arguments.time_unit.map(TimeUnit::seconds),
        bias_n: arguments.bias.unwrap_or_default(),
        calibration: arguments.calibration.as_deref().map(calibration).transpose()?,
    };
    if !options.axes.is_rotation() {
        ui.warn("--axes mirrors, which is right only for a sensor that measures the reaction");
    }
    let log = read_ati(open(path)?, &options).map_err(|e| at(path, &e))?;
    say_all(ui, path, &log.understood);
    warn_all(ui, path, &log.remarks);
    if let Some(rate) = arguments.rate.filter(|_| log.has_time) {
        let path = path.display();
        ui.warn(format_args!("--rate {rate} is not used, because {path} has a column of time"));
    }
    let motion = motion(ui, &arguments.motion)?;
    let joined = join(&motion, &log.samples, arguments.offset);
    let all = log.samples.len();
    if joined.forces == 0 {
        let message = format!(
            "{}: none of its {all} rows is within the time of {}\n  fix: give with --offset the time \
             of the motion at which the log begins",
            path.display(),
            arguments.motion.display()
        );
        return Err(Failure::input(message));
    }
    warn(ui, arguments, &joined, all);
    let Joined { forces, outside, in_gaps, others, trial, .. } = joined;
    let count = |n: usize, what: &str| match n {
        0 => String::new(),
        n => format!(", {n} {what}"),
    };
    let text = format!(
        "{forces} rows{}{}{}",
        count(outside, "outside the motion left out"),
        count(in_gaps, "in its gaps left out"),
        count(others, "rows of the motion alone")
    );
    let json = json!({
        "path": shown(out), "rows": forces, "left_out": outside + in_gaps, "others": others,
    });
    let out = (!arguments.dry_run).then_some(&**out);
    write(ui, out, &ImportedTrial::Catheter(trial), &json, &text)
}

fn calibration(path: &Path) -> Result<ForceCalibration, Failure> {
    ForceCalibration::parse(&read_text(path)?).map_err(|problem| {
        let fix = "give three rows of three or six numbers: newtons for each unit of Fx, Fy, Fz, Tx, Ty, Tz";
        at(path, &format!("{problem}; fix: {fix}"))
    })
}

/// Warns of rows that are left out and of forces that are replaced.
fn warn(ui: &Ui, arguments: &ImportAtiArguments, joined: &Joined, all: usize) {
    let (log, motion) = (arguments.log.display(), arguments.motion.display());
    let Joined { outside, in_gaps, had_force, .. } = *joined;
    if outside as f64 > MOST_OUTSIDE * all as f64 {
        ui.warn(format_args!(
            "{log}: {outside} of its {all} rows are outside the time of {motion}; check --offset, and \
             that the time is in seconds"
        ));
    }
    if in_gaps > 0 {
        ui.warn(format_args!(
            "{motion}: has gaps of more than {LONGEST_GAP_S} s, in which {in_gaps} rows of {log} are \
             left out"
        ));
    }
    if had_force {
        ui.warn(format_args!("{motion}: has a force of its own, which that of {log} replaces"));
    }
}
