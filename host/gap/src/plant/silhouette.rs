//! The outline of a vessel, seen from the side that shows most of it.

use std::collections::BTreeMap;

use cathforce_mechanics::{BRICK_CELLS, Lumen};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Pixels along the longer side of the plane in which the outline is looked for.
const PIXELS: f64 = 240.0;
/// Pixels of nothing around it, so that every line closes.
const MARGIN: f64 = 2.0;
/// Change of the distance from pixel to pixel, over their side, that a wall has at most.
const WALL: f64 = 2.0;
/// A direction is called after an axis that it is as near to (cosine of 20°).
const NEARLY: f64 = 0.94;

/// Projection of a vessel onto the plane of its two longest principal axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Silhouette {
    centre_m: Vector3<f64>,
    /// To the right, upwards, to the eye.
    axes: [Vector3<f64>; 3],
    /// Where the instrument comes in, in the plane.
    pub entry_m: [f64; 2],
    /// Closed lines, in the plane.
    pub outline_m: Vec<Vec<[f64; 2]>>,
}

impl Silhouette {
    /// Of what the field says is inside, the entry to the left; `None` where nothing is.
    pub fn of(lumen: &Lumen<'_>, entry_m: [f64; 3]) -> Option<Self> {
        let inside = inside(lumen);
        let count = inside.len() as f64;
        let centre_m = inside.iter().sum::<Vector3<f64>>() / count;
        if !centre_m.iter().all(|x| x.is_finite()) {
            return None;
        }
        let spread: Matrix3<f64> =
            inside.iter().map(|p| (p - centre_m) * (p - centre_m).transpose()).sum();
        let entry = Vector3::from(entry_m);
        let axes = axes(spread / count, entry - centre_m);
        let mut found = Self { centre_m, axes, entry_m: [0.0; 2], outline_m: Vec::new() };
        found.entry_m = found.project(entry_m);
        found.outline_m = found.plane(lumen, &inside).outline();
        Some(found)
    }

    /// Where a point is in the plane.
    pub fn project(&self, point_m: [f64; 3]) -> [f64; 2] {
        let from = Vector3::from(point_m) - self.centre_m;
        [from.dot(&self.axes[0]), from.dot(&self.axes[1])]
    }

    /// Width and height of the outline.
    pub fn size_m(&self) -> [f64; 2] {
        let [[left, right], [low, high]] = self.bounds_m();
        [right - left, high - low]
    }

    /// From left to right, from below upwards: what the outline spans.
    pub fn bounds_m(&self) -> [[f64; 2]; 2] {
        let points = || self.outline_m.iter().flatten();
        [0, 1].map(|k| {
            let values = points().map(|p| p[k]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        })
    }

    /// Along what one looks, in words.
    pub fn seen_along(&self) -> String {
        let eye = self.axes[2];
        let largest = eye.iamax();
        if eye[largest].abs() >= NEARLY {
            return format!("{} axis", ["x", "y", "z"][largest]);
        }
        let [x, y, z] = [eye.x, eye.y, eye.z].map(|x| (10.0 * x).round() / 10.0 + 0.0);
        format!("direction ({x:.1}, {y:.1}, {z:.1})")
    }

    /// The largest distance to the wall along every line of sight: positive where one passes through
    /// the lumen.
    fn plane(&self, lumen: &Lumen<'_>, inside: &[Vector3<f64>]) -> Plane {
        let cell_m = f64::from(lumen.header().cell_m);
        let range = |axis: usize| {
            let along = inside.iter().map(|p| (p - self.centre_m).dot(&self.axes[axis]));
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x - cell_m), high.max(x + cell_m)]
            })
        };
        let [across, up, depth] = [0, 1, 2].map(range);
        let side_m = (across[1] - across[0]).max(up[1] - up[0]) / PIXELS;
        let first_m = [across[0], up[0]].map(|low| low - MARGIN * side_m);
        let count =
            |[low, high]: [f64; 2]| ((high - low) / side_m + 2.0 * MARGIN).ceil() as usize + 1;
        let (columns, rows) = (count(across), count(up));
        let looks = ((depth[1] - depth[0]) / (0.5 * cell_m)).ceil() as usize + 1;
        let mut distance_m = vec![-cell_m; rows * columns];
        for row in 1..rows - 1 {
            for column in 1..columns - 1 {
                let at = self.centre_m
                    + self.axes[0] * (first_m[0] + column as f64 * side_m)
                    + self.axes[1] * (first_m[1] + row as f64 * side_m);
                let look = |k: usize| {
                    let p = at + self.axes[2] * (depth[0] + k as f64 * 0.5 * cell_m);
                    lumen.sample::<f64>(<[f64; 3]>::from(p)).distance_m
                };
                distance_m[row * columns + column] = (0..looks).map(look).fold(-1.0, f64::max);
            }
        }
        let mut plane = Plane { first_m, side_m, columns, distance_m };
        plane.close();
        // Far from any wall the field says ±1 m.
        plane.distance_m.iter_mut().for_each(|d| *d = d.clamp(-cell_m, cell_m));
        plane
    }
}

/// Nodes of the field that are inside.
fn inside(lumen: &Lumen<'_>) -> Vec<Vector3<f64>> {
    let header = lumen.header();
    let nodes = header.bricks.map(|bricks| usize::from(bricks) * BRICK_CELLS + 1);
    let mut found = Vec::new();
    for z in 0..nodes[2] {
        for y in 0..nodes[1] {
            for x in 0..nodes[0] {
                let index = [x, y, z];
                let at: [f64; 3] = std::array::from_fn(|k| {
                    f64::from(header.origin_m[k]) + index[k] as f64 * f64::from(header.cell_m)
                });
                if lumen.sample::<f64>(at).distance_m > 0.0 {
                    found.push(Vector3::from(at));
                }
            }
        }
    }
    found
}

/// Principal axes, the longest to the right and away from the entry, the shortest to the eye.
fn axes(spread: Matrix3<f64>, entry: Vector3<f64>) -> [Vector3<f64>; 3] {
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let axis = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
    let (mut right, mut up) = (axis(0), axis(1));
    if entry.dot(&right) > 0.0 {
        right.neg_mut();
    }
    // What is up in the vessel's frame is up in the figure.
    if up[up.iamax()] < 0.0 {
        up.neg_mut();
    }
    [right, up, right.cross(&up)]
}

/// Values at the corners of pixels.
struct Plane {
    first_m: [f64; 2],
    side_m: f64,
    columns: usize,
    distance_m: Vec<f64>,
}

/// A side of a pixel: its first corner, and whether it goes up.
type Side = (usize, bool);

impl Plane {
    fn rows(&self) -> usize {
        self.distance_m.len() / self.columns
    }

    /// Cuts off what the field has past openings, where no wall is: there its sign changes at once,
    /// while at a wall the distance goes through zero.
    fn close(&mut self) {
        let (rows, columns) = (self.rows(), self.columns);
        let [mut across, mut up] = [[usize::MAX, 0]; 2];
        for corner in 0..self.distance_m.len() {
            let (column, row) = (corner % columns, corner / columns);
            let right = (column + 1 < columns).then_some(corner + 1);
            let above = (row + 1 < rows).then_some(corner + columns);
            for other in right.into_iter().chain(above) {
                let (a, b) = (self.distance_m[corner], self.distance_m[other]);
                if (a > 0.0) != (b > 0.0) && (a - b).abs() < WALL * self.side_m {
                    across = [across[0].min(column), across[1].max(other % columns)];
                    up = [up[0].min(row), up[1].max(other / columns)];
                }
            }
        }
        for (corner, distance_m) in self.distance_m.iter_mut().enumerate() {
            let within = |at: usize, [low, high]: [usize; 2]| (low..=high).contains(&at);
            let margin = [0, columns - 1].contains(&(corner % columns))
                || [0, rows - 1].contains(&(corner / columns));
            if margin || !within(corner % columns, across) || !within(corner / columns, up) {
                *distance_m = -1.0;
            }
        }
    }

    /// Lines at a distance of zero, by marching squares.
    fn outline(&self) -> Vec<Vec<[f64; 2]>> {
        let mut joined: BTreeMap<Side, Vec<Side>> = BTreeMap::new();
        let rows = self.rows();
        let is_inside = |corner: usize| self.distance_m[corner] > 0.0;
        for row in 0..rows - 1 {
            for column in 0..self.columns - 1 {
                let low = row * self.columns + column;
                let high = low + self.columns;
                // Anticlockwise, each side with its two ends.
                let sides = [
                    ((low, false), [low, low + 1]),
                    ((low + 1, true), [low + 1, high + 1]),
                    ((high, false), [high + 1, high]),
                    ((low, true), [high, low]),
                ];
                let crossed = sides.iter().filter(|(_, [a, b])| is_inside(*a) != is_inside(*b));
                let mut crossed: Vec<_> = crossed.collect();
                // Of four, the two around the same corner inside belong together.
                if crossed.len() == 4 && is_inside(low) {
                    crossed.rotate_right(1);
                }
                for pair in crossed.chunks_exact(2) {
                    joined.entry(pair[0].0).or_default().push(pair[1].0);
                    joined.entry(pair[1].0).or_default().push(pair[0].0);
                }
            }
        }
        let mut lines = Vec::new();
        while let Some((&start, _)) = joined.first_key_value() {
            let (mut line, mut at) = (Vec::new(), start);
            while let Some(next) = joined.remove(&at) {
                line.push(self.crossing(at));
                at = next.into_iter().find(|side| joined.contains_key(side)).unwrap_or(start);
            }
            lines.push(line);
        }
        lines
    }

    /// Where the distance is zero on a side.
    fn crossing(&self, (corner, goes_up): Side) -> [f64; 2] {
        let other = corner + if goes_up { self.columns } else { 1 };
        let (a, b) = (self.distance_m[corner], self.distance_m[other]);
        let share = a / (a - b);
        let place = [(corner % self.columns) as f64, (corner / self.columns) as f64];
        let along = [if goes_up { 0.0 } else { share }, if goes_up { share } else { 0.0 }];
        [0, 1].map(|k| self.first_m[k] + self.side_m * (place[k] + along[k]))
    }
}

#[cfg(any(test, feature = "toy"))]
impl Silhouette {
    /// Of something flat, the entry in the middle of its left side.
    pub fn rectangle([left, right]: [f64; 2], [low, high]: [f64; 2]) -> Self {
        Self {
            centre_m: Vector3::zeros(),
            axes: [Vector3::x(), Vector3::y(), Vector3::z()],
            entry_m: [left, 0.5 * (low + high)],
            outline_m: vec![vec![[left, low], [right, low], [right, high], [left, high]]],
        }
    }
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::geometry::{Branch, Station, TubeWall};
    use cathforce_bundle::lumen::{LumenOptions, build_lumen};

    use super::*;

    const RADIUS_M: f64 = 4e-3;
    const BEND_M: f64 = 0.05;

    /// A third of a circle in the plane of x and y, and where it begins.
    fn bend() -> (Silhouette, [f64; 3]) {
        let station = |i: usize| {
            let angle = 0.02 * i as f64;
            let position_m = BEND_M * Vector3::new(angle.sin(), 1.0 - angle.cos(), 0.3);
            Station { s_m: BEND_M * angle, position_m, radius_m: RADIUS_M }
        };
        let branch = Branch { name: "bend".to_owned(), stations: (0..105).map(station).collect() };
        let wall = TubeWall::new(&[branch]);
        let built = build_lumen(&wall, LumenOptions::for_instrument(5e-4, 1e-3)).unwrap();
        let lumen = Lumen::new(built.header, &built.bytes).unwrap();
        let entry_m = [0.0, 0.0, 0.3 * BEND_M];
        (Silhouette::of(&lumen, entry_m).unwrap(), entry_m)
    }

    #[test]
    fn a_bend_is_seen_across_its_plane_as_wide_as_it_is() {
        let (found, entry_m) = bend();
        assert_eq!(found.seen_along(), "z axis");
        assert_eq!(found.outline_m.len(), 1, "one wall, one line");
        let centre = found.project([0.0, BEND_M, 0.3 * BEND_M]);
        let entry = found.project(entry_m);
        assert!(entry[0] < 0.0 && entry == found.entry_m);
        // Beside the openings, every point of the line is one radius beside the circle.
        let far =
            found.project((BEND_M * Vector3::new(2.1_f64.sin(), 1.0 - 2.1_f64.cos(), 0.3)).into());
        let distance = |a: &[f64; 2], b: [f64; 2]| f64::hypot(a[0] - b[0], a[1] - b[1]);
        let beside: Vec<f64> = found.outline_m[0]
            .iter()
            .filter(|p| distance(p, entry) > 0.016 && distance(p, far) > 0.016)
            .map(|p| (distance(p, centre) - BEND_M).abs())
            .collect();
        assert!(beside.len() > 200);
        let worst = beside.iter().map(|off| (off - RADIUS_M).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst}");
    }

    #[test]
    fn what_the_field_has_past_an_opening_is_no_vessel() {
        let (found, _) = bend();
        // The wall goes on straight for 4 mm, and nothing is stored far beyond.
        let [width_m, height_m] = found.size_m();
        assert!(
            width_m < 2.0 * (BEND_M + RADIUS_M) && height_m < 2.0 * BEND_M,
            "{width_m} {height_m}"
        );
    }
}
