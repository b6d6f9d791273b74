//! The cross-section of the deformed vessel in an image plane.

use nalgebra::{Vector2, Vector3};

use crate::probe::Pose;

/// Each triangle of the wall is cut into so many parts a side. The wall is round within a triangle; at
/// 20 triangles around a vessel, parts of 1/4 leave (π/80)²/2 = 0.08 % of the radius between arc and
/// chord.
const PARTS: usize = 4;

/// Closed curves in the image plane, as line segments in no order. A point is (lateral, depth) in mm,
/// from the middle of the probe's face; depth is counted down from the unloaded top face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    pub segments_mm: Vec<[Vector2<f64>; 2]>,
}

impl Section {
    /// Cuts a wall: triangles with six nodes, corners first, and the places of the nodes.
    pub fn of(triangles: &[[u32; 6]], places_mm: &[Vector3<f64>], pose: &Pose) -> Self {
        let (origin, lateral, normal) = (pose.origin_mm(), pose.lateral(), pose.normal());
        // Lateral, depth, and distance from the plane.
        let local: Vec<Vector3<f64>> = places_mm
            .iter()
            .map(|p| {
                let from = p - origin;
                Vector3::new(from.dot(&lateral), -from.z, from.dot(&normal))
            })
            .collect();
        let mut segments_mm = Vec::new();
        for triangle in triangles {
            let nodes = triangle.map(|node| local[node as usize]);
            let is_before = nodes.map(|p| p.z < 0.0);
            if is_before.iter().all(|before| *before == is_before[0]) {
                continue;
            }
            cut_triangle(&nodes, &mut segments_mm);
        }
        Self { segments_mm }
    }

    /// Area and centroid, by Green's theorem: A = ½ Σ p × q, c = (1/6A) Σ (p + q)(p × q) over the
    /// segments from p to q. Segments run round the vessel in one direction, because the triangles of
    /// the wall do.
    pub fn area_and_centroid_mm(&self) -> (f64, Vector2<f64>) {
        let (mut area, mut moment) = (0.0, Vector2::zeros());
        for [p, q] in &self.segments_mm {
            let cross = p.x * q.y - p.y * q.x;
            area += 0.5 * cross;
            moment += (p + q) * (cross / 6.0);
        }
        (area.abs(), moment / area)
    }

    /// The same curves elsewhere.
    pub fn moved(&self, by_mm: Vector2<f64>) -> Self {
        let moved = |segment: &[Vector2<f64>; 2]| segment.map(|p| p + by_mm);
        Self { segments_mm: self.segments_mm.iter().map(moved).collect() }
    }

    /// The same curves, so much farther out from their centroid as a circle of their area would grow
    /// by this radius.
    pub fn grown(&self, by_mm: f64) -> Self {
        let (area, centre) = self.area_and_centroid_mm();
        let scale = 1.0 + by_mm / (area / std::f64::consts::PI).sqrt();
        let grown = |segment: &[Vector2<f64>; 2]| segment.map(|p| centre + (p - centre) * scale);
        Self { segments_mm: self.segments_mm.iter().map(grown).collect() }
    }

    /// The points of the curves in order round the centroid, closed, for a drawing.
    pub fn outline_mm(&self) -> Vec<Vector2<f64>> {
        let (_, centre) = self.area_and_centroid_mm();
        let mut points: Vec<Vector2<f64>> = self.segments_mm.iter().map(|[p, _]| *p).collect();
        let angle = |p: &Vector2<f64>| (p.y - centre.y).atan2(p.x - centre.x);
        points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        points.extend(points.first().copied());
        points
    }
}

fn cut_triangle(nodes: &[Vector3<f64>; 6], segments_mm: &mut Vec<[Vector2<f64>; 2]>) {
    let at = |i: usize, j: usize| {
        let (a, b) = (i as f64 / PARTS as f64, j as f64 / PARTS as f64);
        let l = [1.0 - a - b, a, b];
        let corners = (0..3).map(|k| nodes[k] * (l[k] * (2.0 * l[k] - 1.0)));
        let middles = (0..3).map(|k| nodes[3 + k] * (4.0 * l[k] * l[(k + 1) % 3]));
        corners.chain(middles).sum::<Vector3<f64>>()
    };
    for i in 0..PARTS {
        for j in 0..PARTS - i {
            cut_part([at(i, j), at(i + 1, j), at(i, j + 1)], segments_mm);
            if i + j + 2 <= PARTS {
                cut_part([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], segments_mm);
            }
        }
    }
}

/// Adds the segment in which a flat triangle meets the plane, from where its outline enters the plane's
/// far side to where it leaves it.
fn cut_part(corners: [Vector3<f64>; 3], segments_mm: &mut Vec<[Vector2<f64>; 2]>) {
    let (mut enters, mut leaves) = (None, None);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        if (p.z < 0.0) != (q.z < 0.0) {
            let crossing = (p + (q - p) * (p.z / (p.z - q.z))).xy();
            *(if p.z < 0.0 { &mut enters } else { &mut leaves }) = Some(crossing);
        }
    }
    if let (Some(from), Some(to)) = (enters, leaves) {
        segments_mm.push([from, to]);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::block::{Block, Elements};

    /// A plane at an angle β to a vessel's cross-section cuts an ellipse of area πr²/cos β.
    #[test]
    fn an_oblique_cut_of_a_round_vessel_is_an_ellipse() {
        let block = Block {
            size_mm: [80.0, 50.0, 30.0],
            vessel_diameter_mm: 8.0,
            vessel_depth_mm: 11.0,
            vessel_aside_mm: 2.0,
        };
        let mesh = block.mesh(Elements { outwards: 2, around: 20, along: 9 }).unwrap();
        for turn_deg in [0.0_f64, 30.0] {
            let pose = Pose { at_mm: [1.7, 0.5], turn_deg };
            let section = Section::of(&mesh.inner, &mesh.nodes_mm, &pose);
            let (area, centroid) = section.area_and_centroid_mm();
            let expected = 16.0 * PI / turn_deg.to_radians().cos();
            assert!((area / expected - 1.0).abs() < 2e-3, "{turn_deg}: {area}, not {expected}");
            let lateral = 1.5 / turn_deg.to_radians().cos();
            assert!((centroid - Vector2::new(lateral, 11.0)).norm() < 1e-2, "{centroid}");
            let moved = section.moved(Vector2::new(1.0, -2.0)).area_and_centroid_mm();
            assert!((moved.0 - area).abs() < 1e-9);
            let radius = |area: f64| (area / PI).sqrt();
            let grown = section.grown(0.2).area_and_centroid_mm();
            assert!((radius(grown.0) - radius(area) - 0.2).abs() < 1e-9);
            assert!((grown.1 - centroid).norm() < 1e-9);
            assert!((moved.1 - centroid - Vector2::new(1.0, -2.0)).norm() < 1e-9);
        }
    }
}
