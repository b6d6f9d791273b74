//! Corners of facets that lie on the edge of another facet, as in many meshes from CAD. The surface has
//! no gap there, yet no two facets share an edge; the facet with the long edge is split.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::mesh::{RIM, next};
use super::weld::WELD_M;

/// A corner lies on an edge when it is no farther from it \[m\]; f32 rounds far less.
const ON_EDGE_M: f64 = 2.0 * WELD_M;
/// A surface with more edges at rims is a set of loose facets; it is not stitched.
const MOST_RIM_EDGES: usize = 20_000;

type Edge = (u32, u32);

fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

/// Splits facets at the corners of others that lie on one of their edges, where that closes the
/// surface, one edge of a facet at a time. Returns the number of split facets; if any, twins must be
/// computed again.
pub(super) fn stitch(positions: &[Vector3<f64>], vertex: &mut Vec<u32>, twin: &[u32]) -> usize {
    let rim: Vec<usize> = (0..twin.len()).filter(|&h| twin[h] == RIM).collect();
    if rim.len() > MOST_RIM_EDGES {
        return 0;
    }
    let mut edges: HashSet<Edge> = rim.iter().map(|&h| edge(vertex[h], vertex[next(h)])).collect();
    let mut corners: Vec<u32> = edges.iter().flat_map(|&(a, b)| [a, b]).collect();
    corners.sort_unstable_by(|&a, &b| {
        positions[a as usize].x.total_cmp(&positions[b as usize].x).then(a.cmp(&b))
    });
    corners.dedup();
    let mut split = HashSet::new();
    for half_edge in rim {
        if split.contains(&(half_edge / 3)) {
            continue;
        }
        let [a, b] = [half_edge, next(half_edge)].map(|h| vertex[h]);
        let opposite = vertex[next(next(half_edge))];
        let on_edge = on_edge(positions, &corners, [a, b], opposite);
        let stops: Vec<u32> = [a].into_iter().chain(on_edge).chain([b]).collect();
        let parts = || stops.windows(2).map(|pair| edge(pair[0], pair[1]));
        if stops.len() == 2 || !parts().all(|part| edges.contains(&part)) {
            continue;
        }
        for part in parts().chain([edge(a, b)]) {
            edges.remove(&part);
        }
        split.insert(half_edge / 3);
        // Of the facet a, b, opposite the first part stays in its place.
        vertex[next(half_edge)] = stops[1];
        for pair in stops.windows(2).skip(1) {
            vertex.extend([pair[0], pair[1], opposite]);
        }
    }
    split.len()
}

/// Of `corners`, ordered by x, those that lie between the ends of an edge on it; in order.
fn on_edge(positions: &[Vector3<f64>], corners: &[u32], ends: [u32; 2], opposite: u32) -> Vec<u32> {
    let [a, b] = ends.map(|end| positions[end as usize]);
    let along = b - a;
    let (low, high) = (a.x.min(b.x) - ON_EDGE_M, a.x.max(b.x) + ON_EDGE_M);
    let first = corners.partition_point(|&corner| positions[corner as usize].x < low);
    let beside = corners[first..].iter().take_while(|&&c| positions[c as usize].x <= high);
    let mut on_edge: Vec<(f64, u32)> = beside
        .filter(|&&corner| corner != ends[0] && corner != ends[1] && corner != opposite)
        .filter_map(|&corner| {
            let from_a = positions[corner as usize] - a;
            let share = from_a.dot(&along) / along.norm_squared();
            let distance_m = (from_a - along * share).norm();
            (share > 0.0 && share < 1.0 && distance_m < ON_EDGE_M).then_some((share, corner))
        })
        .collect();
    on_edge.sort_by(|a, b| a.0.total_cmp(&b.0));
    on_edge.into_iter().map(|(_, corner)| corner).collect()
}
