//! Synthetic vessels and small bundles for the tests.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use cathforce_bundle::geometry::Triangle;
use cathforce_bundle::{Bundle, BundleError, Place};
use nalgebra::Vector3;

pub type Point = Vector3<f64>;

/// The zero surface of `field` within a box of `cells` cubes from `low`, by marching
/// tetrahedra: vertices exactly on the surface, facets inscribed, many of them slivers, open
/// where the surface leaves the box. Facets face the negative side.
pub fn triangulate(
    low: Point,
    cell: f64,
    cells: [usize; 3],
    field: impl Fn(&Point) -> f64,
) -> Vec<Triangle> {
    const CORNERS: [[usize; 3]; 8] =
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];
    // Six tetrahedra around the cube's diagonal; neighbouring cubes agree on every face.
    const TETRAHEDRA: [[usize; 4]; 6] =
        [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
    let mut values: HashMap<[usize; 3], f64> = HashMap::new();
    let at = |node: [usize; 3]| low + Vector3::from(node.map(|n| n as f64)) * cell;
    let mut triangles = Vec::new();
    for x in 0..cells[0] {
        for y in 0..cells[1] {
            for z in 0..cells[2] {
                let nodes = CORNERS.map(|[i, j, k]| [x + i, y + j, z + k]);
                let values = nodes.map(|n| *values.entry(n).or_insert_with(|| field(&at(n))));
                for tetrahedron in TETRAHEDRA {
                    let (inner, outer): (Vec<usize>, Vec<usize>) =
                        tetrahedron.iter().partition(|&&corner| values[corner] > 0.0);
                    let cut = |a: usize, b: usize| root(&field, at(nodes[a]), at(nodes[b]));
                    let polygon: Vec<Point> = match (&inner[..], &outer[..]) {
                        ([], _) | (_, []) => continue,
                        (&[a], others) | (others, &[a]) => {
                            others.iter().map(|&b| cut(a, b)).collect()
                        }
                        (&[a, b], &[c, d]) => vec![cut(a, c), cut(a, d), cut(b, d), cut(b, c)],
                        _ => unreachable!("a tetrahedron has four corners"),
                    };
                    let outwards = at(nodes[outer[0]]) - at(nodes[inner[0]]);
                    for k in 2..polygon.len() {
                        let (a, b, c) = (polygon[0], polygon[k - 1], polygon[k]);
                        let faces_out = (b - a).cross(&(c - a)).dot(&outwards) > 0.0;
                        triangles.push(if faces_out { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
    }
    triangles
}

/// The place where the field changes sign between a positive and a negative point; independent of their
/// order to the last bit.
fn root(field: &impl Fn(&Point) -> f64, a: Point, b: Point) -> Point {
    let (mut inner, mut outer) = if field(&a) > 0.0 { (a, b) } else { (b, a) };
    for _ in 0..50 {
        let middle = 0.5 * (inner + outer);
        if field(&middle) > 0.0 { inner = middle } else { outer = middle }
    }
    inner
}

/// A reproducible generator of numbers in [0, 1).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A binary STL file in millimetres.
pub fn binary_stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = b"solid by a program that writes binary".to_vec();
    bytes.resize(80, 0);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        for x in triangle.iter().flat_map(|corner| corner.iter()) {
            bytes.extend(((x * 1e3) as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// An ASCII STL file in millimetres.
pub fn ascii_stl(triangles: &[Triangle]) -> String {
    let mut text = String::from("solid a facet of a name\n");
    for triangle in triangles {
        text += "  facet normal 0 0 nan\n    outer loop\n";
        for c in triangle {
            text += &format!("      vertex {:e} {:e} {:e}\n", c.x * 1e3, c.y * 1e3, c.z * 1e3);
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid a facet of a name\n"
}

/// A straight tube of 3 mm radius from x = 0 to 20 mm.
pub fn tube() -> Vec<Triangle> {
    triangulate(Point::new(0.0, -4.13e-3, -4.29e-3), 1e-3, [20, 9, 9], |p| 3e-3 - p.y.hypot(p.z))
}

/// Corners around a tube of quads.
pub const AROUND: usize = 24;

/// A tube of quads along x, rings of [`AROUND`] corners apart evenly; moved by `at`.
pub fn quad_tube(radius_m: f64, length_m: f64, rings: usize, at: Point) -> Vec<Triangle> {
    let corner = |ring: usize, side: usize| {
        let angle = std::f64::consts::TAU * (side % AROUND) as f64 / AROUND as f64;
        let along_m = length_m * ring as f64 / rings as f64;
        at + Point::new(along_m, radius_m * angle.cos(), radius_m * angle.sin())
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for side in 0..AROUND {
            let [a, b] = [corner(ring, side), corner(ring + 1, side)];
            let [c, d] = [corner(ring + 1, side + 1), corner(ring, side + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

pub const RIG: &str = r#"format = "trial-bundle/1"
name = "test"

[instrument]
length_m = 0.65
outer_diameter_m = 1.65e-3
inner_diameter_m = 1.02e-3
density_kg_per_m3 = 1100.0
poissons_ratio = 0.4
sections = [
  { length_m = 0.60, youngs_modulus_Pa = 26.0e6 },
  { length_m = 0.05, youngs_modulus_Pa = 50.0e6 },
]
tip_precurve = [ { length_m = 0.012, curvature_per_m = 83.0 } ]

[entry]
position_m = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
guide_length_m = 0.02

[vessel]
friction_coefficient = 0.3
wall_stiffness_N_per_m = 4000.0
wall_contact_spacing_m = 0.005

[environment]
gravity_m_per_s2 = [0.0, 0.0, -9.81]
fluid = "none"

[sensor]
force_noise_sd_N = 0.01
"#;

pub const CENTRELINE: &str = "branch,s_m,x_m,y_m,z_m,radius_m
a,0.0,0.0,0.0,0.0,0.003
a,0.01,0.01,0.0,0.0,0.003
a,0.02,0.02,0.0,0.0,0.003
";

pub const TRIAL: &str = "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,tip_x_m,tip_y_m,tip_z_m
0.0,0.010,0.0,0.0,0.0,0.0,0.01,0.0,0.0
0.2,0.012,0.1,0.01,0.0,-0.01,,,
0.4,0.016,0.3,0.02,0.0,-0.01,0.016,0.0,0.0
";

/// Writes a small bundle whose vessel is the centreline.
pub fn write_bundle(folder: &Path) {
    fs::create_dir_all(folder.join("trials")).unwrap();
    fs::write(folder.join("rig.toml"), RIG).unwrap();
    fs::write(folder.join("centreline.csv"), CENTRELINE).unwrap();
    fs::write(folder.join("trials/000.csv"), TRIAL).unwrap();
}

/// The example bundle of the repository.
pub fn example() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

/// Asserts that a bundle with this `rig.toml` is refused at `at` in its line with `key`, with a message that
/// contains `says` and a fix.
pub fn assert_refused(rig: &str, key: &str, at: &str, says: &str) {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let line = rig.lines().position(|line| line.contains(key)).unwrap();
    let column = rig.lines().nth(line).unwrap().find(at).unwrap();
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let error: BundleError = Bundle::open(folder.path()).unwrap_err();
    assert_eq!(error.place, Place::LineColumn(line + 1, column + 1), "{error}");
    let text = error.to_string();
    assert!(text.contains(says) && text.contains("\n  fix: "), "{text}");
}
