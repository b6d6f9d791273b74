//! Accuracy of walls from meshes and centrelines against exact shapes.

mod support;

use std::f64::consts::TAU;

use cathforce_bundle::geometry::{
    Branch, Mesh, MeshWall, Station, SurfaceModel, Triangle, TubeWall, Wall,
};
use cathforce_bundle::lumen::{LumenOptions, Spread, build_lumen, interpolate, measure};
use cathforce_bundle::{Bundle, Vessel};
use cathforce_mechanics::{FREE, Lumen, OUTSIDE};
use nalgebra::Vector3;
use support::{Point, Random, example, triangulate, tube};

/// Bend radius of the torus and radius of its tube \[m\].
const BEND_M: f64 = 25e-3;
const BORE_M: f64 = 4e-3;

fn wall(triangles: &[Triangle], model: SurfaceModel) -> MeshWall {
    MeshWall::new(Mesh::from_triangles(triangles).unwrap().0, model)
}

fn torus_distance(p: &Point) -> f64 {
    BORE_M - (p.x.hypot(p.y) - BEND_M).hypot(p.z)
}

/// A quarter of a torus, cut open at x = 1 mm and y = 1 mm.
fn torus() -> Vec<Triangle> {
    triangulate(Point::new(1e-3, 1e-3, -5.3e-3), 1e-3, [32, 32, 11], torus_distance)
}

/// Mean, and spread of the size, of an error over points of the torus away from its ends.
fn torus_errors(wall: &dyn Wall) -> (f64, Spread, Spread) {
    let mut random = Random(1);
    let (mut errors, mut angles) = (Vec::new(), Vec::new());
    for _ in 0..5000 {
        let (around, across) = (random.within(0.3, 1.27), random.within(0.0, TAU));
        let depth = random.within(-0.4e-3, 2e-3);
        let radial = Vector3::new(around.cos(), around.sin(), 0.0);
        let outwards = radial * across.cos() + Vector3::z() * across.sin();
        let here = wall.sample(&(radial * BEND_M + outwards * (BORE_M - depth)));
        errors.push(here.distance_m - depth);
        angles.push(here.normal.cross(&outwards).norm());
        assert!(here.normal.dot(&outwards) < 0.0, "the normal points into the lumen");
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    (mean, Spread::of(errors), Spread::of(angles))
}

#[test]
fn a_smooth_surface_removes_the_bias_of_inscribed_facets() {
    let (faceted_mean, ..) = torus_errors(&wall(&torus(), SurfaceModel::Faceted));
    let (mean, spread, angles) = torus_errors(&wall(&torus(), SurfaceModel::Smooth));
    assert!(faceted_mean < -10e-6, "facets are inscribed: {faceted_mean}");
    assert!(mean.abs() < 0.05 * faceted_mean.abs(), "{mean} against {faceted_mean}");
    assert!(spread.p99 < 8e-6, "{spread:?}");
    assert!(angles.p50 < 0.01 && angles.p99 < 0.06, "{angles:?}");
}

#[test]
fn smoothing_gains_most_where_facets_are_coarse() {
    let errors = |cell: f64, model| {
        let cells = [20e-3, 9e-3, 9e-3].map(|size| (size / cell) as usize);
        let low = Point::new(0.0, -4.13e-3, -4.29e-3);
        let mesh = triangulate(low, cell, cells, |p| 3e-3 - p.y.hypot(p.z));
        let wall = wall(&mesh, model);
        let mut random = Random(2);
        Spread::of((0..3000).map(|_| {
            let (x, angle) = (random.within(2e-3, 17e-3), random.within(0.0, TAU));
            let depth = random.within(-0.4e-3, 1.5e-3);
            let r = 3e-3 - depth;
            wall.sample(&Point::new(x, r * angle.cos(), r * angle.sin())).distance_m - depth
        }))
    };
    let faceted = [1.2e-3, 0.6e-3].map(|cell| errors(cell, SurfaceModel::Faceted));
    let smooth = [1.2e-3, 0.6e-3].map(|cell| errors(cell, SurfaceModel::Smooth));
    assert!(faceted[0].p50 > 3.0 * faceted[1].p50, "facets err by the square: {faceted:?}");
    assert!(faceted[0].p99 > 20.0 * smooth[0].p99, "{faceted:?} {smooth:?}");
    // Finer facets gain nothing below the sagitta at which refinement stops.
    assert!(smooth[0].p99 < 5e-6 && smooth[1].p99 < 2.5e-6, "{smooth:?}");
}

/// Two tubes that leave one, run into each other over 1 mm.
fn fork(p: &Point) -> f64 {
    let branch = |slope: f64| {
        let along = Vector3::new(1.0, slope, 0.0).normalize();
        let from = p - Vector3::new(10e-3, 0.0, 0.0);
        2.5e-3 - (from - along * from.dot(&along)).norm()
    };
    let trunk =
        if p.x < 10e-3 { 3e-3 - p.y.hypot(p.z) } else { 3e-3 - (p - Vector3::x() * 10e-3).norm() };
    let union = |a: f64, b: f64| {
        let h = (1e-3 - (a - b).abs()).max(0.0) / 1e-3;
        a.max(b) + 0.25e-3 * h * h
    };
    union(trunk, union(branch(0.5), branch(-0.5)))
}

#[test]
fn at_the_dividing_wall_a_coarse_mesh_agrees_with_a_fine_one() {
    let mesh = |cell: f64| {
        let cells = [22e-3, 22e-3, 8e-3].map(|size| (size / cell) as usize);
        triangulate(Point::new(5.1e-3, -11.03e-3, -4.07e-3), cell, cells, fork)
    };
    let coarse = wall(&mesh(0.8e-3), SurfaceModel::Smooth);
    let fine = wall(&mesh(0.3e-3), SurfaceModel::Smooth);
    let mut random = Random(3);
    let mut errors = Vec::new();
    while errors.len() < 2000 {
        let p = Point::new(
            random.within(9e-3, 20e-3),
            random.within(-6e-3, 6e-3),
            random.within(-2e-3, 2e-3),
        );
        let exact = fine.sample(&p).distance_m;
        if exact > 0.2e-3 && exact < 1.5e-3 {
            let here = coarse.sample(&p).distance_m;
            assert!(here > 0.0, "inside the lumen at {p:?}");
            errors.push(here - exact);
        }
    }
    let spread = Spread::of(errors);
    assert!(spread.p50 < 5e-6 && spread.p99 < 80e-6, "{spread:?}");
}

/// A duct with an L-shaped section of 4 mm, whose inner corner is a sharp ridge along x.
fn duct() -> Vec<Triangle> {
    let outline = [[-4.0, -4.0], [4.0, -4.0], [4.0, 0.0], [0.0, 0.0], [0.0, 4.0], [-4.0, 4.0]];
    let mut triangles = Vec::new();
    for k in 0..6 {
        let [from, to] = [outline[k], outline[(k + 1) % 6]];
        for x in 0..10 {
            let at = |x: usize, [y, z]: [f64; 2]| Point::new(x as f64 * 2.0, y, z) * 1e-3;
            let [a, b, c, d] = [at(x, from), at(x, to), at(x + 1, to), at(x + 1, from)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

#[test]
fn a_sharp_ridge_stays_sharp() {
    let wall = wall(&duct(), SurfaceModel::Smooth);
    // Diagonally off the ridge at y = z = 0, the way from the ridge is the normal.
    let off = wall.sample(&Point::new(9.3e-3, -0.3e-3, -0.4e-3));
    assert!((off.distance_m - 0.5e-3).abs() < 1e-9, "{off:?}");
    assert!((off.normal - Vector3::new(0.0, -0.6, -0.8)).norm() < 1e-6, "{off:?}");
    // Beside it, the flat walls are exact and upright.
    let beside = wall.sample(&Point::new(9.3e-3, 0.5e-3, -0.4e-3));
    assert!((beside.distance_m - 0.4e-3).abs() < 1e-9, "{beside:?}");
    assert!((beside.normal + Vector3::z()).norm() < 1e-6, "{beside:?}");
    // In the tissue behind the ridge.
    assert!(wall.sample(&Point::new(9.3e-3, 0.1e-3, 0.2e-3)).distance_m < 0.0);
}

#[test]
fn openings_are_open_and_the_wall_goes_on_past_them() {
    let wall = wall(&tube(), SurfaceModel::Smooth);
    for x in [-3e-3, -0.5e-3, 0.1e-3, 0.5e-3, 19.8e-3, 21e-3, 23e-3] {
        let axis = wall.sample(&Point::new(x, 0.0, 0.0));
        assert!((axis.distance_m - 3e-3).abs() < 0.1e-3, "no cap at x = {x}: {axis:?}");
        let side = wall.sample(&Point::new(x, 2.2e-3, 0.0));
        assert!((side.distance_m - 0.8e-3).abs() < 0.06e-3, "at x = {x}: {side:?}");
        assert!(wall.sample(&Point::new(x, 3.4e-3, 0.0)).distance_m < 0.0, "at x = {x}");
        assert_eq!(axis.beyond_m > 0.0, !(0.0..=20e-3).contains(&x), "at x = {x}: {axis:?}");
    }
}

#[test]
fn facets_that_face_the_wrong_way_change_nothing() {
    let straight = tube();
    let turned: Vec<_> = straight.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let mixed: Vec<_> = straight
        .iter()
        .enumerate()
        .map(|(k, t)| if k % 7 == 3 { [t[0], t[2], t[1]] } else { *t })
        .collect();
    let walls = [straight, turned, mixed].map(|t| wall(&t, SurfaceModel::Smooth));
    let mut random = Random(4);
    for _ in 0..300 {
        let p = Point::new(
            random.within(1e-3, 19e-3),
            random.within(-3e-3, 3e-3),
            random.within(-3e-3, 3e-3),
        );
        let [a, b, c] = walls.each_ref().map(|wall| wall.sample(&p));
        for other in [b, c] {
            assert!((a.distance_m - other.distance_m).abs() < 1e-8, "{a:?} {other:?}");
        }
    }
}

#[test]
fn a_tapering_centreline_leans_its_wall() {
    let station = |s: f64, radius_m| Station { s_m: s, position_m: Vector3::x() * s, radius_m };
    let stations = (0..=10).map(|k| station(2e-3 * f64::from(k), 5e-3 - 0.1 * 2e-3 * f64::from(k)));
    let wall = TubeWall::new(&[Branch { name: "a".into(), stations: stations.collect() }]);
    let here = wall.sample(&Point::new(10e-3, 0.0, 3e-3));
    // Radius 4 mm there; the wall leans by its taper of 0.1.
    let lean = 1.01_f64.sqrt();
    assert!((here.distance_m - 1e-3 / lean).abs() < 1e-9, "{here:?}");
    assert!((here.normal - Vector3::new(-0.1, 0.0, -1.0) / lean).norm() < 1e-6, "{here:?}");
    let past = wall.sample(&Point::new(-2e-3, 0.0, 0.0));
    assert!((past.distance_m - 5e-3).abs() < 1e-9 && past.beyond_m > 1.9e-3, "{past:?}");
}

#[test]
fn storing_a_lumen_costs_micrometres() {
    let wall = wall(&torus(), SurfaceModel::Smooth);
    let spread = |cell_m| {
        let options = LumenOptions::for_instrument(0.8e-3, cell_m);
        let lumen = build_lumen(&wall, options).unwrap();
        let device = Lumen::new(lumen.header, &lumen.bytes).unwrap();
        let mut random = Random(6);
        for _ in 0..500 {
            let (around, depth) = (random.within(0.2, 1.3), random.within(0.0, 1.5e-3));
            let p = Vector3::new(around.cos(), around.sin(), 0.0) * (BEND_M + BORE_M - depth);
            // The points avoid faces between bricks, where rounding decides which brick is read.
            let p = p + Vector3::z() * 0.3e-3;
            let (ours, _) = interpolate(&lumen, &p).unwrap();
            let theirs = device.sample::<f64>(<[f64; 3]>::from(p));
            assert!((ours.distance_m - theirs.distance_m).abs() < 0.1e-6, "{ours:?} {theirs:?}");
            assert!(
                (ours.normal - Point::from(<[f64; 3]>::from(theirs.normal))).norm() < 1e-3,
                "{ours:?} {theirs:?}"
            );
        }
        measure(&lumen, &wall, &options, 3000)
    };
    let (coarse, fine) = (spread(1e-3), spread(0.5e-3));
    assert_eq!(coarse.points, 3000);
    assert!(coarse.distance_m.p99 < 5e-6, "{coarse:?}");
    assert!(coarse.normal_rad.p99 < 0.05, "{coarse:?}");
    assert!(coarse.trilinear_m.p50 > 10.0 * coarse.distance_m.p50, "{coarse:?}");
    assert!(
        coarse.trilinear_m.p50 > 3.0 * fine.trilinear_m.p50,
        "second order: {coarse:?} {fine:?}"
    );
}

#[test]
fn far_from_the_wall_nothing_is_stored() {
    let station = |s: f64| Station { s_m: s, position_m: Vector3::x() * s, radius_m: 12e-3 };
    let stations = (0..=10).map(|k| station(4e-3 * f64::from(k))).collect();
    let wall = TubeWall::new(&[Branch { name: "a".into(), stations }]);
    let lumen = build_lumen(&wall, LumenOptions::for_instrument(0.8e-3, 1e-3)).unwrap();
    let entry_at = |p: Point| {
        let header = &lumen.header;
        let brick = |axis: usize| ((p[axis] - f64::from(header.origin_m[axis])) / 4e-3) as usize;
        let [nx, ny, _] = header.bricks.map(usize::from);
        let entry = (brick(2) * ny + brick(1)) * nx + brick(0);
        u16::from_le_bytes([lumen.bytes[2 * entry], lumen.bytes[2 * entry + 1]])
    };
    let axis = Point::new(20e-3, 0.0, 0.0);
    assert_eq!((interpolate(&lumen, &axis), entry_at(axis)), (None, FREE));
    let corner = Point::new(20e-3, 13.5e-3, 13.5e-3);
    assert_eq!((interpolate(&lumen, &corner), entry_at(corner)), (None, OUTSIDE));
    // A brick is stored wherever the instrument can touch.
    for depth in [-2.4e-3, 0.0, 0.8e-3, 1.8e-3] {
        for x in [-2e-3, 0.0, 17.3e-3, 40e-3] {
            let p = Point::new(x, 0.6, 0.8);
            let p = Point::new(x, p.y * (12e-3 - depth), p.z * (12e-3 - depth));
            let (here, _) = interpolate(&lumen, &p).unwrap();
            assert!((here.distance_m - depth).abs() < 2e-6, "{here:?} at {depth}");
        }
    }
}

#[test]
fn the_examples_mesh_is_its_centreline() {
    let bundle = Bundle::open(example()).unwrap();
    let vessel = Vessel::from_bundle(&bundle, SurfaceModel::Smooth).unwrap();
    let faceted = Vessel::from_bundle(&bundle, SurfaceModel::Faceted).unwrap();
    let trunk = &bundle.centreline[0];
    let tube = TubeWall::new(std::slice::from_ref(trunk));
    let mut random = Random(5);
    let (mut smooth_errors, mut faceted_errors) = (Vec::new(), Vec::new());
    for _ in 0..3000 {
        // These points lie in the trunk, away from its mouth and from the fork.
        let k = random.within(3.0, 22.0) as usize;
        let (a, b) = (&trunk.stations[k], &trunk.stations[k + 1]);
        let axis = (b.position_m - a.position_m).normalize();
        let angle = random.within(0.0, TAU);
        let side = axis.cross(&Vector3::z()).normalize();
        let across = side * angle.cos() + axis.cross(&side) * angle.sin();
        let p = a.position_m.lerp(&b.position_m, random.next())
            + across * (a.radius_m - random.within(0.0, 1.5e-3));
        let exact = tube.sample(&p).distance_m;
        smooth_errors.push(vessel.wall().sample(&p).distance_m - exact);
        faceted_errors.push(faceted.wall().sample(&p).distance_m - exact);
    }
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean(&faceted_errors) < -10e-6, "{}", mean(&faceted_errors));
    assert!(mean(&smooth_errors).abs() < 1e-6, "{}", mean(&smooth_errors));
    assert!(Spread::of(smooth_errors).p99 < 5e-6);
}

/// A stray station must be refused at once, because sampling the way there would take hours.
#[test]
fn a_vessel_as_long_as_a_street_has_no_lumen() {
    let station = |x| Station { s_m: x, position_m: Vector3::new(x, 0.0, 0.0), radius_m: 4e-3 };
    let options = LumenOptions::for_instrument(0.8e-3, 1e-3);
    for far_m in [10.0, 1e3, 1e300] {
        let stations = vec![station(0.0), station(0.1), station(far_m)];
        let wall = TubeWall::new(&[Branch { name: "stray".into(), stations }]);
        assert_eq!(build_lumen(&wall, options), None, "{far_m} m");
    }
}

/// Where the instrument touches, the stored distance errs by less than 50 µm everywhere, at
/// the crest between the branches too.
#[test]
fn the_examples_lumen_errs_by_less_than_50_micrometres() {
    let bundle = Bundle::open(example()).unwrap();
    let vessel = Vessel::from_bundle(&bundle, SurfaceModel::Smooth).unwrap();
    let radius_m = 0.5 * bundle.catheter().unwrap().instrument.outer_diameter_m;
    let (_, report) = vessel.lumen(LumenOptions::for_instrument(radius_m, 1e-3)).unwrap();
    assert_eq!((report.quality.points, report.openings.len()), (20_000, 3));
    assert!(report.quality.distance_m.max < 50e-6, "{report:?}");
    assert!(report.quality.distance_m.p99 < 12e-6, "{report:?}");
}

/// A tube whose ends are cut askew, with no point known inside.
#[test]
fn openings_are_found_and_an_oblique_cut_is_no_wall() {
    let along = Vector3::new(0.8, 0.6, 0.0);
    let low = Point::new(0.0, -4.13e-3, -4.29e-3);
    let mesh = triangulate(low, 1e-3, [20, 24, 9], |p| 3e-3 - (p - along * p.dot(&along)).norm());
    let mesh = Mesh::from_triangles(&mesh).unwrap().0;
    let wall = MeshWall::new(mesh, SurfaceModel::Smooth);
    assert_eq!((wall.openings.len(), wall.gaps), (2, 0));
    for opening in &wall.openings {
        assert!((opening.radius_m - 3e-3).abs() < 0.1e-3, "{opening:?}");
        let outwards = if opening.centre_m.x < 10e-3 { -along } else { along };
        assert!((opening.axis - outwards).norm() < 0.05, "{opening:?}");
    }
    // Into the tube, through both cuts and out of it.
    for k in -4..=28 {
        let on_axis = wall.sample(&(along * (1e-3 * f64::from(k))));
        assert!((on_axis.distance_m - 3e-3).abs() < 0.1e-3, "{k} mm along: {on_axis:?}");
    }
}
