//! Vessels with a known wall, stored as on a device.

use cathforce_mechanics::{
    BRICK_CELLS, BRICK_EDGE, BRICK_NODES, FREE, Lumen, LumenHeader, NOMINAL_WALL, OUTSIDE,
};

pub type Vector = [f64; 3];

pub fn add(a: Vector, b: Vector, s: f64) -> Vector {
    core::array::from_fn(|i| a[i] + s * b[i])
}

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Distance to the wall, positive inside the lumen \[m\], and the unit normal into the lumen.
pub type Seen = (f64, Vector);

/// A flat wall through `point`.
#[allow(dead_code)] // not every test that shares this file has one
pub fn plane(p: Vector, point: Vector, normal: Vector) -> Seen {
    (dot(add(p, point, -1.0), normal), normal)
}

/// The inside of a tube around the nearest point of its centre line.
pub fn tube(p: Vector, nearest: Vector, radius_m: f64) -> Seen {
    let off = add(nearest, p, -1.0);
    let r = norm(off).max(1e-12);
    (radius_m - r, off.map(|x| x / r))
}

/// A lumen with its bytes.
pub struct StoredWall {
    header: LumenHeader,
    bytes: Vec<u8>,
}

impl StoredWall {
    /// Samples a wall over a box. Bricks are stored where the wall is nearer than `band_m`.
    pub fn sampled(
        [low, high]: [Vector; 2],
        cell_m: f64,
        band_m: f64,
        wall: impl Fn(Vector) -> Seen,
    ) -> Self {
        let brick_m = cell_m * BRICK_CELLS as f64;
        let bricks: [u16; 3] =
            core::array::from_fn(|i| ((high[i] - low[i]) / brick_m).ceil() as u16);
        let half_diagonal = 0.5 * 3f64.sqrt() * brick_m;
        let unit = ((band_m + 2.0 * half_diagonal) / 32767.0).max(1e-8);
        let (mut directory, mut stored_nodes, mut stored) = (Vec::new(), Vec::new(), 0u16);
        let [nx, ny, nz] = bricks.map(usize::from);
        for brick in 0..nx * ny * nz {
            let first = [brick % nx, brick / nx % ny, brick / nx / ny];
            let corner: Vector = core::array::from_fn(|i| low[i] + brick_m * first[i] as f64);
            let centre = wall(corner.map(|x| x + 0.5 * brick_m)).0;
            if centre.abs() > band_m + half_diagonal {
                directory.extend((if centre > 0.0 { FREE } else { OUTSIDE }).to_le_bytes());
                continue;
            }
            directory.extend(stored.to_le_bytes());
            stored += 1;
            for n in 0..BRICK_NODES {
                let at = [n, n / BRICK_EDGE, n / BRICK_EDGE / BRICK_EDGE].map(|a| a % BRICK_EDGE);
                let (d, normal) = wall(core::array::from_fn(|i| corner[i] + cell_m * at[i] as f64));
                let code = (d / unit).round().clamp(-32767.0, 32767.0) as i16;
                stored_nodes.extend(code.to_le_bytes());
                stored_nodes.extend(normal.map(|c| (c * 127.0).round() as i8 as u8));
                stored_nodes.push(NOMINAL_WALL);
            }
        }
        directory.extend(stored_nodes);
        let header = LumenHeader {
            origin_m: low.map(|x| x as f32),
            cell_m: cell_m as f32,
            distance_unit_m: unit as f32,
            bricks,
            stored,
        };
        Self { header, bytes: directory }
    }

    pub fn lumen(&self) -> Lumen<'_> {
        Lumen::new(self.header, &self.bytes).unwrap()
    }
}
