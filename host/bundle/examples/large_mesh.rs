//! How long the lumen of a raw surface of 450 000 triangles takes:
//! `cargo run --release -p cathforce-bundle --example large_mesh`.

use std::error::Error;
use std::fs;
use std::time::Instant;

use cathforce_bundle::geometry::SurfaceModel;
use cathforce_bundle::{CELL_M, LumenJob};

#[path = "../tests/support/mod.rs"]
mod support;

use support::{Point, ascii_stl, binary_stl, triangulate};

/// Edge of the cubes that the vessel is cut into triangles by \[m\].
const CUBE_M: f64 = 0.39e-3;

/// An artery of 16 mm that parts into two of 10 mm, run into each other over 2 mm.
fn vessel(p: &Point) -> f64 {
    let fork = Point::new(70e-3, 0.0, 0.0);
    let tube = |along: Point, radius_m: f64| {
        let from = p - fork;
        radius_m - (from - along * from.dot(&along).max(0.0)).norm()
    };
    let union = |a: f64, b: f64| {
        let h = (2e-3 - (a - b).abs()).max(0.0) / 2e-3;
        a.max(b) + 0.5e-3 * h * h
    };
    let branch = |slope: f64| tube(Point::new(1.0, slope, 0.0).normalize(), 5e-3);
    union(tube(-Point::x(), 8e-3), union(branch(0.4), branch(-0.4)))
}

fn main() -> Result<(), Box<dyn Error>> {
    let low = Point::new(0.0, -38e-3, -9.1e-3);
    let cells = [140e-3, 76e-3, 18.2e-3].map(|size_m| (size_m / CUBE_M) as usize);
    let triangles = triangulate(low, CUBE_M, cells, vessel);
    let folder = tempfile::tempdir()?;
    let (binary, ascii) = (folder.path().join("binary.stl"), folder.path().join("ascii.stl"));
    fs::write(&binary, binary_stl(&triangles))?;
    fs::write(&ascii, ascii_stl(&triangles))?;
    println!("{} triangles, {} threads", triangles.len(), rayon::current_num_threads());

    let job = LumenJob { cell_m: CELL_M, outer_diameter_m: None, surface: SurfaceModel::default() };
    for file in [binary, ascii] {
        let start = Instant::now();
        let mut warnings = Vec::new();
        let (_, report) = job.run(&file, &mut warnings)?;
        println!(
            "{}: {:.1} s, {} bytes, largest error {:.0} µm",
            file.file_name().unwrap_or_default().display(),
            start.elapsed().as_secs_f64(),
            report.bytes,
            1e6 * report.quality.distance_m.max
        );
        for warning in warnings {
            println!("warning: {warning}");
        }
    }
    Ok(())
}
