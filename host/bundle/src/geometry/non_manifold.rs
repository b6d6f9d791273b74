//! Edges that more than two facets share: doubled facets, fins and membranes, which no lumen has.
//!
//! The surface is taken apart along these edges. At each of them the two largest sheets stay, and smaller
//! ones are left out, as long as they are little of the surface.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::mesh::next;

/// Share of the surface that may be left out. A membrane across a vessel is less; more may be a part of
/// the lumen.
const MOST_LEFT_OUT: f64 = 0.05;

/// What was left out along such edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonManifold {
    pub edges: usize,
    pub facets: usize,
    /// One of the edges \[mm\].
    pub at_mm: [f64; 3],
}

type Edge = (u32, u32);

/// The facets at each edge.
fn by_edge(vertex: &[u32]) -> HashMap<Edge, Vec<u32>> {
    let mut facets: HashMap<Edge, Vec<u32>> = HashMap::with_capacity(vertex.len() / 2);
    for half_edge in 0..vertex.len() {
        let (a, b) = (vertex[half_edge], vertex[next(half_edge)]);
        facets.entry((a.min(b), a.max(b))).or_default().push(half_edge as u32 / 3);
    }
    facets
}

/// Leaves out facets until no edge has more than two. `Err` with the number of edges and a place \[mm\]:
/// what is too much would have to go.
pub(super) fn leave_out(
    positions: &[Vector3<f64>],
    vertex: &mut Vec<u32>,
) -> Result<Option<NonManifold>, (usize, [f64; 3])> {
    let at_mm = |edge: &Edge| -> [f64; 3] {
        ((positions[edge.0 as usize] + positions[edge.1 as usize]) * 500.0).into()
    };
    let facets = by_edge(vertex);
    let mut bad: Vec<&Edge> =
        facets.iter().filter(|(_, own)| own.len() > 2).map(|(edge, _)| edge).collect();
    bad.sort_unstable();
    let Some(first) = bad.first() else { return Ok(None) };
    let (edges, first_mm) = (bad.len(), at_mm(first));
    let area = |facet: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| positions[vertex[3 * facet + k] as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let count = vertex.len() / 3;
    let mut is_out = doubled(vertex);
    let sheets = sheets(vertex, &facets, &is_out);
    let mut areas: HashMap<usize, f64> = HashMap::new();
    for facet in (0..count).filter(|&facet| !is_out[facet]) {
        *areas.entry(sheets[facet]).or_default() += area(facet);
    }
    for edge in &bad {
        let mut own: Vec<u32> =
            facets[edge].iter().copied().filter(|&facet| !is_out[facet as usize]).collect();
        own.sort_by(|&a, &b| {
            let area = |facet: u32| areas[&sheets[facet as usize]];
            area(b).total_cmp(&area(a)).then(a.cmp(&b))
        });
        for &facet in own.iter().skip(2) {
            let sheet = sheets[facet as usize];
            (0..count)
                .filter(|&other| sheets[other] == sheet)
                .for_each(|other| is_out[other] = true);
        }
    }
    let all: f64 = (0..count).map(area).sum();
    let out: f64 = (0..count).filter(|&facet| is_out[facet]).map(area).sum();
    if out > MOST_LEFT_OUT * all {
        return Err((edges, first_mm));
    }
    let kept = (0..count).filter(|&facet| !is_out[facet]);
    let kept: Vec<u32> = kept.flat_map(|facet| vertex[3 * facet..3 * facet + 3].to_vec()).collect();
    let left_out = NonManifold { edges, facets: count - kept.len() / 3, at_mm: first_mm };
    *vertex = kept;
    // A sheet that touches itself along an edge is in the way still.
    match by_edge(vertex).values().any(|own| own.len() > 2) {
        true => Err((edges, first_mm)),
        false => Ok(Some(left_out)),
    }
}

/// Facets whose three corners an earlier one has too.
fn doubled(vertex: &[u32]) -> Vec<bool> {
    let mut seen = std::collections::HashSet::new();
    let facet = |corners: &[u32]| {
        let mut corners = [corners[0], corners[1], corners[2]];
        corners.sort_unstable();
        !seen.insert(corners)
    };
    vertex.chunks_exact(3).map(facet).collect()
}

/// The sheet of each facet: those that are joined by edges of two facets.
fn sheets(vertex: &[u32], facets: &HashMap<Edge, Vec<u32>>, is_out: &[bool]) -> Vec<usize> {
    let mut sheet = vec![usize::MAX; vertex.len() / 3];
    let mut queue = Vec::new();
    for start in 0..sheet.len() {
        if sheet[start] != usize::MAX || is_out[start] {
            continue;
        }
        sheet[start] = start;
        queue.push(start);
        while let Some(facet) = queue.pop() {
            for half_edge in 3 * facet..3 * facet + 3 {
                let (a, b) = (vertex[half_edge], vertex[next(half_edge)]);
                let own = &facets[&(a.min(b), a.max(b))];
                let own =
                    || own.iter().map(|&other| other as usize).filter(|&other| !is_out[other]);
                if own().count() > 2 {
                    continue;
                }
                for other in own().collect::<Vec<_>>() {
                    if sheet[other] == usize::MAX {
                        sheet[other] = start;
                        queue.push(other);
                    }
                }
            }
        }
    }
    sheet
}
