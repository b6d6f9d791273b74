//! Where a plane is before a camera: homographies and poses.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, Vector2, Vector3};

use super::model::{Lens, PARAMETERS};
use crate::least_squares::{Linear, Problem, minimise};

/// Rotation and place of a frame in the camera's: X_camera = R X + t \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    pub rotation: Rotation3<f64>,
    pub translation_m: Vector3<f64>,
}

/// Derivatives of a pixel by a pose: three of a turn about the camera's axes, three of a shift.
pub type ByPose = SMatrix<f64, 2, 6>;

impl Pose {
    pub fn apply(&self, point_m: Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_m + self.translation_m
    }

    /// A turn about the camera's axes, applied after the pose's own, and a shift.
    pub fn moved(&self, turn: Vector3<f64>, shift_m: Vector3<f64>) -> Self {
        let turn = Rotation3::from_scaled_axis(turn);
        Self { rotation: turn * self.rotation, translation_m: turn * self.translation_m + shift_m }
    }

    /// The pixel of a point, with its derivatives by this pose and by the lens.
    pub fn seen(
        &self,
        lens: &Lens,
        point_m: Vector3<f64>,
    ) -> ([f64; 2], ByPose, SMatrix<f64, 2, PARAMETERS>) {
        let p = self.apply(point_m);
        let found = lens.projection([p.x / p.z, p.y / p.z]);
        let z = 1.0 / p.z;
        let by_point = SMatrix::<f64, 2, 3>::new(z, 0.0, -p.x * z * z, 0.0, z, -p.y * z * z);
        let by_point = found.by_direction * by_point;
        let mut by_pose = ByPose::zeros();
        by_pose.fixed_columns_mut::<3>(0).copy_from(&(by_point * -p.cross_matrix()));
        by_pose.fixed_columns_mut::<3>(3).copy_from(&by_point);
        (found.pixel, by_pose, found.by_lens)
    }
}

/// The homography that takes plane points to picture points, at least four of each, by the
/// normalised direct linear transformation.
///
/// Returns `None` where three of four points lie on one line. Source: Hartley and Zisserman,
/// "Multiple view geometry", algorithm 4.2.
pub fn homography(plane: &[[f64; 2]], picture: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    let (of_plane, of_picture) = (normalising(plane)?, normalising(picture)?);
    let apply = |m: &Matrix3<f64>, p: &[f64; 2]| m * Vector3::new(p[0], p[1], 1.0);
    // With four points there are eight equations; the decomposition wants no fewer than unknowns.
    let mut equations = DMatrix::zeros((2 * plane.len()).max(9), 9);
    for (i, (from, to)) in plane.iter().zip(picture).enumerate() {
        let (p, q) = (apply(&of_plane, from), apply(&of_picture, to));
        for k in 0..3 {
            equations[(2 * i, k)] = p[k];
            equations[(2 * i, 6 + k)] = -q.x * p[k];
            equations[(2 * i + 1, 3 + k)] = p[k];
            equations[(2 * i + 1, 6 + k)] = -q.y * p[k];
        }
    }
    let squares = equations.transpose() * equations;
    let decomposed = squares.symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| decomposed.eigenvalues[*a].total_cmp(&decomposed.eigenvalues[*b]));
    // A second vanishing value leaves the homography open. Rounding is 1e-16 of the largest.
    if decomposed.eigenvalues[order[1]] < 1e-12 * decomposed.eigenvalues[order[8]] {
        return None;
    }
    let h = decomposed.eigenvectors.column(order[0]);
    let h = Matrix3::from_row_slice(h.as_slice());
    Some(of_picture.try_inverse()? * h * of_plane)
}

/// Moves points to their mean and scales them to a mean distance of √2, so that all equations weigh alike.
fn normalising(points: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    if points.len() < 4 {
        return None;
    }
    let count = points.len() as f64;
    let mean = points.iter().fold(Vector2::zeros(), |sum, p| sum + Vector2::from(*p)) / count;
    let spread = points.iter().map(|p| (Vector2::from(*p) - mean).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / spread;
    scale.is_finite().then(|| {
        Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0)
    })
}

/// The pose of the plane z = 0 whose homography takes plane points to directions (x, y, 1).
pub fn pose_of(homography: &Matrix3<f64>) -> Pose {
    let [a, b, c] = [0, 1, 2].map(|k| homography.column(k).into_owned());
    let scale = 2.0 / (a.norm() + b.norm());
    // The plane lies before the camera.
    let scale = if c.z < 0.0 { -scale } else { scale };
    let (a, b) = (a * scale, b * scale);
    // The nearest rotation; noise makes the columns not quite orthogonal.
    let m = Matrix3::from_columns(&[a, b, a.cross(&b)]);
    let rotation = Rotation3::from_matrix_eps(&m, 1e-14, 200, Rotation3::identity());
    Pose { rotation, translation_m: c * scale }
}

/// Points of a body and the pixels at which they are seen.
struct Seen<'a> {
    lens: &'a Lens,
    points_m: &'a [Vector3<f64>],
    pixels: &'a [[f64; 2]],
}

impl Problem for Seen<'_> {
    type State = Pose;

    fn linear(&self, pose: &Pose) -> Linear {
        let (mut square, mut gradient) = (DMatrix::zeros(6, 6), DVector::zeros(6));
        let mut cost = 0.0;
        for (point, pixel) in self.points_m.iter().zip(self.pixels) {
            let (found, by_pose, _) = pose.seen(self.lens, *point);
            let residual = Vector2::new(found[0] - pixel[0], found[1] - pixel[1]);
            square += by_pose.transpose() * by_pose;
            gradient += by_pose.transpose() * residual;
            cost += residual.norm_squared();
        }
        Linear { square, gradient, cost }
    }

    fn moved(&self, pose: &Pose, step: &DVector<f64>) -> Pose {
        let part = |from: usize| Vector3::new(step[from], step[from + 1], step[from + 2]);
        pose.moved(part(0), part(3))
    }

    fn cost(&self, pose: &Pose) -> f64 {
        let points = self.points_m.iter().zip(self.pixels);
        points.map(|(point, pixel)| squared(self.lens, pose, *point, *pixel)).sum()
    }
}

/// Squared distance between a pixel and where a point is expected \[px²\]; infinite behind the camera.
pub fn squared(lens: &Lens, pose: &Pose, point_m: Vector3<f64>, pixel: [f64; 2]) -> f64 {
    let p = pose.apply(point_m);
    if p.z <= 0.0 {
        return f64::INFINITY;
    }
    let found = lens.project(p);
    (found[0] - pixel[0]).powi(2) + (found[1] - pixel[1]).powi(2)
}

/// The pose of points in the plane z = 0 \[m\] that fits their pixels best.
///
/// Returns `None` where the points or pixels do not determine it.
pub fn plane_pose(lens: &Lens, points_m: &[[f64; 2]], pixels: &[[f64; 2]]) -> Option<Pose> {
    let directions: Vec<_> = pixels.iter().map(|p| lens.direction(*p)).collect::<Option<_>>()?;
    let start = pose_of(&homography(points_m, &directions)?);
    let points_m: Vec<_> = points_m.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
    Some(minimise(&Seen { lens, points_m: &points_m, pixels }, start))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens() -> Lens {
        let lens = Lens::pinhole([1280, 720], [900.0, 905.0], [640.0, 355.0]);
        Lens { k1: -0.2, k2: 0.05, p1: 1e-3, p2: -2e-3, ..lens }
    }

    #[test]
    fn a_pose_comes_back_from_what_it_shows() {
        let turn = Vector3::new(0.3, -0.2, 0.7);
        let pose = Pose {
            rotation: Rotation3::from_scaled_axis(turn),
            translation_m: Vector3::new(-0.05, 0.02, 0.6),
        };
        for count in [4, 30] {
            // Along a spiral no three lie on a line.
            let spiral = |i: i32| (0.02 + 0.002 * f64::from(i), 1.7 * f64::from(i));
            let points: Vec<[f64; 2]> =
                (0..count).map(spiral).map(|(r, a)| [r * a.cos(), r * a.sin()]).collect();
            let pixels: Vec<_> = points
                .iter()
                .map(|p| lens().project(pose.apply(Vector3::new(p[0], p[1], 0.0))))
                .collect();
            let found = plane_pose(&lens(), &points, &pixels).unwrap();
            assert!((found.translation_m - pose.translation_m).norm() < 1e-8, "{count} {found:?}");
            // Unlike an angle, which an arc cosine gives, a matrix has all digits near the identity.
            assert!((found.rotation.matrix() - pose.rotation.matrix()).norm() < 1e-8);
        }
    }

    #[test]
    fn points_on_a_line_determine_nothing() {
        let points: Vec<[f64; 2]> = (0..6).map(|i| [0.01 * f64::from(i), 0.02]).collect();
        let pixels: Vec<_> = (0..6).map(|i| [100.0 + 20.0 * f64::from(i), 300.0]).collect();
        assert_eq!(plane_pose(&lens(), &points, &pixels), None);
    }
}
