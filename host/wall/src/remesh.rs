//! Triangles of a chosen size on a wall that is known by its distance.
//!
//! A vessel's surface comes as a mesh of any quality, or as a centre line with radii. Both are
//! meshed anew from their distance: a vertex in every cell of a grid that the wall passes through
//! ("surface nets", Gibson, MERL TR99-24), moved onto the wall and evened out along it.

use std::collections::HashMap;

use cathforce_bundle::geometry::Wall;
use nalgebra::Vector3;
use thiserror::Error;

use crate::extrude::Surface;

/// Rounds that even the vertices out.
const ROUNDS: usize = 12;
/// Most points of a grid at which the wall is sampled.
const MOST_POINTS: usize = 3_000_000;
/// Millimetres in a metre.
const MM: f64 = 1e3;

/// Why a wall is not meshed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RemeshError {
    #[error(
        "elements of {element_mm} mm make a grid of {points} points, more than {MOST_POINTS}\n  fix: \
         choose larger elements with --element-mm, or cut the vessel to the part that matters"
    )]
    TooFine { element_mm: f64, points: usize },
    #[error(
        "elements of {element_mm} mm are too large for the vessel: nothing of its wall was found\n  \
         fix: choose smaller elements with --element-mm"
    )]
    TooCoarse { element_mm: f64 },
}

/// Samples on a grid \[mm\].
struct Grid<'a> {
    wall: &'a dyn Wall,
    low: Vector3<f64>,
    step: f64,
    size: [usize; 3],
    distances: Vec<f64>,
}

/// Meshes a wall up to its openings. `within`: a box to mesh only a part of it \[mm\].
pub fn remesh(
    wall: &dyn Wall,
    element_mm: f64,
    within: Option<(Vector3<f64>, Vector3<f64>)>,
) -> Result<Surface, RemeshError> {
    let grid = Grid::new(wall, element_mm, within)?;
    let mut number: HashMap<[usize; 3], u32> = HashMap::new();
    let mut vertices: Vec<Vector3<f64>> = Vec::new();
    let mut quads: Vec<[u32; 4]> = Vec::new();
    for edge in grid.crossings() {
        let corners = edge.cells();
        let quad = corners.map(|cell| {
            *number.entry(cell).or_insert_with(|| {
                vertices.push(grid.vertex(cell));
                vertices.len() as u32 - 1
            })
        });
        quads.push(if edge.into_lumen { quad } else { [quad[3], quad[2], quad[1], quad[0]] });
    }
    if quads.is_empty() {
        return Err(RemeshError::TooCoarse { element_mm });
    }
    for _ in 0..ROUNDS {
        even_out(&grid, &mut vertices, &quads);
    }
    let surface = without_ends(&grid, vertices, &quads);
    if surface.triangles.is_empty() {
        Err(RemeshError::TooCoarse { element_mm })
    } else {
        Ok(surface)
    }
}

/// An edge of the grid that the wall crosses.
struct Crossing {
    at: [usize; 3],
    axis: usize,
    into_lumen: bool,
}

impl Crossing {
    /// The four cells around it, by the right hand about the axis.
    fn cells(&self) -> [[usize; 3]; 4] {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        [[1, 1], [0, 1], [0, 0], [1, 0]].map(|[du, dv]| {
            let mut cell = self.at;
            cell[u] -= du;
            cell[v] -= dv;
            cell
        })
    }
}

impl<'a> Grid<'a> {
    fn new(
        wall: &'a dyn Wall,
        element_mm: f64,
        within: Option<(Vector3<f64>, Vector3<f64>)>,
    ) -> Result<Self, RemeshError> {
        let (mut low, mut high) = wall.bounds_m();
        (low, high) = (low * MM, high * MM);
        if let Some((from, to)) = within {
            (low, high) = (low.sup(&from), high.inf(&to));
        }
        // The surface nets of a grid have edges a little shorter than its step.
        let step = element_mm;
        low -= Vector3::repeat(1.5 * step);
        let cells = ((high - low) / step).map(|x| (x.max(0.0) + 2.5).ceil());
        let points = cells.iter().map(|n| n + 1.0).product::<f64>();
        if points > MOST_POINTS as f64 {
            return Err(RemeshError::TooFine { element_mm, points: points as usize });
        }
        let size = [0, 1, 2].map(|axis| cells[axis] as usize + 1);
        let mut grid = Self { wall, low, step, size, distances: Vec::new() };
        let mut distances = Vec::with_capacity(points as usize);
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    distances.push(grid.distance(&grid.place([i, j, k])));
                }
            }
        }
        grid.distances = distances;
        Ok(grid)
    }

    fn place(&self, at: [usize; 3]) -> Vector3<f64> {
        self.low + Vector3::new(at[0] as f64, at[1] as f64, at[2] as f64) * self.step
    }

    /// \[mm\], positive in the lumen.
    fn distance(&self, place: &Vector3<f64>) -> f64 {
        MM * self.wall.sample(&(place / MM)).distance_m
    }

    fn stored(&self, at: [usize; 3]) -> f64 {
        self.distances[at[0] + self.size[0] * (at[1] + self.size[1] * at[2])]
    }

    fn crossings(&self) -> Vec<Crossing> {
        let mut found = Vec::new();
        for k in 1..self.size[2] - 1 {
            for j in 1..self.size[1] - 1 {
                for i in 1..self.size[0] - 1 {
                    let at = [i, j, k];
                    for axis in 0..3 {
                        let mut next = at;
                        next[axis] += 1;
                        let (here, there) = (self.stored(at) > 0.0, self.stored(next) > 0.0);
                        if here != there {
                            found.push(Crossing { at, axis, into_lumen: there });
                        }
                    }
                }
            }
        }
        found
    }

    /// Mean of the places where the wall crosses the edges of a cell, moved onto the wall.
    fn vertex(&self, cell: [usize; 3]) -> Vector3<f64> {
        let corner = |bits: usize| {
            [cell[0] + (bits & 1), cell[1] + ((bits >> 1) & 1), cell[2] + (bits >> 2)]
        };
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for bits in 0..8_usize {
            for axis in 0..3 {
                let other = bits | (1 << axis);
                if other == bits {
                    continue;
                }
                let (a, b) = (self.stored(corner(bits)), self.stored(corner(other)));
                if (a > 0.0) != (b > 0.0) {
                    let share = a / (a - b);
                    sum += self.place(corner(bits)).lerp(&self.place(corner(other)), share);
                    count += 1.0;
                }
            }
        }
        self.onto(&(sum / f64::max(count, 1.0)))
    }

    /// The nearest place on the wall.
    fn onto(&self, place: &Vector3<f64>) -> Vector3<f64> {
        let mut place = *place;
        for _ in 0..2 {
            let seen = self.wall.sample(&(place / MM));
            place -= seen.normal * (seen.distance_m * MM).clamp(-self.step, self.step);
        }
        place
    }
}

/// Moves every vertex to the middle of its neighbours, along the wall.
fn even_out(grid: &Grid<'_>, vertices: &mut [Vector3<f64>], quads: &[[u32; 4]]) {
    let mut sums = vec![(Vector3::zeros(), 0.0); vertices.len()];
    for quad in quads {
        for k in 0..4 {
            let next = vertices[quad[(k + 1) % 4] as usize];
            let before = vertices[quad[(k + 3) % 4] as usize];
            let sum = &mut sums[quad[k] as usize];
            sum.0 += next + before;
            sum.1 += 2.0;
        }
    }
    for (vertex, (sum, count)) in vertices.iter_mut().zip(sums) {
        // Half of the way: the whole of it swings.
        let middle: Vector3<f64> = sum / count;
        *vertex = grid.onto(&vertex.lerp(&middle, 0.5));
    }
}

/// Triangles without those past an opening. Vertices that belong to none are left out.
fn without_ends(grid: &Grid<'_>, vertices: Vec<Vector3<f64>>, quads: &[[u32; 4]]) -> Surface {
    let is_inside: Vec<bool> =
        vertices.iter().map(|place| grid.wall.sample(&(place / MM)).beyond_m <= 0.0).collect();
    let mut surface = Surface::default();
    let mut number = vec![None; vertices.len()];
    for quad in quads.iter().filter(|quad| quad.iter().all(|v| is_inside[*v as usize])) {
        let [a, b, c, d] = quad.map(|vertex| {
            *number[vertex as usize].get_or_insert_with(|| {
                surface.vertices_mm.push(vertices[vertex as usize]);
                surface.vertices_mm.len() as u32 - 1
            })
        });
        let length = |p: u32, q: u32| {
            (surface.vertices_mm[p as usize] - surface.vertices_mm[q as usize]).norm()
        };
        if length(a, c) <= length(b, d) {
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            surface.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }
    surface
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::geometry::{Branch, Station, TubeWall};

    use super::*;

    #[test]
    fn a_tube_is_meshed_on_its_wall_and_faces_its_lumen() {
        let station = |x_m: f64| Station {
            s_m: x_m,
            position_m: Vector3::new(x_m, 0.0, 0.0),
            radius_m: 5e-3,
        };
        let stations = (0..=20).map(|k| station(2e-3 * f64::from(k))).collect();
        let wall = TubeWall::new(&[Branch { name: "tube".into(), stations }]);
        let surface = remesh(&wall, 1.5, None).unwrap();
        let place = |vertex: u32| surface.vertices_mm[vertex as usize];
        let mut area = 0.0;
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(place);
            let normal = (b - a).cross(&(c - a)) * 0.5;
            area += normal.norm();
            let middle = (a + b + c) / 3.0;
            assert!(normal.y * middle.y + normal.z * middle.z < 0.0, "{middle}");
        }
        for vertex in &surface.vertices_mm {
            assert!((vertex.yz().norm() - 5.0).abs() < 0.02, "{vertex}");
        }
        let ends = surface.vertices_mm.iter().map(|v| v.x);
        let (first, last) = (ends.clone().fold(f64::MAX, f64::min), ends.fold(0.0, f64::max));
        let expected = std::f64::consts::TAU * 5.0 * (last - first);
        assert!((0.0..2.0).contains(&first) && (38.0..=40.0).contains(&last), "{first} {last}");
        assert!((area / expected - 1.0).abs() < 0.05, "{area} mm², not {expected}");
        assert!(matches!(remesh(&wall, 1e-3, None), Err(RemeshError::TooFine { .. })));
    }
}
