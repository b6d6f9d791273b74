//! Opens a capped surface at the ends of a centre line.

use cathforce_bundle::geometry::{Branch, Triangle};
use nalgebra::Vector3;

/// Radii around an end within which the surface is cut.
const REACH: f64 = 2.0;
/// Share of the radius by which the cut lies inside the end, so that the cap goes as a whole.
const INSIDE: f64 = 0.1;
/// An end that is deeper in another branch than this share of that one's radius is no end of the vessel.
const WITHIN: f64 = 0.9;

/// An end of a centre line that is an end of the vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    pub position_m: Vector3<f64>,
    /// Unit vector out of the vessel.
    pub outwards: Vector3<f64>,
    pub radius_m: f64,
}

/// The ends of branches that lie in no other branch.
pub fn ends(branches: &[Branch]) -> Vec<End> {
    let mut ends = Vec::new();
    for (index, branch) in branches.iter().enumerate() {
        let is_inside = |p: &Vector3<f64>| {
            let others = branches.iter().enumerate().filter(|(other, _)| *other != index);
            let mut stations = others.flat_map(|(_, other)| &other.stations);
            stations.any(|station| (station.position_m - p).norm() < WITHIN * station.radius_m)
        };
        let mut end = |last: usize, before: usize| {
            let (last, before) = (branch.stations[last], branch.stations[before]);
            let way = (last.position_m - before.position_m).try_normalize(0.0);
            if let Some(outwards) = way.filter(|_| !is_inside(&last.position_m)) {
                ends.push(End { position_m: last.position_m, outwards, radius_m: last.radius_m });
            }
        };
        if branch.stations.len() > 1 {
            end(0, 1);
            end(branch.stations.len() - 1, branch.stations.len() - 2);
        }
    }
    ends
}

/// The surface without what lies beyond an end, and how many facets were cut or taken off.
pub fn opened(triangles: &[Triangle], end: &End) -> (Vec<Triangle>, usize) {
    let plane = end.position_m - end.outwards * (INSIDE * end.radius_m);
    let beyond_m = |p: &Vector3<f64>| (p - plane).dot(&end.outwards);
    let is_near = |triangle: &Triangle| {
        triangle.iter().any(|p| (p - end.position_m).norm() < REACH * end.radius_m)
    };
    let mut kept = Vec::with_capacity(triangles.len());
    let mut changed = 0;
    for triangle in triangles {
        let distances = triangle.map(|p| beyond_m(&p));
        if !is_near(triangle) || distances.iter().all(|distance| *distance <= 0.0) {
            kept.push(*triangle);
            continue;
        }
        changed += 1;
        // What is left of a triangle before a plane has three corners or four.
        let mut corners = Vec::with_capacity(4);
        for k in 0..3 {
            let (from, to) = (k, (k + 1) % 3);
            let (a, b) = (distances[from], distances[to]);
            if a <= 0.0 {
                corners.push(triangle[from]);
            }
            if (a <= 0.0) != (b <= 0.0) {
                corners.push(triangle[from] + (triangle[to] - triangle[from]) * (a / (a - b)));
            }
        }
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            kept.push([corners[0], pair[0], pair[1]]);
        }
    }
    (kept, changed)
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::geometry::{Mesh, MeshWall, Station, SurfaceModel};

    use super::*;

    const AROUND: usize = 32;
    const RINGS: usize = 8;

    /// A tube along x of 3 mm radius and 20 mm length, capped at both ends.
    fn capped() -> Vec<Triangle> {
        let at = |ring: usize, side: usize| {
            let angle = std::f64::consts::TAU * (side % AROUND) as f64 / AROUND as f64;
            Vector3::new(20e-3 * ring as f64 / RINGS as f64, 3e-3 * angle.cos(), 3e-3 * angle.sin())
        };
        let mut triangles = Vec::new();
        for side in 0..AROUND {
            for ring in 0..RINGS {
                let [a, b, c, d] = [
                    at(ring, side),
                    at(ring + 1, side),
                    at(ring + 1, side + 1),
                    at(ring, side + 1),
                ];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
            triangles.push([Vector3::zeros(), at(0, side), at(0, side + 1)]);
            triangles.push([Vector3::x() * 20e-3, at(RINGS, side + 1), at(RINGS, side)]);
        }
        triangles
    }

    fn line(to_m: f64) -> Branch {
        let station = |k: u32| {
            let s_m = to_m * f64::from(k) / 10.0;
            Station { s_m, position_m: Vector3::x() * s_m, radius_m: 3e-3 }
        };
        Branch { name: "line0".into(), stations: (0..=10).map(station).collect() }
    }

    #[test]
    fn a_capped_tube_is_opened_at_both_ends_of_its_centre_line() {
        let mut triangles = capped();
        let found = ends(&[line(20e-3)]);
        assert_eq!(found.len(), 2);
        for end in &found {
            let (kept, changed) = opened(&triangles, end);
            assert!(changed >= AROUND, "{changed}");
            triangles = kept;
        }
        let (mesh, repairs) = Mesh::from_triangles(&triangles).unwrap();
        assert_eq!(repairs.figure.caps, 0);
        let openings = MeshWall::new(mesh, SurfaceModel::Faceted).openings;
        assert_eq!(openings.len(), 2);
        assert!(
            openings.iter().all(|opening| (opening.radius_m - 3e-3).abs() < 0.05e-3),
            "{openings:?}"
        );
    }

    #[test]
    fn an_end_in_another_branch_is_none_of_the_vessel() {
        let side = Branch {
            name: "line1".into(),
            stations: (0..=5)
                .map(|k| {
                    let s_m = 4e-3 * f64::from(k);
                    Station { s_m, position_m: Vector3::new(10e-3, s_m, 0.0), radius_m: 2e-3 }
                })
                .collect(),
        };
        let found = ends(&[line(20e-3), side]);
        assert_eq!(found.len(), 3);
        assert!(found.iter().any(|end| (end.position_m.y - 20e-3).abs() < 1e-9));
    }
}
