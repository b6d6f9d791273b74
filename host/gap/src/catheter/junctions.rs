//! Uncertainty of walls that bend into the lumen, as they do where a vessel divides.
//!
//! A mesh follows a tube to some hundredths of a millimetre. Where tubes meet, the position of the wall
//! also depends on its facets, on the segmentation and on how the tubes are blended. An instrument that
//! leans on a dividing wall presses 10 % harder if that wall is 0.2 mm nearer.
//!
//! Ridges are where the divergence of the stored normals is above [`RIDGE_PER_M`]. Around them the wall
//! moves by a share (1 − ρ²/R²)², where ρ is the straight distance to the nearest ridge that faces the same
//! side and R is [`REACH_M`]. Normals turn by the slope of that displacement, to first order near the wall.

use std::collections::BTreeMap;

use cathforce_bundle::lumen::{StoredBrick, StoredNode, stored_bricks, stored_normal};
use cathforce_mechanics::{BRICK_EDGE, LumenHeader, NODE_BYTES};
use nalgebra::Vector3;

use crate::parallel::each;

/// A wall that is round with a radius R, seen from a distance d beside it, has normals that diverge by
/// 1/(R + d): so these are ridges sharper than about 3 mm, and the inner side of a bend is none.
const RIDGE_PER_M: f64 = 300.0;
/// From a ridge, a wall is known as well as elsewhere \[m\].
const REACH_M: f64 = 4e-3;
/// Nodes that see a ridge within that of each, at least: single ones are at the ends of a mesh.
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

impl Junctions {
    /// Of a lumen that an instrument of this outer radius touches; none of one that cannot be read.
    pub fn of(header: &LumenHeader, bytes: &[u8], outer_radius_m: f64) -> Self {
        let bricks = stored_bricks(header, bytes).unwrap_or_default();
        let touched = -BEHIND_M..outer_radius_m + BEYOND_M;
        let of_brick = |brick: &StoredBrick| {
            let nodes = brick.nodes.iter().enumerate();
            let touched = nodes.filter(|(_, node)| touched.contains(&node.distance_m));
            let bent = touched.filter(|(k, _)| divergence_per_m(brick, *k) > RIDGE_PER_M);
            bent.map(|(_, node)| (node.place, Seen::by(node))).collect::<Vec<_>>()
        };
        // Nodes on faces are stored more than once.
        let bent: BTreeMap<_, _> = bricks.iter().flat_map(of_brick).collect();
        let bent = Points::of(bent.into_values());
        let is_one_of_many = |seen: &Seen| bent.ways_to(seen).count() >= FEWEST;
        let ridges = Points::of(bent.all().filter(is_one_of_many));
        let near = |node: &StoredNode| {
            let seen = Seen::by(node);
            let ways = ridges.ways_to(&seen);
            let nearest = ways.min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
            let rest = 1.0 - nearest.norm_squared() / REACH_M.powi(2);
            let along = nearest - seen.normal * seen.normal.dot(&nearest);
            let tilt_per_m = along * (4.0 * rest / REACH_M.powi(2));
            Some(Near { at: node.at, share: rest * rest, tilt_per_m })
        };
        let nodes = match ridges.0.is_empty() {
            true => Vec::new(),
            false => {
                each(&bricks, |b| b.nodes.iter().filter_map(near).collect::<Vec<_>>()).concat()
            }
        };
        Self { nodes, unit_m: f64::from(header.distance_unit_m) }
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
            let stored = stored_normal(node);
            let length = stored.norm();
            // Its length stays, so that what does not tilt does not change.
            if let Some(tilted) = (stored + tilt_per_m * (by_m * length)).try_normalize(0.0) {
                let [x, y, z] = (tilted * length).map(|x| x.round() as i8 as u8).into();
                [node[2], node[3], node[4]] = [x, y, z];
            }
        }
        moved
    }
}

/// The point of the wall that a node sees.
#[derive(Clone, Copy, Debug)]
struct Seen {
    wall_m: Vector3<f64>,
    normal: Vector3<f64>,
}

impl Seen {
    fn by(node: &StoredNode) -> Self {
        let StoredNode { position_m, distance_m, normal, .. } = *node;
        Self { wall_m: position_m - normal * distance_m, normal }
    }
}

/// Of the normals at a node, by differences over the neighbours that are not behind the wall: there the
/// normals of another vessel may begin.
fn divergence_per_m(brick: &StoredBrick, k: usize) -> f64 {
    let mut sum = 0.0;
    for (axis, stride) in [1, BRICK_EDGE, BRICK_EDGE * BRICK_EDGE].into_iter().enumerate() {
        let place = k / stride % BRICK_EDGE;
        let counts = |k: &usize| brick.nodes[*k].distance_m > -BEHIND_M;
        let low = (place > 0).then(|| k - stride).filter(counts).unwrap_or(k);
        let high = (place + 1 < BRICK_EDGE).then(|| k + stride).filter(counts).unwrap_or(k);
        let rise = brick.nodes[high].normal[axis] - brick.nodes[low].normal[axis];
        let steps = (high - low) / stride;
        sum += rise / (steps.max(1) as f64 * brick.spacing_m);
    }
    sum
}

/// Points of walls, by boxes as wide as ridges reach: in an order, so that of two that are as near always
/// the same one counts.
struct Points(BTreeMap<[i32; 3], Vec<Seen>>);

impl Points {
    fn of(points: impl Iterator<Item = Seen>) -> Self {
        let mut boxes: BTreeMap<_, Vec<_>> = BTreeMap::new();
        points.for_each(|seen| boxes.entry(Self::box_of(&seen)).or_default().push(seen));
        Self(boxes)
    }

    fn box_of(seen: &Seen) -> [i32; 3] {
        seen.wall_m.map(|x| (x / REACH_M).floor() as i32).into()
    }

    fn all(&self) -> impl Iterator<Item = Seen> {
        self.0.values().flatten().copied()
    }

    /// To a point from every one within [`REACH_M`] that looks to the same side \[m\]: the wall opposite
    /// is another.
    fn ways_to(&self, seen: &Seen) -> impl Iterator<Item = Vector3<f64>> {
        let ([x, y, z], seen) = (Self::box_of(seen), *seen);
        let around = (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let near = around.filter_map(|own| self.0.get(&own)).flatten();
        let same = near.filter(move |own| own.normal.dot(&seen.normal) > 0.0);
        let ways = same.map(move |own| seen.wall_m - own.wall_m);
        ways.filter(|way| way.norm_squared() < REACH_M * REACH_M)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;
    use cathforce_bundle::lumen::BuiltLumen;
    use cathforce_mechanics::{BRICK_NODES, Lumen, NOMINAL_WALL};

    use super::*;
    use crate::catheter::plant::{Catheter, SPREAD_SHARE_UNDIVIDED, lumen, spread_share};
    use crate::catheter::simulate::{Setup, Simulator};
    use crate::catheter::ways::{WAYS, WITHOUT_JUNCTIONS};
    use crate::plant::Plant;

    /// Trunk and two branches; where they part, the wall points at the entry.
    const RIDGE_M: [f64; 3] = [69.25e-3, -1.75e-3, 0.1e-3];
    const BY_M: f64 = 2e-4;

    /// The example's lumen as it is stored, and with nearer junctions.
    struct Divided {
        header: LumenHeader,
        stored: Vec<u8>,
        nearer: Vec<u8>,
    }

    impl Divided {
        fn new() -> Self {
            let (BuiltLumen { header, bytes, .. }, _) = lumen(&example(), 0.825e-3).unwrap();
            let nearer = Junctions::of(&header, &bytes, 0.825e-3).nearer(&bytes, BY_M);
            Self { header, stored: bytes, nearer }
        }

        fn distance_m(&self, at_m: [f64; 3]) -> f64 {
            Lumen::new(self.header, &self.stored).unwrap().sample::<f64>(at_m).distance_m
        }

        /// Of distance and normal.
        fn change(&self, at_m: [f64; 3]) -> (f64, Vector3<f64>) {
            let [before, after] = [&self.stored, &self.nearer]
                .map(|bytes| Lumen::new(self.header, bytes).unwrap().sample::<f64>(at_m));
            let normal = after.normal - before.normal;
            let change_m = after.distance_m - before.distance_m;
            (change_m, Vector3::new(normal.x(), normal.y(), normal.z()))
        }
    }

    fn example() -> Bundle {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        Bundle::open(&example).unwrap()
    }

    #[test]
    fn the_wall_between_two_branches_comes_nearer_and_no_other() {
        let divided = Divided::new();
        let by_m = |at_m: [f64; 3]| -divided.change(at_m).0;
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
        let divided = Divided::new();
        let (mut largest, mut off_most, mut compared) = (0.0_f64, 0.0_f64, 0);
        for step in 0..120 {
            let aside_m = [step % 10 - 3, step / 10 - 6, 0].map(|k| 0.5e-3 * f64::from(k));
            let at_m = [0, 1, 2].map(|axis| RIDGE_M[axis] + aside_m[axis]);
            if !(0.2e-3..1.2e-3).contains(&divided.distance_m(at_m)) {
                continue;
            }
            const WAY_M: f64 = 0.4e-3;
            let slope = |axis: usize| {
                let at = |way_m: f64| {
                    let mut at_m = at_m;
                    at_m[axis] += way_m;
                    divided.change(at_m).0
                };
                (at(WAY_M) - at(-WAY_M)) / (2.0 * WAY_M)
            };
            let slopes = Vector3::from([0, 1, 2].map(slope));
            off_most = off_most.max((slopes - divided.change(at_m).1).norm());
            largest = largest.max(slopes.norm());
            compared += 1;
        }
        assert!(compared > 5 && largest > 0.05, "{compared} {largest}");
        assert!(off_most < 0.3 * largest, "{off_most} of {largest}");
    }

    #[test]
    fn a_nuisance_and_a_way_move_them_in_the_model() {
        let catheter = Catheter::new(&example()).unwrap();
        let [none, mut moved] = [0, 1].map(|_| vec![0.0; catheter.nuisances().len()]);
        let at = catheter.nuisances().iter().position(|own| own.name == "nearer junctions");
        moved[at.unwrap()] = catheter.priors.junctions_m;
        let setup = Setup::from(catheter.nominal.clone());
        let predict = |setup: &Setup, nuisances: &[f64]| {
            catheter.uncorrected(0, setup.clone(), nuisances).unwrap()
        };
        let by_nuisance = predict(&setup, &moved);
        let nearer = WAYS[WITHOUT_JUNCTIONS].apply(&setup, &catheter.priors);
        assert_eq!(by_nuisance, predict(&nearer, &none));
        let nominal = predict(&setup, &none);
        let changed = nominal.iter().zip(&by_nuisance).map(|(a, b)| (a - b).abs());
        // The first trial leans on the dividing wall.
        assert!(changed.fold(0.0, f64::max) > 5e-3);
    }

    #[test]
    fn a_wall_between_two_vessels_is_no_ridge() {
        // Two planes 1 mm apart, each with a lumen on its far side, in one brick of 1 mm.
        let header = LumenHeader {
            origin_m: [0.0; 3],
            cell_m: 1e-3,
            distance_unit_m: 0.25e-6,
            bricks: [1, 1, 1],
            stored: 1,
        };
        let wall = |y_mm: f64| if y_mm < 2.0 { (1.6 - y_mm, -127_i8) } else { (y_mm - 2.6, 127) };
        let mut bytes = vec![0, 0];
        for k in 0..BRICK_NODES {
            let (distance_mm, normal) = wall((k / BRICK_EDGE % BRICK_EDGE) as f64);
            bytes.extend(((1e-3 * distance_mm / 0.25e-6) as i16).to_le_bytes());
            bytes.extend([0, normal as u8, 0, NOMINAL_WALL]);
        }
        assert!(Lumen::new(header, &bytes).is_ok());
        assert!(Junctions::of(&header, &bytes, 0.825e-3).is_empty());
    }

    #[test]
    fn a_tube_has_none_and_narrower_intervals() {
        let mut bundle = example();
        bundle.mesh = None;
        bundle.centreline.retain(|branch| branch.name == "trunk");
        let (lumen, _) = lumen(&bundle, 0.825e-3).unwrap();
        assert!(Junctions::of(&lumen.header, &lumen.bytes, 0.825e-3).is_empty());
        let divided = Divided::new();
        let share = |header, bytes| spread_share(&Simulator::new(header, bytes, 0.825e-3, 1));
        assert_eq!(share(lumen.header, lumen.bytes), SPREAD_SHARE_UNDIVIDED);
        assert_eq!(share(divided.header, divided.stored), 1.0);
    }
}
