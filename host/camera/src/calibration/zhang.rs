//! First values of a lens from the homographies of a board, in closed form.

use nalgebra::{DMatrix, Matrix3, Matrix5, SVector};

/// Views of one direction leave more than one number open: then the second smallest of the equations'
/// eigenvalues vanishes but for rounding, which is 1e-16 of the largest.
const LEAST_DETERMINED: f64 = 1e-12;

/// Focal lengths and centre \[px\] of a lens without distortion or skew, from at least two views of
/// a plane. `size`: width and height of the pictures \[px\].
///
/// With one view, or if all views show the plane from one direction, there is no answer.
/// Source: Zhang, "A flexible new technique for camera calibration", 2000, section 3.1; a skew of
/// zero is put in from the start.
pub fn first_values(homographies: &[Matrix3<f64>], size: [usize; 2]) -> Option<[[f64; 2]; 2]> {
    if homographies.len() < 2 {
        return None;
    }
    // Pixels about the middle, in units of the width, so that all equations weigh alike.
    let (scale, middle) = (1.0 / size[0] as f64, size.map(|n| 0.5 * (n as f64 - 1.0)));
    let scaling =
        Matrix3::new(scale, 0.0, -scale * middle[0], 0.0, scale, -scale * middle[1], 0.0, 0.0, 1.0);
    let mut equations = DMatrix::zeros(2 * homographies.len(), 5);
    for (i, homography) in homographies.iter().enumerate() {
        let h = scaling * homography;
        let h = h / h.norm();
        // hᵢᵀ B hⱼ with B = K⁻ᵀ K⁻¹ and the unknowns B₁₁ B₂₂ B₁₃ B₂₃ B₃₃.
        let product = |a: usize, b: usize| {
            [
                h[(0, a)] * h[(0, b)],
                h[(1, a)] * h[(1, b)],
                h[(0, a)] * h[(2, b)] + h[(2, a)] * h[(0, b)],
                h[(1, a)] * h[(2, b)] + h[(2, a)] * h[(1, b)],
                h[(2, a)] * h[(2, b)],
            ]
        };
        let (one, two, both) = (product(0, 0), product(1, 1), product(0, 1));
        for k in 0..5 {
            equations[(2 * i, k)] = both[k];
            equations[(2 * i + 1, k)] = one[k] - two[k];
        }
    }
    let squares: Matrix5<f64> =
        Matrix5::from_iterator((equations.transpose() * &equations).iter().copied());
    let decomposed = squares.symmetric_eigen();
    let (least, _) = decomposed.eigenvalues.argmin();
    let mut sizes: [f64; 5] = decomposed.eigenvalues.into();
    sizes.sort_by(f64::total_cmp);
    if sizes[1] < LEAST_DETERMINED * sizes[4] {
        return None;
    }
    let b: SVector<f64, 5> = decomposed.eigenvectors.column(least).into_owned();
    let [b11, b22, b13, b23, b33]: [f64; 5] = b.into();
    let centre = [-b13 / b11, -b23 / b22];
    let rest = b33 + centre[0] * b13 + centre[1] * b23;
    let focal = [rest / b11, rest / b22].map(f64::sqrt);
    // A wild answer is that of views which do not determine it.
    let is_sane =
        focal.iter().all(|f| (0.1..100.0).contains(f)) && centre.iter().all(|c| c.abs() < 1.0);
    is_sane.then(|| {
        let back = |k: usize| centre[k] / scale + middle[k];
        [focal.map(|f| f / scale), [back(0), back(1)]]
    })
}
