//! Single terms of the model against closed forms. Each test fails if its term is missing or has the wrong
//! sign.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod drives;
mod friction;
mod opening;
mod shape;
mod snap;
mod stream;
mod walls;

use cathforce_mechanics::*;

use rod::rod;
use wall::{StoredWall, plane};

/// The model in double precision, with as many links as on the device.
type Chain = Model<f64>;

/// A description with parameters set by their keys.
fn with(mut description: Description<f64>, values: &[(&str, f64)]) -> Description<f64> {
    for (key, value) in values {
        description.set_parameter(key, *value).unwrap();
    }
    description
}

/// A floor at this height below the lumen, under the whole of a rod of 0.1 m along x.
fn floor(height_m: f64) -> StoredWall {
    let bounds = [[-0.01, -0.012, -20e-3], [0.126, 0.012, 0.014]];
    StoredWall::sampled(bounds, 1e-3, 6e-3, |p| plane(p, [0.0, 0.0, height_m], [0.0, 0.0, 1.0]))
}

/// A piece of pre-curvature of this length, with curvatures towards `up` and `direction × up`.
fn curved(length_m: f64, up_per_m: f64, side_per_m: f64) -> PrecurvePiece<f64> {
    PrecurvePiece {
        length_m,
        curvature_per_m: up_per_m,
        lateral_curvature_per_m: side_per_m,
        torsion_per_m: 0.0,
    }
}

/// A rod as a guidewire in a catheter, both as [`rod()`] makes them.
fn pair(length_m: f64, links: usize, [catheter_ei, wire_ei]: [f64; 2]) -> Description<f64> {
    let wire = rod(length_m, links, wire_ei).instrument;
    Description { guidewire: Some(wire), ..rod(length_m, links, catheter_ei) }
}

/// Positions of both drives, without rotation.
fn both(catheter_m: f64, guidewire_m: f64) -> Drives<f64> {
    Drives {
        catheter: rod::inserted(catheter_m),
        guidewire: rod::inserted(guidewire_m),
        ..Drives::default()
    }
}

/// Asserts that a number is within a share of another one.
fn assert_near(what: &str, found: f64, exact: f64, tolerance: f64) {
    println!("{what}: {found:.6e} ({exact:.6e}), off by {:.1e}", found / exact - 1.0);
    assert!((found / exact - 1.0).abs() < tolerance, "{what}: {found}, not {exact}");
}
