//! One HTML page of a recording: nothing is loaded from elsewhere, all data is inside.

mod band;
mod numbers;
mod surface;

use band::StatedBand;
use cathforce_config::image;
use cathforce_recording::{Analysis, Coverage, Covered, ForceError, Recording, Summary};
use serde_json::{Value, json};

use crate::{escape, template};

/// The wall of a vessel as packed triangles, from the entry; see [`numbers::vessel`].
pub fn vessel_data(lumen: &cathforce_mechanics::Lumen<'_>, entry_m: [f64; 3]) -> Value {
    numbers::vessel(&surface::extract(lumen), entry_m)
}

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str =
    concat!(include_str!("charts.js"), include_str!("scene.js"), include_str!("page.js"));

/// Why a recording has no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    #[error("the device image in the recording: {0}")]
    Image(image::ImageError),
}

/// The page of a recording.
///
/// Returns HTML; fails when the vessel cannot be read from the recording's device image.
pub fn recording_page(
    recording: &Recording,
    analysis: &Analysis,
    summary: &Summary,
) -> Result<String, PageError> {
    let config = image::decode(&recording.image).map_err(PageError::Image)?;
    let info = &recording.info;
    let title = format!("{} · trial {}", info.rig, info.trial);
    let band = StatedBand::of(recording, analysis);
    let coverage = band.as_ref().map(|band| band.coverage(recording));
    let data = json!({
        "title": title,
        "subtitle": subtitle(recording),
        "provenance": info.provenance,
        "tiles": tiles(summary, coverage.as_ref()),
        "facts": facts(recording, analysis, summary, coverage.as_ref()),
        "footnotes": footnotes(analysis, coverage.is_some()),
        "estimated": numbers::estimated(recording, analysis),
        "measured": numbers::measured(&recording.trial),
        "band": band.as_ref().map(StatedBand::lines),
        "charts": charts(recording, analysis),
        "unscored": numbers::unscored(analysis),
        "shape": numbers::shapes(recording, analysis),
        "vessel": numbers::vessel(&surface::extract(&config.lumen), analysis.entry_m),
        "start_s": analysis.peak.map_or(0.0, |peak| peak.t_s),
    });
    Ok(template::fill(
        TEMPLATE,
        &[
            ("title", &escape::html(&title)),
            ("style", STYLE),
            ("script", SCRIPT),
            ("data", &escape::json(&data)),
        ],
    ))
}

fn subtitle(recording: &Recording) -> String {
    let info = &recording.info;
    let clock = if info.lock_step { "virtual time, in lock step" } else { "real time" };
    format!("{} over {}, {clock}", info.board, info.link)
}

fn tiles(summary: &Summary, coverage: Option<&Coverage>) -> Value {
    let mut tiles = Vec::new();
    let mut tile = |label: &str, value: Option<String>, unit: &str, note: &str, verdict: &str| {
        if let Some(value) = value {
            tiles.push(json!({
                "label": label, "value": value, "unit": unit, "note": note, "verdict": verdict,
            }));
        }
    };
    let mn = |n: f64| format!("{:.1}", 1e3 * n);
    let share = summary.error_share().map(|share| format!("{:.1}", 100.0 * share));
    let noise = summary
        .force_noise_rms_n
        .map_or("noise included".to_owned(), |noise| format!("noise alone {} mN", mn(noise)));
    let absolute = summary
        .force_rms_error_n
        .zip(summary.measured_force_peak_n)
        .map_or(String::new(), |(e, p)| format!("{} mN RMS of {} mN peak, {noise}", mn(e), mn(p)));
    tile("force error", share, "% of peak", &absolute, "");
    let place = summary
        .peak_contact_node
        .zip(summary.peak_contact_t_s)
        .map_or(String::new(), |(node, t_s)| format!("node {node}, at {t_s:.2} s"));
    tile("peak contact force", summary.peak_contact_force_n.map(mn), "mN", &place, "");
    let all = coverage.map(Coverage::all).filter(|all| all.stated + all.unknown > 0);
    tile(
        "measured within the band",
        all.and_then(|all| all.share()).map(|share| format!("{:.1}", 100.0 * share)),
        "%",
        &all.and_then(|all| all.stated_share()).map_or(String::new(), |share| {
            format!("{:.1} % of the samples have a band", 100.0 * share)
        }),
        "",
    );
    let verdict = |good: bool| if good { "good" } else { "bad" };
    tile(
        "device against host",
        summary.differing_bits.map(|bits| bits.to_string()),
        "bits differ",
        "every output of every tick",
        verdict(summary.differing_bits == Some(0)),
    );
    let ticks = format!("of {} ticks", summary.ticks);
    tile(
        "missed ticks",
        summary.missed_ticks.map(|n| n.to_string()),
        "",
        &ticks,
        verdict(summary.missed_ticks == Some(0)),
    );
    tile(
        "worst tick",
        summary.worst_instructions_per_tick.map(|n| format!("{:.0}", f64::from(n) / 1e3)),
        "k instructions",
        &summary.budget_share_480mhz.map_or(String::new(), |share| {
            format!("{:.0} % of 480 MHz at 1 cycle each", 100.0 * share)
        }),
        "",
    );
    json!(tiles)
}

fn facts(
    recording: &Recording,
    analysis: &Analysis,
    summary: &Summary,
    coverage: Option<&Coverage>,
) -> Value {
    let info = &recording.info;
    let axes = |c: &ForceError| {
        let axis = |k: usize| format!("{:.1}", 1e3 * c.axis_rms_n[k]);
        format!("{} · {} · {} mN", axis(0), axis(1), axis(2))
    };
    let mut sections = vec![json!({ "section": "Figures", "rows": summary.rows() })];
    if let Some(c) = &analysis.comparison {
        let mut rows = Vec::new();
        if c.scored.rows > 0 {
            rows.push(["error RMS, x · y · z".to_owned(), axes(&c.scored)]);
            rows.push(["error, median".to_owned(), format!("{:.1} mN", 1e3 * c.scored.median_n)]);
            rows.push(["error, largest".to_owned(), format!("{:.1} mN", 1e3 * c.scored.max_n)]);
        }
        let excluded = format!("{:.1} %", 100.0 * c.excluded_share);
        rows.push(["left out of the score".to_owned(), excluded]);
        for pair in &c.snaps {
            let at =
                format!("{:.2} s, {:.1} mm", pair.measured.t_s, 1e3 * pair.measured.insertion_m);
            let model = pair.estimated.map_or("not in the model".to_owned(), |snap| {
                format!("model {:+.0} ms", 1e3 * (snap.t_s - pair.measured.t_s))
            });
            rows.push([format!("snap at {at}"), model]);
        }
        sections.push(json!({ "section": "Against the sensor", "rows": rows }));
    }
    if let Some(coverage) = coverage {
        let names = ["on the vessel, x", "y", "z", "behind the guide"];
        let own = names.iter().zip(&coverage.channels);
        let rows: Vec<_> = own.map(|(name, own)| [(*name).to_owned(), within(own)]).collect();
        sections.push(json!({ "section": "Measured within the band", "rows": rows }));
    }
    let complete = recording.completeness();
    sections.push(json!({ "section": "Made with", "rows": [
        ["board", info.board.as_str()],
        ["firmware", info.firmware_version.as_str()],
        ["host", info.host_version.as_str()],
        ["protocol", info.protocol.as_str()],
        ["recording complete", complete.as_str()],
    ] }));
    json!(sections)
}

/// Share within, and of how many.
fn within(own: &Covered) -> String {
    match own.share().zip(own.half_width_n()) {
        Some((share, width_n)) => format!(
            "{:.1} % (±{:.1} mN), a band for {} of {}",
            100.0 * share,
            1e3 * width_n,
            own.stated,
            own.stated + own.unknown
        ),
        None if own.unknown > 0 => format!("no band for any of {}", own.unknown),
        None => "not measured".to_owned(),
    }
}

fn footnotes(analysis: &Analysis, has_band: bool) -> Value {
    let mut lines = Vec::new();
    if has_band {
        lines.push(
            "The band is what the device stated: nine of ten true forces lie within. Of the \
             measured ones, at every row, the sensor's noise is allowed for besides.",
        );
    }
    if analysis.comparison.is_some() {
        lines.push(
            "Nothing is fitted, shifted or subtracted; measured force includes the sensor's noise. \
             Not scored: the first 3 mm of feed (grey) and 100 ms around snaps of the measured \
             force (orange).",
        );
    }
    if analysis.replay.is_some() {
        lines.push(
            "Nodes and peak come from the replay of the recording on the host, which reproduces \
             the device's outputs.",
        );
    }
    json!(lines)
}

fn charts(recording: &Recording, analysis: &Analysis) -> Value {
    let chart = |title: &str, axis: &str, channel: usize| json!({ "title": title, "axis": axis, "unit": "mN", "digits": 1, "channel": channel, "line": "estimated" });
    let mut charts = vec![
        chart("Force on the vessel, x", "force", 0),
        chart("Force on the vessel, y", "force", 1),
        chart("Force on the vessel, z", "force", 2),
        chart("Drive force behind the guide", "force", 3),
    ];
    if analysis.guidewire_radius_m.is_some() {
        charts.push(chart("Drive force of the guidewire", "force", 6));
    }
    if analysis.comparison.is_some() {
        let mut error = chart("Norm of the force error", "error", 0);
        error["error"] = numbers::error(recording, analysis);
        charts.push(error);
    }
    let insertion = |title: &str, channel: usize| json!({ "title": title, "axis": "insertion", "unit": "mm", "digits": 1, "channel": channel, "line": "encoder" });
    charts.push(insertion("Insertion", 4));
    if analysis.guidewire_radius_m.is_some() {
        charts.push(insertion("Insertion of the guidewire", 7));
    }
    json!(charts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_has_every_place_once_and_nothing_is_loaded() {
        for place in ["{{title}}", "{{style}}", "{{data}}", "{{script}}"] {
            assert_eq!(TEMPLATE.matches(place).count(), 1, "{place}");
        }
        for text in [TEMPLATE, STYLE, SCRIPT] {
            for loads in ["http:", "https:", "src=", "@import", "url(", "import ", "fetch("] {
                assert!(!text.contains(loads), "{loads}");
            }
            assert!(!text.contains("</script>") || text == TEMPLATE);
        }
    }
}
