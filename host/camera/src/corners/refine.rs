//! A crossing of edges, to a few hundredths of a pixel.

use nalgebra::{Matrix2, Vector2};

use crate::picture::Picture;

/// Steps until a corner stands still; three are usual.
const MOST_STEPS: usize = 20;
/// A corner that moves less stands still \[px\].
const STILL_PX: f64 = 1e-3;

/// The place near `start` from which every gradient in a window is seen sideways, which is where
/// edges meet: Σ g gᵀ (p − c) = 0 over the pixels p of the window, with gradient g.
///
/// The window reaches `reach_px` to each side and must hold one crossing only. Returns `None` if
/// the place wanders out of it. Source: Förstner and Gülch, "A fast operator for detection and
/// precise location of distinct points, corners and centres of circular features", 1987.
pub fn refine(picture: &Picture, start: [f64; 2], reach_px: f64) -> Option<[f64; 2]> {
    let start = Vector2::from(start);
    let mut corner = start;
    let reach = reach_px.floor() as i32;
    // Pixels far from the corner, where the lens bends the edges, count less.
    let spread = 2.0 / (reach_px * reach_px);
    for _ in 0..MOST_STEPS {
        if !picture.contains(corner.into(), reach_px + 1.5) {
            return None;
        }
        let (mut square, mut sum) = (Matrix2::zeros(), Vector2::zeros());
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let offset = Vector2::new(f64::from(dx), f64::from(dy));
                let at = corner + offset;
                let sample = |x: f64, y: f64| picture.sample([at.x + x, at.y + y]);
                let gradient = Vector2::new(
                    sample(1.0, 0.0) - sample(-1.0, 0.0),
                    sample(0.0, 1.0) - sample(0.0, -1.0),
                );
                let weight = (-spread * offset.norm_squared()).exp();
                let outer = weight * gradient * gradient.transpose();
                square += outer;
                sum += outer * offset;
            }
        }
        let step = square.try_inverse()? * sum;
        corner += step;
        if (corner - start).norm() > reach_px {
            return None;
        }
        if step.norm() < STILL_PX {
            return Some(corner.into());
        }
    }
    None
}
