//! Meshes with faults of exporters: which are repaired, refused or warned of.

mod support;

use std::f64::consts::TAU;
use std::fs;

use cathforce_bundle::geometry::{
    Mesh, MeshCause, MeshRepairs, MeshWall, SurfaceModel, Triangle, Wall,
};
use cathforce_bundle::{Bundle, Vessel};
use support::{AROUND, Point, RIG, binary_stl, quad_tube as tube, write_bundle};

fn turned(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

fn read(triangles: &[Triangle]) -> (Mesh, MeshRepairs) {
    Mesh::from_triangles(triangles).unwrap()
}

fn wall(triangles: &[Triangle]) -> MeshWall {
    MeshWall::new(read(triangles).0, SurfaceModel::Faceted)
}

/// Fails unless both walls agree up to rounding in a box around a tube of 20 mm.
fn assert_same(a: &MeshWall, b: &MeshWall) {
    let mut random = support::Random(11);
    for _ in 0..2000 {
        let p = Point::new(
            random.within(-2e-3, 22e-3),
            random.within(-4e-3, 4e-3),
            random.within(-4e-3, 4e-3),
        );
        let [a, b] = [a, b].map(|wall| wall.sample(&p));
        assert!((a.distance_m - b.distance_m).abs() < 1e-8, "{p:?}: {a:?} {b:?}");
    }
}

/// The corners of one seam, moved outwards on one of its sides.
fn seam_opened_by(width_m: f64) -> Vec<Triangle> {
    let mut triangles = tube(3e-3, 20e-3, 8, Point::zeros());
    for (index, triangle) in triangles.iter_mut().enumerate() {
        if index / 2 % AROUND == 0 {
            for corner in triangle.iter_mut().filter(|p| p.z.abs() < 1e-9) {
                corner.y += width_m;
            }
        }
    }
    triangles
}

#[test]
fn corners_of_one_place_are_one_across_the_border_of_a_cell() {
    // Either side of the border between two cells of the welder.
    let border_m = 30_000.5 * 1e-7;
    let whole = wall(&tube(3e-3, 20e-3, 8, Point::zeros()));
    for width_m in [0.24e-9, 20e-9] {
        let mut triangles = tube(3e-3, 20e-3, 8, Point::zeros());
        for (index, triangle) in triangles.iter_mut().enumerate() {
            for corner in triangle.iter_mut().filter(|p| p.z.abs() < 1e-9 && p.y > 0.0) {
                let side = if index / 2 % AROUND == 0 { 0.5 } else { -0.5 };
                corner.y = border_m + side * width_m;
            }
        }
        let welded = wall(&triangles);
        assert_eq!((welded.openings.len(), welded.gaps), (2, 0), "{width_m}");
        let p = Point::new(10e-3, 2e-3, 0.0);
        let [a, b] = [&whole, &welded].map(|wall| wall.sample(&p).distance_m);
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
}

#[test]
fn a_crack_is_called_so_with_its_place() {
    let cause = Mesh::from_triangles(&seam_opened_by(0.5e-6)).unwrap_err();
    let MeshCause::Cracked { at_mm: [x, y, z], length_mm } = cause else { panic!("{cause:?}") };
    assert!((0.0..=20.0).contains(&x) && (y - 3.0).abs() < 0.01 && z.abs() < 0.01, "{x} {y} {z}");
    // The seam, and half around both ends.
    assert!((length_mm - 20.0 - TAU * 3.0).abs() < 1.0, "{length_mm}");
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("vessel.stl"), binary_stl(&seam_opened_by(0.5e-6))).unwrap();
    let message = Bundle::open(folder.path()).unwrap_err().to_string();
    for says in ["vessel.stl", "cracked along", "fix: merge close vertices"] {
        assert!(message.contains(says), "{message}");
    }
}

/// A crack from one end of the vessel to its middle, which joins the rim of that end.
#[test]
fn a_crack_that_runs_into_an_opening_is_called_so() {
    let whole = tube(3e-3, 20e-3, 8, Point::zeros());
    let open = seam_opened_by(0.5e-6);
    let half: Vec<_> = open
        .iter()
        .zip(&whole)
        .map(|(open, whole)| [0, 1, 2].map(|k| if whole[k].x < 9e-3 { open[k] } else { whole[k] }))
        .collect();
    let cause = Mesh::from_triangles(&half).unwrap_err();
    let MeshCause::Cracked { at_mm: [x, y, _], .. } = cause else { panic!("{cause:?}") };
    assert!((0.0..=10.0).contains(&x) && (y - 3.0).abs() < 0.01, "{x} {y}");
}

/// A mesh from CAD: a corner in the middle of a neighbour's edge.
#[test]
fn a_corner_on_the_edge_of_another_facet_is_no_opening() {
    let whole = tube(3e-3, 20e-3, 4, Point::zeros());
    // Within the wall, and from one end of it to the other.
    for (rings, index) in [(4, 2 * AROUND), (1, 0)] {
        let mut triangles = tube(3e-3, 20e-3, rings, Point::zeros());
        let [a, b, c] = triangles.remove(index);
        // One in the middle, and three at once.
        for stops in [vec![0.5], vec![0.2, 0.5, 0.9]] {
            let mut triangles = triangles.clone();
            let mut ends = vec![a];
            ends.extend(stops.iter().map(|&share| a.lerp(&b, share)));
            ends.push(b);
            triangles.extend(ends.windows(2).map(|pair| [pair[0], pair[1], c]));
            let (mesh, repairs) = read(&triangles);
            assert_eq!(repairs.split, 1);
            let stitched = MeshWall::new(mesh, SurfaceModel::Faceted);
            assert_eq!((stitched.openings.len(), stitched.gaps), (2, 0), "{stops:?}");
            assert_same(&stitched, &wall(&whole));
        }
    }
}

/// Corners on both sides of a cut, none of them shared.
#[test]
fn a_slit_without_width_is_a_gap_and_closed() {
    let whole = tube(3e-3, 20e-3, 2, Point::zeros());
    let mut triangles = whole.clone();
    // The edge from ring to ring that two facets of the second ring share.
    let at = 2 * AROUND + 3;
    let [a, c, d] = triangles.remove(at);
    let [e, f, g] = triangles.remove(at - 1);
    assert!(e == a && g == c, "they share the edge from a to c");
    let parts = |shares: [f64; 2], far: Point| {
        let ends = [a, a.lerp(&c, shares[0]), a.lerp(&c, shares[1]), c];
        [0, 1, 2].map(|k| [ends[k], ends[k + 1], far])
    };
    triangles.extend(parts([0.3, 0.6], d));
    triangles.extend(parts([0.4, 0.7], f));
    let closed = wall(&triangles);
    assert_eq!((closed.openings.len(), closed.gaps), (2, 1));
    assert_same(&closed, &wall(&whole));
    // The slit is as wide as an eyelash and lets nothing through.
    let slit_m = 50e-6;
    let mut moved = whole;
    let middle = a.lerp(&c, 0.5);
    let middle = middle - (middle - Point::x() * middle.x).normalize() * slit_m;
    moved[at] = [a, middle, d];
    moved.push([middle, c, d]);
    let closed = wall(&moved);
    assert_eq!((closed.openings.len(), closed.gaps), (2, 1));
    for depth_m in [0.1e-3, 1e-3, 2e-3] {
        let p = a.lerp(&c, 0.45) - Point::x() * a.lerp(&c, 0.45).x;
        let p = a.lerp(&c, 0.45) - p.normalize() * depth_m;
        let off_m = closed.sample(&p).distance_m - depth_m;
        assert!(off_m.abs() < 2.0 * slit_m, "{depth_m}: {off_m}");
    }
}

#[test]
fn every_piece_faces_its_own_lumen() {
    let first = tube(3e-3, 20e-3, 8, Point::zeros());
    let second = tube(2.5e-3, 20e-3, 8, Point::new(0.0, 12e-3, 0.0));
    for second in [second.clone(), turned(&second)] {
        let both = wall(&[first.clone(), second].concat());
        for y in [0.0, 12e-3] {
            let here = both.sample(&Point::new(10e-3, y, 0.0));
            assert!(here.distance_m > 2e-3, "{here:?}");
        }
    }
}

#[test]
fn a_piece_within_another_is_refused() {
    let (inner, outer) =
        (tube(3e-3, 20e-3, 8, Point::zeros()), tube(5e-3, 20e-3, 8, Point::zeros()));
    for inner in [inner.clone(), turned(&inner)] {
        let cause = Mesh::from_triangles(&[inner, outer.clone()].concat()).unwrap_err();
        let MeshCause::Nested { at_mm: [_, y, z] } = cause else { panic!("{cause:?}") };
        assert!((y.hypot(z) - 3.0).abs() < 0.1, "{y} {z}");
    }
    let across = tube(2e-3, 15e-3, 8, Point::zeros()).iter().map(|t| t.map(|p| p.yxz())).collect();
    let across: Vec<Triangle> = across;
    let across: Vec<_> = across.iter().map(|t| t.map(|p| p + Point::x() * 10e-3)).collect();
    let (_, repairs) = read(&[tube(3e-3, 20e-3, 8, Point::zeros()), across].concat());
    let [x, ..] = repairs.doubts.overlap_mm.unwrap();
    assert!((x - 10.0).abs() < 2.5, "{x}");
}

#[test]
fn the_wall_of_a_phantom_is_told_from_its_lumen() {
    let (inner, outer) =
        (tube(3e-3, 20e-3, 8, Point::zeros()), tube(5e-3, 20e-3, 8, Point::zeros()));
    let ring = |x: f64| {
        let corner = move |radius_m: f64, side: usize| {
            let angle = TAU * (side % AROUND) as f64 / AROUND as f64;
            Point::new(x, radius_m * angle.cos(), radius_m * angle.sin())
        };
        (0..AROUND).flat_map(move |side| {
            let [a, b] = [3e-3, 5e-3].map(|radius_m| corner(radius_m, side));
            let [d, c] = [3e-3, 5e-3].map(|radius_m| corner(radius_m, side + 1));
            [[a, b, c], [a, c, d]]
        })
    };
    let mut solid = [inner.clone(), outer].concat();
    solid.extend(ring(0.0));
    solid.extend(ring(20e-3));
    let (_, repairs) = read(&solid);
    assert_eq!((repairs.pieces, repairs.doubts.channels), (1, 1));
    assert!(repairs.figure.is_phantom(), "{:?}", repairs.figure);
    // Neither a tube nor a vessel that is closed at both ends has channels.
    let mut capped = inner;
    for (x, middle) in [(0.0, Point::zeros()), (20e-3, Point::x() * 20e-3)] {
        let rim: Vec<_> = ring(x).step_by(2).map(|[a, ..]| a).collect();
        capped.extend((0..AROUND).map(|k| [rim[k], rim[(k + 1) % AROUND], middle]));
    }
    let (mesh, repairs) = read(&capped);
    assert_eq!((repairs.doubts.channels, repairs.figure.caps), (0, 2));
    let [first, second] = repairs.figure.named_caps_mm() else { panic!("{:?}", repairs.figure) };
    assert!(first[0].abs() < 0.01 && (second[0] - 20.0).abs() < 0.01, "{first:?} {second:?}");
    assert!(MeshWall::new(mesh, SurfaceModel::Faceted).openings.is_empty());
}

/// The wall does not depend on it, but another program's does.
#[test]
fn a_surface_that_is_inside_out_is_said_with_its_count() {
    let whole = tube(3e-3, 20e-3, 8, Point::zeros());
    let (_, repairs) = read(&whole);
    let (mesh, other) = read(&turned(&whole));
    let [inside_out, right] = match repairs.inside_out {
        0 => [other, repairs],
        _ => [repairs, other],
    };
    assert_eq!((right.inside_out, right.flipped), (0, 0));
    assert_eq!((inside_out.inside_out, inside_out.flipped), (whole.len(), 0));
    let outwards = mesh.facing_outwards();
    assert_eq!(read(&outwards).1.inside_out, 0);
    // The first triangle alone is wrong: the others do not follow it.
    let mut one = outwards.clone();
    one[0] = turned(&one)[0];
    let (_, repairs) = read(&one);
    assert_eq!((repairs.inside_out, repairs.flipped), (0, 1));
    let mut but_one = turned(&one);
    but_one.rotate_left(7);
    let (_, repairs) = read(&but_one);
    assert_eq!((repairs.inside_out, repairs.flipped), (whole.len() - 1, 1));
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("vessel.stl"), binary_stl(&but_one)).unwrap();
    let warnings = Bundle::open(folder.path()).unwrap().warnings;
    let says = format!("inside out: {} triangles face the lumen", whole.len() - 1);
    assert!(warnings.iter().any(|warning| warning.message.contains(&says)), "{warnings:?}");
}

/// Doubled facets, fins and a membrane are left out, and the lumen is that without them.
#[test]
fn what_is_too_much_on_an_edge_is_left_out_with_its_place() {
    let whole = tube(3e-3, 20e-3, 8, Point::zeros());
    let clean = wall(&whole);
    let doubled: Vec<_> = whole.iter().chain(&whole[40..44]).copied().collect();
    let (mesh, repairs) = read(&doubled);
    let left_out = repairs.left_out.unwrap();
    assert!(left_out.facets == 4 && left_out.edges > 4, "{left_out:?}");
    assert_same(&MeshWall::new(mesh, SurfaceModel::Faceted), &clean);
    // A fin outside, on three edges of one seam.
    let seam = |k: usize| Point::new(20e-3 * k as f64 / 8.0, 3e-3, 0.0);
    let fin = (2..5).map(|k| [seam(k), seam(k + 1), seam(k) + Point::y() * 2e-3]);
    let finned: Vec<_> = whole.iter().copied().chain(fin).collect();
    let (mesh, repairs) = read(&finned);
    let left_out = repairs.left_out.unwrap();
    assert_eq!((left_out.edges, left_out.facets), (3, 3));
    let [x, y, z] = left_out.at_mm;
    assert!((5.0..12.6).contains(&x) && (y - 3.0).abs() < 1e-6 && z.abs() < 1e-6, "{left_out:?}");
    assert_same(&MeshWall::new(mesh, SurfaceModel::Faceted), &clean);
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("vessel.stl"), binary_stl(&finned)).unwrap();
    let warnings = Bundle::open(folder.path()).unwrap().warnings;
    let said = |says: &str| warnings.iter().any(|warning| warning.message.contains(says));
    assert!(said("share 3 edges") && said("3 triangles of fins"), "{warnings:?}");
}

#[test]
fn a_surface_that_runs_through_itself_is_said_with_place_and_count() {
    assert_eq!(read(&tube(3e-3, 20e-3, 8, Point::zeros())).1.crossing, None);
    // One tube through another, off its middle, so that edges pass through facets and not each other.
    let first = tube(3e-3, 20e-3, 8, Point::zeros());
    let second = tube(3e-3, 20e-3, 8, Point::zeros());
    let across =
        second.iter().map(|t| t.map(|p| Point::new(10.3e-3 + p.y, p.x - 9.7e-3, p.z + 0.4e-3)));
    let (_, repairs) = read(&first.iter().copied().chain(across).collect::<Vec<_>>());
    let crossing = repairs.crossing.unwrap();
    let [x, y, z] = crossing.at_mm;
    assert!(crossing.pairs > 20, "{crossing:?}");
    assert!((x - 10.0).abs() < 3.5 && y.abs() < 3.5 && z.abs() < 3.5, "{crossing:?}");
}

/// A ring is a lumen that goes round, not the wall of a phantom.
#[test]
fn a_lumen_with_a_loop_is_told_from_the_wall_of_a_phantom() {
    const RING: usize = 48;
    let at = |i: usize, k: usize| {
        let [turn, side] = [(i, RING), (k, AROUND)].map(|(at, of)| TAU * at as f64 / of as f64);
        let out = 15e-3 + 2e-3 * side.cos();
        Point::new(out * turn.cos(), out * turn.sin(), 2e-3 * side.sin())
    };
    let quad = |i: usize, k: usize| {
        let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
        [[a, b, c], [a, c, d]]
    };
    let ring: Vec<_> = (0..RING).flat_map(|i| (0..AROUND).flat_map(move |k| quad(i, k))).collect();
    let (_, repairs) = read(&ring);
    assert_eq!(repairs.doubts.channels, 1);
    assert!(!repairs.figure.is_phantom(), "{:?}", repairs.figure);
    assert!((repairs.figure.radius_m - 2e-3).abs() < 0.1e-3, "{:?}", repairs.figure);
}

/// The vessel of a bundle whose instrument enters at (x, y, 0) m along x.
fn entered_at(position: &str, triangles: &[Triangle]) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("vessel.stl"), binary_stl(triangles)).unwrap();
    let rig = RIG.replace("position_m = [0.0, 0.0, 0.0]", &format!("position_m = {position}"));
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    Vessel::from_bundle(&bundle, SurfaceModel::Faceted).err().map(|error| error.to_string())
}

#[test]
fn an_entry_beside_the_vessel_is_refused_with_its_key() {
    let vessel = tube(3e-3, 20e-3, 8, Point::zeros());
    for (y_mm, outside) in [("4", "1.0 mm"), ("8", "5.0 mm"), ("20", "17.0 mm")] {
        let message = entered_at(&format!("[0.0, {y_mm}e-3, 0.0]"), &vessel).unwrap();
        let aside = format!("{y_mm}.0 mm beside the middle");
        let outside = format!("{outside} outside the wall");
        for says in ["rig.toml", "[entry] position_m", &outside, &aside, "fix: correct"] {
            assert!(message.contains(says), "{message}");
        }
    }
    // Within the opening, before its plane, and some way in.
    for good in ["[0.0, 1e-3, 0.0]", "[-6e-3, 0.0, 0.0]", "[7e-3, 0.0, -1.5e-3]"] {
        assert_eq!(entered_at(good, &vessel), None, "{good}");
    }
}
