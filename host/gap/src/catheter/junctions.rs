//! Walls that bend into the lumen, as where a vessel divides: they are known worse than others.
//!
//! A mesh follows a tube to some hundredths of a millimetre, but where tubes part its facets, its
//! segmentation and whoever blends the tubes decide where the wall is. An instrument that leans on a
//! dividing wall 0.2 mm nearer presses by a tenth more.
//!
//! Ridges are where the divergence of the stored normals is above [`RIDGE_PER_M`]; around them the wall
//! moves by a share of 1 − ρ²/R², squared, ρ being the way to the nearest of them and R [`REACH_M`].

use std::collections::BTreeMap;

use cathforce_mechanics::{
    BRICK_EDGE, BRICK_NODES, FINE, FREE, LumenHeader, NODE_BYTES, OCTANTS, OUTSIDE,
};
use nalgebra::Vector3;

/// Divergence of the normals from which on a wall is a ridge: bends of vessels are at least 5 mm wide, and
/// the centre line of an instrument is within some millimetre of what it touches.
const RIDGE_PER_M: f64 = 300.0;
/// From a ridge, a wall is known as well as elsewhere \[m\].
const REACH_M: f64 = 4e-3;
/// Points of a ridge within that of each, at least: single ones are at the ends of a mesh.
const FEWEST: usize = 8;
/// Behind the wall, and beyond what touches it, normals say nothing of it \[m\].
const BEHIND_M: f64 = 2e-4;
const BEYOND_M: f64 = 3e-4;

/// What is stored near ridges, and how it changes.
#[derive(Clone, Debug, Default)]
pub struct Junctions {
    nodes: Vec<Near>,
    unit_m: f64,
}

/// A node near a ridge.
#[derive(Clone, Copy, Debug)]
struct Near {
    /// Of its first byte.
    at: usize,
    /// What a wall that is nearer by 1 m changes of its distance \[1\] and of its normal \[1/m\].
    share: f64,
    tilt_per_m: Vector3<f64>,
}

/// A node as it is stored.
#[derive(Clone, Copy, Debug)]
struct Node {
    at: usize,
    position_m: Vector3<f64>,
    distance_m: f64,
    normal: Vector3<f64>,
}

impl Node {
    /// The point of the wall that it sees.
    fn wall_m(&self) -> Vector3<f64> {
        self.position_m - self.normal * self.distance_m
    }
}

impl Junctions {
    /// Of a lumen that an instrument of this outer radius touches.
    pub fn of(header: &LumenHeader, bytes: &[u8], outer_radius_m: f64) -> Self {
        let bricks = bricks(header, bytes);
        let touched = -BEHIND_M..outer_radius_m + BEYOND_M;
        let of_brick = |brick: &Brick| {
            let nodes = brick.nodes.iter().enumerate();
            let touched = nodes.filter(|(_, node)| touched.contains(&node.distance_m));
            let bent = touched.filter(|(k, _)| brick.divergence_per_m(*k) > RIDGE_PER_M);
            bent.map(|(_, node)| node.wall_m()).collect::<Vec<_>>()
        };
        let bent = Points::of(bricks.iter().flat_map(of_brick));
        let is_one_of_many = |point: &Vector3<f64>| bent.ways_to(*point).count() >= FEWEST;
        let ridges = Points::of(bent.all().filter(is_one_of_many));
        let near = bricks.iter().flat_map(|brick| &brick.nodes).filter_map(|node| {
            let ways = ridges.ways_to(node.wall_m());
            let nearest = ways.min_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            let rest = 1.0 - nearest.norm_squared() / REACH_M.powi(2);
            let along = nearest - node.normal * node.normal.dot(&nearest);
            let tilt_per_m = along * (4.0 * rest / REACH_M.powi(2));
            Some(Near { at: node.at, share: rest * rest, tilt_per_m })
        });
        Self { nodes: near.collect(), unit_m: f64::from(header.distance_unit_m) }
    }

    /// Whether the vessel has none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The lumen with these walls nearer.
    pub fn nearer(&self, bytes: &[u8], by_m: f64) -> Vec<u8> {
        let mut moved = bytes.to_vec();
        for Near { at, share, tilt_per_m } in &self.nodes {
            let Some(node) = moved[*at..].first_chunk_mut::<NODE_BYTES>() else { continue };
            let distance = f64::from(i16::from_le_bytes([node[0], node[1]]));
            let distance = distance - share * by_m / self.unit_m;
            // Saturates: what is so far away is touched by nothing.
            [node[0], node[1]] = (distance.round() as i16).to_le_bytes();
            let normal = normal(node) + tilt_per_m * by_m;
            let [x, y, z] = (normal.normalize() * 127.0).map(|x| x.round() as i8 as u8).into();
            [node[2], node[3], node[4]] = [x, y, z];
        }
        moved
    }
}

fn normal(node: &[u8; NODE_BYTES]) -> Vector3<f64> {
    let stored = Vector3::new(node[2], node[3], node[4]).map(|x| f64::from(x as i8));
    stored / stored.norm().max(1.0)
}

/// A brick with the spacing of its nodes.
struct Brick {
    spacing_m: f64,
    /// x fastest.
    nodes: Vec<Node>,
}

impl Brick {
    /// Of the normals, by differences over the neighbours that there are.
    fn divergence_per_m(&self, k: usize) -> f64 {
        let mut sum = 0.0;
        for (axis, stride) in [1, BRICK_EDGE, BRICK_EDGE * BRICK_EDGE].into_iter().enumerate() {
            let place = k / stride % BRICK_EDGE;
            let low = if place > 0 { k - stride } else { k };
            let high = if place + 1 < BRICK_EDGE { k + stride } else { k };
            let steps = ((high - low) / stride) as f64;
            let rise = self.nodes[high].normal[axis] - self.nodes[low].normal[axis];
            sum += rise / (steps * self.spacing_m);
        }
        sum
    }
}

/// All that are stored.
fn bricks(header: &LumenHeader, bytes: &[u8]) -> Vec<Brick> {
    let [nx, ny, nz] = header.bricks.map(usize::from);
    let directory_bytes = 2 * nx * ny * nz;
    let Some((directory, _)) = bytes.split_at_checked(directory_bytes) else { return Vec::new() };
    let edge_m = f64::from(header.cell_m) * (BRICK_EDGE - 1) as f64;
    let origin_m = Vector3::from(header.origin_m).map(f64::from);
    let mut found = Vec::new();
    for (entry, stored) in directory.as_chunks::<2>().0.iter().enumerate() {
        let index = u16::from_le_bytes(*stored);
        if index == FREE || index == OUTSIDE {
            continue;
        }
        let place = [entry % nx, entry / nx % ny, entry / (nx * ny)].map(|k| k as f64);
        let first_m = origin_m + Vector3::from(place) * edge_m;
        let is_fine = index & FINE != 0;
        let (count, parts) = if is_fine { (OCTANTS, 2.0) } else { (1, 1.0) };
        for octant in 0..count {
            let aside = [octant & 1, octant >> 1 & 1, octant >> 2].map(|k| f64::from(k) / parts);
            let brick = usize::from((index & !FINE) + octant);
            found.extend(read_brick(
                bytes,
                directory_bytes + brick * BRICK_NODES * NODE_BYTES,
                first_m + Vector3::from(aside) * edge_m,
                f64::from(header.cell_m) / parts,
                f64::from(header.distance_unit_m),
            ));
        }
    }
    found
}

fn read_brick(
    bytes: &[u8],
    start: usize,
    first_m: Vector3<f64>,
    spacing_m: f64,
    unit_m: f64,
) -> Option<Brick> {
    let stored = bytes.get(start..)?.as_chunks::<NODE_BYTES>().0.get(..BRICK_NODES)?;
    let node = |(k, node): (usize, &[u8; NODE_BYTES])| {
        let place = [k % BRICK_EDGE, k / BRICK_EDGE % BRICK_EDGE, k / (BRICK_EDGE * BRICK_EDGE)];
        Node {
            at: start + k * NODE_BYTES,
            position_m: first_m + Vector3::from(place.map(|k| k as f64)) * spacing_m,
            distance_m: f64::from(i16::from_le_bytes([node[0], node[1]])) * unit_m,
            normal: normal(node),
        }
    };
    Some(Brick { spacing_m, nodes: stored.iter().enumerate().map(node).collect() })
}

/// Points of walls \[m\], by boxes as wide as ridges reach: in an order, so that of two that are as near
/// always the same one counts.
struct Points(BTreeMap<[i32; 3], Vec<Vector3<f64>>>);

impl Points {
    fn of(points: impl Iterator<Item = Vector3<f64>>) -> Self {
        let mut boxes: BTreeMap<_, Vec<_>> = BTreeMap::new();
        points.for_each(|point| boxes.entry(Self::box_of(&point)).or_default().push(point));
        Self(boxes)
    }

    fn box_of(point: &Vector3<f64>) -> [i32; 3] {
        point.map(|x| (x / REACH_M).floor() as i32).into()
    }

    fn all(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.0.values().flatten().copied()
    }

    /// From every one within [`REACH_M`] to a point.
    fn ways_to(&self, point: Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
        let [x, y, z] = Self::box_of(&point);
        let around = (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let near = around.filter_map(|own| self.0.get(&own)).flatten();
        near.map(move |own| point - own).filter(|way| way.norm() < REACH_M)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_mechanics::{Lumen, WallSample};
    use cathforce_rig::Bundle;
    use cathforce_rig::lumen::BuiltLumen;

    use super::*;
    use crate::catheter::lumen;

    /// Trunk and two branches; where they part, the wall points at the entry.
    const RIDGE_M: [f64; 3] = [69.25e-3, -1.75e-3, 0.1e-3];
    const BY_M: f64 = 2e-4;

    fn divided() -> (BuiltLumen, Junctions) {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let (lumen, _) = lumen(&Bundle::open(&example).unwrap(), 0.825e-3).unwrap();
        let junctions = Junctions::of(&lumen.header, &lumen.bytes, 0.825e-3);
        (lumen, junctions)
    }

    fn sample(lumen: &BuiltLumen, bytes: &[u8], at_m: [f64; 3]) -> WallSample<f64> {
        Lumen::new(lumen.header, bytes).unwrap().sample(at_m)
    }

    #[test]
    fn the_wall_between_two_branches_comes_nearer_and_no_other() {
        let (lumen, junctions) = divided();
        let nearer = junctions.nearer(&lumen.bytes, BY_M);
        let by_m = |at_m: [f64; 3]| {
            let [before, after] = [&lumen.bytes, &nearer].map(|b| sample(&lumen, b, at_m));
            before.distance_m - after.distance_m
        };
        let [x, y, z] = RIDGE_M;
        for before_m in [0.3e-3, 0.6e-3, 0.9e-3] {
            let moved = by_m([x - before_m, y, z]);
            assert!((0.85..1.05).contains(&(moved / BY_M)), "{before_m}: {moved}");
        }
        for at_m in [[20e-3, 4e-3, 0.0], [60e-3, 1e-3, 0.0], [80e-3, 8e-3, 2.5e-3]] {
            assert!(by_m(at_m).abs() < 1e-6, "{at_m:?}");
        }
    }

    #[test]
    fn normals_stay_gradients_of_the_distance() {
        let (lumen, junctions) = divided();
        let nearer = junctions.nearer(&lumen.bytes, BY_M);
        let change = |at_m: [f64; 3]| {
            let [before, after] = [&lumen.bytes, &nearer].map(|b| sample(&lumen, b, at_m));
            (after.distance_m - before.distance_m, after.normal - before.normal)
        };
        let (mut largest, mut compared) = (0.0_f64, 0);
        for step in 0..120 {
            let aside_m = [step % 10 - 3, step / 10 - 6, 0].map(|k| 0.5e-3 * f64::from(k));
            let at_m = [0, 1, 2].map(|axis| RIDGE_M[axis] + aside_m[axis]);
            if !(0.2e-3..1.2e-3).contains(&sample(&lumen, &lumen.bytes, at_m).distance_m) {
                continue;
            }
            const WAY_M: f64 = 0.4e-3;
            let slope = |axis: usize| {
                let at = |way_m: f64| {
                    let mut at_m = at_m;
                    at_m[axis] += way_m;
                    change(at_m).0
                };
                (at(WAY_M) - at(-WAY_M)) / (2.0 * WAY_M)
            };
            let normal = change(at_m).1;
            let off =
                Vector3::new(slope(0) - normal.x(), slope(1) - normal.y(), slope(2) - normal.z());
            assert!(off.norm() < 0.03, "{at_m:?}: {off:?}");
            largest = largest.max(Vector3::new(slope(0), slope(1), slope(2)).norm());
            compared += 1;
        }
        assert!(compared > 5 && largest > 0.05, "{compared} {largest}");
    }

    #[test]
    fn a_tube_has_none() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let mut bundle = Bundle::open(&example).unwrap();
        bundle.mesh = None;
        bundle.centreline.retain(|branch| branch.name == "trunk");
        let (lumen, _) = lumen(&bundle, 0.825e-3).unwrap();
        assert!(Junctions::of(&lumen.header, &lumen.bytes, 0.825e-3).is_empty());
    }
}
