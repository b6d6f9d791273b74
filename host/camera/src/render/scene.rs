//! A board, and lines of known shape on a ground.

use nalgebra::{Vector2, Vector3};

use super::camera::Camera;
use crate::board::Board;
use crate::lens::pose::Pose;
use crate::picture::Picture;

/// Reflectance of printed black and of paper.
const INK: f64 = 0.08;
const PAPER: f64 = 0.92;

/// A line of constant width in the plane, such as a catheter or the edge of a vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its middle \[m\]; the last point is the nose of its round end.
    pub line_m: Vec<Vector2<f64>>,
    pub diameter_m: f64,
    pub reflectance: f64,
    /// Reflectance of a bright line a third of the radius beside the middle, as a lamp makes on a round
    /// thing; 0 for none.
    pub highlight: f64,
}

/// The reflectance of a board in the plane z = 0 of `pose`, on a table as bright as its paper.
pub fn board(camera: &Camera, pose: &Pose, board: &Board) -> Picture {
    let square_m = 1e-3 * board.square_mm;
    let reflectance = |[x, y]: [f64; 2]| {
        let (i, j) = ((x / square_m).floor() + 1.0, (y / square_m).floor() + 1.0);
        let is_inside = i >= 0.0 && j >= 0.0 && i <= board.columns as f64 && j <= board.rows as f64;
        if is_inside && (i + j).rem_euclid(2.0) < 0.5 { INK } else { PAPER }
    };
    let is_fine = |pixel: usize| {
        let [a, b, c, d] = camera.corners_of(pose, pixel).map(reflectance);
        a != b || a != c || a != d
    };
    camera.see(pose, is_fine, |place, _| reflectance(place))
}

/// The reflectance of a ground with strokes in the plane z = 0 of `pose`; later ones lie above.
pub fn strokes(camera: &Camera, pose: &Pose, ground: f64, strokes: &[Stroke]) -> Picture {
    let drawn: Vec<_> = strokes.iter().map(|stroke| Drawn::new(camera, pose, stroke)).collect();
    let is_fine = |pixel: usize| drawn.iter().any(|drawn| drawn.near[pixel].is_some());
    camera.see(pose, is_fine, |place, pixel| {
        let above = drawn.iter().rev().find_map(|drawn| drawn.reflectance(place.into(), pixel));
        above.unwrap_or(ground)
    })
}

/// A stroke with the pixels that it may touch.
struct Drawn<'a> {
    stroke: &'a Stroke,
    /// The line, shortened so that its round end is where the stroke ends.
    line_m: Vec<Vector2<f64>>,
    /// For each pixel the first and the last segment that may be near.
    near: Vec<Option<[u32; 2]>>,
}

impl<'a> Drawn<'a> {
    fn new(camera: &Camera, pose: &Pose, stroke: &'a Stroke) -> Self {
        let line_m = shortened(&stroke.line_m, 0.5 * stroke.diameter_m);
        let [width, height] = camera.lens.size();
        let mut near: Vec<Option<[u32; 2]>> = vec![None; width * height];
        let pixel = |p: Vector2<f64>| camera.lens.project(pose.apply(Vector3::new(p.x, p.y, 0.0)));
        for (segment, pair) in line_m.windows(2).enumerate() {
            let [from, to] = [pair[0], pair[1]].map(pixel);
            let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
            let beside = pixel(0.5 * (pair[0] + pair[1]) + Vector2::new(stroke.diameter_m, 0.0));
            let diameter = (beside[0] - middle[0]).hypot(beside[1] - middle[1]);
            let reach = 0.5 * (to[0] - from[0]).hypot(to[1] - from[1]) + 0.75 * diameter + 2.0;
            let range = |middle: f64, size: usize| {
                let low = (middle - reach).floor().max(0.0) as usize;
                low..((middle + reach).ceil().max(0.0) as usize + 1).min(size)
            };
            for (x, y) in
                range(middle[1], height).flat_map(|y| range(middle[0], width).map(move |x| (x, y)))
            {
                let segment = segment as u32;
                let first = near[y * width + x].map_or(segment, |[first, _]| first);
                near[y * width + x] = Some([first, segment]);
            }
        }
        Self { stroke, line_m, near }
    }

    /// The reflectance of the stroke at a place, if it is there.
    fn reflectance(&self, place: Vector2<f64>, pixel: usize) -> Option<f64> {
        let [first, last] = self.near[pixel]?;
        let mut best = (f64::INFINITY, 0.0);
        for pair in self.line_m[first as usize..=last as usize + 1].windows(2) {
            let along = pair[1] - pair[0];
            let share = (place - pair[0]).dot(&along) / along.norm_squared().max(1e-18);
            let from = place - pair[0] - share.clamp(0.0, 1.0) * along;
            if from.norm() < best.0 {
                best = (from.norm(), along.perp(&from).signum());
            }
        }
        let radius_m = 0.5 * self.stroke.diameter_m;
        let (distance_m, side) = best;
        (distance_m <= radius_m).then(|| {
            let beside = (side * distance_m / radius_m - 0.33) / 0.15;
            self.stroke.reflectance + self.stroke.highlight * (-0.5 * beside * beside).exp()
        })
    }
}

/// A line without its last `by_m`.
fn shortened(line_m: &[Vector2<f64>], by_m: f64) -> Vec<Vector2<f64>> {
    let mut line = line_m.to_vec();
    let mut left = by_m;
    while line.len() > 1 {
        let (end, before) = (line[line.len() - 1], line[line.len() - 2]);
        let step = (end - before).norm();
        line.pop();
        if step > left {
            line.push(end + (before - end) * (left / step));
            break;
        }
        left -= step;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::model::Lens;
    use nalgebra::Rotation3;

    fn camera() -> (Camera, Pose) {
        let lens = Lens::pinhole([200, 100], [1000.0; 2], [99.5, 49.5]);
        // One pixel shows half a millimetre.
        let translation_m = Vector3::new(0.0, 0.0, 0.5);
        (Camera::new(lens), Pose { rotation: Rotation3::identity(), translation_m })
    }

    #[test]
    fn a_stroke_covers_its_area_and_ends_at_its_last_point() {
        let (camera, pose) = camera();
        let line_m = (0..=40).map(|i| Vector2::new(-0.02 + 0.001 * f64::from(i), 0.001)).collect();
        let stroke = Stroke { line_m, diameter_m: 2e-3, reflectance: 0.0, highlight: 0.0 };
        let picture = strokes(&camera, &pose, 1.0, &[stroke]);
        let dark: f64 = picture.grey.iter().map(|grey| 1.0 - f64::from(*grey)).sum();
        // 39 mm of 2 mm width with two half discs, in pixels of 0.25 mm².
        let expected = (39.0 * 2.0 + std::f64::consts::PI) / 0.25;
        assert!((dark / expected - 1.0).abs() < 0.005, "{dark} {expected}");
        let row = |x: usize| picture.at(x, 51);
        // 20 mm are 40 pixels to the right of the middle.
        assert!(row(138) < 0.05 && row(140) > 0.95, "{} {}", row(138), row(140));
    }

    #[test]
    fn the_first_square_of_a_board_is_black() {
        let (camera, pose) = camera();
        let picture = board(&camera, &pose, &Board { columns: 3, rows: 2, square_mm: 10.0 });
        // The first inner corner is in the middle; a square is 20 pixels.
        assert_eq!((picture.at(90, 40), picture.at(110, 40)), (INK as f32, PAPER as f32));
        assert_eq!((picture.at(60, 40), picture.at(90, 60)), (PAPER as f32, PAPER as f32));
    }
}
