//! The wall as triangles, from the distance field that the device reads.
//!
//! Naive surface nets (Gibson 1998): one vertex in every cell whose corners differ in sign,
//! at the mean of the crossings of its edges; one quadrilateral around every crossed edge.

use std::collections::HashMap;

use cathforce_mechanics::{BRICK_CELLS, Lumen};
use nalgebra::Vector3;

/// Triangles with a normal at every vertex; lengths in metres, normals into the lumen.
#[derive(Debug, Default)]
pub struct Surface {
    pub vertices: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Distances beyond this are the field's way of saying "far away".
const FAR_M: f32 = 0.5;

/// The surface where the distance is zero. Openings stay open.
pub fn extract(lumen: &Lumen<'_>) -> Surface {
    let header = lumen.header();
    let cells = header.bricks.map(|b| usize::from(b) * BRICK_CELLS);
    let place = |index: [usize; 3]| {
        Vector3::from(std::array::from_fn::<f32, 3, _>(|k| {
            header.origin_m[k] + index[k] as f32 * header.cell_m
        }))
    };
    // One plane of cells at a time needs two planes of samples.
    let plane = |z: usize| -> Vec<f32> {
        let mut samples = Vec::with_capacity((cells[0] + 1) * (cells[1] + 1));
        for y in 0..=cells[1] {
            for x in 0..=cells[0] {
                samples.push(lumen.sample(<[f32; 3]>::from(place([x, y, z]))).distance_m);
            }
        }
        samples
    };
    let mut nets =
        Nets { surface: Surface::default(), vertex_of: HashMap::new(), edges: Vec::new() };
    let mut low = plane(0);
    for z in 0..cells[2] {
        let high = plane(z + 1);
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let at = |dx: usize, dy: usize, samples: &[f32]| {
                    samples[x + dx + (y + dy) * (cells[0] + 1)]
                };
                let corners: [f32; 8] = std::array::from_fn(|c| {
                    at(c & 1, c >> 1 & 1, if c < 4 { &low } else { &high })
                });
                nets.cell([x, y, z], &corners, lumen, place([x, y, z]), header.cell_m);
            }
        }
        low = high;
    }
    nets.finish()
}

struct Nets {
    surface: Surface,
    vertex_of: HashMap<[usize; 3], u32>,
    /// Cell at the high end of the edge's first corner, axis, and whether the edge leaves the
    /// lumen along it.
    edges: Vec<([usize; 3], usize, bool)>,
}

impl Nets {
    fn cell(
        &mut self,
        cell: [usize; 3],
        corners: &[f32; 8],
        lumen: &Lumen<'_>,
        first: Vector3<f32>,
        size_m: f32,
    ) {
        let inside = corners.iter().filter(|&&d| d > 0.0).count();
        if inside == 0 || inside == 8 || corners.iter().any(|d| d.abs() > FAR_M) {
            return;
        }
        let (mut sum, mut crossings) = (Vector3::zeros(), 0.0_f32);
        for axis in 0..3 {
            for from in (0..8).filter(|c| c >> axis & 1 == 0) {
                let (a, b) = (corners[from], corners[from | 1 << axis]);
                if (a > 0.0) != (b > 0.0) {
                    let mut point =
                        Vector3::from(std::array::from_fn::<f32, 3, _>(|k| (from >> k & 1) as f32));
                    point[axis] = a / (a - b);
                    sum += point;
                    crossings += 1.0;
                }
            }
            // The edge from the cell's first corner belongs to this cell alone.
            let (a, b) = (corners[0], corners[1 << axis]);
            if (a > 0.0) != (b > 0.0) {
                self.edges.push((cell, axis, a > 0.0));
            }
        }
        let point = first + sum * (size_m / crossings);
        self.vertex_of.insert(cell, self.surface.vertices.len() as u32);
        self.surface.vertices.push(point.into());
        self.surface.normals.push(lumen.sample(<[f32; 3]>::from(point)).normal.into());
    }

    fn finish(mut self) -> Surface {
        for &(cell, axis, leaves) in &self.edges {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let vertex = |du: usize, dv: usize| {
                let mut at = cell;
                at[u] = at[u].checked_sub(du)?;
                at[v] = at[v].checked_sub(dv)?;
                self.vertex_of.get(&at).copied()
            };
            let corners = [vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1)];
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
            // Counter-clockwise as seen from inside the lumen.
            let (b, d) = if leaves { (d, b) } else { (b, d) };
            self.surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
        self.surface
    }
}

#[cfg(test)]
mod tests {
    use cathforce_mechanics::{BRICK_EDGE, LumenHeader};

    use super::*;

    /// A ball of radius 9 mm in a cube of 6³ bricks of 1 mm cells, all stored.
    fn ball() -> (LumenHeader, Vec<u8>) {
        let header = LumenHeader {
            origin_m: [-0.012; 3],
            cell_m: 1e-3,
            distance_unit_m: 1e-6,
            bricks: [6; 3],
            stored: 216,
        };
        let mut bytes: Vec<u8> = (0..216_u16).flat_map(u16::to_le_bytes).collect();
        for brick in 0..216 {
            let corner = [brick % 6, brick / 6 % 6, brick / 36];
            for node in 0..BRICK_EDGE.pow(3) {
                let local = [node % 5, node / 5 % 5, node / 25];
                let at: [f32; 3] =
                    std::array::from_fn(|k| -0.012 + 1e-3 * (corner[k] * 4 + local[k]) as f32);
                let radius_m = Vector3::from(at).norm();
                bytes.extend((((9e-3 - radius_m) * 1e6) as i16).to_le_bytes());
                let code = |x: f32| (-x / radius_m.max(1e-6) * 127.0) as i8 as u8;
                bytes.extend(at.map(code));
                bytes.push(128);
            }
        }
        (header, bytes)
    }

    #[test]
    fn a_ball_is_closed_round_and_faces_inwards() {
        let (header, bytes) = ball();
        let surface = extract(&Lumen::new(header, &bytes).unwrap());
        assert!(surface.vertices.len() > 500);
        for vertex in &surface.vertices {
            assert!((Vector3::from(*vertex).norm() - 9e-3).abs() < 1.5e-4);
        }
        // Closed: every edge is passed once each way.
        let mut passes = HashMap::new();
        for [a, b, c] in &surface.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *passes.entry((*from, *to)).or_insert(0) += 1;
            }
        }
        assert!(passes.iter().all(|((a, b), n)| *n == 1 && passes.contains_key(&(*b, *a))));
        for [a, b, c] in &surface.triangles {
            let [a, b, c] = [a, b, c].map(|&i| Vector3::from(surface.vertices[i as usize]));
            let outwards = (b - a).cross(&(c - a)).dot(&a.normalize());
            // Vertices that meet at a node of the grid span a sliver, with no direction.
            assert!(outwards <= 1e-6 * header.cell_m * header.cell_m, "a face looks outwards");
        }
    }
}
