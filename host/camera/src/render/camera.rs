//! Which place of a plane each pixel of a camera shows.

use nalgebra::Vector3;

use crate::lens::model::Lens;
use crate::lens::pose::Pose;
use crate::picture::Picture;

/// Samples along a side of a pixel where something ends in it.
const FINE: usize = 5;

/// A lens with the direction of every pixel's corners, which takes longest to compute.
pub struct Camera {
    pub lens: Lens,
    /// (width + 1) × (height + 1); not a number where the lens shows nothing.
    directions: Vec<[f64; 2]>,
}

impl Camera {
    pub fn new(lens: Lens) -> Self {
        let [width, height] = lens.size();
        let corner = |i: usize| {
            let pixel = [(i % (width + 1)) as f64 - 0.5, (i / (width + 1)) as f64 - 0.5];
            lens.direction(pixel).unwrap_or([f64::NAN; 2])
        };
        Self { lens, directions: (0..(width + 1) * (height + 1)).map(corner).collect() }
    }

    /// The mean of `reflectance` over each pixel. It is given a place in the plane z = 0 of `pose` \[m\]
    /// and the pixel's number, and is asked once, in the middle, where `is_fine` says so of no pixel.
    pub fn see(
        &self,
        pose: &Pose,
        is_fine: impl Fn(usize) -> bool,
        reflectance: impl Fn([f64; 2], usize) -> f64,
    ) -> Picture {
        let [width, height] = self.lens.size();
        let places: Vec<[f64; 2]> = self.directions.iter().map(|d| place(pose, *d)).collect();
        let mut picture = Picture::uniform(width, height, 0.0);
        for y in 0..height {
            for x in 0..width {
                let (i, above) = (y * width + x, y * (width + 1) + x);
                let corners = [above, above + 1, above + width + 1, above + width + 2];
                let corners = corners.map(|k| places[k]);
                let side = if is_fine(i) { FINE } else { 1 };
                let mut sum = 0.0;
                for k in 0..side * side {
                    let share = |k: usize| (k as f64 + 0.5) / side as f64;
                    sum += reflectance(mix(corners, [share(k % side), share(k / side)]), i);
                }
                let mean = sum / (side * side) as f64;
                picture.grey[i] = if mean.is_finite() { mean as f32 } else { 0.0 };
            }
        }
        picture
    }

    /// The four places of the plane at a pixel's corners; what a pixel shows is a quadrangle.
    pub fn corners_of(&self, pose: &Pose, pixel: usize) -> [[f64; 2]; 4] {
        let width = self.lens.width_px;
        let above = (pixel / width) * (width + 1) + pixel % width;
        [above, above + 1, above + width + 1, above + width + 2]
            .map(|k| place(pose, self.directions[k]))
    }
}

/// Where a direction meets the plane z = 0 of a pose.
fn place(pose: &Pose, [x, y]: [f64; 2]) -> [f64; 2] {
    let back = pose.rotation.inverse();
    let (camera_m, ray) = (back * -pose.translation_m, back * Vector3::new(x, y, 1.0));
    let along = -camera_m.z / ray.z;
    match along > 0.0 {
        true => [camera_m.x + along * ray.x, camera_m.y + along * ray.y],
        false => [f64::NAN; 2],
    }
}

/// The place at shares of a quadrangle's width and height.
fn mix([a, b, c, d]: [[f64; 2]; 4], [u, v]: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| (1.0 - v) * ((1.0 - u) * a[k] + u * b[k]) + v * ((1.0 - u) * c[k] + u * d[k]))
}
