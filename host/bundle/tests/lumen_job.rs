//! Lumens from files: both forms of STL, and warnings about meshes that look wrong.

mod support;

use std::fs;

use cathforce_bundle::geometry::{Mesh, MeshWall, SurfaceModel, Triangle};
use cathforce_bundle::lumen::BuiltLumen;
use cathforce_bundle::{LumenJob, LumenReport};
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

/// Fails unless one warning contains all of `says`.
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

/// A hole as wide as the instrument is told from an opening by the wall around it.
#[test]
fn a_hole_that_lets_the_instrument_through_is_said_with_its_place() {
    let middle = Point::new(10e-3, 0.0, 3e-3);
    let is_far = |t: &&Triangle| ((t[0] + t[1] + t[2]) / 3.0 - middle).norm() > 2.0e-3;
    let pierced: Vec<_> = tube().iter().filter(is_far).copied().collect();
    doubted(
        &pierced,
        1.6e-3,
        &["(9.9, -0.4, 2.6) mm", "lies in the wall", "a hole in the surface?"],
    );
    let (_, warnings) = run(&binary_stl(&tube()), 1.6e-3);
    assert_eq!(warnings, Vec::<String>::new());
}

#[test]
fn the_unit_that_would_make_room_is_proposed() {
    let small = scaled(&tube(), 0.1);
    doubted(&small, 3e-3, &["nowhere is room", "0.559 mm wide"]);
    doubted(&small, 3e-3, &["no vessel is", "in centimetres? Then scale it by 10"]);
    // One unit alone is proposed, before what follows from it.
    let (_, warnings) = run(&binary_stl(&scaled(&tube(), 0.1)), 3e-3);
    let hints = warnings.iter().filter(|said| said.contains("scale it by")).count();
    assert!(hints == 1 && warnings[0].contains("scale it by 10"), "{warnings:?}");
    // No unit is suggested here, because ten times as long the vessel would be longer than a body.
    let (_, mut report) = run(&binary_stl(&tube()), 1.6e-3).0.unwrap();
    (report.widest_m, report.span_m) = (0.1e-3, 0.3);
    let nowhere = report.doubts().join("; ");
    assert!(nowhere.contains("nowhere is room") && !nowhere.contains("scale it"), "{nowhere}");
}

#[test]
fn a_vessel_farther_off_than_a_device_takes_is_refused() {
    let moved = |x: f64| {
        let by = Point::new(x, 0.0, 0.0);
        let moved: Vec<_> = tube().iter().map(|corners| corners.map(|p| p + by)).collect();
        run(&binary_stl(&moved), 1.6e-3).0
    };
    for x in [15.0, -15.0] {
        let message = moved(x).unwrap_err();
        for says in [&format!("({:.1}", 1e3 * x), "10000 mm of the origin", "fix: move"] {
            assert!(message.contains(says), "{message}");
        }
    }
    let (built, _) = moved(9.9).unwrap();
    assert!(cathforce_mechanics::Lumen::new(built.header, &built.bytes).is_ok());
}

#[test]
fn a_grid_that_nobody_can_ask_for_is_not_advised() {
    let (_, mut report) = run(&binary_stl(&tube()), 1.6e-3).0.unwrap();
    let mut advice = |error_m: f64| {
        report.quality.distance_m.max = error_m;
        report.doubts().join("; ")
    };
    assert!(advice(100e-6).contains("take a grid of about 0.50 mm (--cell)"));
    let hopeless = advice(0.9e-3);
    assert!(hopeless.contains("no grid helps") && !hopeless.contains("--cell"), "{hopeless}");
}

#[test]
fn a_smooth_surface_that_leaves_flat_walls_is_said() {
    // A wide tube from CAD that narrows within 3 mm.
    const SIDES: usize = 12;
    let profile = [(0.0, 5.0), (20.0, 5.0), (23.0, 3.5)];
    let corner = |(x, r): (f64, f64), side: usize| {
        let angle = std::f64::consts::TAU * (side % SIDES) as f64 / SIDES as f64;
        Point::new(x, r * angle.cos(), r * angle.sin()) * 1e-3
    };
    let mut cone = Vec::new();
    for ends in profile.windows(2) {
        for side in 0..SIDES {
            let [a, b] = [corner(ends[0], side), corner(ends[1], side)];
            let [c, d] = [corner(ends[1], side + 1), corner(ends[0], side + 1)];
            cone.extend([[a, b, c], [a, c, d]]);
        }
    }
    let off_m = |triangles: &[Triangle]| {
        let mesh = Mesh::from_triangles(triangles).unwrap().0;
        MeshWall::new(mesh, SurfaceModel::Smooth).off_facets.unwrap()
    };
    let (_, mut report) = run(&binary_stl(&tube()), 1.6e-3).0.unwrap();
    let mut says = |off| {
        report.off_facets = Some(off);
        report.doubts().join("; ")
    };
    let doubt = says(off_m(&cone));
    assert!(doubt.contains("leaves the facets") && doubt.contains("--surface flat"), "{doubt}");
    assert_eq!(says(off_m(&tube())), "");
}

#[test]
fn what_is_no_stl_is_called_so() {
    let (refused, _) = run("ply\nformat ascii 1.0\n".repeat(9).as_bytes(), 1.6e-3);
    let message = refused.unwrap_err();
    assert!(message.contains("no STL file; it begins with `ply`"), "{message}");
}
