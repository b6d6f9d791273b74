//! `cathforce import camera`.

mod calibration;
mod report;
mod trial;
mod view;

use cathforce_camera::{Ffmpeg, Frames, follow};

use crate::args::ImportCameraArguments;
use crate::failure::Failure;
use crate::output::check_new;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ImportCameraArguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.calibration.draw_board {
        return calibration::draw_board(ui, &arguments.calibration, path);
    }
    // What is missing is said before any work is done.
    if let Some(out) = &arguments.out {
        check_new(out)?;
    }
    let Some(path) = &arguments.frames else {
        return calibration::alone(ui, &arguments.calibration);
    };
    let needed = view::Needed::of(arguments)?;
    let calibrated = calibration::get(ui, &arguments.calibration)?;
    let mut frames = Frames::open(path, arguments.view.rate, &Ffmpeg::default())?;
    let tracker = view::tracker(ui, arguments, &needed, &calibrated.calibration, frames.size())?;
    let motion = trial::motion(ui, arguments)?;
    let mut progress = ui.progress("frames", frames.count() as u64, "frames");
    let every = arguments.view.every as usize;
    let found = follow(&mut frames, &tracker, every, |done| progress.set(done as u64));
    drop(progress);
    let sequence = found?;
    if sequence.kept.is_empty() {
        return Err(view::nothing_found(path, &sequence));
    }
    view::check_covered(ui, &calibrated.calibration, &sequence)?;
    let joined = motion.map(|motion| trial::join(ui, arguments, &motion, &sequence)).transpose()?;
    let report = report::Report {
        calibrated: &calibrated,
        tracker: &tracker,
        frames: &frames,
        sequence: &sequence,
        joined: joined.as_ref(),
        every,
    };
    report.warn(ui);
    let out = arguments.out.as_ref().filter(|_| !arguments.dry_run);
    let joined = joined.as_ref().filter(|_| out.is_some());
    trial::write(ui, out, joined, &report)
}
