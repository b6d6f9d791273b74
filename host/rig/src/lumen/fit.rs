//! Fits the stored distances where the wall bends faster than the grid.
//!
//! Around the crest between two branches, and where two walls are equally near, the distance
//! is not smooth on the scale of a cell, and the interpolant of exact nodes errs by tens of
//! micrometres in the cells between them. Moving the nodes' distances a little evens that out
//! at no cost on the device: least squares at probes within the cells, weighted towards the
//! largest errors, held to the exact distances by a ridge.

use cathforce_mechanics::{BRICK_CELLS, BRICK_EDGE};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::build::{Brick, Field, Node};
use super::grid::{Place, steps};
use crate::geometry::Wall;

/// Cells in which the interpolant errs by more than this are fitted \[m\].
const TOLERANCE_M: f64 = 30e-6;
/// It can only where nodes contradict each other by more than this \[m\].
const CONTRADICTION_M: f64 = 8e-6;
/// Probes along an edge of a cell.
const PROBES: usize = 4;
/// Points farther outside the wall are not fitted \[m\].
pub(super) const DEEPEST_INDENTATION_M: f64 = 0.5e-3;
/// Rounds of weighting, and sweeps over all nodes in each.
const ROUNDS: usize = 10;
const SWEEPS: usize = 10;
/// An error of this size doubles the weight of its probe in a round \[m\].
const WEIGHED_M: f64 = 10e-6;
/// Weight of a node's exact distance, over that of a probe next to the node.
const RIDGE: f64 = 0.01;

/// Corner k of a cell is up along x, y, z by bits 0, 1, 2 of k.
fn corner(k: usize) -> Place {
    [k & 1, k >> 1 & 1, k >> 2 & 1]
}

/// A cell: its first node, and its corners as indices into [`Field::nodes`].
struct Cell {
    place: Place,
    corners: [u32; 8],
}

/// Where the field should have the wall's distance.
struct Probe {
    corners: [u32; 8],
    /// Trilinear weights of the corners.
    weights: [f64; 8],
    /// Exact less interpolated \[m\].
    error_m: f64,
}

/// Moves the nodes of `field` to where its interpolant errs least from `wall`.
pub(super) fn fit(field: &mut Field, wall: &dyn Wall) {
    let cells = cells(field);
    let mut moves = vec![false; field.nodes.len()];
    let bad: Vec<&Cell> = cells
        .par_iter()
        .filter(|cell| contradicts(field, cell))
        .filter(|cell| probes(field, wall, cell).iter().any(|p| p.error_m.abs() > TOLERANCE_M))
        .collect();
    for cell in bad {
        for &node in &cell.corners {
            moves[node as usize] = true;
        }
    }
    let mut probes: Vec<Probe> = cells
        .par_iter()
        .filter(|cell| cell.corners.iter().any(|&node| moves[node as usize]))
        .flat_map_iter(|cell| probes(field, wall, cell))
        .collect();

    let mut touching = vec![Vec::new(); field.nodes.len()];
    for (index, probe) in probes.iter().enumerate() {
        for (&node, &weight) in probe.corners.iter().zip(&probe.weights) {
            if moves[node as usize] {
                touching[node as usize].push((index, weight));
            }
        }
    }
    descend(field, &mut probes, &touching);
}

/// All cells of stored bricks.
fn cells(field: &Field) -> Vec<Cell> {
    let mut cells = Vec::new();
    for (entry, brick) in field.bricks.iter().enumerate() {
        let Brick::Stored(nodes) = brick else { continue };
        let [x, y, z] = field.grid.first_node(entry);
        for index in 0..BRICK_CELLS.pow(3) {
            let (i, j, k) = (
                index % BRICK_CELLS,
                index / BRICK_CELLS % BRICK_CELLS,
                index / BRICK_CELLS.pow(2),
            );
            let corners = std::array::from_fn(|c| {
                let [di, dj, dk] = corner(c);
                nodes[i + di + BRICK_EDGE * (j + dj + BRICK_EDGE * (k + dk))]
            });
            cells.push(Cell { place: [x + i, y + j, z + k], corners });
        }
    }
    cells
}

/// Along an edge of a smooth field the distance changes by the mean slope of its ends.
fn contradicts(field: &Field, cell: &Cell) -> bool {
    let nodes = cell.corners.map(|node| &field.nodes[node as usize]);
    let in_band = |node: &&Node| {
        node.distance_m > -DEEPEST_INDENTATION_M - field.grid.cell_m
            && node.distance_m < field.options.inside_m + field.grid.cell_m
    };
    nodes.iter().any(in_band)
        && (0..8).any(|low| {
            (0..3).filter(|axis| low >> axis & 1 == 0).any(|axis| {
                let (a, b) = (nodes[low], nodes[low | 1 << axis]);
                let slope = 0.5 * (a.normal()[axis] + b.normal()[axis]);
                let rise_m = b.distance_m - a.distance_m;
                (rise_m - slope * field.grid.cell_m).abs() > CONTRADICTION_M
            })
        })
}

/// The probes of a cell where an instrument's centre line can be.
fn probes(field: &Field, wall: &dyn Wall, cell: &Cell) -> Vec<Probe> {
    let mut probes = Vec::new();
    for index in 0..PROBES.pow(3) {
        let share = Vector3::new(index % PROBES, index / PROBES % PROBES, index / PROBES.pow(2))
            .map(|i| (i as f64 + 0.5) / PROBES as f64);
        let exact = wall.sample(&field.grid.position_m(steps(cell.place) + share));
        let touched =
            exact.distance_m > -DEEPEST_INDENTATION_M && exact.distance_m < field.options.inside_m;
        if !touched || exact.beyond_m > 0.0 {
            continue;
        }
        let mut error_m = exact.distance_m;
        let weights = std::array::from_fn(|c| {
            let from_corner = share - steps(corner(c));
            let weight: f64 = from_corner.iter().map(|x| 1.0 - x.abs()).product();
            let node = &field.nodes[cell.corners[c] as usize];
            let tangent_m = node.normal().dot(&from_corner) * field.grid.cell_m;
            error_m -= weight * (node.distance_m + 0.5 * tangent_m);
            weight
        });
        probes.push(Probe { corners: cell.corners, weights, error_m });
    }
    probes
}

/// Coordinate descent on the weighted squares. `touching`: by node, the probes that it moves,
/// with its weight there.
fn descend(field: &mut Field, probes: &mut [Probe], touching: &[Vec<(usize, f64)>]) {
    let mut moved_m = vec![0.0; field.nodes.len()];
    let mut importance = vec![1.0; probes.len()];
    for _ in 0..ROUNDS {
        for (importance, probe) in importance.iter_mut().zip(&*probes) {
            *importance += (probe.error_m / WEIGHED_M).powi(2);
        }
        for _ in 0..SWEEPS {
            for (node, touching) in touching.iter().enumerate().filter(|(_, t)| !t.is_empty()) {
                let ridge = RIDGE * touching.len() as f64;
                let (mut pull_m, mut weight) = (-ridge * moved_m[node], ridge);
                for &(probe, share) in touching {
                    pull_m += importance[probe] * share * probes[probe].error_m;
                    weight += importance[probe] * share * share;
                }
                let step_m = pull_m / weight;
                moved_m[node] += step_m;
                for &(probe, share) in touching {
                    probes[probe].error_m -= share * step_m;
                }
            }
        }
    }
    for (node, moved_m) in field.nodes.iter_mut().zip(moved_m) {
        node.distance_m += moved_m;
    }
}
