//! One vertex for corners that are the same point but for rounding.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::wall::Triangle;

/// Corners within one cell of this size are one \[m\], and so are neighbours across its border
/// that are nearer than half of it.
pub(super) const WELD_M: f64 = 1e-7;

type Cell = [i64; 3];

/// One vertex for corners that coincide; triangles without area are left out.
pub(super) fn weld(triangles: &[Triangle]) -> (Vec<Vector3<f64>>, Vec<u32>) {
    let mut welder = Welder::default();
    let mut vertex = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let corners = triangle.map(|p| welder.vertex(p));
        if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
            vertex.extend(corners);
        }
    }
    (welder.positions, vertex)
}

#[derive(Default)]
struct Welder {
    positions: Vec<Vector3<f64>>,
    index_of: HashMap<Cell, u32>,
}

impl Welder {
    fn vertex(&mut self, p: Vector3<f64>) -> u32 {
        let cell: Cell = [p.x, p.y, p.z].map(|x| (x / WELD_M).round() as i64);
        if let Some(&index) = self.index_of.get(&cell) {
            return index;
        }
        let index = self.across_border(&p, cell).unwrap_or_else(|| {
            self.positions.push(p);
            self.positions.len() as u32 - 1
        });
        self.index_of.insert(cell, index);
        index
    }

    /// The nearest vertex of the cells that lie within half a cell of `p`.
    fn across_border(&self, p: &Vector3<f64>, cell: Cell) -> Option<u32> {
        // Towards the nearer border on each axis: what lies farther is too far.
        let side = [0, 1, 2].map(|k| if p[k] / WELD_M < cell[k] as f64 { -1 } else { 1 });
        let beside = (1..8).filter_map(|step| {
            // Corners beyond 10¹¹ m share the last cells; no lumen is built of a mesh so large.
            let shift = |k: usize| cell[k].saturating_add(side[k] * i64::from(step >> k & 1));
            self.index_of.get(&[shift(0), shift(1), shift(2)]).copied()
        });
        let distance_m = |index: u32| (self.positions[index as usize] - p).norm();
        let near = beside.map(|index| (distance_m(index), index));
        let near = near.filter(|(distance_m, _)| *distance_m < 0.5 * WELD_M);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
    }
}
