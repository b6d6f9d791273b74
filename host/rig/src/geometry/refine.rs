//! Refinement of a mesh onto the curved surface that its vertices and normals imply.
//!
//! The vertices of an exported vessel lie on the wall, its facets cut the corner: on average
//! they stand inside by a third of the sagitta L²/8R of their edges. Every edge becomes the
//! cubic that meets both end points and is normal to both normals; triangles are split in
//! four through the middles of their edges. A cubic edge is reproduced exactly, so the
//! facets' error falls by four a round.

use nalgebra::Vector3;

use super::mesh::{Mesh, RIM, next};

/// Facets are accurate enough when 95 % of the edges have a smaller sagitta \[m\].
const SAGITTA_M: f64 = 0.5e-6;
/// No refinement beyond this many triangles.
const MOST_TRIANGLES: usize = 1_500_000;

/// The middle of a curved edge.
struct Middle {
    /// From the middle of the chord \[m\].
    offset: Vector3<f64>,
    normal: Vector3<f64>,
}

/// Cubic Hermite edge from `a` to `b` with unit normals `na`, `nb` at its ends.
fn middle(a: Vector3<f64>, na: Vector3<f64>, b: Vector3<f64>, nb: Vector3<f64>) -> Middle {
    let chord = b - a;
    let length_squared = chord.norm_squared();
    let mean = na + nb;
    let along = mean.dot(&chord) / length_squared;
    let across = mean - chord * along;
    let Some(up) = across.try_normalize(1e-9) else {
        return Middle { offset: Vector3::zeros(), normal: na };
    };
    // With end slopes s (height over chord), the middle stands L (s_a − s_b)/8 above the
    // chord and its slope is −(s_a + s_b)/4; the slope at an end is −(n·t)/(n·up).
    let height = -(na.dot(&chord) / na.dot(&up) - nb.dot(&chord) / nb.dot(&up)) / 8.0;
    // A fold sharper than a smooth surface can make keeps its chord.
    let height = if height.abs() < 0.25 * length_squared.sqrt() { height } else { 0.0 };
    let normal = (across - chord * (0.5 * along)).normalize();
    Middle { offset: up * height, normal }
}

impl Mesh {
    /// Refines until the facets are accurate to well below a micrometre, or there are too
    /// many. Returns the rounds.
    pub(crate) fn refine(&mut self) -> usize {
        let mut rounds = 0;
        while 4 * self.len() <= MOST_TRIANGLES && self.sagitta_p95_m() > SAGITTA_M {
            *self = self.split();
            rounds += 1;
        }
        rounds
    }

    fn edge_middle(&self, half_edge: usize) -> Middle {
        let end = next(half_edge);
        let position = |corner: usize| self.positions[self.vertex[corner] as usize];
        let normal = |corner: usize| self.normals[self.corner_normal[corner] as usize];
        middle(position(half_edge), normal(half_edge), position(end), normal(end))
    }

    /// Sagitta that 95 % of the edges stay below \[m\].
    pub(crate) fn sagitta_p95_m(&self) -> f64 {
        let mut all: Vec<f64> =
            (0..self.vertex.len()).map(|h| self.edge_middle(h).offset.norm()).collect();
        let at = all.len() * 95 / 100;
        *all.select_nth_unstable_by(at, f64::total_cmp).1
    }

    /// Splits every triangle in four. Child k of triangle t is `4 t + k` at corner k, child 3
    /// is the middle one.
    fn split(&self) -> Mesh {
        let half_edges = self.vertex.len();
        let mut positions = self.positions.clone();
        let mut beyond_m = self.beyond_m.clone();
        let mut normals = self.normals.clone();
        let mut middle_vertex = vec![0_u32; half_edges];
        let mut middle_normal = vec![0_u32; half_edges];
        for half_edge in 0..half_edges {
            let twin = self.twin[half_edge];
            if twin != RIM && (twin as usize) < half_edge {
                continue;
            }
            let ends = [half_edge, next(half_edge)];
            let chord_middle = 0.5
                * ends
                    .map(|h| self.positions[self.vertex[h] as usize])
                    .iter()
                    .sum::<Vector3<f64>>();
            let mut here = self.edge_middle(half_edge);
            middle_vertex[half_edge] = positions.len() as u32;
            middle_normal[half_edge] = normals.len() as u32;
            normals.push(here.normal);
            if twin != RIM {
                let twin = twin as usize;
                let smooth = self.corner_normal[half_edge] == self.corner_normal[next(twin)]
                    && self.corner_normal[next(half_edge)] == self.corner_normal[twin];
                middle_vertex[twin] = positions.len() as u32;
                middle_normal[twin] = middle_normal[half_edge];
                if !smooth {
                    let there = self.edge_middle(twin);
                    here.offset = 0.5 * (here.offset + there.offset);
                    middle_normal[twin] = normals.len() as u32;
                    normals.push(there.normal);
                }
            }
            positions.push(chord_middle + here.offset);
            let [a, b] = ends.map(|h| self.beyond_m[self.vertex[h] as usize]);
            beyond_m.push(0.5 * (a + b));
        }

        let corners = |own: &[u32], middle: &[u32]| -> Vec<u32> {
            let triangles = own.as_chunks::<3>().0.iter().zip(middle.as_chunks::<3>().0);
            triangles
                .flat_map(|(&[a, b, c], &[ab, bc, ca])| {
                    [a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]
                })
                .collect()
        };
        let vertex = corners(&self.vertex, &middle_vertex);
        let corner_normal = corners(&self.corner_normal, &middle_normal);

        let mut twin = vec![RIM; 4 * half_edges];
        for half_edge in 0..half_edges {
            let (t, k) = (half_edge / 3, half_edge % 3);
            // Between child k and the middle one.
            let (inner, of_middle) = (3 * (4 * t + k) + (k + 1) % 3, 3 * (4 * t + 3) + (k + 2) % 3);
            twin[inner] = of_middle as u32;
            twin[of_middle] = inner as u32;
            if self.twin[half_edge] == RIM {
                continue;
            }
            let (u, l) = (self.twin[half_edge] as usize / 3, self.twin[half_edge] as usize % 3);
            twin[3 * (4 * t + k) + k] = (3 * (4 * u + (l + 1) % 3) + l) as u32;
            twin[3 * (4 * t + (k + 1) % 3) + k] = (3 * (4 * u + l) + l) as u32;
        }
        Mesh { positions, beyond_m, vertex, twin, corner_normal, normals }
    }
}
