//! `cathforce lumen`: the distance field of a vessel as the device has it, its size and accuracy.

use std::path::Path;
use std::time::Instant;

use cathforce_bundle::lumen::{DEVICE_LUMEN_BYTES, Spread};
use cathforce_bundle::{CELL_M, LumenBuildError, LumenJob, LumenReport, WallSource, Warning};
use cathforce_mechanics::LumenHeader;
use serde_json::{Value, json};

use crate::args::LumenArguments;
use crate::failure::{Code, Failure};
use crate::output::{Kind, write_again};
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &LumenArguments) -> Result<(), Failure> {
    let start = Instant::now();
    let path = &arguments.path;
    let job = LumenJob {
        cell_m: arguments.cell.map_or(CELL_M, |mm| 1e-3 * mm),
        outer_diameter_m: arguments.diameter.map(|mm| 1e-3 * mm),
        surface: arguments.surface.into(),
    };
    let mut warnings = Vec::new();
    let built = job.run(path, &mut warnings);
    for warning in &warnings {
        ui.warn(warning);
    }
    let (built, report) = built.map_err(|error| refuse(path, &error))?;
    let seconds = start.elapsed().as_secs_f64();
    // A field that the device would refuse is not written.
    if let Some(out) = arguments.out.as_ref().filter(|_| report.too_large.is_none()) {
        write_again(out, Kind::Lumen, &built.bytes)?;
        ui.say(format_args!("{} bytes: {}", built.bytes.len(), out.display()));
    }
    let warnings: Vec<String> = warnings.iter().map(Warning::to_string).collect();
    let json = to_json(&report, &built.header, &warnings, seconds);
    ui.data(&json, two_columns(&to_rows(&report, seconds)))?;
    match report.too_large {
        None => Ok(()),
        Some(error) => {
            let message = format!("{}: {error}; `--cell` sets the grid", path.display());
            Err(Failure::new(Code::Threshold, message))
        }
    }
}

fn refuse(path: &Path, error: &LumenBuildError) -> Failure {
    match error {
        // This error names its file itself.
        LumenBuildError::Bundle(error) => Failure::input(error),
        error if error.is_about_room() => {
            let message = format!("{}: {error}; `--cell` sets the grid", path.display());
            Failure::new(Code::Threshold, message)
        }
        error => Failure::input(format!("{}: {error}", path.display())),
    }
}

fn source(report: &LumenReport) -> String {
    match report.source {
        WallSource::Mesh { read, triangles, rounds: 0 } => {
            format!("mesh of {read} triangles, {triangles} with the sleeves")
        }
        WallSource::Mesh { read, triangles, rounds } => {
            format!("mesh of {read} triangles, {triangles} after {rounds} rounds of smoothing")
        }
        WallSource::Centreline { branches } => format!("centreline of {branches} branches"),
    }
}

/// The spread of a quantity, unless it was measured at no point.
fn measured(spread: &Spread, points: usize) -> Option<&Spread> {
    (points > 0).then_some(spread)
}

fn micrometres(spread: Option<&Spread>) -> String {
    let Some(spread) = spread else { return "not measured".into() };
    let [p50, p99, max] = [spread.p50, spread.p99, spread.max].map(|x| 1e6 * x);
    format!("median {p50:.1}, 99 % {p99:.1}, largest {max:.1} µm")
}

fn to_rows(report: &LumenReport, seconds: f64) -> Vec<(String, String)> {
    let percent = 100.0 * report.bytes as f64 / DEVICE_LUMEN_BYTES as f64;
    let fits = if report.too_large.is_none() { "fits" } else { "does not fit" };
    let openings: Vec<_> = report
        .openings
        .iter()
        .map(|o| {
            let [x, y, z]: [f64; 3] = (1e3 * o.centre_m).into();
            format!("({x:.1}, {y:.1}, {z:.1}) mm, radius {:.2} mm", 1e3 * o.radius_m)
        })
        .collect();
    let quality = &report.quality;
    let touching = measured(&quality.distance_m, quality.points);
    let deeper = measured(&quality.deeper_m, quality.deeper_points);
    let [low, high] = quality.touching_m.map(|x| 1e3 * x);
    let mut rows = vec![
        ("wall", source(report)),
        ("openings", if openings.is_empty() { "none".into() } else { openings.join("\n") }),
        ("cell", format!("{:.2} mm", 1e3 * report.cell_m)),
        ("bricks", bricks(report)),
        ("bytes", format!("{}, {percent:.0} % of the device's room: {fits}", report.bytes)),
        ("error", format!("{} to the surface", micrometres(touching))),
    ];
    if let Some(facets) = &report.facets_m {
        rows.push(("", format!("{} to the flat facets", micrometres(Some(facets)))));
    }
    if let Some(facets) = &report.surface_to_facets_m {
        rows.push((
            "",
            format!("{} from the surface to the flat facets", micrometres(Some(facets))),
        ));
    }
    rows.push((
        "",
        format!(
            "at {} points where the instrument touches, {low:.1} to {high:.1} mm from the wall",
            quality.points
        ),
    ));
    if quality.not_stored > 0 {
        rows.push(("", format!("at {} more nothing is stored", quality.not_stored)));
    }
    rows.push(("deeper", format!("{} to the surface", micrometres(deeper))));
    if report.gaps > 0 {
        rows.push(("gaps closed", report.gaps.to_string()));
    }
    rows.push(("time", format!("{seconds:.1} s")));
    rows.into_iter().map(|(label, value)| (label.to_owned(), value)).collect()
}

fn bricks(report: &LumenReport) -> String {
    let [fine, without_room] = report.fine;
    let missing = match without_room {
        0 => String::new(),
        n => format!("; no room for {n} more"),
    };
    format!("{}, in the place of {fine} eight of half the spacing{missing}", report.bricks)
}

fn to_json(report: &LumenReport, header: &LumenHeader, warnings: &[String], seconds: f64) -> Value {
    let quality = &report.quality;
    let spread = |s: &Spread| json!({ "median_m": s.p50, "p99_m": s.p99, "max_m": s.max });
    let touching = |s: &Spread| measured(s, quality.points).map(spread);
    let deeper = measured(&quality.deeper_m, quality.deeper_points).map(spread);
    let normal_max_rad = measured(&quality.normal_rad, quality.points).map(|s| s.max);
    let (read, used) = match report.source {
        WallSource::Mesh { read, triangles, .. } => (Some(read), Some(triangles)),
        WallSource::Centreline { .. } => (None, None),
    };
    let openings: Vec<_> = report
        .openings
        .iter()
        .map(|o| {
            json!({
                "position_m": o.centre_m.as_slice(),
                "radius_m": o.radius_m,
                "axis": o.axis.as_slice(),
                "in_the_wall": o.is_flush,
                "sleeve_m": o.sleeve_m,
            })
        })
        .collect();
    json!({
        "triangles": read,
        "triangles_after_smoothing": used,
        "openings": openings,
        "gaps_closed": report.gaps,
        "origin_m": header.origin_m,
        "grid_bricks": header.bricks,
        "cell_m": header.cell_m,
        "distance_unit_m": header.distance_unit_m,
        "bricks": report.bricks,
        "bricks_of_half_the_spacing_for": report.fine[0],
        "bricks_without_room_for_it": report.fine[1],
        "bytes": report.bytes,
        "device_bytes": DEVICE_LUMEN_BYTES,
        "fits": report.too_large.is_none(),
        "error_to_surface": touching(&quality.distance_m),
        "error_deeper": deeper,
        "error_of_trilinear": touching(&quality.trilinear_m),
        "error_to_facets": report.facets_m.as_ref().map(spread),
        "surface_to_facets": report.surface_to_facets_m.as_ref().map(spread),
        "normal_max_rad": normal_max_rad,
        "points": quality.points,
        "points_not_stored": quality.not_stored,
        "touching_m": quality.touching_m,
        "warnings": warnings,
        "seconds": seconds,
    })
}
