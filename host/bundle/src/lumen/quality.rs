//! Errors of a stored lumen: interpolated against exact distance.

use cathforce_mechanics::{BRICK_CELLS, BRICK_EDGE, BRICK_NODES, FINE, NODE_BYTES, OUTSIDE};
use nalgebra::Vector3;

use super::beside::Beside;
use super::options::{BuiltLumen, LumenOptions};
use crate::geometry::{Wall, WallPoint};

/// Deepest indentation of a wall \[m\].
const DEEPEST_INDENTATION_M: f64 = 1e-3;
/// A surface that is farther from the wall cannot touch it within a step of 1 ms \[m\].
const AHEAD_M: f64 = 0.25e-3;

/// Median, 99th percentile and largest of a set of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

impl Spread {
    /// The spread of absolute values; zeros for an empty set.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut all: Vec<f64> = values.into_iter().map(f64::abs).collect();
        all.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * all.len() as f64) as usize;
            all.get(index.min(all.len().saturating_sub(1))).copied().unwrap_or_default()
        };
        Self { p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

/// Errors of the stored field at random points where the instrument touches the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LumenQuality {
    /// Points compared.
    pub points: usize,
    /// An instrument's centre line lies between these distances from the wall, positive
    /// inside, when it touches it \[m\].
    pub touching_m: [f64; 2],
    /// Distance with the normals' second-order term, as the device interpolates \[m\].
    pub distance_m: Spread,
    /// Distance by plain trilinear interpolation \[m\].
    pub trilinear_m: Spread,
    /// Angle between stored and exact normal \[rad\].
    pub normal_rad: Spread,
    /// Where the largest error of the distance is \[m\].
    pub worst_at_m: [f64; 3],
    /// Error of the distance deeper inside, where it is stored but nothing touches \[m\].
    pub deeper_m: Spread,
    /// Points compared there.
    pub deeper_points: usize,
    /// Points where an instrument touches the wall, but no brick is stored.
    pub not_stored: usize,
    /// One of them \[m\].
    pub not_stored_at_m: [f64; 3],
}

/// Reference evaluation of a stored lumen in f64:
/// distance = Σ wᵢ (dᵢ + ½ nᵢ·(x − xᵢ)), normal = Σ wᵢ nᵢ normalised, with the trilinear
/// weights wᵢ of the cell's corners. Also gives the plain trilinear distance.
/// `None` where no brick is stored.
pub fn interpolate(lumen: &BuiltLumen, p: &Vector3<f64>) -> Option<(WallPoint, f64)> {
    let header = &lumen.header;
    let (mut cell_m, unit_m) = (f64::from(header.cell_m), f64::from(header.distance_unit_m));
    let bricks = header.bricks.map(usize::from);
    // Coordinates in bricks, then in cells of the brick.
    let mut scaled = (p - Vector3::from(header.origin_m.map(f64::from))) / cell_m;
    scaled /= BRICK_CELLS as f64;
    if (0..3).any(|axis| !(0.0..bricks[axis] as f64).contains(&scaled[axis])) {
        return None;
    }
    let [x, y, z] = [scaled.x, scaled.y, scaled.z].map(|at| at as usize);
    let entry = (z * bricks[1] + y) * bricks[0] + x;
    let index = u16::from_le_bytes([lumen.bytes[2 * entry], lumen.bytes[2 * entry + 1]]);
    if index >= OUTSIDE {
        return None;
    }
    let mut brick = usize::from(index & !FINE);
    scaled.apply(|at| *at -= at.floor());
    if index & FINE != 0 {
        cell_m *= 0.5;
        scaled *= 2.0;
        let octant = [scaled.x, scaled.y, scaled.z].map(|at| at as usize);
        brick += octant[0] + 2 * octant[1] + 4 * octant[2];
        scaled.apply(|at| *at -= at.floor());
    }
    scaled *= BRICK_CELLS as f64;
    let cell = [scaled.x, scaled.y, scaled.z].map(|at| (at as usize).min(BRICK_CELLS - 1));
    let brick_bytes = BRICK_NODES * NODE_BYTES;
    let first = 2 * bricks.iter().product::<usize>() + brick * brick_bytes;
    let (mut distance_m, mut trilinear_m, mut normal) = (0.0, 0.0, Vector3::zeros());
    for corner in 0..8 {
        let (mut weight, mut offset) = (1.0, Vector3::zeros());
        let mut node = 0;
        for axis in (0..3).rev() {
            let up = corner >> axis & 1;
            let share = scaled[axis] - cell[axis] as f64;
            weight *= if up == 1 { share } else { 1.0 - share };
            offset[axis] = (share - up as f64) * cell_m;
            node = node * BRICK_EDGE + cell[axis] + up;
        }
        let bytes = &lumen.bytes[first + node * NODE_BYTES..][..NODE_BYTES];
        let stored_m = f64::from(i16::from_le_bytes([bytes[0], bytes[1]])) * unit_m;
        let n = Vector3::from_fn(|axis, _| f64::from(bytes[2 + axis].cast_signed()) / 127.0);
        distance_m += weight * (stored_m + 0.5 * n.dot(&offset));
        trilinear_m += weight * stored_m;
        normal += n * weight;
    }
    let normal = normal.try_normalize(1e-9).unwrap_or_default();
    Some((WallPoint { distance_m, normal, beyond_m: 0.0 }, trilinear_m))
}

/// A point of the comparison.
struct Compared {
    at: Vector3<f64>,
    stored: WallPoint,
    trilinear_m: f64,
    exact: WallPoint,
}

/// Points of the comparison.
#[derive(Default)]
struct Points {
    /// Where an instrument touches the wall.
    touching: Vec<Compared>,
    /// The same, but no brick is stored there.
    not_stored: Vec<Vector3<f64>>,
    /// Deeper inside.
    deeper: Vec<Compared>,
}

/// Draws random points beside the wall and not past an opening, by their exact distance alone, until
/// an instrument touches the wall at `points` of them.
fn compare(lumen: &BuiltLumen, wall: &dyn Wall, options: &LumenOptions, points: usize) -> Points {
    let [low_m, high_m] = touching_m(options);
    let deepest_m = options.inside_m();
    let mut beside = Beside::new(wall);
    let mut found = Points::default();
    // The bound ends the search if the instrument fits nowhere.
    for _ in 0..4 * points {
        let Some(at) = beside.place(low_m, deepest_m) else { continue };
        let exact = wall.sample(&at);
        let is_beside = exact.distance_m > low_m && exact.distance_m < deepest_m;
        if !is_beside || exact.beyond_m > 0.0 {
            continue;
        }
        let touches = exact.distance_m < high_m;
        match interpolate(lumen, &at) {
            Some((stored, trilinear_m)) => {
                let of = if touches { &mut found.touching } else { &mut found.deeper };
                of.push(Compared { at, stored, trilinear_m, exact });
            }
            None if touches => found.not_stored.push(at),
            None => {}
        }
        if found.touching.len() + found.not_stored.len() == points {
            break;
        }
    }
    found
}

pub(super) fn touching_m(options: &LumenOptions) -> [f64; 2] {
    let radius_m = options.outer_radius_m;
    [radius_m - DEEPEST_INDENTATION_M, radius_m + AHEAD_M]
}

/// Compares at up to `points` random points where an instrument touches the wall.
pub fn measure(
    lumen: &BuiltLumen,
    wall: &dyn Wall,
    options: &LumenOptions,
    points: usize,
) -> LumenQuality {
    let Points { touching: compared, not_stored, deeper } = compare(lumen, wall, options, points);
    let error = |c: &Compared| c.stored.distance_m - c.exact.distance_m;
    let worst = compared.iter().max_by(|a, b| error(a).abs().total_cmp(&error(b).abs()));
    let angle = |c: &Compared| {
        let (stored, exact) = (&c.stored.normal, &c.exact.normal);
        stored.cross(exact).norm().atan2(stored.dot(exact))
    };
    LumenQuality {
        points: compared.len(),
        touching_m: touching_m(options),
        distance_m: Spread::of(compared.iter().map(error)),
        trilinear_m: Spread::of(compared.iter().map(|c| c.trilinear_m - c.exact.distance_m)),
        normal_rad: Spread::of(compared.iter().map(angle)),
        worst_at_m: worst.map(|c| c.at.into()).unwrap_or_default(),
        deeper_m: Spread::of(deeper.iter().map(error)),
        deeper_points: deeper.len(),
        not_stored: not_stored.len(),
        not_stored_at_m: not_stored.first().map(|&at| at.into()).unwrap_or_default(),
    }
}

/// Errors against another wall at the points of [`measure`] that lie beside it: those of the stored
/// distance, and those of `wall` itself \[m\]. `None` if there is no such point.
pub fn measure_against(
    lumen: &BuiltLumen,
    wall: &dyn Wall,
    other: &dyn Wall,
    options: &LumenOptions,
    points: usize,
) -> Option<(Spread, Spread)> {
    let pairs: Vec<_> = compare(lumen, wall, options, points)
        .touching
        .into_iter()
        .map(|compared| (other.sample(&compared.at), compared))
        .filter(|(other, _)| other.beyond_m == 0.0)
        .collect();
    let error = |distance_m: &dyn Fn(&Compared) -> f64| {
        Spread::of(pairs.iter().map(|(other, c)| distance_m(c) - other.distance_m))
    };
    (!pairs.is_empty()).then(|| (error(&|c| c.stored.distance_m), error(&|c| c.exact.distance_m)))
}
