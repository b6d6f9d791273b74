//! From files to a lumen: both forms of STL, and what is said of meshes that look wrong.

mod support;

use std::fs;

use cathforce_rig::geometry::{SurfaceModel, Triangle};
use cathforce_rig::lumen::BuiltLumen;
use cathforce_rig::{LumenJob, LumenReport};
use support::{Point, ascii_stl, binary_stl, triangulate, tube};

/// Lumen and report of a file's bytes, or the error, and the warnings.
fn run(bytes: &[u8], diameter_m: f64) -> (Result<(BuiltLumen, LumenReport), String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("vessel.stl");
    fs::write(&file, bytes).unwrap();
    let surface = SurfaceModel::Faceted;
    let job = LumenJob { cell_m: 1e-3, outer_diameter_m: Some(diameter_m), surface };
    let mut warnings = Vec::new();
    let result = job.run(&file, &mut warnings).map_err(|error| error.to_string());
    (result, warnings.into_iter().map(|warning| warning.message).collect())
}

/// The warnings, one of which must say all of `says`.
fn doubted(triangles: &[Triangle], diameter_m: f64, says: &[&str]) {
    let (_, warnings) = run(&binary_stl(triangles), diameter_m);
    let one_says = warnings.iter().any(|message| says.iter().all(|said| message.contains(said)));
    assert!(one_says, "{says:?}: {warnings:?}");
}

fn scaled(triangles: &[Triangle], by: f64) -> Vec<Triangle> {
    triangles.iter().map(|corners| corners.map(|p| p * by)).collect()
}

#[test]
fn ascii_and_binary_give_the_same_lumen() {
    let surface = tube();
    let built = |bytes: &[u8]| {
        let (built, warnings) = run(bytes, 1.6e-3);
        (built.unwrap(), warnings)
    };
    let binary = built(&binary_stl(&surface));
    let ascii = ascii_stl(&surface);
    assert!(built(ascii.as_bytes()) == binary);
    assert!(built(ascii.replace('\n', "\r\n").as_bytes()) == binary);
}

#[test]
fn a_unit_a_thousand_times_off_is_said() {
    let surface = tube();
    doubted(&scaled(&surface, 1e-3), 1.6e-3, &["metres", "scale it by 1000"]);
    let large = binary_stl(&scaled(&surface, 1e3));
    let (refused, warnings) = run(&large, 1.6e-3);
    assert!(refused.unwrap_err().contains("too many bricks"));
    assert!(warnings.iter().any(|said| said.contains("scale it by 0.001")), "{warnings:?}");
}

#[test]
fn a_vessel_that_no_instrument_can_enter_is_said() {
    let surface = tube();
    doubted(&surface, 6.5e-3, &["no opening is as wide", "6.50 mm"]);
    let low = Point::new(-4.11e-3, -4.13e-3, -4.29e-3);
    let closed = triangulate(low, 1e-3, [9, 9, 9], |p| 3e-3 - p.norm());
    doubted(&closed, 1.6e-3, &["no opening", "cannot enter"]);
}

#[test]
fn a_hole_in_the_wall_is_said() {
    let near = |t: &&Triangle| {
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        (middle - Point::new(10e-3, 0.0, 3e-3)).norm() > 0.8e-3
    };
    let pierced: Vec<_> = tube().iter().filter(near).copied().collect();
    doubted(&pierced, 3e-3, &["1 of 3 openings", "holes in the surface?"]);
}

#[test]
fn what_is_no_stl_is_called_so() {
    let (refused, _) = run("ply\nformat ascii 1.0\n".repeat(9).as_bytes(), 1.6e-3);
    let message = refused.unwrap_err();
    assert!(message.contains("no STL file; it begins with `ply`"), "{message}");
}
