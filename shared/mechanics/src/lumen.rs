//! The lumen: signed distance to the wall with stored normals, on sparse bricks.
//!
//! The field is sampled at the nodes of a regular grid, in bricks of 4 × 4 × 4 cells. A brick stores
//! its 5 × 5 × 5 nodes, so that a cell never straddles two bricks. Only bricks near the wall are
//! stored. The directory tells whether another brick is inside the lumen, too far from the wall for
//! contact, or outside. Where the wall is strongly curved within a cell, eight bricks of half the
//! spacing replace one. Neighbouring bricks may differ at their common face by the error of the
//! coarser one.
//!
//! Byte layout, little endian, zero-copy (`LumenHeader` travels beside it):
//!
//! | part | bytes |
//! | --- | --- |
//! | directory | `bricks[0] × bricks[1] × bricks[2]` × u16, x fastest: index of the brick, or [`FINE`] and the index of the first of eight (octants, x fastest), or [`FREE`], or [`OUTSIDE`] |
//! | bricks | 125 nodes each, x fastest, 6 bytes a node: distance i16, normal 3 × i8, wall u8 |
//!
//! * distance: positive inside the lumen, in units of `distance_unit_m`.
//! * normal: unit gradient of the distance (into the lumen) × 127.
//! * wall: stiffness scale, `2^((wall − 128)/16)`; 128 is the nominal stiffness.

use cathforce_scalar::{Number, PlainPack, Real, Vector3};
use serde::{Deserialize, Serialize};

/// Version of the byte layout; others are refused. Version 1 had bricks of one spacing only.
pub const LUMEN_LAYOUT: u32 = 2;
/// Cells along an edge of a brick.
pub const BRICK_CELLS: usize = 4;
/// Nodes along an edge of a brick.
pub const BRICK_EDGE: usize = BRICK_CELLS + 1;
/// Nodes of a brick.
pub const BRICK_NODES: usize = BRICK_EDGE * BRICK_EDGE * BRICK_EDGE;
/// Bytes of a node.
pub const NODE_BYTES: usize = 6;
/// Directory entry: inside, too far from the wall for contact.
pub const FREE: u16 = 0xFFFF;
/// Directory entry: outside, beyond the stored band.
pub const OUTSIDE: u16 = 0xFFFE;
/// Set in a directory entry: eight bricks of half the spacing.
pub const FINE: u16 = 0x8000;
/// Fine bricks that replace one.
pub const OCTANTS: u16 = 8;
/// Most bricks that a directory can name.
pub const MOST_BRICKS: u16 = OUTSIDE & !FINE;
/// The `wall` byte of the nominal stiffness.
pub const NOMINAL_WALL: u8 = 128;

/// Geometry of the grid, and units of the stored bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LumenHeader {
    /// Position of the first node, vessel frame \[m\].
    pub origin_m: [f32; 3],
    /// Grid spacing \[m\]; of fine bricks, half of it.
    pub cell_m: f32,
    /// Metres per unit of a stored distance.
    pub distance_unit_m: f32,
    /// Bricks along x, y, z.
    pub bricks: [u16; 3],
    /// Bricks stored.
    pub stored: u16,
}

/// Why the bytes of a lumen are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LumenError {
    /// This field of the header is not finite or out of range.
    Header(&'static str),
    /// The number of bytes differs from what the header says.
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
        // In this form, NaN is refused.
        let within = |x: f32, low: f32, high: f32| x >= low && x <= high;
        if !self.origin_m.iter().all(|&x| within(x, -10.0, 10.0)) {
            return Err(LumenError::Header("origin_m"));
        }
        if !within(self.cell_m, 1e-4, 1e-2) {
            return Err(LumenError::Header("cell_m"));
        }
        if !within(self.distance_unit_m, 1e-8, 1e-4) {
            return Err(LumenError::Header("distance_unit_m"));
        }
        if self.bricks.iter().any(|&b| b == 0 || b > 1024) || self.stored > MOST_BRICKS {
            return Err(LumenError::Header("bricks"));
        }
        Ok(())
    }
}

/// The wall next to one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallSample<T: Number> {
    /// Signed distance to the wall \[m\], positive inside the lumen; ± 1 where no wall is stored.
    pub distance_m: T,
    /// Unit normal into the lumen; zero where no wall is stored.
    pub normal: Vector3<T>,
    /// Stiffness of the wall over the nominal one \[1\]; 0 where no wall is stored.
    pub stiffness: T,
}

/// A lumen read in place from the bytes of a device image.
#[derive(Clone, Copy, Debug)]
pub struct Lumen<'a> {
    header: LumenHeader,
    /// Metres per unit of a [`Place`], and its inverse.
    place: f32,
    places_per_m: f32,
    /// Last unit along x, y, z.
    last_place: [i32; 3],
    /// Directory entries from a brick to the next one along y, z.
    strides: [usize; 2],
    /// Metres per unit of a blended distance.
    distance_unit: f32,
    /// Half a cell per unit of a blended normal, for coarse and for fine bricks \[m\].
    half_cells: [f32; 2],
    directory: &'a [[u8; 2]],
    bricks: &'a [[Node; BRICK_NODES]],
}

impl<'a> Lumen<'a> {
    /// Checks the bytes against the header. Nothing is copied.
    ///
    /// Errors: a field of the header out of range, a wrong number of bytes, or a directory entry that
    /// names a brick that is not stored.
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
            let last = match brick {
                FREE | OUTSIDE => continue,
                fine if fine & FINE != 0 => (fine & !FINE) + (OCTANTS - 1),
                coarse => coarse,
            };
            if last >= header.stored {
                return Err(LumenError::Directory { entry, brick: last });
            }
        }
        let unit = PLACE_UNIT as f32;
        let [nx, ny, _] = header.bricks.map(usize::from);
        let places = |bricks: u16| i32::from(bricks) * ((BRICK_CELLS as i32) << PLACE_BITS);
        Ok(Self {
            header,
            place: header.cell_m * unit,
            places_per_m: 1.0 / (header.cell_m * unit),
            last_place: header.bricks.map(|bricks| places(bricks) - 1),
            strides: [nx, nx * ny],
            distance_unit: header.distance_unit_m * unit,
            half_cells: [0.5, 0.25].map(|half| half * header.cell_m / 127.0 * unit),
            directory,
            bricks,
        })
    }

    /// The header of the bytes.
    pub fn header(&self) -> &LumenHeader {
        &self.header
    }

    /// Both were made of the same bytes, at the same place in memory.
    pub fn has_the_bytes_of(&self, other: &Lumen<'_>) -> bool {
        core::ptr::eq(self.directory, other.directory) && core::ptr::eq(self.bricks, other.bricks)
    }

    /// The wall next to a point of the vessel frame \[m\].     docs/explanation/model.md (9)
    ///
    /// The distance is interpolated to third order. The trilinear interpolant of the stored distances
    /// is too large, and the blend of the tangent planes at the nodes too small, by the same
    /// ½ Σ ∂²d/∂xₐ² uₐ(1 − uₐ) h², which their mean cancels. The normal is the normalised blend of the
    /// stored ones. Below the resolution of a [`Place`], and beyond the grid, the distance is
    /// extrapolated along the normal.
    ///
    /// Total on any input, never panics, and takes the same operations everywhere. Stored integers are
    /// blended as integers, with weights in units of 2⁻¹⁵.
    #[inline(always)]
    pub fn sample<T: Real>(&self, point: impl Into<Vector3<T>>) -> WallSample<T> {
        self.sample_lanes::<T, T>(point.into())
    }

    /// [`Lumen::sample`] of one point in each lane.
    #[inline(always)]
    pub(crate) fn sample_lanes<T: Real, N: PlainPack<T>>(
        &self,
        point: Vector3<N>,
    ) -> WallSample<N> {
        let x = self.place::<T, N>(point.x(), 0);
        let y = self.place::<T, N>(point.y(), 1);
        let z = self.place::<T, N>(point.z(), 2);
        let found = N::per_lane(|lane| self.find([&x, &y, &z].map(|at| at.whole[lane])));

        let across_x = across::<N>(&found, 1, 2);
        let across_y = across::<N>(&found, 0, 2);
        let across_z = across::<N>(&found, 0, 1);
        let d = Blend::<N>::between::<T>(&found, &across_x, [X0, X1], |node| {
            i32::from(i16::from_le_bytes([node[0], node[1]]))
        });
        let n_x = Blend::<N>::between::<T>(&found, &across_x, [X0, X1], |n| i32::from(n[2] as i8));
        let n_y = Blend::<N>::between::<T>(&found, &across_y, [Y0, Y1], |n| i32::from(n[3] as i8));
        let n_z = Blend::<N>::between::<T>(&found, &across_z, [Z0, Z1], |n| i32::from(n[4] as i8));
        let codes = N::per_lane(|lane| {
            let sum = |face| across_x[lane].sum(face, |node| i32::from(found[lane].cell[node][5]));
            let (low, high) = (sum(X0), sum(X1));
            low + ((((high - low) >> 8) * found[lane].within[0]) >> (PLACE_BITS - 8))
        });

        let u = share::<T, N>(&found, 0);
        let v = share::<T, N>(&found, 1);
        let w = share::<T, N>(&found, 2);
        let one = N::lit(1.0);
        let half_cell = N::from_lanes(|lane| T::lit(f64::from(found[lane].half_cell)));
        let bend = u * (one - u) * n_x.rise + v * (one - v) * n_y.rise + w * (one - w) * n_z.rise;
        let distance = d.at(u) * N::lit(f64::from(self.distance_unit)) - bend * half_cell;
        let normal = Vector3::new(n_x.at(u), n_y.at(v), n_z.at(w));
        let length = normal.norm();
        let normal = normal * (one / length.larger(N::lit(1e-3 / PLACE_UNIT)));
        let rest = normal.x() * x.rest + normal.y() * y.rest + normal.z() * z.rest;
        let presence = N::from_lanes(|lane| T::lit(f64::from(found[lane].presence)));
        let away = N::from_lanes(|lane| T::lit(f64::from(found[lane].away)));
        WallSample {
            distance_m: away + distance + rest * N::lit(f64::from(self.place)),
            normal,
            stiffness: presence * stiffness::<T, N>(|lane| codes[lane]),
        }
    }

    /// The cell that contains a place.
    #[inline(always)]
    fn find(&self, place: [i32; 3]) -> Found<'_> {
        let [x, y, z] = place.map(|place| (place >> BRICK_BITS) as usize);
        let [along_y, along_z] = self.strides;
        let entry = self.directory.get(x + along_y * y + along_z * z);
        let index = entry.map_or(OUTSIDE, |&b| u16::from_le_bytes(b));
        // In fine bricks, places count half cells, and the bit above them selects the octant.
        let fine = usize::from(index >> FINE_BIT);
        let place = place.map(|place| place << fine);
        let [x, y, z] = place.map(|place| (place >> BRICK_BITS) as usize & fine);
        let brick = self.bricks.get(usize::from(index & !FINE) + x + 2 * y + 4 * z);
        let [x, y, z] = place.map(|place| (place >> PLACE_BITS) as usize % BRICK_CELLS);
        let first = x + BRICK_EDGE * (y + BRICK_EDGE * z);
        let stored = brick.and_then(|b| b.get(first..)).and_then(|b| b.first_chunk());
        let within = place.map(within);
        let half_cell = self.half_cells[fine & 1];
        match stored {
            Some(cell) => Found { cell, within, half_cell, presence: 1.0, away: 0.0 },
            None => {
                let away = if index == FREE { 1.0 } else { -1.0 };
                Found { cell: &NOTHING, within, half_cell, presence: 0.0, away }
            }
        }
    }

    /// Place of a coordinate on the grid.
    #[inline(always)]
    fn place<T: Real, N: PlainPack<T>>(&self, coordinate: N, axis: usize) -> Place<N> {
        let from_origin = coordinate - N::lit(f64::from(self.header.origin_m[axis]));
        let exact = from_origin * N::lit(f64::from(self.places_per_m));
        let whole = exact.to_clamped_ints(self.last_place[axis]);
        let rest = exact - N::from_ints(|lane| whole[lane]);
        Place { whole, rest }
    }
}

/// Units of a place along a cell, as a power of two. 2⁻¹⁵ mm is about the resolution of `f32`.
const PLACE_BITS: u32 = 15;
const PLACE_UNIT: f64 = 1.0 / (1 << PLACE_BITS) as f64;
/// Units of a place along a brick, as a power of two.
const BRICK_BITS: u32 = PLACE_BITS + BRICK_CELLS.ilog2();
/// Index of the bit [`FINE`].
const FINE_BIT: u32 = FINE.ilog2();

/// Place of one coordinate on the grid, one in each lane.
struct Place<N: Number> {
    /// Truncated to a whole unit \[2⁻¹⁵ cells\].
    whole: N::Lanes<i32>,
    /// Remainder \[2⁻¹⁵ cells\]; large beyond the grid.
    rest: N,
}

/// Part of a place within its cell \[2⁻¹⁵\].
#[inline(always)]
fn within(place: i32) -> i32 {
    place & ((1 << PLACE_BITS) - 1)
}

/// The stored nodes around a place.
struct Found<'a> {
    cell: &'a [Node; CELL_SPAN],
    /// Place relative to the first node along x, y, z \[2⁻¹⁵ of the spacing\].
    within: [i32; 3],
    /// Half the spacing per unit of a blended normal \[m\].
    half_cell: f32,
    /// 1 where a wall is stored, else 0.
    presence: f32,
    /// Where no wall is stored: 1 inside, −1 outside; else 0.
    away: f32,
}

/// Stored distance, normal and wall byte of a node.
type Node = [u8; NODE_BYTES];

/// Nodes of a brick from the first to the last node of a cell.
const CELL_SPAN: usize = 2 + BRICK_EDGE + BRICK_EDGE * BRICK_EDGE;
/// Nodes where no brick is stored.
const NOTHING: [Node; CELL_SPAN] = [[0; NODE_BYTES]; CELL_SPAN];

const X: usize = 1;
const Y: usize = BRICK_EDGE;
const Z: usize = BRICK_EDGE * BRICK_EDGE;
// The four nodes of each face of a cell: the low and the high one across x, y, z.
const X0: [usize; 4] = [0, Y, Z, Y + Z];
const X1: [usize; 4] = [X, X + Y, X + Z, X + Y + Z];
const Y0: [usize; 4] = [0, X, Z, X + Z];
const Y1: [usize; 4] = [Y, X + Y, Y + Z, X + Y + Z];
const Z0: [usize; 4] = [0, X, Y, X + Y];
const Z1: [usize; 4] = [Z, X + Z, Y + Z, X + Y + Z];

/// Bilinear weights of a face's nodes \[2⁻¹⁵\]; their sum is 1.
struct Weights([i32; 4]);

#[inline(always)]
fn weights(p: i32, q: i32) -> Weights {
    let both = (p * q) >> PLACE_BITS;
    let (p, q) = (p - both, q - both);
    Weights([(1 << PLACE_BITS) - p - q - both, p, q, both])
}

/// Weights on the faces that are parallel to the axes `p` and `q`.
#[inline(always)]
fn across<N: Number>(found: &N::Lanes<Found<'_>>, p: usize, q: usize) -> N::Lanes<Weights> {
    N::per_lane(|lane| weights(found[lane].within[p], found[lane].within[q]))
}

/// Position within the cell along an axis, 0 to 1.
#[inline(always)]
fn share<T: Real, N: PlainPack<T>>(found: &N::Lanes<Found<'_>>, axis: usize) -> N {
    N::from_ints(|lane| found[lane].within[axis]) * N::lit(PLACE_UNIT)
}

impl Weights {
    /// Weighted sum over a face \[2⁻¹⁵\]; below 2³¹ for values of 16 bits.
    #[inline(always)]
    fn sum(&self, face: [usize; 4], value: impl Fn(usize) -> i32) -> i32 {
        let Self([a, b, c, d]) = self;
        a * value(face[0]) + b * value(face[1]) + c * value(face[2]) + d * value(face[3])
    }
}

/// A value that changes linearly from one face to the opposite one.
struct Blend<T> {
    low: T,
    rise: T,
}

impl<N: Number> Blend<N> {
    /// Interpolates the nodes' `value` between two opposite faces.
    #[inline(always)]
    fn between<T: Real>(
        found: &N::Lanes<Found<'_>>,
        across: &N::Lanes<Weights>,
        [low, high]: [[usize; 4]; 2],
        value: impl Fn(&Node) -> i32,
    ) -> Self
    where
        N: PlainPack<T>,
    {
        let sum = |lane: usize, face| across[lane].sum(face, |node| value(&found[lane].cell[node]));
        let low = N::from_ints(|lane| sum(lane, low));
        Self { low, rise: N::from_ints(|lane| sum(lane, high)) - low }
    }
}

impl<T: Number> Blend<T> {
    #[inline(always)]
    fn at(&self, share: T) -> T {
        self.low + share * self.rise
    }
}

/// Stiffness scale of a wall code \[2⁻¹⁵\]: 16 codes double it; linear in between.
#[inline(always)]
fn stiffness<T: Real, N: PlainPack<T>>(code: impl Fn(usize) -> i32) -> N {
    let step = |lane| (code(lane) >> PLACE_BITS) as usize & 0xFF;
    let share = N::from_ints(|lane| within(code(lane))) * N::lit(PLACE_UNIT);
    let scale = N::from_lanes(|lane| T::lit(f64::from(STIFFNESS[step(lane)])));
    scale + share * scale * N::lit(STEP - 1.0)
}

/// 2^(1/16)
const STEP: f64 = 1.044_273_782_427_413_8;

/// Stiffness scale of each code.
static STIFFNESS: [f32; 256] = {
    let mut table = [1.0; 256];
    let (mut steps, mut scale) = (0, 1.0);
    while steps < 128 {
        table[NOMINAL_WALL as usize + steps] = scale as f32;
        table[NOMINAL_WALL as usize - steps] = (1.0 / scale) as f32;
        steps += 1;
        scale = if steps % 16 == 0 { (1 << (steps / 16)) as f64 } else { scale * STEP };
    }
    table[0] = 1.0 / 256.0;
    table
};

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    const CELL: f64 = 1e-3;
    const UNIT: f64 = 0.25e-6;

    /// Two bricks along x before the wall y = 1 mm: one of the grid's spacing, one of half of it.
    fn beside_a_plane(directory: [u16; 2]) -> (LumenHeader, Vec<u8>) {
        let stored = 1 + OCTANTS;
        let header = LumenHeader {
            origin_m: [0.0; 3],
            cell_m: CELL as f32,
            distance_unit_m: UNIT as f32,
            bricks: [2, 1, 1],
            stored,
        };
        let mut bytes: Vec<u8> = directory.iter().flat_map(|b| b.to_le_bytes()).collect();
        for brick in 0..stored {
            let octant = brick.checked_sub(1);
            let (first, spacing) = match octant {
                None => (0.0, CELL),
                Some(octant) => (f64::from(octant >> 1 & 1) * 2.0 * CELL, 0.5 * CELL),
            };
            for node in 0..BRICK_NODES {
                let y = first + (node / BRICK_EDGE % BRICK_EDGE) as f64 * spacing;
                bytes.extend((((y - CELL) / UNIT) as i16).to_le_bytes());
                bytes.extend([0, 127, 0, NOMINAL_WALL + octant.map_or(0, |octant| octant as u8)]);
            }
        }
        (header, bytes)
    }

    #[test]
    fn eight_bricks_of_half_the_spacing_stand_for_one() {
        let (header, bytes) = beside_a_plane([0, FINE | 1]);
        let lumen = Lumen::new(header, &bytes).unwrap();
        for k in 0..200 {
            // Never on a face.
            let share = |prime: usize| (0.3 + (k * prime % 200) as f64) / 200.0;
            let [x, y, z] = [8.0 * share(1), 4.0 * share(77), 4.0 * share(31)];
            let here = lumen.sample([x, y, z].map(|mm| 1e-3 * mm));
            assert!((here.distance_m - 1e-3 * (y - 1.0)).abs() < 0.3e-6, "{x} {y} {z}: {here:?}");
            assert!((here.normal.y() - 1.0).abs() < 1e-6);
            let octant = [x >= 6.0, y >= 2.0, z >= 2.0];
            let code = (0..3).map(|axis| u32::from(octant[axis]) << axis).sum::<u32>();
            let scale = if x < 4.0 { 1.0 } else { 2_f64.powf(f64::from(code) / 16.0) };
            assert!((here.stiffness - scale).abs() < 1e-3, "{x} {y} {z}: {here:?}, not {scale}");
        }
    }

    #[test]
    fn the_eight_must_be_stored() {
        let (header, bytes) = beside_a_plane([0, FINE | 2]);
        let refused = Lumen::new(header, &bytes).err();
        assert_eq!(refused, Some(LumenError::Directory { entry: 1, brick: 9 }));
        let (header, bytes) = beside_a_plane([FREE, OUTSIDE]);
        let lumen = Lumen::new(header, &bytes).unwrap();
        for (x, away) in [(1e-3, 1.0), (7.9e-3, -1.0)] {
            let here: WallSample<f64> = lumen.sample([x, 3.9e-3, 3.9e-3]);
            assert_eq!((here.distance_m, here.stiffness), (away, 0.0));
        }
    }
}
