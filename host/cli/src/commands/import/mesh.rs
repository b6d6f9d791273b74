//! `cathforce import mesh` and `cathforce import centreline`.

use std::path::Path;

use cathforce_bundle::bundle::mesh_doubts;
use cathforce_bundle::geometry::{Branch, Mesh, MeshRepairs, Triangle, read_centreline};
use cathforce_mesh_files::{
    Contents, LineOptions, branches, centreline_csv, ends, opened, stl, triangles,
};
use cathforce_recording::write_whole;
use serde_json::json;

use super::trial::{at, say_all, warn_all};
use crate::args::{ImportCentrelineArguments, ImportMeshArguments, MeshUnit};
use crate::failure::Failure;
use crate::open::{read_bytes, read_text};
use crate::output::{check_new, shown};
use crate::ui::Ui;

pub fn surface(ui: &Ui, arguments: &ImportMeshArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.file, &arguments.out);
    check_new(out)?;
    let contents = read(ui, path)?;
    if contents.facets.is_empty() {
        let message = format!(
            "{}: the file has no surface, but {} lines\n  fix: a centre line is read by `cathforce import \
             centreline`",
            path.display(),
            contents.lines.len()
        );
        return Err(Failure::input(message));
    }
    let unit_m = unit_m(path, &contents, arguments.unit)?;
    let mut surface = triangles(&contents, unit_m);
    let mut done = Vec::new();
    if let Some(line) = &arguments.open_at {
        let branches = branches_of(line)?;
        for end in ends(&branches) {
            let (kept, changed) = opened(&surface, &end);
            surface = kept;
            let [x, y, z]: [f64; 3] = (end.position_m * 1e3).into();
            done.push(format!(
                "opened at ({x:.1}, {y:.1}, {z:.1}) mm: {changed} triangles cut or taken off"
            ));
        }
    }
    let (mesh, repairs) = Mesh::from_triangles(&surface).map_err(|cause| {
        Failure::input(format!("{}: {cause}\n  fix: {}", path.display(), cause.fix()))
    })?;
    let doubts = mesh_doubts(&repairs);
    if arguments.repair {
        surface = mesh.facing_outwards();
        done.extend(doubts.iter().map(|doubt| format!("repaired as far as it can be: {doubt}")));
    } else {
        warn_all(ui, path, &doubts);
    }
    say_all(ui, path, &[size(&surface, &repairs)]);
    say_all(ui, path, &done);
    if !arguments.dry_run {
        write(out, &stl(&surface))?;
    }
    let json = json!({
        "path": shown(out), "format": contents.format.name(), "triangles": surface.len(),
        "doubts": doubts, "done": done,
    });
    ui.data(&json, text(out, arguments.dry_run, &format!("{} triangles", surface.len())))
}

pub fn centreline(ui: &Ui, arguments: &ImportCentrelineArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.file, &arguments.out);
    check_new(out)?;
    let contents = read(ui, path)?;
    let unit_m = unit_m(path, &contents, arguments.unit)?;
    let options = LineOptions {
        unit_m,
        array: arguments.radius_array.clone(),
        radius_m: arguments.radius.map(|mm| 1e-3 * mm),
    };
    let (branches, remarks) = branches(&contents, &options).map_err(|e| at(path, &e))?;
    warn_all(ui, path, &remarks);
    let csv = centreline_csv(&branches);
    // What a bundle would refuse is not written.
    let checked = read_centreline(&csv);
    checked.map_err(|(_, cause)| {
        Failure::input(format!("{}: {cause}\n  fix: check --unit and the radii", path.display()))
    })?;
    let stations = branches.iter().map(|branch| branch.stations.len()).sum::<usize>();
    if !arguments.dry_run {
        write(out, csv.as_bytes())?;
    }
    let json = json!({
        "path": shown(out), "format": contents.format.name(), "branches": branches.len(),
        "stations": stations, "remarks": remarks,
    });
    let what = format!("{} branches of {stations} stations", branches.len());
    ui.data(&json, text(out, arguments.dry_run, &what))
}

/// Reads a file and says what it holds.
fn read(ui: &Ui, path: &Path) -> Result<Contents, Failure> {
    let contents = Contents::read(&read_bytes(path)?).map_err(|e| at(path, &e))?;
    let arrays = contents.scalars.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>();
    let arrays = if arrays.is_empty() { "none".to_owned() } else { arrays.join(", ") };
    let understood = format!(
        "{}: {} points, {} triangles, {} lines; arrays: {arrays}",
        contents.format.name(),
        contents.points.len(),
        contents.facets.len(),
        contents.lines.len()
    );
    say_all(ui, path, &[understood]);
    warn_all(ui, path, &contents.remarks);
    Ok(contents)
}

/// The unit of the command line, which must not contradict the file's; else that, else millimetres.
fn unit_m(path: &Path, contents: &Contents, given: Option<MeshUnit>) -> Result<f64, Failure> {
    match (&contents.unit, given.map(MeshUnit::metres)) {
        (Some((name, own)), Some(given)) if *own != given => Err(Failure::input(format!(
            "{}: by its own words it is in {name}, which --unit contradicts\n  fix: leave --unit out",
            path.display()
        ))),
        (Some((_, own)), _) => Ok(*own),
        (None, given) => Ok(given.unwrap_or(MeshUnit::Mm.metres())),
    }
}

fn branches_of(path: &Path) -> Result<Vec<Branch>, Failure> {
    let read = read_centreline(&read_text(path)?);
    let (branches, _) = read.map_err(|(place, cause)| {
        Failure::input(format!("{}{place}: {cause}\n  fix: {}", path.display(), cause.fix()))
    })?;
    Ok(branches)
}

fn size(surface: &[Triangle], repairs: &MeshRepairs) -> String {
    format!(
        "{} triangles in {} pieces, {:.1} mm from corner to corner, about {:.2} mm wide",
        surface.len(),
        repairs.pieces,
        1e3 * repairs.figure.span_m,
        2e3 * repairs.figure.radius_m
    )
}

fn write(out: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let write =
        |file: &mut std::io::BufWriter<std::fs::File>| std::io::Write::write_all(file, bytes);
    write_whole(out, write).map_err(|e: std::io::Error| Failure::write(out, e))
}

fn text(out: &Path, is_dry: bool, what: &str) -> String {
    match is_dry {
        true => format!("{what}: nothing is written\n"),
        false => format!("{what}: {}\n", out.display()),
    }
}
