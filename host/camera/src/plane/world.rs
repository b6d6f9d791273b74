//! The plane in which the catheter lies, between pixels and the vessel's frame.

use nalgebra::Vector3;

use crate::lens::model::Lens;
use crate::lens::pose::{Pose, plane_pose};

/// A plane of the vessel's frame as the camera sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    pub lens: Lens,
    /// The vessel's frame in the camera's.
    pub pose: Pose,
    /// A point of the plane, vessel frame \[m\].
    pub point_m: Vector3<f64>,
    /// Unit normal, vessel frame, towards the camera.
    pub normal: Vector3<f64>,
    /// What the plane was found from, and how well it fits.
    pub quality: PlaneQuality,
}

/// How well the places that define a plane fit it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneQuality {
    /// Number of corners or points.
    pub points: usize,
    /// Root of the mean squared distance to their expected pixels \[px\].
    pub rms_px: f64,
    /// The largest distance in the plane between a point and where its pixel says it is \[m\].
    pub worst_m: f64,
    /// Which one that is, counted from 0.
    pub worst: usize,
}

/// A frame in the plane: what a board or points are given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    pub origin_m: Vector3<f64>,
    /// Orthonormal, vessel frame.
    pub x: Vector3<f64>,
    pub y: Vector3<f64>,
}

impl Plane {
    /// The plane through points that are given in its own axes \[m\] and by their pixels, moved
    /// towards the camera by `offset_m`.
    ///
    /// Returns `None` where the points do not determine it.
    pub fn fit(
        lens: &Lens,
        axes: Axes,
        points_m: &[[f64; 2]],
        pixels: &[[f64; 2]],
        offset_m: f64,
    ) -> Option<Self> {
        let of_plane = plane_pose(lens, points_m, pixels)?;
        let normal = axes.x.cross(&axes.y);
        let from_plane = nalgebra::Matrix3::from_columns(&[axes.x, axes.y, normal]);
        let to_plane = nalgebra::Rotation3::from_matrix_unchecked(from_plane.transpose());
        let rotation = of_plane.rotation * to_plane;
        let translation_m = of_plane.translation_m - rotation * axes.origin_m;
        let pose = Pose { rotation, translation_m };
        // The camera is at the origin of its frame.
        let camera_m = pose.rotation.inverse() * -pose.translation_m;
        let is_ahead = (camera_m - axes.origin_m).dot(&normal) > 0.0;
        let normal = if is_ahead { normal } else { -normal };
        let quality = PlaneQuality { points: points_m.len(), rms_px: 0.0, worst_m: 0.0, worst: 0 };
        let mut plane = Self { lens: *lens, pose, point_m: axes.origin_m, normal, quality };
        let mut squares = 0.0;
        for (i, (point, pixel)) in points_m.iter().zip(pixels).enumerate() {
            let point_m = axes.origin_m + point[0] * axes.x + point[1] * axes.y;
            let seen = plane.pixel(point_m)?;
            squares += (seen[0] - pixel[0]).powi(2) + (seen[1] - pixel[1]).powi(2);
            let error_m = (plane.place(*pixel)? - point_m).norm();
            if error_m > plane.quality.worst_m {
                (plane.quality.worst_m, plane.quality.worst) = (error_m, i);
            }
        }
        plane.quality.rms_px = (squares / points_m.len() as f64).sqrt();
        plane.point_m += offset_m * plane.normal;
        Some(plane)
    }

    /// Where the plane is seen at a pixel, vessel frame \[m\]. `None` where the lens or the plane is
    /// not seen there.
    pub fn place(&self, pixel: [f64; 2]) -> Option<Vector3<f64>> {
        let [x, y] = self.lens.direction(pixel)?;
        let back = self.pose.rotation.inverse();
        let (camera_m, ray) = (back * -self.pose.translation_m, back * Vector3::new(x, y, 1.0));
        let along = (self.point_m - camera_m).dot(&self.normal) / ray.dot(&self.normal);
        (along > 0.0 && along.is_finite()).then(|| camera_m + along * ray)
    }

    /// The pixel of a point of the vessel's frame \[m\]. `None` behind the camera.
    pub fn pixel(&self, point_m: Vector3<f64>) -> Option<[f64; 2]> {
        let p = self.pose.apply(point_m);
        (p.z > 0.0).then(|| self.lens.project(p))
    }

    /// Length of the plane that one pixel shows at a place \[m\]: the mean over directions.
    pub fn pixel_m(&self, pixel: [f64; 2]) -> Option<f64> {
        let here = self.place(pixel)?;
        let right = self.place([pixel[0] + 1.0, pixel[1]])? - here;
        let down = self.place([pixel[0], pixel[1] + 1.0])? - here;
        Some(right.cross(&down).norm().sqrt())
    }

    /// Distance of a point from the plane, positive towards the camera \[m\].
    pub fn height_m(&self, point_m: Vector3<f64>) -> f64 {
        (point_m - self.point_m).dot(&self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn a_plane_maps_pixels_back_and_its_offset_points_to_the_camera() {
        let lens = Lens { k1: -0.1, ..Lens::pinhole([1280, 720], [900.0; 2], [640.0, 360.0]) };
        // The camera looks down on the vessel's x–z plane from +y.
        let axes =
            Axes { origin_m: Vector3::new(0.01, 0.02, 0.03), x: Vector3::x(), y: Vector3::z() };
        let of_plane = Pose {
            rotation: Rotation3::from_scaled_axis(Vector3::new(0.1, 0.05, 0.3)),
            translation_m: Vector3::new(-0.05, -0.02, 0.5),
        };
        let points: Vec<[f64; 2]> =
            (0..20).map(|i| [0.02 * f64::from(i % 5), 0.03 * f64::from(i / 5)]).collect();
        let pixels: Vec<_> = points
            .iter()
            .map(|p| lens.project(of_plane.apply(Vector3::new(p[0], p[1], 0.0))))
            .collect();
        let plane = Plane::fit(&lens, axes, &points, &pixels, 0.0).unwrap();
        assert!(plane.quality.rms_px < 1e-6 && plane.quality.worst_m < 1e-9);
        let point = axes.origin_m + 0.04 * axes.x + 0.05 * axes.y;
        let pixel = plane.pixel(point).unwrap();
        assert!((plane.place(pixel).unwrap() - point).norm() < 1e-9);
        let scale = plane.pixel_m([640.0, 360.0]).unwrap();
        assert!((scale - 0.5 / 900.0).abs() < 0.1 * scale, "{scale}");
        let raised = Plane::fit(&lens, axes, &points, &pixels, 0.005).unwrap();
        let camera = plane.pose.rotation.inverse() * -plane.pose.translation_m;
        assert!((plane.height_m(camera) - raised.height_m(camera) - 0.005).abs() < 1e-9);
        // Nearer to the camera a pixel shows less.
        assert!(raised.pixel_m([640.0, 360.0]).unwrap() < scale);
    }
}
