//! Vessels with a known wall, stored as a device would store them.

use cathforce_mechanics::{
    BRICK_CELLS, BRICK_EDGE, BRICK_NODES, FREE, Lumen, LumenHeader, NOMINAL_WALL,
};

/// A lumen with the bytes that it reads.
pub struct StoredWall {
    header: LumenHeader,
    bytes: Vec<u8>,
}

impl StoredWall {
    /// No wall anywhere.
    pub fn none() -> Self {
        let header = LumenHeader {
            origin_m: [-1.0; 3],
            cell_m: 1e-2,
            distance_unit_m: 1e-6,
            bricks: [50; 3],
            stored: 0,
        };
        Self { header, bytes: FREE.to_le_bytes().repeat(50 * 50 * 50) }
    }

    /// A straight tube of 5 mm radius along x, from −20 mm to 140 mm, stored whole.
    #[allow(dead_code)] // not every test that shares this file has a tube
    pub fn tube() -> Self {
        let (cell, unit) = (2e-3, 1e-6);
        let (low, size) = ([-0.02, -0.012, -0.012], [20usize, 3, 3]);
        let (mut directory, mut bricks) = (Vec::new(), Vec::new());
        for brick in 0..size[0] * size[1] * size[2] {
            directory.extend((brick as u16).to_le_bytes());
            let first = [brick % size[0], brick / size[0] % size[1], brick / size[0] / size[1]];
            for n in 0..BRICK_NODES {
                let at = [n % BRICK_EDGE, n / BRICK_EDGE % BRICK_EDGE, n / BRICK_EDGE / BRICK_EDGE];
                let [_, y, z]: [f64; 3] = std::array::from_fn(|i| {
                    low[i] + cell * (BRICK_CELLS * first[i] + at[i]) as f64
                });
                let radius = y.hypot(z).max(1e-9);
                let distance = ((5e-3 - radius) / unit).clamp(-32767.0, 32767.0) as i16;
                bricks.extend(distance.to_le_bytes());
                let normal = [0.0, -y / radius, -z / radius];
                bricks.extend(normal.map(|c: f64| (c * 127.0).round() as i8 as u8));
                bricks.push(NOMINAL_WALL);
            }
        }
        let header = LumenHeader {
            origin_m: low.map(|x| x as f32),
            cell_m: cell as f32,
            distance_unit_m: unit as f32,
            bricks: size.map(|x| x as u16),
            stored: directory.len() as u16 / 2,
        };
        directory.extend(bricks);
        Self { header, bytes: directory }
    }

    pub fn lumen(&self) -> Lumen<'_> {
        Lumen::new(self.header, &self.bytes).unwrap()
    }
}
