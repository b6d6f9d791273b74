//! Lumens of meshes against the exact distance to the shapes that the meshes stand for:
//! a branch, an aneurysm, and the openings of both.

mod support;

use std::f64::consts::{PI, TAU};

use cathforce_bundle::Vessel;
use cathforce_bundle::geometry::{Mesh, MeshWall, SurfaceModel, Triangle, Wall};
use cathforce_bundle::lumen::{BuiltLumen, LumenOptions, Spread, build_lumen, interpolate};
use cathforce_mechanics::{BRICK_NODES, Lumen, NODE_BYTES, WallSample};
use nalgebra::Vector3;
use support::{Point, Random, triangulate};

/// Edge of the cubes that the shapes are cut into triangles by \[m\].
const CUBE_M: f64 = 0.4e-3;
/// Distance from a crease within which facets cut it off, and a cell of the grid \[m\].
const CUT_OFF_M: f64 = 2.0 * CUBE_M + 1e-3;
/// Outer radius of the instrument \[m\].
const RADIUS_M: f64 = 0.8e-3;

enum Shape {
    /// A round tube from a point in one direction, with a round end.
    Tube {
        from: Point,
        along: Point,
        radius_m: f64,
    },
    Ball {
        middle: Point,
        radius_m: f64,
    },
}

impl Shape {
    /// The nearest point of the axis, and the radius.
    fn core(&self, p: &Point) -> (Point, f64) {
        match self {
            Self::Tube { from, along, radius_m } => {
                (from + along * (p - from).dot(along).max(0.0), *radius_m)
            }
            Self::Ball { middle, radius_m } => (*middle, *radius_m),
        }
    }

    fn depth_m(&self, p: &Point) -> f64 {
        let (core, radius_m) = self.core(p);
        radius_m - (p - core).norm()
    }

    fn on_wall(&self, p: &Point) -> Point {
        let (core, radius_m) = self.core(p);
        core + (p - core).normalize() * radius_m
    }
}

/// A trunk and a second shape that leaves it.
struct Vascular {
    shapes: [Shape; 2],
    /// Points of the line where both meet.
    crease: Vec<Point>,
    triangles: Vec<Triangle>,
}

impl Vascular {
    /// `way`: points of the second shape's wall by the angle around it and a share from 0, in
    /// the trunk, to 1, outside.
    fn new(shapes: [Shape; 2], way: impl Fn(f64, f64) -> Point, low: Point, high: Point) -> Self {
        let crease = (0..4000).map(|k| {
            let around = TAU * f64::from(k) / 4000.0;
            let (mut inner, mut outer) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (inner + outer);
                let inside = shapes[0].depth_m(&way(around, middle)) > 0.0;
                if inside { inner = middle } else { outer = middle }
            }
            way(around, inner)
        });
        let crease = crease.collect();
        let cells = ((high - low) / CUBE_M).map(f64::floor);
        let cells = [cells.x as usize, cells.y as usize, cells.z as usize];
        let [a, b] = &shapes;
        let triangles = triangulate(low, CUBE_M, cells, |p| a.depth_m(p).max(b.depth_m(p)));
        Self { shapes, crease, triangles }
    }

    /// Signed distance, and how far the nearest point of the wall is from the crease \[m\].
    fn exact(&self, p: &Point) -> (f64, f64) {
        let to_crease = |p: &Point| {
            let squares = self.crease.iter().map(|q| (q - p).norm_squared());
            squares.fold(f64::INFINITY, f64::min).sqrt()
        };
        let [a, b] = &self.shapes;
        let mut nearest = (to_crease(p), 0.0);
        for (shape, other) in [(a, b), (b, a)] {
            let q = shape.on_wall(p);
            if other.depth_m(&q) <= 0.0 && (q - p).norm() < nearest.0 {
                nearest = ((q - p).norm(), to_crease(&q));
            }
        }
        let inside = a.depth_m(p).max(b.depth_m(p)) > 0.0;
        (if inside { nearest.0 } else { -nearest.0 }, nearest.1)
    }

    fn lumen(&self) -> BuiltLumen {
        self.lumen_by(LumenOptions::for_instrument(RADIUS_M, 1e-3))
    }

    fn lumen_by(&self, options: LumenOptions) -> BuiltLumen {
        let vessel = Vessel::from_mesh(
            &Mesh::from_triangles(&self.triangles).unwrap().0,
            SurfaceModel::Smooth,
        );
        build_lumen(vessel.wall(), options).unwrap()
    }

    /// Errors of the stored distance where an instrument touches the wall, in a box: away from
    /// the crease, and beside it.
    fn errors(&self, lumen: &BuiltLumen, low: Point, high: Point) -> [Spread; 2] {
        let mut random = Random(7);
        let (mut away, mut near) = (Vec::new(), Vec::new());
        while away.len() < 3000 {
            let p = Point::from_fn(|axis, _| random.within(low[axis], high[axis]));
            let depth_m = self.shapes.iter().map(|shape| shape.depth_m(&p)).fold(-1.0, f64::max);
            if !(-0.2e-3..1.1e-3).contains(&depth_m) {
                continue;
            }
            let (exact_m, to_crease_m) = self.exact(&p);
            if exact_m > RADIUS_M + 0.25e-3 {
                continue;
            }
            let (stored, _) = interpolate(lumen, &p).expect("stored wherever it touches");
            let of = if to_crease_m > CUT_OFF_M { &mut away } else { &mut near };
            of.push(stored.distance_m - exact_m);
        }
        [Spread::of(away), Spread::of(near)]
    }
}

/// A trunk along x that a branch leaves at 60°, cut obliquely.
fn branch() -> Vascular {
    let along = Point::new(0.5, 0.75_f64.sqrt(), 0.0);
    let from = Point::new(9e-3, 0.0, 0.0);
    let across = along.cross(&Vector3::z());
    let trunk =
        Shape::Tube { from: Point::new(-1.0, 0.0, 0.0), along: Vector3::x(), radius_m: 4e-3 };
    let branch = Shape::Tube { from, along, radius_m: 2.5e-3 };
    let way = |around: f64, share: f64| {
        from + (across * around.cos() + Vector3::z() * around.sin()) * 2.5e-3
            + along * (12e-3 * share)
    };
    let (low, high) = (Point::new(0.07, -4.61, -4.73), Point::new(24.1, 11.9, 4.9));
    Vascular::new([trunk, branch], way, low * 1e-3, high * 1e-3)
}

/// A trunk along x with a ball on its side.
fn aneurysm() -> Vascular {
    let middle = Point::new(12e-3, 4.5e-3, 0.0);
    let trunk =
        Shape::Tube { from: Point::new(-1.0, 0.0, 0.0), along: Vector3::x(), radius_m: 3e-3 };
    let ball = Shape::Ball { middle, radius_m: 4e-3 };
    let way = |around: f64, share: f64| {
        let (across, up) = (PI * share).sin_cos();
        middle + (Vector3::x() * around.cos() + Vector3::z() * around.sin()) * (4e-3 * across)
            - Vector3::y() * (4e-3 * up)
    };
    let (low, high) = (Point::new(0.07, -3.61, -4.73), Point::new(24.1, 9.3, 4.9));
    Vascular::new([trunk, ball], way, low * 1e-3, high * 1e-3)
}

#[test]
fn a_branch_is_exact_to_50_micrometres() {
    let vessel = branch();
    let lumen = vessel.lumen();
    // Past the cuts of the trunk too, up to the cut of the branch.
    let (low, high) = (Point::new(-2.5, -4.5, -4.5) * 1e-3, Point::new(26.5, 11.0, 4.5) * 1e-3);
    let [away, near] = vessel.errors(&lumen, low, high);
    assert!(away.p50 < 2e-6 && away.max < 50e-6, "{away:?}");
    assert!(near.p50 < 10e-6 && near.max < 0.5 * CUBE_M, "{near:?}");
    // No wall across the branch's mouth.
    let mouth = Point::new(11e-3, 3.5e-3, 0.0);
    assert!(interpolate(&lumen, &mouth).is_none_or(|(here, _)| here.distance_m > 1.2e-3));
}

#[test]
fn the_spacing_is_halved_where_the_wall_bends() {
    let vessel = branch();
    let whole = LumenOptions::for_instrument(RADIUS_M, 1e-3);
    let even = vessel.lumen_by(LumenOptions { fine_above_m: f64::INFINITY, ..whole });
    let fine = vessel.lumen();
    assert!(even.fine == [0, 0] && fine.fine[0] > 5 && fine.fine[1] == 0, "{:?}", fine.fine);
    let more = 7 * fine.fine[0] * BRICK_NODES * NODE_BYTES;
    assert_eq!(fine.bytes.len(), even.bytes.len() + more);
    // The remaining errors lie between the cells' middles, or are those of the mesh.
    let device = Lumen::new(fine.header, &fine.bytes).unwrap();
    let (low, high) = (Point::new(5e-3, 2e-3, -4e-3), Point::new(18e-3, 6e-3, 4e-3));
    let wall = Vessel::from_mesh(
        &Mesh::from_triangles(&vessel.triangles).unwrap().0,
        SurfaceModel::Smooth,
    );
    let (mut random, mut errors) = (Random(9), [Vec::new(), Vec::new()]);
    while errors[0].len() < 2000 {
        let p = Point::from_fn(|axis, _| random.within(low[axis], high[axis]));
        let exact_m = wall.wall().sample(&p).distance_m;
        if !(RADIUS_M - 0.2e-3..RADIUS_M + 0.25e-3).contains(&exact_m) {
            continue;
        }
        for (lumen, errors) in [&even, &fine].into_iter().zip(&mut errors) {
            let (stored, _) = interpolate(lumen, &p).expect("stored wherever it touches");
            errors.push(stored.distance_m - exact_m);
        }
        let (host, _) = interpolate(&fine, &p).unwrap();
        let there: WallSample<f64> = device.sample(<[f64; 3]>::from(p));
        assert!((there.distance_m - host.distance_m).abs() < 0.1e-6, "{there:?} {host:?}");
    }
    let [even_m, fine_m] = errors.map(Spread::of);
    println!("{even_m:?} on an even grid, {fine_m:?}");
    assert!(fine_m.p99 < 0.6 * even_m.p99, "{fine_m:?} {even_m:?}");
}

#[test]
fn bricks_that_err_most_come_first_where_room_is_short() {
    let vessel = branch();
    let options = LumenOptions::for_instrument(RADIUS_M, 1e-3);
    let all = vessel.lumen_by(options);
    let worst = vessel.lumen_by(LumenOptions { fine_above_m: 12e-6, ..options });
    let (fine, left) = (worst.fine[0], all.fine[0] - worst.fine[0]);
    assert!(fine > 0 && left > 0, "{fine} of {}", all.fine[0]);
    // One byte short of one more.
    let room_bytes = worst.bytes.len() + 7 * BRICK_NODES * NODE_BYTES - 1;
    let some = vessel.lumen_by(LumenOptions { room_bytes, ..options });
    assert_eq!(some.fine, [fine, left]);
    assert!(some.bytes == worst.bytes);
}

#[test]
fn past_an_oblique_cut_the_branch_goes_on() {
    let vessel = branch();
    let lumen = vessel.lumen();
    let along = Point::new(0.5, 0.75_f64.sqrt(), 0.0);
    let (mut random, mut errors) = (Random(8), Vec::new());
    for _ in 0..1000 {
        // The cut is at y = 11.8 mm, 13.6 mm along the axis.
        let (way, around) = (random.within(15.2e-3, 17e-3), random.within(0.0, TAU));
        let depth_m = random.within(-0.2e-3, RADIUS_M + 0.25e-3);
        let across = along.cross(&Vector3::z()) * around.cos() + Vector3::z() * around.sin();
        let p = Point::new(9e-3, 0.0, 0.0) + along * way + across * (2.5e-3 - depth_m);
        let (stored, _) = interpolate(&lumen, &p).expect("stored past the cut");
        errors.push(stored.distance_m - depth_m);
    }
    let errors = Spread::of(errors);
    assert!(errors.p50 < 15e-6 && errors.max < 80e-6, "{errors:?}");
}

#[test]
fn an_aneurysm_is_exact_to_50_micrometres() {
    let vessel = aneurysm();
    let lumen = vessel.lumen();
    let (low, high) = (Point::new(-2.5, -3.5, -4.5) * 1e-3, Point::new(26.5, 9.0, 4.5) * 1e-3);
    let [away, near] = vessel.errors(&lumen, low, high);
    assert!(away.p50 < 2e-6 && away.max < 50e-6, "{away:?}");
    assert!(near.p50 < 10e-6 && near.max < 0.5 * CUBE_M, "{near:?}");
    let neck = Point::new(12e-3, 2.5e-3, 0.0);
    assert!(interpolate(&lumen, &neck).is_none_or(|(here, _)| here.distance_m > 1.2e-3));
}

/// Slivers at the neck, bent by the normals of their corners, would put a wall across the lumen.
#[test]
fn no_facet_folds_over() {
    let vessel = aneurysm();
    let mesh = Mesh::from_triangles(&vessel.triangles).unwrap().0;
    let wall = MeshWall::new(mesh, SurfaceModel::Smooth);
    let (low, high) = (Point::new(1e-3, -3.5e-3, -4.5e-3), Point::new(23e-3, 9e-3, 4.5e-3));
    let (mut random, mut compared) = (Random(70), 0);
    for _ in 0..200_000 {
        let p = Point::from_fn(|axis, _| random.within(low[axis], high[axis]));
        let depth_m = vessel.shapes.iter().map(|shape| shape.depth_m(&p)).fold(-1.0, f64::max);
        // Points inside, beyond the reach of rounded creases.
        if (0.3e-3..1.5e-3).contains(&depth_m) {
            let here = wall.sample(&p);
            assert!(here.distance_m > 0.0, "{p:?} is {depth_m} inside: {here:?}");
            compared += 1;
        }
    }
    assert!(compared > 10_000, "{compared}");
}

/// The sleeve past an opening must not stand in another branch.
#[test]
fn a_sleeve_ends_before_a_branch_that_lies_in_front_of_it() {
    // A tube of 3 mm along x, and one of 2 mm along y that is cut 3 mm above it.
    let low = Point::new(0.07e-3, -3.61e-3, -3.53e-3);
    let mut triangles = triangulate(low, CUBE_M, [60, 18, 18], |p| 3e-3 - p.y.hypot(p.z));
    let low = Point::new(9.23e-3, 6e-3, -2.83e-3);
    let across = |p: &Point| (p.x - 12e-3).hypot(p.z);
    triangles.extend(triangulate(low, CUBE_M, [14, 20, 14], |p| 2e-3 - across(p)));
    let mesh = Mesh::from_triangles(&triangles).unwrap().0;
    let wall = MeshWall::new(mesh, SurfaceModel::Smooth);
    let mut lengths: Vec<_> = wall.openings.iter().map(|opening| opening.sleeve_m).collect();
    lengths.sort_by(f64::total_cmp);
    assert_eq!(lengths.len(), 4);
    assert!((2.5e-3..=3.0e-3).contains(&lengths[0]), "{lengths:?}");
    assert!(lengths[1..].iter().all(|&length_m| length_m == 8e-3), "{lengths:?}");
    for x in [9.9e-3, 10.1e-3, 12e-3, 14.05e-3] {
        let here = wall.sample(&Point::new(x, 0.0, 0.0));
        assert!((here.distance_m - 3e-3).abs() < 20e-6, "a wall stands at x = {x}: {here:?}");
    }
}
