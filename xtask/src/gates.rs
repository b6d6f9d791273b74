//! What a run of the example on the emulated board must reach.

use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

/// Half of what a 480 MHz processor has in a tick, at one cycle an instruction.
const INSTRUCTIONS: f64 = 240_000.0;
/// Of the measured peak, outside snaps and the first 3 mm.
const FORCE_ERROR: f64 = 0.10;
/// The example is 10 s long.
const TICKS: f64 = 10_000.0;

/// Fails with every gate that the summary in `path` does not pass.
pub fn check(path: &Path) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let failed = failed(&serde_json::from_str(&text)?);
    if !failed.is_empty() {
        bail!("the example on the emulated board ({}):\n  {}", path.display(), failed.join("\n  "));
    }
    Ok(())
}

fn failed(summary: &Value) -> Vec<String> {
    let number = |key: &str| summary[key].as_f64();
    let gate = |label: &str, value: Option<f64>, low: f64, high: f64| {
        let fits = value.is_some_and(|value| value >= low && value <= high);
        let shown = value.map_or("not measured".into(), |value| value.to_string());
        (!fits).then(|| format!("{label}: {shown}, wanted {low} to {high}"))
    };
    let share = number("force_rms_error_N").zip(number("measured_force_peak_N"));
    [
        gate("ticks", number("ticks"), TICKS, f64::INFINITY),
        gate("missed ticks", number("missed_ticks"), 0.0, 0.0),
        // A counter that stands still is no success.
        gate("instructions a tick", number("worst_instructions_per_tick"), 1000.0, INSTRUCTIONS),
        gate("bits that differ", number("differing_bits"), 0.0, 0.0),
        gate("force error", share.map(|(rms, peak)| rms / peak), 0.0, FORCE_ERROR),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn each_gate_closes() {
        let good = json!({
            "ticks": 10_500, "missed_ticks": 0, "worst_instructions_per_tick": 150_000,
            "differing_bits": 0, "force_rms_error_N": 0.01, "measured_force_peak_N": 0.4,
        });
        assert!(failed(&good).is_empty(), "{:?}", failed(&good));
        for (key, value) in [
            ("ticks", json!(9_999)),
            ("missed_ticks", json!(1)),
            ("worst_instructions_per_tick", json!(240_001)),
            ("worst_instructions_per_tick", json!(0)),
            ("worst_instructions_per_tick", json!(null)),
            ("differing_bits", json!(1)),
            ("force_rms_error_N", json!(0.041)),
        ] {
            let mut bad = good.clone();
            bad[key] = value;
            assert_eq!(failed(&bad).len(), 1, "{key}");
        }
    }
}
