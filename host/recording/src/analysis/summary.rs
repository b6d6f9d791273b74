//! The figures of a run: rows of a table, and fields of a JSON object.

use serde::Serialize;

use super::analyse::Analysis;
use super::estimates::trial_time_s;
use crate::decoding::tick::GuidewireEstimate;
use crate::reading::reader::Recording;

/// Cycles of one tick of a 480 MHz processor.
const BUDGET_CYCLES: f64 = 480_000.0;

/// The figures of a run. What was not measured is absent.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(default)]
pub struct Summary {
    pub ticks: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_ticks: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_instructions_per_tick: Option<u32>,
    /// At one cycle an instruction, which is the least that it can be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget_share_480mhz: Option<f64>,
    #[serde(rename = "peak_contact_force_N", skip_serializing_if = "Option::is_none")]
    pub peak_contact_force_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_contact_node: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_contact_t_s: Option<f64>,
    /// Of the norm of the error, outside snaps and the first 3 mm, noise included.
    #[serde(rename = "force_rms_error_N", skip_serializing_if = "Option::is_none")]
    pub force_rms_error_n: Option<f64>,
    /// Of the norm, over the same time.
    #[serde(rename = "measured_force_peak_N", skip_serializing_if = "Option::is_none")]
    pub measured_force_peak_n: Option<f64>,
    /// What the sensor's noise alone would be, where the rig states it; of others likewise.
    #[serde(rename = "force_noise_rms_N", skip_serializing_if = "Option::is_none")]
    pub force_noise_rms_n: Option<f64>,
    #[serde(rename = "force_rms_error_whole_N", skip_serializing_if = "Option::is_none")]
    pub force_rms_error_whole_n: Option<f64>,
    #[serde(rename = "drive_fx_rms_error_N", skip_serializing_if = "Option::is_none")]
    pub drive_force_rms_error_n: Option<f64>,
    #[serde(rename = "drive_fx_noise_rms_N", skip_serializing_if = "Option::is_none")]
    pub drive_force_noise_rms_n: Option<f64>,
    /// Largest magnitudes of the guidewire's load during the trial.
    #[serde(rename = "guidewire_peak_drive_fx_N", skip_serializing_if = "Option::is_none")]
    pub guidewire_peak_drive_force_n: Option<f64>,
    #[serde(rename = "guidewire_peak_drive_torque_N_m", skip_serializing_if = "Option::is_none")]
    pub guidewire_peak_drive_torque_n_m: Option<f64>,
    #[serde(rename = "guidewire_drive_fx_rms_error_N", skip_serializing_if = "Option::is_none")]
    pub guidewire_force_rms_error_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_rms_error_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_noise_rms_m: Option<f64>,
    /// Measured, found by the model, and found by the model alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub snaps: Option<[usize; 3]>,
    pub unresolved_ticks: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub differing_bits: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_s: Option<f64>,
}

impl Summary {
    /// From a recording and what follows from it.
    pub fn of(recording: &Recording, analysis: &Analysis) -> Self {
        let counted = |n: u32| (n > 0).then_some(n);
        let result = recording.result;
        let worst = result.and_then(|r| counted(r.worst_instructions));
        let comparison = analysis.comparison.as_ref();
        let scored = comparison.map(|c| c.scored).filter(|scored| scored.rows > 0);
        let wire_peak = |load: fn(&GuidewireEstimate) -> Option<f32>| {
            let played = analysis.track.ticks.iter();
            let played = played.filter(|tick| trial_time_s(recording, tick.at_ns) >= 0.0);
            let loads = played.filter(|tick| !tick.unresolved).filter_map(|tick| {
                let load = load(tick.guidewire.as_ref()?)?;
                Some(f64::from(load.abs()))
            });
            loads.max_by(f64::total_cmp)
        };
        Self {
            ticks: analysis.track.ticks.len() as u64,
            missed_ticks: result.map(|r| r.missed_ticks),
            worst_instructions_per_tick: worst,
            budget_share_480mhz: worst.map(|n| f64::from(n) / BUDGET_CYCLES),
            peak_contact_force_n: analysis.peak.map(|peak| peak.force_n),
            peak_contact_node: analysis.peak.map(|peak| peak.node),
            peak_contact_t_s: analysis.peak.map(|peak| peak.t_s),
            force_rms_error_n: scored.map(|scored| scored.rms_n),
            measured_force_peak_n: scored.map(|scored| scored.measured_peak_n),
            force_noise_rms_n: comparison.and_then(|c| c.noise_rms_n),
            force_rms_error_whole_n: comparison.map(|c| c.whole.rms_n),
            drive_force_rms_error_n: comparison.and_then(|c| Some(c.drive_force?.rms)),
            drive_force_noise_rms_n: comparison.and_then(|c| c.drive_force?.noise_rms),
            guidewire_peak_drive_force_n: wire_peak(|wire| wire.drive_force_n),
            guidewire_peak_drive_torque_n_m: wire_peak(|wire| wire.drive_torque_n_m),
            guidewire_force_rms_error_n: comparison.and_then(|c| Some(c.guidewire_force?.rms)),
            tip_rms_error_m: comparison.and_then(|c| Some(c.tip?.rms)),
            tip_noise_rms_m: comparison.and_then(|c| c.tip?.noise_rms),
            snaps: comparison.map(|c| {
                let found = c.snaps.iter().filter(|pair| pair.estimated.is_some()).count();
                [c.snaps.len(), found, c.false_snaps.len()]
            }),
            unresolved_ticks: analysis.track.ticks.iter().filter(|t| t.unresolved).count(),
            differing_bits: analysis
                .replay
                .as_ref()
                .filter(|replay| replay.frames_compared > 0)
                .map(|replay| replay.differing_bits),
            wall_s: result.map(|r| f64::from(r.wall_ms) * 1e-3),
        }
    }

    /// `force_rms_error_n` over `measured_force_peak_n`, when there is something to compare.
    pub fn error_share(&self) -> Option<f64> {
        let share = self.force_rms_error_n? / self.measured_force_peak_n?;
        share.is_finite().then_some(share)
    }

    /// Label and value, in the order in which people ask.
    pub fn rows(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        let mut row = |label: &str, value: Option<String>| {
            rows.push((label.to_owned(), value.unwrap_or_else(|| "not measured".to_owned())));
        };
        let mn = |n: f64| format!("{:.1} mN", 1e3 * n);
        let mm = |m: f64| format!("{:.2} mm", 1e3 * m);
        let noise_of = |noise: Option<String>| {
            noise.map_or(String::new(), |noise| format!(", sensor noise {noise}"))
        };
        row("ticks", Some(self.ticks.to_string()));
        row("missed ticks", self.missed_ticks.map(|n| n.to_string()));
        row("worst tick", self.worst_instructions_per_tick.map(|n| format!("{n} instructions")));
        row(
            "share of 480 MHz",
            self.budget_share_480mhz
                .map(|share| format!("{:.1} %, at one cycle an instruction", 100.0 * share)),
        );
        row(
            "peak contact force",
            self.peak_contact_force_n
                .zip(self.peak_contact_node)
                .zip(self.peak_contact_t_s)
                .map(|((force, node), t_s)| format!("{} at node {node}, {t_s:.3} s", mn(force))),
        );
        row(
            "force error",
            self.force_rms_error_n.zip(self.measured_force_peak_n).map(|(rms, peak)| {
                let noise = noise_of(self.force_noise_rms_n.map(mn));
                format!("{} RMS, {:.1} % of {}{noise}", mn(rms), 100.0 * rms / peak, mn(peak))
            }),
        );
        row("  snaps included", self.force_rms_error_whole_n.map(|rms| format!("{} RMS", mn(rms))));
        row(
            "drive force error",
            self.drive_force_rms_error_n.map(|rms| {
                format!("{} RMS{}", mn(rms), noise_of(self.drive_force_noise_rms_n.map(mn)))
            }),
        );
        if let Some((force, torque)) =
            self.guidewire_peak_drive_force_n.zip(self.guidewire_peak_drive_torque_n_m)
        {
            let load = format!("{} and {:.1} µN·m at most", mn(force), 1e6 * torque);
            row("guidewire's drive", Some(load));
            let error = self.guidewire_force_rms_error_n;
            row("  its force error", error.map(|rms| format!("{} RMS", mn(rms))));
        }
        let tip = self
            .tip_rms_error_m
            .map(|rms| format!("{} RMS{}", mm(rms), noise_of(self.tip_noise_rms_m.map(mm))));
        row("tip error", tip);
        row(
            "snaps",
            self.snaps.map(|[measured, found, alone]| {
                format!("{measured} measured, {found} of them found, {alone} in the model alone")
            }),
        );
        row("unresolved ticks", Some(self.unresolved_ticks.to_string()));
        row("device and host", self.differing_bits.map(|bits| format!("{bits} bits differ")));
        row("wall time", self.wall_s.map(|s| format!("{s:.1} s")));
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_said_and_left_out() {
        let summary = Summary { ticks: 3, ..Summary::default() };
        let rows = summary.rows();
        assert!(rows.contains(&("worst tick".into(), "not measured".into())), "{rows:?}");
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json.get("worst_instructions_per_tick"), None);
        assert_eq!(json["ticks"], 3);
        assert_eq!(summary.error_share(), None);
    }

    #[test]
    fn the_keys_of_the_demo_are_there() {
        let summary = Summary {
            missed_ticks: Some(0),
            worst_instructions_per_tick: Some(150_000),
            budget_share_480mhz: Some(0.3125),
            peak_contact_force_n: Some(0.1),
            force_rms_error_n: Some(0.125),
            measured_force_peak_n: Some(0.5),
            differing_bits: Some(0),
            wall_s: Some(12.0),
            ..Summary::default()
        };
        let json = serde_json::to_value(&summary).unwrap();
        for key in [
            "ticks",
            "missed_ticks",
            "worst_instructions_per_tick",
            "budget_share_480mhz",
            "peak_contact_force_N",
            "force_rms_error_N",
            "measured_force_peak_N",
            "differing_bits",
            "wall_s",
        ] {
            assert!(json.get(key).is_some_and(serde_json::Value::is_number), "{key}");
        }
        assert_eq!(summary.error_share(), Some(0.25));
    }
}
