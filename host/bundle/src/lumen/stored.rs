//! The bricks of a stored lumen, node by node. Byte layout: `cathforce_mechanics::Lumen`.

use cathforce_mechanics::{BRICK_NODES, FINE, Lumen, LumenError, LumenHeader, NODE_BYTES, OUTSIDE};
use nalgebra::Vector3;

use super::grid::{Grid, Place, half_steps};

/// A stored node.
#[derive(Clone, Copy, Debug)]
pub struct StoredNode {
    /// Offset of its first byte.
    pub at: usize,
    /// Half steps from the first node of the grid along x, y, z.
    pub place: [usize; 3],
    pub position_m: Vector3<f64>,
    /// Positive inside.
    pub distance_m: f64,
    /// Of unit length; zero where none is stored.
    pub normal: Vector3<f64>,
}

/// A brick with the spacing of its nodes.
#[derive(Clone, Debug)]
pub struct StoredBrick {
    pub spacing_m: f64,
    /// x fastest.
    pub nodes: Vec<StoredNode>,
}

/// All bricks of a lumen, if its bytes match the header. Nodes that bricks share occur in each of them.
pub fn stored_bricks(header: &LumenHeader, bytes: &[u8]) -> Result<Vec<StoredBrick>, LumenError> {
    Lumen::new(*header, bytes)?;
    let grid = Grid::of(header);
    let first_byte = 2 * grid.len();
    let read = |brick: usize, half_cells: usize, places: &mut dyn Iterator<Item = Place>| {
        let start = first_byte + brick * BRICK_NODES * NODE_BYTES;
        let node = |(k, place): (usize, Place)| {
            let at = start + k * NODE_BYTES;
            let stored = bytes[at..].first_chunk()?;
            let distance = f64::from(i16::from_le_bytes([stored[0], stored[1]]));
            Some(StoredNode {
                at,
                place,
                position_m: grid.position_m(half_steps(place)),
                distance_m: distance * f64::from(header.distance_unit_m),
                normal: stored_normal(stored).try_normalize(0.0).unwrap_or_default(),
            })
        };
        StoredBrick {
            spacing_m: half_cells as f64 * 0.5 * grid.cell_m,
            nodes: places.enumerate().filter_map(node).collect(),
        }
    };
    let (directory, _) = bytes[..first_byte].as_chunks::<2>();
    let mut found = Vec::new();
    for (entry, stored) in directory.iter().enumerate() {
        let index = u16::from_le_bytes(*stored);
        if index >= OUTSIDE {
            continue;
        }
        let first = usize::from(index & !FINE);
        if index & FINE == 0 {
            found.push(read(first, 2, &mut grid.nodes(entry)));
        } else {
            let octants = grid.octants(entry).enumerate();
            found.extend(octants.map(|(k, mut places)| read(first + k, 1, &mut places)));
        }
    }
    Ok(found)
}

/// × 127, as it is stored.
pub fn stored_normal(node: &[u8; NODE_BYTES]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| f64::from(node[2 + axis].cast_signed()))
}
