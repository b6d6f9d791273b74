//! Centre lines.

use cathforce_bundle::tips::Tip;
use nalgebra::Vector3;

/// `count` points at equal arc on a polyline, from `skip_m` behind its first point to its end; `None`
/// if it is not that long.
pub fn at_equal_arc(line: &[Vector3<f64>], skip_m: f64, count: usize) -> Option<Vec<Vector3<f64>>> {
    let length_m: f64 = line.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    if length_m <= skip_m || count < 2 {
        return None;
    }
    let step_m = (length_m - skip_m) / (count - 1) as f64;
    Some((0..count).filter_map(|k| at_arc(line, skip_m + step_m * k as f64)).collect())
}

/// The point at `arc_m` behind the first one; the last one beyond the end.
pub fn at_arc(line: &[Vector3<f64>], arc_m: f64) -> Option<Vector3<f64>> {
    let mut left = arc_m;
    for pair in line.windows(2) {
        let length = (pair[1] - pair[0]).norm();
        if left <= length && length > 0.0 {
            return Some(pair[0].lerp(&pair[1], left / length));
        }
        left -= length;
    }
    line.last().copied()
}

/// The unloaded centre line of a tip in its plane \[m\], the end first, with `shaft_m` of straight
/// shaft behind it: x along the shaft, y towards the side to which positive angles turn.
pub fn drawn(tip: &Tip, shaft_m: f64) -> Vec<[f64; 2]> {
    const STEP_M: f64 = 0.25e-3;
    let (mut at, mut angle) = ([shaft_m, 0.0], 0.0_f64);
    let mut points = vec![[0.0, 0.0], at];
    for piece in tip.pieces.iter().rev() {
        let steps = (piece.length_m / STEP_M).ceil().max(1.0);
        let (ds, turn) = (piece.length_m / steps, piece.turn_deg.to_radians() / steps);
        for _ in 0..steps as usize {
            let middle = angle + 0.5 * turn;
            at = [at[0] + ds * middle.cos(), at[1] + ds * middle.sin()];
            angle += turn;
            points.push(at);
        }
    }
    points.reverse();
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_at_their_arc() {
        let line = [0.0, 0.01, 0.05].map(|x| Vector3::new(x, 0.0, 0.0));
        let points = at_equal_arc(&line, 0.01, 5).unwrap();
        assert!(
            points.iter().enumerate().all(|(k, p)| (p.x - 0.01 * (k + 1) as f64).abs() < 1e-12)
        );
        assert!(at_equal_arc(&line, 0.06, 5).is_none());
    }

    #[test]
    fn the_published_hook_ends_a_diameter_beside_the_shaft() {
        let hook = Tip::find("hook").unwrap();
        let points = drawn(hook, 0.03);
        let ([x, y], [base_x, base_y]) = (points[0], points[points.len() - 1]);
        assert!((x - 0.03).abs() < 1e-5 && (y - 0.016).abs() < 1e-5, "{x} {y}");
        assert_eq!([base_x, base_y], [0.0, 0.0]);
    }
}
