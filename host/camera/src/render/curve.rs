//! Plane curves from pieces of constant curvature.

use nalgebra::Vector2;

/// Part of a curve: its length \[m\], and its curvature, positive to the right of x towards y \[1/m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub length_m: f64,
    pub curvature_per_m: f64,
}

/// Points of a curve \[m\] about `step_m` apart, from `start` in the direction of `heading_rad`.
pub fn curve(
    start: [f64; 2],
    heading_rad: f64,
    pieces: &[Piece],
    step_m: f64,
) -> Vec<Vector2<f64>> {
    let (mut at, mut heading) = (Vector2::from(start), heading_rad);
    let mut points = vec![at];
    for Piece { length_m, curvature_per_m } in pieces {
        let count = (length_m / step_m).ceil().max(1.0) as usize;
        let step = length_m / count as f64;
        for _ in 0..count {
            // The chord of an arc points along its middle.
            let half = 0.5 * step * curvature_per_m;
            let chord = if half.abs() > 1e-9 { step * half.sin() / half } else { step };
            let (sine, cosine) = (heading + half).sin_cos();
            at += chord * Vector2::new(cosine, sine);
            heading += 2.0 * half;
            points.push(at);
        }
    }
    points
}

/// The first pieces of a route, `length_m` long in all. The last one goes on if the route is shorter.
pub fn first(route: &[Piece], length_m: f64) -> Vec<Piece> {
    let mut left = length_m;
    let mut pieces = Vec::new();
    for (i, piece) in route.iter().enumerate() {
        let is_last = i + 1 == route.len();
        let length_m = if is_last { left } else { piece.length_m.min(left) };
        if length_m > 0.0 {
            pieces.push(Piece { length_m, ..*piece });
        }
        left -= length_m;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_of_a_circle_ends_beside_its_centre() {
        let quarter =
            Piece { length_m: 0.01 * std::f64::consts::FRAC_PI_2, curvature_per_m: 100.0 };
        let points = curve([0.0, 0.0], 0.0, &[quarter], 1e-4);
        let end = points[points.len() - 1];
        assert!((end - Vector2::new(0.01, 0.01)).norm() < 1e-12, "{end}");
        let route = [Piece { length_m: 0.01, curvature_per_m: 0.0 }, quarter];
        assert_eq!(first(&route, 0.005), [Piece { length_m: 0.005, curvature_per_m: 0.0 }]);
        assert_eq!(first(&route, 1.0).iter().map(|p| p.length_m).sum::<f64>(), 1.0);
    }
}
