//! `cathforce wall reduce`: the wall that the device runs, from finite elements.

use std::collections::BTreeMap;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_bundle::Vessel;
use cathforce_bundle::bundle::{CatheterRig, WallRegion};
use cathforce_bundle::geometry::SurfaceModel;
use cathforce_wall::reduce::{
    Curve, Errors, Field, Probe, Station, Stiffening, probes, stations, stiffness_field,
};
use cathforce_wall::{Extruded, Solver, press};
use serde_json::{Value, json};
use toml_edit::{Array, DocumentMut, InlineTable, value};

use super::law::{Named, of_argument};
use super::load::{mesh_json, meshed, thickness};
use crate::args::WallReduceArguments;
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, check_apart, check_new, shown, write_again};
use crate::settings::{Setting, SettingsFile};
use crate::ui::{Ui, two_columns};

/// Loads that the stiffening curve is fitted to unless others are asked for \[N\]: the range that
/// catheters exert, 0.1 to 1.5 N by Pescio et al. 2025, without its ends.
const FORCES_N: [f64; 3] = [0.25, 0.5, 1.0];
/// Load beyond the largest that is fitted, over it.
const BEYOND: f64 = 1.5;
/// A station whose stiffness differs less from the nominal one has no region of its own: half a step
/// of the stored stiffness.
const ALIKE: f64 = 0.022;
/// Elements of a bundle's vessel unless others are asked for, over its narrowest radius.
const ELEMENT_OF_RADIUS: f64 = 0.5;

/// The result of a reduction.
struct Reduction {
    field: Field,
    stiffening: Stiffening,
    curves: Vec<Curve>,
    regions: Vec<WallRegion>,
    fitted_n: Vec<f64>,
}

pub fn run(ui: &Ui, arguments: &WallReduceArguments) -> Result<(), Failure> {
    check_outputs(arguments)?;
    let thickness_mm = thickness(&arguments.bundle, arguments.thickness_mm)?;
    let law = of_argument(&arguments.law, arguments.elements.poisson)?;
    let bundle = Bundle::open(&arguments.bundle)?;
    let rig = rig(&bundle)?;
    if bundle.centreline.is_empty() {
        return Err(Failure::input(format!(
            "{}: has no centreline.csv, along which the wall would be pressed\n  fix: add the centre lines of \
             the vessel (branch,s_m,x_m,y_m,z_m,radius_m)",
            arguments.bundle.display()
        )));
    }
    if !rig.vessel.wall_regions.is_empty() {
        ui.warn("the wall_regions of rig.toml are not part of the finite elements; the result replaces them");
    }
    let vessel = Vessel::from_bundle(&bundle, SurfaceModel::default()).map_err(Failure::input)?;
    let elements = crate::args::ElementArguments {
        element_mm: arguments.elements.element_mm.or_else(|| narrowest_mm(&bundle)),
        ..arguments.elements
    };
    let extruded = meshed(ui, vessel.wall(), thickness_mm, &elements)?;
    let reduction = reduce(ui, arguments, (&bundle, rig, &vessel), &extruded, &law)?;
    write_files(ui, arguments, &bundle, &reduction)?;
    let json = to_json(arguments, &law, &extruded, &reduction);
    arguments.json_file.write(ui, &json, text(&law, &extruded, &reduction))
}

fn check_outputs(arguments: &WallReduceArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let outputs = [&arguments.json_file.out, &arguments.rig_out, &arguments.settings_out];
    check_apart(outputs.into_iter().flatten().map(|path| path.as_path()))?;
    if let Some(path) = &arguments.rig_out {
        check_new(path)?;
    }
    match &arguments.settings_out {
        Some(path) => check_again(path, Kind::Settings),
        None => Ok(()),
    }
}

fn rig(bundle: &Bundle) -> Result<&CatheterRig, Failure> {
    bundle.catheter().ok_or_else(|| {
        Failure::input(format!(
            "`{}` is a drive without a vessel\n  fix: use a bundle of a catheter",
            bundle.rig.name
        ))
    })
}

fn narrowest_mm(bundle: &Bundle) -> Option<f64> {
    let radii = bundle.centreline.iter().flat_map(|branch| &branch.stations).map(|s| s.radius_m);
    radii.min_by(f64::total_cmp).map(|radius_m| 1e3 * ELEMENT_OF_RADIUS * radius_m)
}

fn reduce(
    ui: &Ui,
    arguments: &WallReduceArguments,
    (bundle, rig, vessel): (&Bundle, &CatheterRig, &Vessel),
    extruded: &Extruded,
    law: &Named,
) -> Result<Reduction, Failure> {
    let mesh = &extruded.mesh;
    let mut solver = Solver::new(mesh, &[]).map_err(Failure::input)?;
    let spacing_mm = 1e3 * rig.vessel.wall_contact_spacing_m;
    let half_axes_mm = [0.5 * spacing_mm, 0.5e3 * rig.instrument.outer_diameter_m];
    let every_m = 1e-3 * arguments.every_mm;
    let all = stations(&bundle.centreline, every_m);
    let own = probes(vessel.wall(), &all, half_axes_mm);
    let between = between(vessel, bundle, &all, half_axes_mm, every_m);
    let field =
        stiffness_field(mesh, &mut solver, &law.material, &all, [&own, &between], spacing_mm)
            .map_err(Failure::input)?;
    if field.stations.is_empty() {
        return Err(Failure::input(format!(
            "{}: none of the {} stations has a wall beside it\n  fix: check that centreline.csv runs inside \
             the vessel",
            arguments.bundle.display(),
            all.len()
        )));
    }
    let (mut fitted_n, curves) = (fitted(arguments), usize::from(arguments.curves));
    let forces_n = with_checks(&mut fitted_n);
    let chosen = chosen(&field, &all, &own, curves);
    let mut bar = ui.progress("pressing", (chosen.len() * forces_n.len()) as u64, "loads");
    let mut done = 0;
    let mut found = Vec::new();
    for probe in chosen {
        let pressed = press(mesh, &mut solver, &law.material, &probe.patch, &forces_n, |_| {
            done += 1;
            bar.set(done);
        });
        let pressed =
            pressed.map_err(|e| Failure::new(Code::Failed, format!("{}: {e}", law.name)))?;
        let first = press(mesh, &mut solver, &law.material, &probe.patch, &[1e-3], |_| ());
        let first = first.map_err(|e| Failure::new(Code::Failed, format!("{}: {e}", law.name)))?;
        found.push(Curve { stiffness_n_per_m: 1.0 / first[0].displacement_mm, pressed });
    }
    drop(bar);
    let stiffening = Stiffening::fit(&found, &fitted_n);
    let regions = regions(&field);
    Ok(Reduction { field, stiffening, curves: found, regions, fitted_n })
}

/// Probes half-way between stations, each with the station that stands for its place.
fn between(
    vessel: &Vessel,
    bundle: &Bundle,
    all: &[Station],
    half_axes_mm: [f64; 2],
    every_m: f64,
) -> Vec<Probe> {
    // Stations at two thirds of the distance never coincide with the others' middles.
    let others = stations(&bundle.centreline, 0.66 * every_m);
    let mut found = probes(vessel.wall(), &others, half_axes_mm);
    for probe in &mut found {
        let place = others[probe.station].position_m;
        let distance = |station: &Station| (station.position_m - place).norm_squared();
        let nearest =
            (0..all.len()).min_by(|a, b| distance(&all[*a]).total_cmp(&distance(&all[*b])));
        probe.station = nearest.unwrap_or(0);
    }
    found
}

fn fitted(arguments: &WallReduceArguments) -> Vec<f64> {
    if arguments.forces_n.is_empty() { FORCES_N.to_vec() } else { arguments.forces_n.clone() }
}

/// Sorts the loads, and adds some between them and one beyond that check the fit.
fn with_checks(fitted_n: &mut Vec<f64>) -> Vec<f64> {
    fitted_n.sort_by(f64::total_cmp);
    fitted_n.dedup();
    let mut all = fitted_n.clone();
    all.extend(fitted_n.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
    all.extend(fitted_n.last().map(|last| BEYOND * last));
    all.sort_by(f64::total_cmp);
    all
}

/// Probes at stations from the softest to the stiffest.
fn chosen<'a>(field: &Field, all: &[Station], own: &'a [Probe], count: usize) -> Vec<&'a Probe> {
    let mut order: Vec<_> = field.stations.iter().collect();
    order.sort_by(|a, b| a.stiffness_n_per_m.total_cmp(&b.stiffness_n_per_m));
    let count = count.min(order.len());
    let pick = |k: usize| {
        let station = order[(2 * k + 1) * order.len() / (2 * count)].station;
        own.iter().find(|probe| all[probe.station] == station)
    };
    (0..count).filter_map(pick).collect()
}

/// Spheres around the stations that are stiffer or softer than the nominal wall; each holds the wall
/// beside its part of the branch.
fn regions(field: &Field) -> Vec<WallRegion> {
    let region = |found: &cathforce_wall::reduce::StationStiffness| {
        let ratio = found.stiffness_n_per_m / field.nominal_n_per_m;
        let station = found.station;
        ((ratio - 1.0).abs() > ALIKE).then(|| WallRegion {
            centre_m: station.position_m.into(),
            radius_m: station.radius_m.hypot(0.5 * station.length_m),
            stiffness_ratio: ratio.clamp(0.01, 100.0),
        })
    };
    field.stations.iter().filter_map(region).collect()
}

fn write_files(
    ui: &Ui,
    arguments: &WallReduceArguments,
    bundle: &Bundle,
    reduction: &Reduction,
) -> Result<(), Failure> {
    if let Some(path) = &arguments.rig_out {
        let text = rig_text(&arguments.bundle.join("rig.toml"), reduction)?;
        check_new(path)?;
        std::fs::write(path, text).map_err(|error| Failure::write(path, error))?;
        ui.say(format_args!(
            "rig with {} wall regions: {}",
            reduction.regions.len(),
            path.display()
        ));
    }
    if let Some(path) = &arguments.settings_out {
        let Stiffening { strain_per_m, mooney_share, .. } = reduction.stiffening;
        let set = [
            ("effects.wall.hyperelastic.strain_per_m", strain_per_m),
            ("effects.wall.hyperelastic.mooney_share", mooney_share),
        ];
        let set = set.map(|(name, value)| (name.to_owned(), Setting::ByHand(value as f32)));
        let file = SettingsFile {
            rig: bundle.rig.name.clone(),
            set: BTreeMap::from(set),
            ..SettingsFile::default()
        };
        write_again(path, Kind::Settings, file.text())?;
        ui.say(format_args!("settings of the stiffening curve: {}", path.display()));
    }
    Ok(())
}

/// The rig with its wall replaced; comments and all else stay.
fn rig_text(path: &Path, reduction: &Reduction) -> Result<String, Failure> {
    let refused =
        |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| refused(&error))?;
    let mut document: DocumentMut = text.parse().map_err(|error| refused(&error))?;
    let rounded = |x: f64, digits: f64| (x * digits).round() / digits;
    let mut regions = Array::new();
    for region in &reduction.regions {
        let mut table = InlineTable::new();
        let centre: Array = region.centre_m.iter().map(|x| rounded(*x, 1e6)).collect();
        table.insert("centre_m", centre.into());
        table.insert("radius_m", rounded(region.radius_m, 1e6).into());
        table.insert("stiffness_ratio", rounded(region.stiffness_ratio, 1e4).into());
        let mut entry = toml_edit::Value::from(table);
        entry.decor_mut().set_prefix("\n  ");
        regions.push_formatted(entry);
    }
    if !reduction.regions.is_empty() {
        regions.set_trailing("\n");
        regions.set_trailing_comma(true);
    }
    let vessel = &mut document["vessel"];
    vessel["wall_stiffness_N_per_m"] = value(rounded(reduction.field.nominal_n_per_m, 1e3));
    vessel["wall_regions"] = value(regions);
    Ok(document.to_string())
}

fn percent(errors: &Errors) -> String {
    match errors.count {
        0 => "not measured".into(),
        n => format!(
            "{:.1} % rms, {:.1} % at most, of {n}",
            100.0 * errors.rms,
            100.0 * errors.largest
        ),
    }
}

fn text(law: &Named, extruded: &Extruded, reduction: &Reduction) -> String {
    let Reduction { field, stiffening, regions, curves, fitted_n, .. } = reduction;
    let stiffness = field.stations.iter().map(|s| s.stiffness_n_per_m);
    let (low, high) = (stiffness.clone().fold(f64::MAX, f64::min), stiffness.fold(0.0, f64::max));
    let loads = fitted_n.iter().map(|force| format!("{force}")).collect::<Vec<_>>().join(", ");
    let rows = [
        ("law", law.name.clone()),
        ("elements", format!("{} tetrahedra", extruded.mesh.tetrahedra.len())),
        (
            "stiffness",
            format!(
                "{:.1} N/m a contact point, {low:.1} to {high:.1} at {} stations, {} regions",
                field.nominal_n_per_m,
                field.stations.len(),
                regions.len()
            ),
        ),
        ("error of it", format!("{} directions around the stations", percent(&field.around))),
        ("", format!("{} places between the stations", percent(&field.between))),
        (
            "stiffening",
            format!(
                "strain_per_m {:.2}, mooney_share {:.2}, from {loads} N at {} stations",
                stiffening.strain_per_m,
                stiffening.mooney_share,
                curves.len()
            ),
        ),
        ("error of it", format!("{} loads that were fitted", percent(&stiffening.fitted))),
        ("", format!("{} loads between them", percent(&stiffening.between))),
        ("", format!("{} loads beyond them", percent(&stiffening.beyond))),
        (
            "neighbours",
            format!(
                "one contact spacing beside a load the wall moves {:.0} % as far; the device's wall stays",
                100.0 * field.spread
            ),
        ),
    ];
    two_columns(&rows.map(|(label, value)| (label.to_owned(), value)))
}

fn to_json(
    arguments: &WallReduceArguments,
    law: &Named,
    extruded: &Extruded,
    reduction: &Reduction,
) -> Value {
    let Reduction { field, stiffening, regions, curves, fitted_n } = reduction;
    let errors = |e: &Errors| json!({ "rms": e.rms, "largest": e.largest, "count": e.count });
    json!({
        "bundle": shown(&arguments.bundle),
        "law": law.name,
        "parameters_si": law.material.law.parameters(),
        "poissons_ratio": law.material.poissons_ratio,
        "mesh": mesh_json(&extruded.mesh),
        "wall_stiffness_n_per_m": field.nominal_n_per_m,
        "stations": field.stations.iter().map(|s| json!({
            "position_m": s.station.position_m.as_slice(),
            "stiffness_n_per_m": s.stiffness_n_per_m,
            "directions": s.directions,
        })).collect::<Vec<_>>(),
        "wall_regions": regions.iter().map(|r| json!({
            "centre_m": r.centre_m, "radius_m": r.radius_m, "stiffness_ratio": r.stiffness_ratio,
        })).collect::<Vec<_>>(),
        "error_around_stations": errors(&field.around),
        "error_between_stations": errors(&field.between),
        "spread_at_contact_spacing": field.spread,
        "strain_per_m": stiffening.strain_per_m,
        "mooney_share": stiffening.mooney_share,
        "fitted_n": fitted_n,
        "error_at_fitted_loads": errors(&stiffening.fitted),
        "error_between_loads": errors(&stiffening.between),
        "error_beyond_loads": errors(&stiffening.beyond),
        "curves": curves.iter().map(|c| json!({
            "stiffness_n_per_m": c.stiffness_n_per_m,
            "loads": c.pressed.iter().map(|p| json!({
                "force_n": p.force_n, "displacement_mm": p.displacement_mm,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}
