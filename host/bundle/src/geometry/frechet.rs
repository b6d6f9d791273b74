//! Discrete Fréchet distance between two paths, which does not depend on their pace.

use nalgebra::Vector3;

/// Discrete Fréchet distance: the longest step between two paths when both are walked from their
/// first point to their last, neither ever backwards, in the way that keeps that step shortest.
///
/// > c(i, j) = max(‖pᵢ − qⱼ‖, min(c(i−1, j), c(i−1, j−1), c(i, j−1)))
///
/// In the points' unit; `None` where a path has no point. Takes O(n m) time, and the memory of one
/// row.
/// Source: T. Eiter and H. Mannila, Computing discrete Fréchet distance, technical report CD-TR
/// 94/64, Technische Universität Wien, 1994.
pub fn frechet(p: &[Vector3<f64>], q: &[Vector3<f64>]) -> Option<f64> {
    let mut row = vec![f64::INFINITY; q.len()];
    for (i, a) in p.iter().enumerate() {
        // c(i−1, j−1) and c(i, j−1) of the first column: the walk begins at the first pair.
        let mut diagonal = if i == 0 { 0.0 } else { f64::INFINITY };
        let mut left = f64::INFINITY;
        for (c, b) in row.iter_mut().zip(q) {
            let reached = c.min(diagonal).min(left).max((a - b).norm());
            diagonal = std::mem::replace(c, reached);
            left = reached;
        }
    }
    row.last().copied().filter(|_| !p.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight path along x.
    fn line(points: impl IntoIterator<Item = f64>, y: f64) -> Vec<Vector3<f64>> {
        points.into_iter().map(|x| Vector3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn shifted_lines_are_as_far_apart_as_they_are_shifted() {
        let steps = || (0..20).map(f64::from);
        let apart = frechet(&line(steps(), 0.0), &line(steps(), 3.0));
        assert_eq!(apart, Some(3.0));
        // Along itself, by the ends, which must be met.
        let ahead = frechet(&line(steps(), 0.0), &line(steps().map(|x| x + 2.5), 0.0));
        assert_eq!(ahead, Some(2.5));
    }

    #[test]
    fn pace_makes_no_difference_and_order_does() {
        let path = line([0.0, 1.0, 2.0, 3.0], 0.0);
        let dwells = line([0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0], 0.0);
        assert_eq!(frechet(&path, &dwells), Some(0.0));
        assert_eq!(frechet(&dwells, &path), Some(0.0));
        // The same points backwards, whose sets are equal: the ends are 3 apart.
        let backwards = line([3.0, 2.0, 1.0, 0.0], 0.0);
        assert_eq!(frechet(&path, &backwards), Some(3.0));
        // Two points changed places: at 2 before 1, the other waits at 1 or goes on to 2 and waits.
        assert_eq!(frechet(&path, &line([0.0, 2.0, 1.0, 3.0], 0.0)), Some(1.0));
    }

    #[test]
    fn a_detour_counts_by_its_farthest_point() {
        let path = line([0.0, 1.0, 2.0], 0.0);
        let detour = [[0.0, 0.0], [1.0, 4.0], [2.0, 0.0]].map(|[x, z]| Vector3::new(x, 0.0, z));
        assert_eq!(frechet(&path, &detour), Some(4.0));
        assert_eq!(frechet(&path, &[]), None);
        assert_eq!(frechet(&[], &path), None);
    }
}
