//! How far the camera is off: rendered frames of a known catheter, through the whole pipeline.

use std::time::Instant;

use nalgebra::Vector3;

use super::film::{Film, Glare};
use super::stand::{DIAMETER_M, Stand};
use crate::calibration::calibrate::{Calibrated, CalibrationOptions, calibrate};
use crate::corners::find::find_board;
use crate::error::CameraError;
use crate::plane::world::{Axes, Plane};
use crate::shape::centreline::{arc, at_arc};
use crate::shape::track::{Entry, Miss, NoView, Sighting, TrackOptions, Tracker};

/// Points of the shape that are compared, as many as the published comparison of a catheter's deformation
/// has ("Catheter modelling for medical simulator with CathBot integration", MSc thesis, Twente, section 6.3).
pub const POINTS: usize = 16;

/// A stand whose camera was calibrated from pictures alone.
pub struct Study {
    pub stand: Stand,
    pub calibrated: Calibrated,
    pub plane: Plane,
}

/// A condition under which frames are taken.
#[derive(Clone, Debug)]
pub struct Condition {
    pub name: &'static str,
    pub film: Film,
    /// Whether a picture without the catheter is given.
    pub with_background: bool,
}

/// Errors over the frames of one condition.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    pub frames: usize,
    /// Distance of the tip from the true one, of each frame that was not missed \[m\].
    pub tip_m: Vec<f64>,
    /// Root of the mean squared distance of the shape's points from the true ones, likewise \[m\].
    pub shape_rms_m: Vec<f64>,
    /// Mean distance of each of the shape's points, from the tip \[m\].
    pub by_point_m: Vec<f64>,
    pub missed: Vec<Miss>,
    /// Time that the search of a frame took on one core \[s\], on average.
    pub seconds_a_frame: f64,
}

/// Conditions from a studio to a lamp that shines on the catheter.
pub fn conditions() -> Vec<Condition> {
    let webcam = Film::webcam();
    let with = |name, film, with_background| Condition { name, film, with_background };
    let glare = |pixel, radius_px, grey| Glare { pixel, radius_px, grey };
    vec![
        with("even light, no noise", Film::PLAIN, false),
        with("webcam: uneven light, blur, noise of 3 grey values", webcam.clone(), false),
        with("webcam, background picture", webcam.clone(), true),
        with("webcam, half the light", Film { white: 110.0, ..webcam.clone() }, false),
        with("webcam, noise of 8 grey values", Film { noise: 8.0, ..webcam.clone() }, false),
        with(
            "webcam, glare on the catheter's middle",
            Film {
                glare: vec![glare([370.0, 413.0], 12.0, 200.0), glare([560.0, 330.0], 60.0, 60.0)],
                ..webcam
            },
            false,
        ),
    ]
}

impl Study {
    /// Calibrates from rendered pictures of a board, and finds the plane from a board that lies in it.
    pub fn new(film: &Film) -> Result<Self, CameraError> {
        let stand = Stand::webcam();
        let pictures = stand.calibration_pictures(film);
        let calibrated = calibrate(&pictures, &stand.board, CalibrationOptions::default())?;
        let lens = calibrated.calibration.lens;
        let pixels = find_board(&stand.plane_picture(film), &stand.board);
        let [origin_m, x, y] = Stand::PLANE_BOARD.map(Vector3::from);
        let axes = Axes { origin_m, x, y };
        let corners_m = stand.board.corners_m();
        let plane = pixels.ok().and_then(|px| Plane::fit(&lens, axes, &corners_m, &px, 0.0));
        let plane = plane.ok_or(CameraError::OneDirection)?;
        Ok(Self { stand, calibrated, plane })
    }

    /// Where the catheter comes in.
    pub fn entry(&self) -> Entry {
        let entry = self.stand.entry_m;
        Entry { position_m: Vector3::new(entry.x, entry.y, 0.0), direction: Vector3::x() }
    }

    /// A tracker for frames of a condition.
    pub fn tracker(&self, condition: &Condition) -> Result<Tracker, NoView> {
        let film = &condition.film;
        let background = condition.with_background.then(|| self.stand.background(film, 77));
        let options = TrackOptions { background, points: POINTS, ..TrackOptions::default() };
        Tracker::new(self.plane.clone(), self.entry(), DIAMETER_M, options)
    }

    /// The true points at equal steps from the tip to the entry, when `length_m` are past the entry.
    pub fn truth(&self, length_m: f64) -> Vec<Vector3<f64>> {
        let line = self.stand.catheter(length_m);
        let lengths = arc(&line);
        let whole = lengths.last().copied().unwrap_or(0.0);
        let point = |k: usize| {
            let at = whole - length_m * k as f64 / (POINTS - 1) as f64;
            at_arc(&line, &lengths, at).push(0.0)
        };
        (0..POINTS).map(point).collect()
    }

    /// Errors over frames of a condition, with so much of the catheter past the entry in each.
    pub fn errors(&self, condition: &Condition, lengths_m: &[f64]) -> Result<Errors, NoView> {
        let tracker = self.tracker(condition)?;
        let mut errors = Errors { by_point_m: vec![0.0; POINTS], ..Errors::default() };
        for (i, length_m) in lengths_m.iter().enumerate() {
            let frame = self.stand.frame(*length_m, &condition.film, i as u64);
            let started = Instant::now();
            let seen = tracker.track(&frame);
            errors.seconds_a_frame += started.elapsed().as_secs_f64();
            errors.frames += 1;
            match seen {
                Ok(seen) => errors.add(&seen, &self.truth(*length_m)),
                Err(miss) => errors.missed.push(miss),
            }
        }
        errors.seconds_a_frame /= errors.frames.max(1) as f64;
        let found = errors.tip_m.len().max(1) as f64;
        errors.by_point_m.iter_mut().for_each(|sum| *sum /= found);
        Ok(errors)
    }
}

impl Errors {
    fn add(&mut self, seen: &Sighting, truth: &[Vector3<f64>]) {
        let distance = |(a, b): (&[f64; 3], &Vector3<f64>)| (Vector3::from(*a) - b).norm();
        let distances: Vec<f64> = seen.shape_m.iter().zip(truth).map(distance).collect();
        let square = distances.iter().map(|d| d * d).sum::<f64>() / distances.len() as f64;
        self.by_point_m.iter_mut().zip(&distances).for_each(|(sum, d)| *sum += d);
        self.tip_m.push(distances[0]);
        self.shape_rms_m.push(square.sqrt());
    }
}

/// Mean and largest of some values.
pub fn mean_and_worst(values: &[f64]) -> [f64; 2] {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    [mean, values.iter().copied().fold(0.0, f64::max)]
}
