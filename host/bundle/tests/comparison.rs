//! The comparison of a stored lumen with its wall covers everything.

mod support;

use cathforce_bundle::geometry::{Branch, Mesh, MeshWall, Station, SurfaceModel, TubeWall};
use cathforce_bundle::lumen::{LumenOptions, build_lumen, measure};
use nalgebra::Rotation3;
use support::{Point, quad_tube, tube};

const POINTS: usize = 5000;

fn wall() -> MeshWall {
    MeshWall::new(Mesh::from_triangles(&tube()).unwrap().0, SurfaceModel::Faceted)
}

#[test]
fn a_stored_distance_that_is_far_off_is_not_left_out() {
    let (wall, options) = (wall(), LumenOptions::for_instrument(0.8e-3, 1e-3));
    let mut lumen = build_lumen(&wall, options).unwrap();
    let good = measure(&lumen, &wall, &options, POINTS);
    assert_eq!((good.points, good.not_stored), (POINTS, 0));
    assert!(good.distance_m.max < 0.2e-3, "{good:?}");
    // 5 mm more, everywhere.
    let directory: usize = lumen.header.bricks.iter().map(|&n| usize::from(n)).product();
    for node in lumen.bytes[2 * directory..].as_chunks_mut::<6>().0 {
        let units = i16::from_le_bytes([node[0], node[1]]).saturating_add(20_000);
        node[..2].copy_from_slice(&units.to_le_bytes());
    }
    let wrong = measure(&lumen, &wall, &options, POINTS);
    assert_eq!(wrong.points, POINTS);
    assert!(wrong.distance_m.p50 > 4.5e-3, "{wrong:?}");
}

#[test]
fn places_that_are_touched_but_not_stored_are_counted() {
    let wall = wall();
    let thin = LumenOptions { outside_m: 0.1e-3, ..LumenOptions::for_instrument(0.1e-3, 0.2e-3) };
    let thick = LumenOptions { outer_radius_m: 2.5e-3, ..thin };
    let lumen = build_lumen(&wall, thin).unwrap();
    let quality = measure(&lumen, &wall, &thick, POINTS);
    assert!(quality.not_stored > POINTS / 10, "{quality:?}");
    assert_eq!(quality.points + quality.not_stored, POINTS);
    // The instrument lies there, on the axis of the tube.
    let [_, y, z] = quality.not_stored_at_m;
    assert!(y.hypot(z) < 1.6e-3, "{quality:?}");
}

/// A slender vessel fills little of the box around it.
#[test]
fn a_long_diagonal_vessel_is_compared_at_as_many_points() {
    let turn = Rotation3::rotation_between(&Point::x(), &Point::new(1.0, 1.0, 1.0)).unwrap();
    let along_x = quad_tube(1.5e-3, 250e-3, 100, Point::zeros());
    let diagonal: Vec<_> = along_x.iter().map(|corners| corners.map(|p| turn * p)).collect();
    let mesh = Mesh::from_triangles(&diagonal).unwrap().0;
    let wall = MeshWall::new(mesh, SurfaceModel::Faceted);
    let options = LumenOptions::for_instrument(0.8e-3, 1e-3);
    let lumen = build_lumen(&wall, options).unwrap();
    let quality = measure(&lumen, &wall, &options, POINTS);
    assert_eq!((quality.points, quality.not_stored), (POINTS, 0));
    assert!(quality.deeper_points > 100, "{quality:?}");
}

/// A centreline has no facets of its own.
#[test]
fn the_wall_of_a_centreline_is_compared_too() {
    let station = |s_m: f64| Station { s_m, position_m: Point::y() * s_m, radius_m: 3e-3 };
    let stations = (0..=5).map(|k| station(4e-3 * f64::from(k))).collect();
    let wall = TubeWall::new(&[Branch { name: "a".into(), stations }]);
    let options = LumenOptions::for_instrument(0.8e-3, 1e-3);
    let quality = measure(&build_lumen(&wall, options).unwrap(), &wall, &options, POINTS);
    assert_eq!((quality.points, quality.not_stored), (POINTS, 0));
    assert!(quality.deeper_points > 0 && quality.distance_m.max < 50e-6, "{quality:?}");
    let y = quality.worst_at_m[1];
    assert!((0.0..=20e-3).contains(&y), "past an opening nothing is compared: {quality:?}");
}

/// A lumen that is far too large for any device is refused before its nodes are sampled.
#[test]
fn far_too_many_bricks_are_counted_and_not_sampled() {
    struct Counting {
        wall: MeshWall,
        asked: std::sync::atomic::AtomicUsize,
    }
    impl cathforce_bundle::geometry::Wall for Counting {
        fn sample(&self, p: &Point) -> cathforce_bundle::geometry::WallPoint {
            self.asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            self.wall.sample(p)
        }
        fn bounds_m(&self) -> (Point, Point) {
            self.wall.bounds_m()
        }
    }
    let wide: Vec<_> = tube().iter().map(|corners| corners.map(|p| p * 3.0)).collect();
    let wall = MeshWall::new(Mesh::from_triangles(&wide).unwrap().0, SurfaceModel::Faceted);
    let wall = Counting { wall, asked: 0.into() };
    assert_eq!(build_lumen(&wall, LumenOptions::for_instrument(0.8e-3, 0.15e-3)), None);
    // Once for every brick of the box; the nodes are some five million.
    let asked = wall.asked.into_inner();
    assert!(asked < 300_000, "{asked}");
}
