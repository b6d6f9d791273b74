//! The whole analysis of a recording.

use cathforce_config::image;
use cathforce_mechanics::Solver;
use serde::Serialize;

use super::compare::{Comparison, compare};
use super::estimates::{estimates, trial_time_s};
use super::sensed::as_sensed;
use crate::decoding::tick::decode;
use crate::reading::reader::Recording;
use crate::replay::{ReplayError, ReplayReport, Track, replay};

/// The largest contact force at a node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PeakContact {
    pub force_n: f64,
    /// 0 is the tip.
    pub node: u16,
    /// Time of the trial \[s\].
    pub t_s: f64,
}

/// A recording replayed and compared with the trial that it played.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// `None` if the recording was made without lock step and cannot be replayed.
    pub replay: Option<ReplayReport>,
    /// From the replay; without one, from the frames alone.
    pub track: Track,
    /// `None` without a measured force.
    pub comparison: Option<Comparison>,
    /// Largest force during the trial, in ticks that the model resolved; known only from a replay.
    pub peak: Option<PeakContact>,
    /// Position of the entry, vessel frame \[m\].
    pub entry_m: [f64; 3],
    /// Outer radius of the instrument \[m\].
    pub radius_m: f64,
    /// Outer radius of the guidewire, if there is one \[m\].
    pub guidewire_radius_m: Option<f64>,
    /// Settings of the model, which say where its nodes lie along the instrument.
    pub solver: Solver<f32>,
}

/// Replays a recording if that is possible and compares it with its trial.
pub fn analyse(recording: &Recording) -> Result<Analysis, ReplayError> {
    let config = image::decode(&recording.image).map_err(ReplayError::Image)?;
    let description = config.model.description();
    let entry_m = description.entry.position_m.map(f64::from);
    let (report, track) = match replay(recording) {
        Ok((report, track)) => (Some(report), track),
        Err(ReplayError::FreeRunning | ReplayError::Damaged { .. }) => {
            let (ticks, shapes) = decode(&recording.frames, recording.master());
            (None, Track { ticks, shapes })
        }
        Err(error) => return Err(error),
    };
    let mut estimates = estimates(recording, &track, entry_m);
    as_sensed(&mut estimates, &description.effects.sensor);
    let comparison = compare(&estimates, &recording.trial);
    let peak = peak(recording, &track);
    Ok(Analysis {
        replay: report,
        track,
        comparison,
        peak,
        entry_m,
        radius_m: f64::from(description.instrument.outer_radius_m),
        guidewire_radius_m: description.guidewire.as_ref().map(|w| f64::from(w.outer_radius_m)),
        solver: description.solver,
    })
}

fn peak(recording: &Recording, track: &Track) -> Option<PeakContact> {
    let resolved = track.ticks.iter().filter(|tick| !tick.unresolved);
    resolved
        .filter_map(|tick| {
            let force_n = f64::from(tick.peak_contact_force_n?);
            let t_s = trial_time_s(recording, tick.at_ns);
            (t_s >= 0.0).then_some(PeakContact { force_n, node: tick.peak_node?, t_s })
        })
        .max_by(|a, b| a.force_n.total_cmp(&b.force_n))
}
