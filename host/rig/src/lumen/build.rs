//! Sampling a wall on the bricks near it. Byte layout: `cathforce_mechanics::Lumen`.

use std::collections::HashMap;

use cathforce_mechanics::{BRICK_CELLS, BRICK_NODES, FREE, LumenHeader, NOMINAL_WALL, OUTSIDE};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::grid::{Grid, Place, steps};
use crate::geometry::Wall;

/// How finely and how widely a lumen is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumenOptions {
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Metres per unit of a stored distance; ± 32 767 of them must span the band and a brick.
    pub distance_unit_m: f64,
    /// Of the instrument \[m\].
    pub outer_radius_m: f64,
    /// Bricks that lie farther than this outside are not stored \[m\].
    pub outside_m: f64,
    /// The wall goes on straight past an opening, for so long \[m\].
    pub past_opening_m: f64,
}

impl LumenOptions {
    /// What an instrument of this outer radius needs.
    pub fn for_instrument(outer_radius_m: f64, cell_m: f64) -> Self {
        Self {
            cell_m,
            distance_unit_m: 0.25e-6,
            outer_radius_m,
            outside_m: 2.5e-3,
            past_opening_m: 4e-3,
        }
    }

    /// Bricks that lie deeper than this inside the lumen are not stored \[m\].
    pub fn inside_m(&self) -> f64 {
        self.outer_radius_m + 1e-3
    }
}

/// Header and bytes of a lumen, as [`cathforce_mechanics::Lumen::new`] takes them.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltLumen {
    pub header: LumenHeader,
    pub bytes: Vec<u8>,
}

/// What a node holds before it is packed.
#[derive(Clone, Copy, Debug)]
struct Node {
    distance_m: f64,
    /// × 127, as it is stored.
    normal: [i8; 3],
    /// How far past an opening \[m\].
    beyond_m: f64,
}

impl Node {
    fn sample(wall: &dyn Wall, at: &Vector3<f64>) -> Self {
        let here = wall.sample(at);
        let normal = here.normal.map(|x| (x * 127.0).round() as i8).into();
        Self { distance_m: here.distance_m, normal, beyond_m: here.beyond_m }
    }
}

/// What a brick of the directory holds.
enum Brick {
    Free,
    Outside,
    /// Its nodes, as indices into [`Field::nodes`].
    Stored(Box<[u32; BRICK_NODES]>),
}

impl Brick {
    fn away(distance_m: f64) -> Self {
        if distance_m > 0.0 { Self::Free } else { Self::Outside }
    }
}

/// A sampled field: nodes that bricks share are there once.
struct Field {
    grid: Grid,
    options: LumenOptions,
    nodes: Vec<Node>,
    /// By directory entry.
    bricks: Vec<Brick>,
}

impl Field {
    fn sample(wall: &dyn Wall, options: LumenOptions) -> Option<Self> {
        let grid = Grid::around(wall, &options)?;
        let near: Vec<_> = (0..grid.len())
            .into_par_iter()
            .map(|entry| near(&grid, &options, wall, entry))
            .collect();

        let mut index_of: HashMap<Place, u32> = HashMap::new();
        let mut places = Vec::new();
        let mut bricks: Vec<_> = near
            .into_iter()
            .enumerate()
            .map(|(entry, near)| {
                if let Err(away) = near {
                    return away;
                }
                let mut nodes = Box::new([0; BRICK_NODES]);
                for (node, place) in nodes.iter_mut().zip(grid.nodes(entry)) {
                    *node = *index_of.entry(place).or_insert_with(|| {
                        places.push(place);
                        places.len() as u32 - 1
                    });
                }
                Brick::Stored(nodes)
            })
            .collect();
        let nodes: Vec<_> = places
            .into_par_iter()
            .map(|place| Node::sample(wall, &grid.position_m(steps(place))))
            .collect();

        let in_band = |&node: &u32| {
            let Node { distance_m, beyond_m, .. } = nodes[node as usize];
            distance_m < options.inside_m()
                && distance_m > -options.outside_m
                && beyond_m < options.past_opening_m
        };
        for brick in &mut bricks {
            if let Brick::Stored(indices) = brick
                && !indices.iter().any(in_band)
            {
                *brick = Brick::away(nodes[indices[BRICK_NODES / 2] as usize].distance_m);
            }
        }
        Some(Self { grid, options, nodes, bricks })
    }

    /// `None` when there are too many bricks for the directory's numbers.
    fn pack(&self) -> Option<BuiltLumen> {
        let unit_m = f64::from(self.options.distance_unit_m as f32);
        let mut bytes = Vec::with_capacity(2 * self.grid.len());
        let mut stored: u16 = 0;
        for brick in &self.bricks {
            let entry = match brick {
                Brick::Free => FREE,
                Brick::Outside => OUTSIDE,
                Brick::Stored(_) => {
                    stored = stored.checked_add(1).filter(|&count| count < OUTSIDE)?;
                    stored - 1
                }
            };
            bytes.extend(entry.to_le_bytes());
        }
        for brick in &self.bricks {
            let Brick::Stored(indices) = brick else { continue };
            for &index in indices.iter() {
                let node = &self.nodes[index as usize];
                bytes.extend(quantise(node.distance_m / unit_m).to_le_bytes());
                bytes.extend(node.normal.map(i8::cast_unsigned));
                bytes.push(NOMINAL_WALL);
            }
        }
        let [nx, ny, nz] = self.grid.bricks;
        let header = LumenHeader {
            origin_m: self.grid.origin_m.map(|x| x as f32).into(),
            cell_m: self.options.cell_m as f32,
            distance_unit_m: self.options.distance_unit_m as f32,
            bricks: [u16::try_from(nx).ok()?, u16::try_from(ny).ok()?, u16::try_from(nz).ok()?],
            stored,
        };
        Some(BuiltLumen { header, bytes })
    }
}

/// Whether a brick can reach into the stored band; what it is when it cannot.
fn near(grid: &Grid, options: &LumenOptions, wall: &dyn Wall, entry: usize) -> Result<(), Brick> {
    let half = 0.5 * BRICK_CELLS as f64;
    let middle = steps(grid.first_node(entry)) + Vector3::repeat(half);
    let centre = wall.sample(&grid.position_m(middle));
    // Distances change by no more than the way; past an opening by a little more.
    let reach_m = 1.1 * half * grid.cell_m * 3.0_f64.sqrt();
    let beside = centre.distance_m > options.inside_m() + reach_m
        || centre.distance_m < -options.outside_m - reach_m
        || centre.beyond_m > options.past_opening_m + reach_m;
    if beside { Err(Brick::away(centre.distance_m)) } else { Ok(()) }
}

/// Nearest i16, saturating.
fn quantise(units: f64) -> i16 {
    units.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16
}

/// Samples `wall` on all processors. `None` when there are too many bricks, stored or not.
pub fn build_lumen(wall: &dyn Wall, options: LumenOptions) -> Option<BuiltLumen> {
    Field::sample(wall, options)?.pack()
}
