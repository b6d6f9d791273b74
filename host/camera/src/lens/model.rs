//! The pinhole camera with the distortion of its lens.

use nalgebra::{Matrix2, SMatrix, Vector3};
use serde::{Deserialize, Serialize};

/// How many numbers describe a lens: two focal lengths, the centre, k1, k2, p1, p2, k3.
pub const PARAMETERS: usize = 9;

/// A pinhole camera with radial and tangential distortion.
///
/// A direction (x, y, 1) is seen at `focal_px · d(x, y) + centre_px`, with r² = x² + y² and
///
/// - d_x = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
/// - d_y = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
///
/// Source: Brown, "Decentering distortion of lenses", 1966; the order of the coefficients is that
/// of Zhang, "A flexible new technique for camera calibration", 2000, as common tools use it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    pub width_px: usize,
    pub height_px: usize,
    pub focal_px: [f64; 2],
    pub centre_px: [f64; 2],
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    #[serde(default)]
    pub k3: f64,
}

/// The place of a direction and its derivatives.
pub struct Projection {
    pub pixel: [f64; 2],
    /// By the direction's x and y.
    pub by_direction: Matrix2<f64>,
    /// By the lens's numbers, in the order of [`Lens::parameters`].
    pub by_lens: SMatrix<f64, 2, PARAMETERS>,
}

impl Lens {
    /// A lens without distortion.
    pub fn pinhole(size: [usize; 2], focal_px: [f64; 2], centre_px: [f64; 2]) -> Self {
        let [width_px, height_px] = size;
        Self {
            width_px,
            height_px,
            focal_px,
            centre_px,
            k1: 0.0,
            k2: 0.0,
            p1: 0.0,
            p2: 0.0,
            k3: 0.0,
        }
    }

    pub fn parameters(&self) -> [f64; PARAMETERS] {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.centre_px);
        [fx, fy, cx, cy, self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    pub fn with_parameters(&self, p: [f64; PARAMETERS]) -> Self {
        let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = p;
        Self { focal_px: [fx, fy], centre_px: [cx, cy], k1, k2, p1, p2, k3, ..*self }
    }

    pub fn size(&self) -> [usize; 2] {
        [self.width_px, self.height_px]
    }

    /// The pixel at which a direction (x, y, 1) is seen.
    pub fn pixel(&self, direction: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.distorted(direction);
        [self.focal_px[0] * x + self.centre_px[0], self.focal_px[1] * y + self.centre_px[1]]
    }

    /// The pixel at which a point is seen \[m\], in the camera's frame (x right, y down, z ahead).
    pub fn project(&self, point_m: Vector3<f64>) -> [f64; 2] {
        self.pixel([point_m.x / point_m.z, point_m.y / point_m.z])
    }

    fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        [
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        ]
    }

    /// The pixel of a direction with its derivatives.
    pub fn projection(&self, [x, y]: [f64; 2]) -> Projection {
        let ([fx, fy], [dx, dy]) = (self.focal_px, self.distorted([x, y]));
        let r2 = x * x + y * y;
        let by_direction = self.slope([x, y]);
        let by_direction = Matrix2::from_diagonal(&nalgebra::Vector2::new(fx, fy)) * by_direction;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let (xx, yy, xy) = (r2 + 2.0 * x * x, r2 + 2.0 * y * y, 2.0 * x * y);
        let rows = [
            [dx, 0.0, 1.0, 0.0, x * r2, x * r4, xy, xx, x * r6],
            [0.0, dy, 0.0, 1.0, y * r2, y * r4, yy, xy, y * r6],
        ];
        let mut by_lens = SMatrix::<f64, 2, PARAMETERS>::from_row_slice(rows.as_flattened());
        for k in 4..PARAMETERS {
            by_lens[(0, k)] *= fx;
            by_lens[(1, k)] *= fy;
        }
        Projection { pixel: self.pixel([x, y]), by_direction, by_lens }
    }

    /// Derivative of the distorted direction by the direction.
    fn slope(&self, [x, y]: [f64; 2]) -> Matrix2<f64> {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let by_r2 = self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3);
        let cross = 2.0 * x * y * by_r2 + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        Matrix2::new(
            radial + 2.0 * x * x * by_r2 + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * by_r2 + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    /// The direction (x, y, 1) that is seen at a pixel, by Newton's method.
    ///
    /// Returns `None` where the distortion folds, so that no direction, or more than one, is seen
    /// there: far outside of what a calibration has covered.
    pub fn direction(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let target = [0, 1].map(|k| (pixel[k] - self.centre_px[k]) / self.focal_px[k]);
        let mut found = target;
        for _ in 0..MOST_STEPS {
            let now = self.distorted(found);
            let error = nalgebra::Vector2::new(target[0] - now[0], target[1] - now[1]);
            let slope = self.slope(found);
            // A fold lies between the axis and any place of negative determinant.
            if slope.determinant() < LEAST_DETERMINANT {
                return None;
            }
            if error.norm() < CONVERGED {
                return Some(found);
            }
            let step = slope.try_inverse()? * error;
            found = [found[0] + step.x, found[1] + step.y];
        }
        None
    }
}

/// A thousandth of a millionth of the distance: far below a pixel.
const CONVERGED: f64 = 1e-12;
/// Newton's method doubles the digits in each step; strong distortion takes five.
const MOST_STEPS: usize = 30;
/// At 0 the picture folds; at a tenth it is squeezed so much that no measurement is left.
const LEAST_DETERMINANT: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    pub fn webcam() -> Lens {
        let lens = Lens::pinhole([1280, 720], [930.0, 940.0], [650.0, 350.0]);
        Lens { k1: 0.12, k2: -0.25, p1: 0.002, p2: -0.001, k3: 0.03, ..lens }
    }

    #[test]
    fn a_direction_comes_back_from_its_pixel() {
        let lens = webcam();
        for pixel in [[0.0, 0.0], [1279.0, 719.0], [640.0, 360.0], [1279.0, 0.0]] {
            let direction = lens.direction(pixel).unwrap();
            let again = lens.pixel(direction);
            assert!((0..2).all(|k| (again[k] - pixel[k]).abs() < 1e-8), "{pixel:?} {again:?}");
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let lens = webcam();
        let at = [0.31, -0.22];
        let found = lens.projection(at);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + a.abs());
        for k in 0..2 {
            let step = 1e-6;
            let shifted = |by: f64| {
                let mut at = at;
                at[k] += by;
                lens.pixel(at)
            };
            let (ahead, behind) = (shifted(step), shifted(-step));
            for axis in 0..2 {
                let slope = (ahead[axis] - behind[axis]) / (2.0 * step);
                assert!(close(found.by_direction[(axis, k)], slope));
            }
        }
        for k in 0..PARAMETERS {
            let step = 1e-6 * (1.0 + lens.parameters()[k].abs());
            let shifted = |by: f64| {
                let mut parameters = lens.parameters();
                parameters[k] += by;
                lens.with_parameters(parameters).pixel(at)
            };
            let (ahead, behind) = (shifted(step), shifted(-step));
            for axis in 0..2 {
                let slope = (ahead[axis] - behind[axis]) / (2.0 * step);
                assert!(close(found.by_lens[(axis, k)], slope), "{k} {axis}");
            }
        }
    }

    #[test]
    fn where_the_picture_folds_there_is_no_direction() {
        let barrel = Lens { k1: -0.5, ..Lens::pinhole([1280, 720], [500.0; 2], [640.0, 360.0]) };
        assert_eq!(barrel.direction([1279.0, 719.0]), None);
        assert!(barrel.direction([800.0, 400.0]).is_some());
    }
}
