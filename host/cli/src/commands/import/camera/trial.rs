//! The trial that is made of a camera's frames and a motion.

use std::path::PathBuf;

use cathforce_bundle::bundle::LONGEST_GAP_S;
use cathforce_camera::Sequence;
use cathforce_recording::Trial;
use cathforce_recording::import::{ImportedTrial, JoinedSeen, Seen, best_offset, join_seen};

use super::super::motion::motion as read_motion;
use super::super::trial::write as write_trial;
use super::report::Report;
use crate::args::ImportCameraArguments;
use crate::failure::Failure;
use crate::output::shown;
use crate::ui::Ui;

/// The motion that was recorded beside the camera, where one is given.
pub fn motion(ui: &Ui, arguments: &ImportCameraArguments) -> Result<Option<Trial>, Failure> {
    arguments.motion.as_ref().map(|path| read_motion(ui, path)).transpose()
}

/// A length that changes less is no motion by which clocks could be compared \[m\].
const LEAST_MOTION_M: f64 = 5e-3;
/// Another offset is named where it makes length and insertion agree twice as well.
const MUCH_BETTER: f64 = 0.5;
/// Length and insertion differ by the slack of the instrument in the vessel, which is less \[m\].
const MOST_EXCESS_M: f64 = 5e-3;

/// Gives each sighting the motion of its time, and warns of what does not fit.
pub fn join(
    ui: &Ui,
    arguments: &ImportCameraArguments,
    motion: &Trial,
    sequence: &Sequence,
) -> Result<JoinedSeen, Failure> {
    let seen: Vec<Seen> = sequence
        .kept
        .iter()
        .map(|kept| Seen {
            t_s: kept.t_s,
            tip_m: kept.sighting.tip_m,
            shape_m: kept.sighting.shape_m.clone(),
            length_m: kept.sighting.length_m,
        })
        .collect();
    let (seen, hidden) = without_hidden(motion, seen, arguments.offset);
    let joined = join_seen(motion, &seen, arguments.offset);
    if hidden > 0 {
        ui.warn(format_args!(
            "{hidden} frames are left out, whose centre line differs by more than {:.0} mm more from the \
             insertion than is usual in this recording: the tip is hidden, or something else is taken for it",
            1e3 * MOST_EXCESS_M
        ));
    }
    let name = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
    let motion_name = name(&arguments.motion).unwrap_or_default();
    let frames_name = name(&arguments.frames).unwrap_or_default();
    if joined.seen == 0 {
        return Err(Failure::input(format!(
            "{frames_name}: none of its frames is within the time of {motion_name}\n  fix: give with \
             --offset the time of the motion at which the first frame was taken"
        )));
    }
    if joined.outside > 0 {
        ui.warn(format_args!(
            "{} frames are outside the time of {motion_name} and are left out; check --offset",
            joined.outside
        ));
    }
    if joined.in_gaps > 0 {
        ui.warn(format_args!(
            "{motion_name}: has gaps of more than {LONGEST_GAP_S} s, in which {} frames are left out",
            joined.in_gaps
        ));
    }
    if joined.had_own {
        ui.warn(format_args!(
            "{motion_name}: has a tip or shape of its own, which those of the camera replace"
        ));
    }
    compare_lengths(ui, arguments, motion, &seen, &joined);
    Ok(joined)
}

/// Sightings whose length fits the insertion as those of the others do, and the number of those that do
/// not. Where most do not fit, the offset is wrong and all are kept.
fn without_hidden(motion: &Trial, seen: Vec<Seen>, offset_s: f64) -> (Vec<Seen>, usize) {
    let excess = |one: &Seen| Some(one.length_m - insertion_m(motion, one.t_s + offset_s)?);
    let excess: Vec<Option<f64>> = seen.iter().map(excess).collect();
    let mut known: Vec<f64> = excess.iter().copied().flatten().collect();
    known.sort_by(f64::total_cmp);
    let Some(usual_m) = known.get(known.len() / 2).copied() else { return (seen, 0) };
    let fits = |excess: &Option<f64>| excess.is_none_or(|m| (m - usual_m).abs() < MOST_EXCESS_M);
    let hidden = excess.iter().filter(|excess| !fits(excess)).count();
    if 4 * hidden > seen.len() {
        return (seen, 0);
    }
    let kept = seen.into_iter().zip(&excess).filter(|(_, excess)| fits(excess));
    (kept.map(|(one, _)| one).collect(), hidden)
}

/// The insertion at a time within the motion \[m\].
fn insertion_m(motion: &Trial, t_s: f64) -> Option<f64> {
    let next = motion.rows.partition_point(|row| row.t_s < t_s);
    let (before, after) = (motion.rows.get(next.checked_sub(1)?)?, motion.rows.get(next)?);
    let share = (t_s - before.t_s) / (after.t_s - before.t_s);
    Some(before.insertion_m + share * (after.insertion_m - before.insertion_m))
}

/// The length that is seen is the insertion, but for slack and mistakes.
fn compare_lengths(
    ui: &Ui,
    arguments: &ImportCameraArguments,
    motion: &Trial,
    seen: &[Seen],
    joined: &JoinedSeen,
) {
    let Some((mean_m, sd_m)) = joined.excess() else { return };
    if mean_m.abs() > MOST_EXCESS_M {
        let word = if mean_m > 0.0 { "longer" } else { "shorter" };
        ui.warn(format_args!(
            "the centre line is {:.1} mm {word} than the insertion, on average\n  fix: check the entry, \
             offset_m and the scale of the plane, and that insertion_m is the length inside",
            1e3 * mean_m.abs()
        ));
    }
    let lengths = || seen.iter().map(|one| one.length_m);
    let span_m = lengths().fold(f64::MIN, f64::max) - lengths().fold(f64::MAX, f64::min);
    if span_m < LEAST_MOTION_M {
        return;
    }
    let best = best_offset(motion, seen, arguments.offset);
    if let Some((offset_s, best_m)) = best.filter(|(_, best_m)| *best_m < MUCH_BETTER * sd_m) {
        ui.warn(format_args!(
            "the centre line and the insertion change at different times: with --offset {offset_s:.2} they \
             differ by ±{:.2} mm instead of ±{:.2} mm",
            1e3 * best_m,
            1e3 * sd_m
        ));
    }
}

/// Writes the trial, if there is one to be written, and prints the report.
pub fn write(
    ui: &Ui,
    out: Option<&PathBuf>,
    joined: Option<&JoinedSeen>,
    report: &Report<'_>,
) -> Result<(), Failure> {
    let mut json = report.json();
    json["path"] = serde_json::json!(out.map(shown));
    let text = report.text();
    match out.zip(joined) {
        None => ui.data(&json, format_args!("{text}nothing is written\n")),
        Some((out, joined)) => {
            json["rows"] = joined.trial.rows.len().into();
            let last = format!("{text}{} rows", joined.trial.rows.len());
            write_trial(ui, Some(out), &ImportedTrial::Catheter(joined.trial.clone()), &json, &last)
        }
    }
}

#[cfg(test)]
mod tests {
    use cathforce_recording::Measured;

    use super::*;

    #[test]
    fn a_frame_that_contradicts_the_insertion_is_left_out_unless_most_do() {
        let row = |k: u32| Measured {
            t_s: 0.01 * f64::from(k),
            insertion_m: 0.05 + 1e-4 * f64::from(k),
            rotation_rad: 0.0,
            force_n: None,
            drive_force_n: None,
            tip_m: None,
            guidewire: None,
            tendons_m: [None; 4],
        };
        let motion = Trial { rows: (0..200).map(row).collect(), ..Trial::default() };
        let seen = |hidden: usize| {
            let one = |k: usize| {
                let t_s = k as f64 / 30.0;
                let length_m = if k < hidden { 0.03 } else { 0.049 + 0.01 * t_s };
                Seen { t_s, tip_m: [0.0; 3], shape_m: Vec::new(), length_m }
            };
            (0..40).map(one).collect::<Vec<_>>()
        };
        // With an offset every frame lies between two rows.
        let (kept, hidden) = without_hidden(&motion, seen(5), 0.005);
        assert_eq!((kept.len(), hidden), (35, 5));
        assert_eq!(without_hidden(&motion, seen(30), 0.005).1, 0);
    }
}
