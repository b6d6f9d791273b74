//! A webcam above a phantom, with everything known: what tests, examples and reproductions render.

use nalgebra::{Rotation3, Vector2, Vector3};

use super::camera::Camera;
use super::curve::{Piece, curve, first};
use super::film::Film;
use super::scene::{self, Stroke};
use crate::board::Board;
use crate::lens::model::Lens;
use crate::lens::pose::Pose;
use crate::picture::Picture;

/// Outer diameter of a catheter of 4 French \[m\].
pub const DIAMETER_M: f64 = 1.32e-3;
/// Ground of a phantom under a lamp, as a share of white.
const GROUND: f64 = 0.8;
/// A dark catheter, and the edge of a transparent vessel.
const DARK: f64 = 0.12;
const EDGE: f64 = 0.62;
/// Points of a rendered line are this far apart \[m\]: a chord of it is off an arc of 8 mm by 0.6 µm.
const STEP_M: f64 = 2e-4;

/// A camera of 1280 × 720 pixels half a metre above the vessel's x–y plane, which it sees along −z.
pub struct Stand {
    pub camera: Camera,
    /// The vessel's frame in the camera's.
    pub pose: Pose,
    pub board: Board,
    /// The vessel's middle and the catheter in it.
    route: Vec<Piece>,
    pub entry_m: Vector2<f64>,
}

impl Stand {
    /// A webcam's lens, tilted by 6° against the plane. A box of 300 mm × 170 mm fills the picture.
    pub fn webcam() -> Self {
        let lens = Lens::pinhole([1280, 720], [952.0, 955.0], [648.5, 352.0]);
        let lens = Lens { k1: 0.09, k2: -0.21, p1: 0.0012, p2: -0.0018, ..lens };
        // y of the vessel points up in the picture, z towards the camera.
        let over = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let tilt = Rotation3::from_scaled_axis(Vector3::new(0.10, -0.03, 0.02));
        let rotation = tilt * over;
        let middle_m = Vector3::new(0.11, 0.0, 0.0);
        let translation_m = Vector3::new(0.0, 0.0, 0.30) - rotation * middle_m;
        let piece = |length_m, curvature_per_m| Piece { length_m, curvature_per_m };
        Self {
            camera: Camera::new(lens),
            pose: Pose { rotation, translation_m },
            board: Board { columns: 9, rows: 6, square_mm: 12.0 },
            // Straight, up into a branch, and back: radii of 60 and 80 mm.
            route: vec![
                piece(0.05, 0.0),
                piece(0.05, 1.0 / 0.060),
                piece(0.06, -1.0 / 0.080),
                piece(0.10, 0.0),
            ],
            entry_m: Vector2::new(0.0, -0.02),
        }
    }

    /// The middle of the catheter when `length_m` of it is past the entry \[m\]: it follows the vessel, but
    /// for its tip, which is bent by 70° to a radius of 8 mm. Begins 40 mm before the entry.
    pub fn catheter(&self, length_m: f64) -> Vec<Vector2<f64>> {
        const BEFORE_M: f64 = 0.04;
        const HOOK: Piece = Piece { length_m: 0.0098, curvature_per_m: -1.0 / 0.008 };
        let hook = Piece { length_m: HOOK.length_m.min(length_m), ..HOOK };
        let mut pieces = vec![Piece { length_m: BEFORE_M, curvature_per_m: 0.0 }];
        pieces.extend(first(&self.route, length_m - hook.length_m));
        pieces.push(hook);
        let start = self.entry_m - Vector2::new(BEFORE_M, 0.0);
        curve(start.into(), 0.0, &pieces, STEP_M)
    }

    /// A frame with so much of the catheter past the entry.
    pub fn frame(&self, length_m: f64, film: &Film, seed: u64) -> Picture {
        let catheter = Stroke {
            line_m: self.catheter(length_m),
            diameter_m: DIAMETER_M,
            reflectance: DARK,
            highlight: 0.25,
        };
        let mut all = self.vessel();
        all.push(catheter);
        let plane = self.pose;
        film.expose(&scene::strokes(&self.camera, &plane, GROUND, &all), seed)
    }

    /// The same view without the catheter.
    pub fn background(&self, film: &Film, seed: u64) -> Picture {
        film.expose(&scene::strokes(&self.camera, &self.pose, GROUND, &self.vessel()), seed)
    }

    /// The two edges of the vessel, 19 mm apart, as faint lines.
    fn vessel(&self) -> Vec<Stroke> {
        let middle = curve(self.entry_m.into(), 0.0, &self.route, 1e-3);
        let beside = |side: f64| {
            let offset = |i: usize| {
                let (before, after) = (i.saturating_sub(1), (i + 1).min(middle.len() - 1));
                let along = (middle[after] - middle[before]).normalize();
                middle[i] + side * Vector2::new(-along.y, along.x)
            };
            let line_m = (0..middle.len()).map(offset).collect();
            Stroke { line_m, diameter_m: 0.8e-3, reflectance: EDGE, highlight: 0.0 }
        };
        vec![beside(9.5e-3), beside(-9.5e-3)]
    }

    /// Pictures of the board from twelve directions, near to all borders of the picture.
    pub fn calibration_pictures(&self, film: &Film) -> Vec<(String, Picture)> {
        let views = [
            ([0.0, 0.0, 0.0], [0.0, 0.0]),
            ([0.45, 0.0, 0.1], [0.0, 0.02]),
            ([-0.45, 0.1, 0.0], [0.0, -0.02]),
            ([0.0, 0.5, 0.0], [0.05, 0.0]),
            ([0.1, -0.5, 0.0], [-0.05, 0.0]),
            ([0.25, 0.25, 0.3], [-0.10, -0.05]),
            ([-0.25, 0.25, -0.2], [-0.10, 0.05]),
            ([0.25, -0.25, 1.5], [0.11, 0.02]),
            ([-0.25, -0.25, 0.1], [0.10, 0.05]),
            ([0.3, 0.0, 3.1], [0.10, -0.05]),
            ([0.0, 0.35, 1.6], [-0.12, 0.0]),
            ([-0.35, 0.2, -0.3], [0.0, 0.06]),
        ];
        let taken = views.into_iter().enumerate().map(|(i, (turn, at))| {
            let rotation = Rotation3::from_scaled_axis(Vector3::from(turn));
            let middle_m = Vector3::new(0.048, 0.030, 0.0);
            let place_m = Vector3::new(at[0], at[1], 0.30);
            let pose = Pose { rotation, translation_m: place_m - rotation * middle_m };
            let picture = scene::board(&self.camera, &pose, &self.board);
            (format!("board{:02}.png", i + 1), film.expose(&picture, 1000 + i as u64))
        });
        taken.collect()
    }

    /// Where the first corner of the plane's board lies in the vessel's frame \[m\], and the directions of
    /// its rows and columns.
    pub const PLANE_BOARD: [[f64; 3]; 3] = [[0.06, 0.03, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];

    /// A picture of the board in the plane of the catheter.
    pub fn plane_picture(&self, film: &Film) -> Picture {
        let [origin, x, y] = Self::PLANE_BOARD.map(Vector3::from);
        let axes = nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let rotation = self.pose.rotation * Rotation3::from_matrix_unchecked(axes);
        let pose = Pose { rotation, translation_m: self.pose.apply(origin) };
        film.expose(&scene::board(&self.camera, &pose, &self.board), 999)
    }
}
