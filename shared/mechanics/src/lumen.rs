//! The lumen: signed distance to the wall with stored normals, on sparse bricks.
//!
//! The field is sampled on a regular grid of nodes, kept in bricks of 4 × 4 × 4 cells.
//! A brick stores its 5 × 5 × 5 nodes (the shared faces twice), so that a cell never
//! straddles two bricks. Only bricks near the wall are stored; the directory says of the
//! others whether they are inside the lumen, farther from the wall than any instrument
//! can touch, or outside.
//!
//! Byte layout, little endian, zero-copy (`LumenHeader` travels beside it):
//!
//! | part | bytes |
//! | --- | --- |
//! | directory | `bricks[0] × bricks[1] × bricks[2]` × u16, x fastest: index of the brick, or [`FREE`], or [`OUTSIDE`] |
//! | bricks | 125 nodes each, x fastest, 6 bytes a node: distance i16, normal 3 × i8, wall u8 |
//!
//! * distance: positive inside the lumen, in units of `distance_unit_m`.
//! * normal: unit gradient of the distance (into the lumen) × 127.
//! * wall: stiffness scale, `2^((wall − 128)/16)`; 128 is the nominal stiffness.

use cathforce_scalar::Real;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Cells along an edge of a brick.
pub const BRICK_CELLS: usize = 4;
/// Nodes along an edge of a brick.
pub const BRICK_EDGE: usize = BRICK_CELLS + 1;
/// Nodes of a brick.
pub const BRICK_NODES: usize = BRICK_EDGE * BRICK_EDGE * BRICK_EDGE;
/// Bytes of a node.
pub const NODE_BYTES: usize = 6;
/// Directory entry: inside, farther from the wall than any instrument can touch.
pub const FREE: u16 = 0xFFFF;
/// Directory entry: outside, beyond the stored band.
pub const OUTSIDE: u16 = 0xFFFE;
/// The `wall` byte of the nominal stiffness.
pub const NOMINAL_WALL: u8 = 128;

/// What the byte arrays of a lumen mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LumenHeader {
    /// Position of the first node, vessel frame \[m\].
    pub origin_m: [f32; 3],
    /// Grid spacing \[m\].
    pub cell_m: f32,
    /// Metres per unit of a stored distance.
    pub distance_unit_m: f32,
    /// Bricks along x, y, z.
    pub bricks: [u16; 3],
    /// Bricks stored.
    pub stored: u16,
}

/// What is wrong with the bytes of a lumen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LumenError {
    /// A number of the header is not finite or out of range.
    Header(&'static str),
    /// The bytes are fewer or more than the header says.
    Length { expected: usize, found: usize },
    /// This directory entry names a brick that is not stored.
    Directory { entry: usize, brick: u16 },
}

impl LumenHeader {
    fn directory_entries(&self) -> usize {
        self.bricks.iter().map(|&b| usize::from(b)).product()
    }

    /// Bytes that directory and bricks take.
    pub fn byte_len(&self) -> usize {
        2 * self.directory_entries() + usize::from(self.stored) * BRICK_NODES * NODE_BYTES
    }

    fn validate(&self) -> Result<(), LumenError> {
        let finite = |x: f32, low: f32, high: f32| x >= low && x <= high;
        if !self.origin_m.iter().all(|&x| finite(x, -10.0, 10.0)) {
            return Err(LumenError::Header("origin_m"));
        }
        if !finite(self.cell_m, 1e-4, 1e-2) {
            return Err(LumenError::Header("cell_m"));
        }
        if !finite(self.distance_unit_m, 1e-8, 1e-4) {
            return Err(LumenError::Header("distance_unit_m"));
        }
        if self.bricks.iter().any(|&b| b == 0 || b > 1024) || self.stored >= OUTSIDE {
            return Err(LumenError::Header("bricks"));
        }
        Ok(())
    }
}

/// The wall as seen from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallSample<T: Real> {
    /// Signed distance to the wall \[m\], positive inside the lumen.
    pub distance_m: T,
    /// Unit normal into the lumen; zero where the wall is too far away to be stored.
    pub normal: Vector3<T>,
    /// Stiffness code of the wall, see [`NOMINAL_WALL`].
    pub stiffness: u8,
}

/// A lumen read in place from the bytes of a device image.
#[derive(Clone, Copy, Debug)]
pub struct Lumen<'a> {
    header: LumenHeader,
    /// Cells per metre.
    inverse_cell: f32,
    /// Half a cell per unit of a stored normal \[m\].
    half_cell: f32,
    directory: &'a [[u8; 2]],
    bricks: &'a [[[u8; NODE_BYTES]; BRICK_NODES]],
}

impl<'a> Lumen<'a> {
    /// Checks the bytes against the header; nothing is copied.
    pub fn new(header: LumenHeader, bytes: &'a [u8]) -> Result<Self, LumenError> {
        header.validate()?;
        let wrong_length = LumenError::Length { expected: header.byte_len(), found: bytes.len() };
        if bytes.len() != header.byte_len() {
            return Err(wrong_length);
        }
        let (directory, bricks) =
            bytes.split_at_checked(2 * header.directory_entries()).ok_or(wrong_length)?;
        let (directory, _) = directory.as_chunks::<2>();
        let (nodes, _) = bricks.as_chunks::<NODE_BYTES>();
        let (bricks, _) = nodes.as_chunks::<BRICK_NODES>();
        for (entry, &bytes) in directory.iter().enumerate() {
            let brick = u16::from_le_bytes(bytes);
            if brick < OUTSIDE && brick >= header.stored {
                return Err(LumenError::Directory { entry, brick });
            }
        }
        let (inverse_cell, half_cell) = (1.0 / header.cell_m, 0.5 * header.cell_m / 127.0);
        Ok(Self { header, inverse_cell, half_cell, directory, bricks })
    }

    /// What the byte arrays mean.
    pub fn header(&self) -> &LumenHeader {
        &self.header
    }

    /// The wall seen from a point of the vessel frame \[m\].     docs/model.md (9)
    ///
    /// Distance by third-order interpolation: the trilinear interpolant d̂ of the stored
    /// distances is too large, and the blend of their tangent planes too small, by the same
    /// ½ Σ ∂²d/∂xₐ² uₐ(1 − uₐ) h²; their mean cancels it. The normal is the blend of the
    /// stored ones, normalised. Total on any input; never panics.
    #[inline]
    pub fn sample<T: Real>(&self, point: &Vector3<T>) -> WallSample<T> {
        let h = &self.header;
        let inverse_cell = T::lit(f64::from(self.inverse_cell));
        let axis = |x: T, origin: f32, bricks: u16| {
            let grid = (x - T::lit(f64::from(origin))) * inverse_cell;
            let cells = i32::from(bricks) * BRICK_CELLS as i32;
            let cell = grid.floor_int().clamp(0, cells - 1);
            let inside = grid - T::int(cell);
            (cell as usize, inside)
        };
        let (i, u) = axis(point.x, h.origin_m[0], h.bricks[0]);
        let (j, v) = axis(point.y, h.origin_m[1], h.bricks[1]);
        let (k, w) = axis(point.z, h.origin_m[2], h.bricks[2]);
        let [nx, ny, _] = h.bricks.map(usize::from);
        let entry = i / BRICK_CELLS + nx * (j / BRICK_CELLS + ny * (k / BRICK_CELLS));
        let index = self.directory.get(entry).map_or(OUTSIDE, |&b| u16::from_le_bytes(b));
        let Some(brick) = self.bricks.get(usize::from(index)) else {
            return if index == FREE { WallSample::free() } else { WallSample::outside() };
        };
        let first =
            i % BRICK_CELLS + BRICK_EDGE * (j % BRICK_CELLS + BRICK_EDGE * (k % BRICK_CELLS));
        let mut stiffness = NOMINAL_WALL;
        let mut edge = |offset: usize| {
            // Two neighbours along x: their blend, and the slope of the normal's x.
            let node = |n: usize| brick.get(first + n).copied().unwrap_or([0; NODE_BYTES]);
            let (a, b) = (node(offset), node(offset + 1));
            stiffness = a[5];
            let distance =
                |n: [u8; NODE_BYTES]| T::int(i32::from(i16::from_le_bytes([n[0], n[1]])));
            let normal = |n: u8| T::int(i32::from(n as i8));
            let blend = |p: T, q: T| p + u * (q - p);
            let slope = normal(b[2]) - normal(a[2]);
            Edge {
                distance: blend(distance(a), distance(b)),
                normal: Vector3::new(
                    normal(a[2]) + u * slope,
                    blend(normal(a[3]), normal(b[3])),
                    blend(normal(a[4]), normal(b[4])),
                ),
                slope,
            }
        };
        const Y: usize = BRICK_EDGE;
        const Z: usize = BRICK_EDGE * BRICK_EDGE;
        let (e00, e10, e01, e11) = (edge(0), edge(Y), edge(Z), edge(Y + Z));
        let blend = |p: T, q: T, t: T| p + t * (q - p);
        // Along y, then z; the slope of the normal's component along each axis comes along.
        let low = e00.normal + (e10.normal - e00.normal) * v;
        let high = e01.normal + (e11.normal - e01.normal) * v;
        let normal = low + (high - low) * w;
        let slope_x = blend(blend(e00.slope, e10.slope, v), blend(e01.slope, e11.slope, v), w);
        let slope_y = blend(e10.normal.y - e00.normal.y, e11.normal.y - e01.normal.y, w);
        let slope_z = high.z - low.z;
        let distance =
            blend(blend(e00.distance, e10.distance, v), blend(e01.distance, e11.distance, v), w);
        let one = T::one();
        let bend = u * (one - u) * slope_x + v * (one - v) * slope_y + w * (one - w) * slope_z;
        let half_cell = T::lit(f64::from(self.half_cell));
        let length = (normal.x * normal.x + normal.y * normal.y + normal.z * normal.z).root();
        let floor = T::lit(1e-3);
        let scale = one / if length > floor { length } else { floor };
        WallSample {
            distance_m: distance * T::lit(f64::from(h.distance_unit_m)) - half_cell * bend,
            normal: normal * scale,
            stiffness,
        }
    }
}

/// Two grid nodes blended along x.
struct Edge<T: Real> {
    distance: T,
    normal: Vector3<T>,
    slope: T,
}

impl<T: Real> WallSample<T> {
    /// Farther from the wall than any instrument can touch.
    fn free() -> Self {
        Self { distance_m: T::one(), normal: Vector3::zeros(), stiffness: NOMINAL_WALL }
    }

    /// Outside the stored band: no normal is known, so no force can be given.
    fn outside() -> Self {
        Self { distance_m: -T::one(), normal: Vector3::zeros(), stiffness: NOMINAL_WALL }
    }
}
