//! Sampling a wall on the bricks near it. Byte layout: `cathforce_mechanics::Lumen`.

use std::num::NonZero;
use std::thread;

use cathforce_mechanics::{
    BRICK_CELLS, BRICK_EDGE, BRICK_NODES, FREE, LumenHeader, NODE_BYTES, NOMINAL_WALL, OUTSIDE,
};
use nalgebra::Vector3;

use crate::geometry::Wall;

/// How finely and how widely a lumen is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumenOptions {
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Metres per unit of a stored distance; ± 32 767 of them must span the band and a brick.
    pub distance_unit_m: f64,
    /// Bricks that lie deeper than this inside the lumen are not stored \[m\].
    pub inside_m: f64,
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
            inside_m: outer_radius_m + 1e-3,
            outside_m: 2.5e-3,
            past_opening_m: 4e-3,
        }
    }
}

/// Header and bytes of a lumen, as [`cathforce_mechanics::Lumen::new`] takes them.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltLumen {
    pub header: LumenHeader,
    pub bytes: Vec<u8>,
}

/// What a brick of the directory holds.
enum Brick {
    Free,
    Outside,
    Stored(Box<[[u8; NODE_BYTES]; BRICK_NODES]>),
}

/// Most bricks along an axis, as the device takes them.
const MOST_ALONG_AXIS: usize = 1024;
/// Most bricks that are looked at: a directory of four times the device's room. One stray
/// corner of a vessel, metres away, must not cost hours.
const MOST_ENTRIES: usize = 1 << 22;

/// A grid of bricks around a wall.
struct Grid {
    origin_m: Vector3<f64>,
    bricks: [usize; 3],
    options: LumenOptions,
}

impl Grid {
    /// `None` when it would have too many bricks.
    fn around(wall: &dyn Wall, options: LumenOptions) -> Option<Self> {
        let (low, high) = wall.bounds_m();
        let margin = Vector3::repeat(options.outside_m + options.cell_m);
        // Nodes at whole multiples of the spacing, so that the field of a vessel does not
        // change with the extent of its far branches. f32 holds the origin.
        let first = ((low - margin) / options.cell_m).map(f64::floor);
        let origin_m = (first * options.cell_m).map(|x| f64::from(x as f32));
        let brick_m = options.cell_m * BRICK_CELLS as f64;
        let size = (high + margin - origin_m) / brick_m;
        let bricks = [size.x, size.y, size.z].map(|n| (n.ceil() as usize).max(1));
        let fits = bricks.iter().all(|&n| n <= MOST_ALONG_AXIS)
            && bricks.iter().product::<usize>() <= MOST_ENTRIES;
        fits.then_some(Self { origin_m, bricks, options })
    }

    fn len(&self) -> usize {
        self.bricks.iter().product()
    }

    fn corner_m(&self, entry: usize) -> Vector3<f64> {
        let [nx, ny, _] = self.bricks;
        let at = [entry % nx, entry / nx % ny, entry / (nx * ny)];
        let brick_m = f64::from(self.options.cell_m as f32) * BRICK_CELLS as f64;
        self.origin_m + Vector3::from_fn(|axis, _| at[axis] as f64 * brick_m)
    }

    fn brick(&self, wall: &dyn Wall, entry: usize) -> Brick {
        let options = &self.options;
        // As the device reads it back.
        let cell_m = f64::from(options.cell_m as f32);
        let corner = self.corner_m(entry);
        let half_m = 0.5 * cell_m * BRICK_CELLS as f64;
        let centre = wall.sample(&(corner + Vector3::repeat(half_m)));
        let away = |inside: bool| if inside { Brick::Free } else { Brick::Outside };
        // Distances change by no more than the way; past an opening by a little more.
        let reach_m = 1.1 * half_m * 3.0_f64.sqrt();
        let beside = centre.distance_m > options.inside_m + reach_m
            || centre.distance_m < -options.outside_m - reach_m
            || centre.beyond_m > options.past_opening_m + reach_m;
        if beside {
            return away(centre.distance_m > 0.0);
        }
        let mut nodes = Box::new([[0; NODE_BYTES]; BRICK_NODES]);
        let mut in_band = false;
        for (index, node) in nodes.iter_mut().enumerate() {
            let at = [
                index % BRICK_EDGE,
                index / BRICK_EDGE % BRICK_EDGE,
                index / (BRICK_EDGE * BRICK_EDGE),
            ];
            let offset = Vector3::from_fn(|axis, _| at[axis] as f64 * cell_m);
            let here = wall.sample(&(corner + offset));
            in_band |= here.distance_m < options.inside_m
                && here.distance_m > -options.outside_m
                && here.beyond_m < options.past_opening_m;
            let [low, high] =
                quantise(here.distance_m / f64::from(options.distance_unit_m as f32)).to_le_bytes();
            let normal = here.normal.map(|x| ((x * 127.0).round() as i8).to_le_bytes()[0]);
            *node = [low, high, normal.x, normal.y, normal.z, NOMINAL_WALL];
        }
        if in_band { Brick::Stored(nodes) } else { away(centre.distance_m > 0.0) }
    }
}

/// Nearest i16, saturating.
fn quantise(units: f64) -> i16 {
    units.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16
}

/// Samples `wall` on all processors. `None` when there are too many bricks, stored or not.
pub fn build_lumen(wall: &dyn Wall, options: LumenOptions) -> Option<BuiltLumen> {
    let grid = Grid::around(wall, options)?;
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let share = grid.len().div_ceil(16 * workers);
    let next = std::sync::atomic::AtomicUsize::new(0);
    let mut parts: Vec<(usize, Vec<Brick>)> = thread::scope(|scope| {
        let work = || {
            let mut done = Vec::new();
            loop {
                let first = next.fetch_add(share, std::sync::atomic::Ordering::Relaxed);
                if first >= grid.len() {
                    return done;
                }
                let entries = first..(first + share).min(grid.len());
                done.push((first, entries.map(|entry| grid.brick(wall, entry)).collect()));
            }
        };
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        threads
            .into_iter()
            .flat_map(|thread| match thread.join() {
                Ok(done) => done,
                Err(panic) => std::panic::resume_unwind(panic),
            })
            .collect()
    });
    parts.sort_unstable_by_key(|(first, _)| *first);

    let mut directory = Vec::with_capacity(2 * grid.len());
    let mut bricks: Vec<u8> = Vec::new();
    let mut stored: u16 = 0;
    for brick in parts.into_iter().flat_map(|(_, bricks)| bricks) {
        let entry = match brick {
            Brick::Free => FREE,
            Brick::Outside => OUTSIDE,
            Brick::Stored(nodes) => {
                bricks.extend(nodes.as_flattened());
                stored = stored.checked_add(1).filter(|&count| count < OUTSIDE)?;
                stored - 1
            }
        };
        directory.extend(entry.to_le_bytes());
    }
    let mut bytes = directory;
    bytes.append(&mut bricks);
    let [nx, ny, nz] = grid.bricks;
    let header = LumenHeader {
        origin_m: grid.origin_m.map(|x| x as f32).into(),
        cell_m: options.cell_m as f32,
        distance_unit_m: options.distance_unit_m as f32,
        bricks: [u16::try_from(nx).ok()?, u16::try_from(ny).ok()?, u16::try_from(nz).ok()?],
        stored,
    };
    Some(BuiltLumen { header, bytes })
}
