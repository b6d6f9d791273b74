//! Sampling a wall on the bricks near it. Byte layout: `cathforce_mechanics::Lumen`.
//!
//! All bricks begin with the grid's spacing; those with the largest error then get half of it, as far
//! as there is room.

use std::collections::HashMap;
use std::slice;

use cathforce_mechanics::{
    BRICK_CELLS, BRICK_NODES, FINE, FREE, LumenHeader, MOST_BRICKS, NODE_BYTES, NOMINAL_WALL,
    OCTANTS, OUTSIDE,
};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::grid::{Grid, Place, half_steps};
use super::options::{BuiltLumen, DEVICE_LUMEN_BYTES, LumenOptions};
use super::quality::{interpolate, touching_m};
use crate::geometry::Wall;

/// A node before it is packed.
#[derive(Clone, Copy, Debug)]
struct Node {
    distance_m: f64,
    /// Stored form: the unit vector × 127.
    normal: [i8; 3],
    /// How far past an opening \[m\].
    beyond_m: f64,
    /// Stored form of the stiffness.
    wall: u8,
}

impl Node {
    fn sample(wall: &dyn Wall, at: &Vector3<f64>) -> Self {
        let here = wall.sample(at);
        let normal = here.normal.map(|x| (x * 127.0).round() as i8).into();
        let wall = wall_code(wall.stiffness_ratio(at));
        Self { distance_m: here.distance_m, normal, beyond_m: here.beyond_m, wall }
    }
}

/// An entry of the directory.
enum Brick {
    Free,
    Outside,
    /// Its nodes, as indices into [`Field::nodes`].
    Stored(Nodes),
    /// Those of its octants.
    Fine(Vec<Nodes>),
}

type Nodes = Box<[u32; BRICK_NODES]>;

impl Brick {
    fn away(distance_m: f64) -> Self {
        if distance_m > 0.0 { Self::Free } else { Self::Outside }
    }
}

/// A sampled field; nodes that bricks share are stored once.
struct Field<'a> {
    wall: &'a dyn Wall,
    grid: Grid,
    options: LumenOptions,
    nodes: Vec<Node>,
    index_of: HashMap<Place, u32>,
    /// By directory entry.
    bricks: Vec<Brick>,
    /// [`BuiltLumen::fine`]
    fine: [usize; 2],
}

impl<'a> Field<'a> {
    fn sample(wall: &'a dyn Wall, options: LumenOptions) -> Option<Self> {
        let grid = Grid::around(wall, &options)?;
        let near = all_near(&grid, &options, wall);
        // A lumen that is far too large is refused before it takes minutes and gigabytes.
        if count_near(&near) > 2 * usize::from(MOST_BRICKS) {
            return None;
        }
        let (nodes, index_of) = (Vec::new(), HashMap::new());
        let bricks = Vec::new();
        let mut field = Self { wall, grid, options, nodes, index_of, bricks, fine: [0; 2] };
        let mut bricks = field.with_nodes(|indices| {
            let brick = |(entry, near): (usize, Result<(), Brick>)| match near {
                Ok(()) => Brick::Stored(indices.of(grid.nodes(entry))),
                Err(away) => away,
            };
            near.into_iter().enumerate().map(brick).collect::<Vec<_>>()
        });
        for brick in &mut bricks {
            if let Brick::Stored(indices) = brick
                && !indices.iter().any(|&node| field.is_in_band(node))
            {
                let middle = field.nodes[indices[BRICK_NODES / 2] as usize];
                *brick = Brick::away(middle.distance_m);
            }
        }
        field.bricks = bricks;
        Some(field)
    }

    /// Calls `make`, then samples all nodes that it asked for; returns its result.
    fn with_nodes<T>(&mut self, make: impl FnOnce(&mut Indices<'_>) -> T) -> T {
        let mut indices =
            Indices { first: self.nodes.len(), of: &mut self.index_of, new: Vec::new() };
        let made = make(&mut indices);
        let sample = |place| Node::sample(self.wall, &self.grid.position_m(half_steps(place)));
        let new = indices.new.into_par_iter().map(sample);
        self.nodes.par_extend(new);
        made
    }

    fn is_in_band(&self, node: u32) -> bool {
        let Node { distance_m, beyond_m, .. } = self.nodes[node as usize];
        distance_m < self.options.inside_m()
            && distance_m > -self.options.outside_m
            && beyond_m < self.options.past_opening_m
    }

    /// Gives half the spacing to the bricks with the largest error, as far as there is room.
    fn refine(&mut self, built: &BuiltLumen) {
        let more = usize::from(OCTANTS - 1) * BRICK_NODES * NODE_BYTES;
        let room = self.options.room_bytes.saturating_sub(built.bytes.len()) / more;
        let numbers = usize::from(MOST_BRICKS - built.header.stored) / usize::from(OCTANTS - 1);
        let stored = |entry: &usize| matches!(self.bricks[*entry], Brick::Stored(_));
        let entries: Vec<usize> = (0..self.bricks.len()).filter(stored).collect();
        let error_m = |entry| (self.error_m(built, entry), entry);
        let mut errors: Vec<_> = entries.into_par_iter().map(error_m).collect();
        errors.retain(|(error_m, _)| *error_m > self.options.fine_above_m);
        errors.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let fine = errors.len().min(room).min(numbers);
        self.fine = [fine, errors.len() - fine];
        errors.truncate(fine);
        let grid = self.grid;
        let fine = self.with_nodes(|indices| {
            let of = |(_, entry)| (entry, grid.octants(entry).map(|o| indices.of(o)).collect());
            errors.into_iter().map(of).collect::<Vec<(usize, Vec<Nodes>)>>()
        });
        for (entry, octants) in fine {
            self.bricks[entry] = Brick::Fine(octants);
        }
    }

    /// Largest error of a brick's distances in the middle of its cells, where an instrument touches \[m\].
    fn error_m(&self, built: &BuiltLumen, entry: usize) -> f64 {
        let [low_m, high_m] = touching_m(&self.options);
        let first = half_steps(self.grid.first_node(entry));
        let error_m = |cell: usize| {
            let along = [cell, cell / BRICK_CELLS, cell / BRICK_CELLS.pow(2)];
            let amid = Vector3::from(along.map(|n| (2 * (n % BRICK_CELLS) + 1) as f64));
            let at = self.grid.position_m(first + amid);
            let (stored, trilinear_m) = interpolate(built, &at)?;
            // The corners are half a diagonal away, so this is off the distance by less.
            if trilinear_m < low_m - self.grid.cell_m || trilinear_m > high_m + self.grid.cell_m {
                return None;
            }
            let exact = self.wall.sample(&at);
            let touches = (low_m..high_m).contains(&exact.distance_m) && exact.beyond_m <= 0.0;
            touches.then_some((stored.distance_m - exact.distance_m).abs())
        };
        (0..BRICK_CELLS.pow(3)).filter_map(error_m).fold(0.0, f64::max)
    }

    /// `None` when there are too many bricks for the directory's numbers.
    fn pack(&self) -> Option<BuiltLumen> {
        let unit_m = f64::from(self.options.distance_unit_m as f32);
        let mut bytes = Vec::with_capacity(2 * self.grid.len());
        let mut stored: u16 = 0;
        for brick in &self.bricks {
            let (entry, bricks) = match brick {
                Brick::Free => (FREE, 0),
                Brick::Outside => (OUTSIDE, 0),
                Brick::Stored(_) => (stored, 1),
                Brick::Fine(_) => (FINE | stored, OCTANTS),
            };
            stored = stored.checked_add(bricks).filter(|&count| count <= MOST_BRICKS)?;
            bytes.extend(entry.to_le_bytes());
        }
        for brick in &self.bricks {
            let bricks = match brick {
                Brick::Free | Brick::Outside => &[],
                Brick::Stored(nodes) => slice::from_ref(nodes),
                Brick::Fine(octants) => octants.as_slice(),
            };
            for &index in bricks.iter().flat_map(|nodes| nodes.iter()) {
                let node = &self.nodes[index as usize];
                bytes.extend(quantise(node.distance_m / unit_m).to_le_bytes());
                bytes.extend(node.normal.map(i8::cast_unsigned));
                bytes.push(node.wall);
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
        Some(BuiltLumen { header, bytes, fine: self.fine })
    }
}

/// Assigns indices to nodes.
struct Indices<'a> {
    /// Number of nodes that were there before.
    first: usize,
    of: &'a mut HashMap<Place, u32>,
    /// Nodes that have to be sampled.
    new: Vec<Place>,
}

impl Indices<'_> {
    fn of(&mut self, places: impl Iterator<Item = Place>) -> Nodes {
        let mut nodes = Box::new([0; BRICK_NODES]);
        for (node, place) in nodes.iter_mut().zip(places) {
            *node = *self.of.entry(place).or_insert_with(|| {
                self.new.push(place);
                (self.first + self.new.len() - 1) as u32
            });
        }
        nodes
    }
}

/// `Ok` if a brick can reach into the stored band, else what it is.
fn near(grid: &Grid, options: &LumenOptions, wall: &dyn Wall, entry: usize) -> Result<(), Brick> {
    let half = 0.5 * BRICK_CELLS as f64;
    let middle = half_steps(grid.first_node(entry)) + Vector3::repeat(2.0 * half);
    let centre = wall.sample(&grid.position_m(middle));
    // A distance changes by no more than the way; past an opening, by a little more.
    let reach_m = 1.1 * half * grid.cell_m * 3.0_f64.sqrt();
    let beside = centre.distance_m > options.inside_m() + reach_m
        || centre.distance_m < -options.outside_m - reach_m
        || centre.beyond_m > options.past_opening_m + reach_m;
    if beside { Err(Brick::away(centre.distance_m)) } else { Ok(()) }
}

/// At least one in so many of the bricks that may reach into the band does. They are judged by the
/// sphere around them, whose margin is widest in a narrow vessel.
const MOST_NEAR_TO_ONE: usize = 3;

/// [`near`] of every entry of the directory.
fn all_near(grid: &Grid, options: &LumenOptions, wall: &dyn Wall) -> Vec<Result<(), Brick>> {
    (0..grid.len()).into_par_iter().map(|entry| near(grid, options, wall, entry)).collect()
}

fn count_near(near: &[Result<(), Brick>]) -> usize {
    near.iter().filter(|near| near.is_ok()).count()
}

/// Whether the device may have room for a lumen, judged without sampling its nodes.
pub(crate) fn may_fit(wall: &dyn Wall, options: &LumenOptions) -> bool {
    Grid::around(wall, options).is_some_and(|grid| {
        let bricks = count_near(&all_near(&grid, options, wall)) / MOST_NEAR_TO_ONE;
        2 * grid.len() + bricks * BRICK_NODES * NODE_BYTES <= DEVICE_LUMEN_BYTES
    })
}

/// The byte of a stiffness over the nominal one: sixteen steps to a doubling, saturating.
fn wall_code(ratio: f64) -> u8 {
    (f64::from(NOMINAL_WALL) + 16.0 * ratio.log2()).round() as u8
}

/// Nearest i16, saturating.
fn quantise(units: f64) -> i16 {
    units.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16
}

/// Samples `wall` on all processors. `None` when there are too many bricks, stored or not.
pub fn build_lumen(wall: &dyn Wall, options: LumenOptions) -> Option<BuiltLumen> {
    let mut field = Field::sample(wall, options)?;
    let built = field.pack()?;
    field.refine(&built);
    field.pack()
}
