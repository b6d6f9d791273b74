//! The grid of bricks around a wall.

use cathforce_mechanics::{BRICK_CELLS, BRICK_EDGE, BRICK_NODES, LumenHeader, OCTANTS};
use nalgebra::Vector3;

use super::options::LumenOptions;
use crate::geometry::Wall;

/// Largest number of bricks along an axis that the device accepts.
const MOST_ALONG_AXIS: usize = 1024;
/// Largest number of bricks that are examined: a directory of four times the device's room. A stray
/// corner of a vessel, metres away, would take hours otherwise.
const MOST_ENTRIES: usize = 1 << 22;

/// Half steps from the first node along x, y, z.
pub(super) type Place = [usize; 3];

/// A grid of bricks around a wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub origin_m: Vector3<f64>,
    pub bricks: [usize; 3],
    /// Spacing after rounding to f32, as the device reads it \[m\].
    pub cell_m: f64,
}

impl Grid {
    /// `None` when it would have too many bricks.
    pub fn around(wall: &dyn Wall, options: &LumenOptions) -> Option<Self> {
        let (low, high) = wall.bounds_m();
        let margin = Vector3::repeat(options.outside_m + options.cell_m);
        // Nodes at whole multiples of the spacing, so that the field of a vessel does not
        // change with the extent of its far branches. f32 holds the origin.
        let first = ((low - margin) / options.cell_m).map(f64::floor);
        let origin_m = (first * options.cell_m).map(|x| f64::from(x as f32));
        let brick_m = options.cell_m * BRICK_CELLS as f64;
        let size = (high + margin - origin_m) / brick_m;
        let bricks = [size.x, size.y, size.z].map(|n| (n.ceil() as usize).max(1));
        let fits = bricks.iter().all(|&n| n <= MOST_ALONG_AXIS)
            && bricks.iter().product::<usize>() <= MOST_ENTRIES;
        fits.then_some(Self { origin_m, bricks, cell_m: f64::from(options.cell_m as f32) })
    }

    /// The grid of a stored lumen.
    pub fn of(header: &LumenHeader) -> Self {
        Self {
            origin_m: Vector3::from(header.origin_m).map(f64::from),
            bricks: header.bricks.map(usize::from),
            cell_m: f64::from(header.cell_m),
        }
    }

    /// Bricks, stored or not.
    pub fn len(&self) -> usize {
        self.bricks.iter().product()
    }

    /// The first node of a brick.
    pub fn first_node(&self, entry: usize) -> Place {
        let [nx, ny, _] = self.bricks;
        [entry % nx, entry / nx % ny, entry / (nx * ny)].map(|brick| 2 * brick * BRICK_CELLS)
    }

    /// The nodes of a brick in the order in which they are stored.
    pub fn nodes(&self, entry: usize) -> impl Iterator<Item = Place> {
        nodes_from(self.first_node(entry), 2)
    }

    /// The nodes of the eight bricks of half the spacing that may stand for one.
    pub fn octants(&self, entry: usize) -> impl Iterator<Item = impl Iterator<Item = Place>> {
        let first = self.first_node(entry);
        (0..usize::from(OCTANTS)).map(move |octant| {
            let shift = |axis: usize| first[axis] + (octant >> axis & 1) * BRICK_CELLS;
            nodes_from([shift(0), shift(1), shift(2)], 1)
        })
    }

    /// Position of a node, or of a point between nodes \[m\].
    pub fn position_m(&self, half_steps: Vector3<f64>) -> Vector3<f64> {
        self.origin_m + half_steps * (0.5 * self.cell_m)
    }
}

fn nodes_from([x, y, z]: Place, half_steps: usize) -> impl Iterator<Item = Place> {
    (0..BRICK_NODES).map(move |index| {
        let (i, j, k) =
            (index % BRICK_EDGE, index / BRICK_EDGE % BRICK_EDGE, index / BRICK_EDGE.pow(2));
        [x + half_steps * i, y + half_steps * j, z + half_steps * k]
    })
}

/// A place as numbers.
pub(super) fn half_steps(place: Place) -> Vector3<f64> {
    Vector3::from(place.map(|n| n as f64))
}
