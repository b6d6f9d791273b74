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
    /// Unit normal into the lumen.
    pub normal: Vector3<T>,
}

/// A lumen read in place from the bytes of a device image.
#[derive(Clone, Copy, Debug)]
pub struct Lumen<'a> {
    header: LumenHeader,
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
        Ok(Self { header, directory, bricks })
    }

    /// What the byte arrays mean.
    pub fn header(&self) -> &LumenHeader {
        &self.header
    }
}
