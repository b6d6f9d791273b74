//! What an import has understood.

use cathforce_camera::{Calibrated, Frames, Sequence, Tracker};
use cathforce_recording::import::JoinedSeen;
use serde_json::{Value, json};

use super::calibration;
use super::view::{ENTRY_REACH_M, grouped};
use crate::ui::{Ui, two_columns};

pub struct Report<'a> {
    pub calibrated: &'a Calibrated,
    pub tracker: &'a Tracker,
    pub frames: &'a Frames,
    pub sequence: &'a Sequence,
    pub joined: Option<&'a JoinedSeen>,
    pub every: usize,
}

/// Gaps and branches up to this length are no remark: a reflection, a thinned corner \[m\].
const SMALL_M: f64 = 2e-3;

impl Report<'_> {
    /// Warns of dropped frames and of what was bridged or left out.
    pub fn warn(&self, ui: &Ui) {
        for group in grouped(&self.sequence.dropped) {
            ui.warn(format_args!("{}\n  fix: {}", group.text(), group.fix));
        }
        let count = |of: fn(&cathforce_camera::Sighting) -> f64| {
            let kept = self.sequence.kept.iter();
            kept.filter(|kept| of(&kept.sighting) > SMALL_M).count()
        };
        for (frames, what) in [
            (
                count(|s| s.bridged_m),
                "a gap of the catheter of more than 2 mm is bridged by a straight line",
            ),
            (
                count(|s| s.side_branch_m),
                "a branch of more than 2 mm is left out: it may be another thing, or the catheter crosses \
                 itself",
            ),
        ] {
            if frames > 0 {
                ui.warn(format_args!("in {frames} frames {what}"));
            }
        }
        let unseen = count(|s| s.unseen_at_entry_m);
        if unseen > 0 {
            let reach_mm = 1e3 * ENTRY_REACH_M;
            ui.warn(format_args!(
                "in {unseen} frames the catheter is seen only from 2 to {reach_mm:.0} mm past the entry on; \
                 a straight line joins it to the entry"
            ));
        }
    }

    pub fn text(&self) -> String {
        let mut rows = calibration::rows(self.calibrated);
        let tracker = self.tracker;
        let quality = &tracker.plane().quality;
        let [width, height] = self.frames.size();
        let kept = &self.sequence.kept;
        let span_s = kept.last().map_or(0.0, |kept| kept.t_s);
        let mut add = |label: &str, value: String| rows.push((label.to_owned(), value));
        add(
            "plane",
            format!(
                "{} points, {:.3} px, worst {:.2} mm",
                quality.points,
                quality.rms_px,
                1e3 * quality.worst_m
            ),
        );
        let [x, y] = tracker.entry_px();
        add(
            "entry",
            format!(
                "at pixel {x:.0}, {y:.0}; a pixel shows {:.3} mm, the catheter is {:.1} px wide",
                1e3 * tracker.pixel_m(),
                tracker.width_px()
            ),
        );
        let every = match self.every {
            1 => String::new(),
            n => format!(", one of {n} taken"),
        };
        let rate = rate_hz(kept.iter().map(|kept| kept.t_s));
        let rate = rate.map_or(String::new(), |rate| format!(", {rate:.2} Hz"));
        let frames = self.frames.count();
        add("frames", format!("{frames} of {width}x{height} px in {span_s:.2} s{rate}{every}"));
        let dropped = self.sequence.dropped.len();
        add("catheter", format!("in {} frames, {dropped} dropped", kept.len()));
        let lengths = kept.iter().map(|kept| kept.sighting.length_m);
        let (low, high) = lengths.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        add("length", format!("from {:.1} to {:.1} mm", 1e3 * low, 1e3 * high));
        if let Some(noise_m) = self.sequence.tip_noise_m() {
            add("tip noise", format!("{:.3} mm from frame to frame, each axis", 1e3 * noise_m));
        }
        if let Some((mean_m, sd_m)) = self.joined.and_then(JoinedSeen::excess) {
            let (mean_mm, sd_mm) = (1e3 * mean_m, 1e3 * sd_m);
            add("insertion", format!("the length is {mean_mm:+.2} ± {sd_mm:.2} mm from it"));
        }
        two_columns(&rows)
    }

    pub fn json(&self) -> Value {
        let mut json = calibration::json(self.calibrated);
        let quality = &self.tracker.plane().quality;
        let dropped = self.sequence.dropped.iter();
        let dropped = dropped.map(|one| json!({ "frame": one.number, "why": one.why.to_string() }));
        json["plane"] = json!({
            "points": quality.points, "rms_px": quality.rms_px, "worst_m": quality.worst_m,
        });
        json["entry_px"] = json!(self.tracker.entry_px());
        json["pixel_m"] = json!(self.tracker.pixel_m());
        json["size_px"] = json!(self.frames.size());
        json["frames"] = json!(self.frames.count());
        json["rate_hz"] = json!(rate_hz(self.sequence.kept.iter().map(|kept| kept.t_s)));
        json["found"] = json!(self.sequence.kept.len());
        json["dropped"] = json!(dropped.collect::<Vec<_>>());
        json["tip_noise_m"] = json!(self.sequence.tip_noise_m());
        let excess = self.joined.and_then(JoinedSeen::excess);
        json["length_less_insertion_m"] =
            json!(excess.map(|(mean, sd)| json!({ "mean": mean, "sd": sd })));
        json
    }
}

/// Frames a second, from the median step, so that dropped frames do not count.
fn rate_hz(times_s: impl Iterator<Item = f64>) -> Option<f64> {
    let times_s: Vec<f64> = times_s.collect();
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).filter(|step| **step > 0.0).map(|step| 1.0 / step)
}
