//! Refines a mesh onto the curved surface given by its vertices and normals.
//!
//! The vertices of an exported vessel lie on the wall, its facets cut the corner: on average
//! they stand inside by a third of the sagitta L²/8R of their edges. Every edge becomes the
//! cubic that meets both end points and is normal to both normals; triangles are split in
//! four through the middles of their edges. A cubic edge is reproduced exactly, so the
//! facets' error falls by four a round. Slivers whose normals lean along them would fold over, and
//! a fold has no inner side: their edges stay straight.

use nalgebra::Vector3;

use super::mesh::{Mesh, RIM, next};
use super::wall::Triangle;

/// Facets are accurate enough when 95 % of the edges have a smaller sagitta \[m\].
const SAGITTA_M: f64 = 0.5e-6;
/// Cosine of the angle by which part of a facet may turn from it.
const LEAST_COSINE: f64 = 0.5;
/// Largest number of triangles after refinement.
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
        let facets: Vec<_> = (0..self.len()).map(|t| self.area_normal(t)).collect();
        let mut rounds = 0;
        while 4 * self.len() <= MOST_TRIANGLES && self.sagitta_p95_m() > SAGITTA_M {
            let offsets = self.offsets(|triangle| facets[triangle >> (2 * rounds)]);
            *self = self.split(&offsets);
            rounds += 1;
        }
        rounds
    }

    /// Largest distance of the vertices of a mesh, refined in `rounds`, from the planes of its facets,
    /// and the place \[m\]. Vertices past openings are ignored.
    pub(crate) fn farthest_from(
        &self,
        facets: &[Triangle],
        rounds: usize,
    ) -> Option<(f64, Vector3<f64>)> {
        let corners = (0..self.vertex.len()).filter_map(|corner| {
            let vertex = self.vertex[corner] as usize;
            let [a, b, c] = &facets[(corner / 3) >> (2 * rounds)];
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
            let at = self.positions[vertex];
            (self.beyond_m[vertex] == 0.0).then(|| (normal.dot(&(at - a)).abs(), at))
        });
        corners.max_by(|a, b| a.0.total_cmp(&b.0))
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

    /// Half edges that have the same normals on both sides.
    fn is_smooth(&self, half_edge: usize, twin: usize) -> bool {
        self.corner_normal[half_edge] == self.corner_normal[next(twin)]
            && self.corner_normal[next(half_edge)] == self.corner_normal[twin]
    }

    /// For each half-edge, the vector from the middle of its chord to that of the curved edge \[m\];
    /// zero where a triangle would fold over. `facet`: normal of the facet that a triangle is part of.
    fn offsets(&self, facet: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let of = |half_edge: usize| {
            let offset = |half_edge: usize| self.edge_middle(half_edge).offset;
            match self.twin[half_edge] {
                RIM => offset(half_edge),
                // The twin sets it below, so that both are equal to the last bit.
                twin if (twin as usize) < half_edge => Vector3::zeros(),
                twin if self.is_smooth(half_edge, twin as usize) => offset(half_edge),
                twin => 0.5 * (offset(half_edge) + offset(twin as usize)),
            }
        };
        let mut offsets: Vec<_> = (0..self.vertex.len()).map(of).collect();
        for half_edge in 0..offsets.len() {
            let twin = self.twin[half_edge];
            if twin != RIM && (twin as usize) < half_edge {
                offsets[half_edge] = offsets[twin as usize];
            }
        }
        let mut suspects: Vec<usize> = (0..self.len()).collect();
        while !suspects.is_empty() {
            let mut changed = Vec::new();
            for triangle in suspects {
                let edges = [3 * triangle, 3 * triangle + 1, 3 * triangle + 2];
                let is_straight = edges.iter().all(|&h| offsets[h] == Vector3::zeros());
                if is_straight || !self.folds(triangle, edges.map(|h| offsets[h]), facet(triangle))
                {
                    continue;
                }
                for half_edge in edges {
                    offsets[half_edge] = Vector3::zeros();
                    let twin = self.twin[half_edge];
                    if twin != RIM {
                        offsets[twin as usize] = Vector3::zeros();
                        changed.push(twin as usize / 3);
                    }
                }
            }
            suspects = changed;
        }
        offsets
    }

    /// Whether one of the four parts of a triangle turns far away from its facet.
    fn folds(&self, triangle: usize, offsets: [Vector3<f64>; 3], facet: Vector3<f64>) -> bool {
        let [a, b, c] = self.triangle(triangle);
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| 0.5 * (from + to));
        let [ab, bc, ca] = [ab + offsets[0], bc + offsets[1], ca + offsets[2]];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].iter().any(|[a, b, c]| {
            let normal = (b - a).cross(&(c - a));
            normal.dot(&facet) < LEAST_COSINE * normal.norm() * facet.norm()
        })
    }

    /// Splits every triangle in four. Child k of triangle t is `4 t + k` at corner k, child 3
    /// is the middle one. `offsets`: by half edge, from the middle of its chord.
    fn split(&self, offsets: &[Vector3<f64>]) -> Mesh {
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
            middle_vertex[half_edge] = positions.len() as u32;
            middle_normal[half_edge] = normals.len() as u32;
            normals.push(self.edge_middle(half_edge).normal);
            if twin != RIM {
                let twin = twin as usize;
                middle_vertex[twin] = positions.len() as u32;
                middle_normal[twin] = middle_normal[half_edge];
                if !self.is_smooth(half_edge, twin) {
                    middle_normal[twin] = normals.len() as u32;
                    normals.push(self.edge_middle(twin).normal);
                }
            }
            positions.push(chord_middle + offsets[half_edge]);
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
