//! Linear systems with a band matrix.

/// A square band matrix with as many diagonals below the main one as above it.
///
/// Rows are stored one after the other, each with room for the diagonals that partial
/// pivoting fills in above the band.
#[derive(Clone, Debug)]
pub(crate) struct Band {
    size: usize,
    half: usize,
    rows: Vec<f64>,
}

impl Band {
    /// A zero matrix of `size` rows with `half` diagonals on either side.
    pub fn new(size: usize, half: usize) -> Self {
        Self { size, half, rows: vec![0.0; size * (3 * half + 1)] }
    }

    /// Sets a new size and every entry to zero.
    pub fn reset(&mut self, size: usize) {
        self.size = size;
        self.rows.clear();
        self.rows.resize(size * self.width(), 0.0);
    }

    fn width(&self) -> usize {
        3 * self.half + 1
    }

    /// matrix\[row\]\[column\] += value, for |row − column| within the band.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        debug_assert!(row.abs_diff(column) <= self.half);
        let width = self.width();
        self.rows[row * width + column + self.half - row] += value;
    }

    /// Solves matrix · x = `rhs` in place by Gaussian elimination with row pivoting. The matrix is
    /// overwritten. Returns `false` if it is singular; `rhs` is then meaningless.
    pub fn solve(&mut self, rhs: &mut [f64]) -> bool {
        let (n, half, width) = (self.size, self.half, self.width());
        // Element (row, column) stands at row * width + half + column − row.
        let at = |row: usize, column: usize| row * width + half + column - row;
        for k in 0..n {
            let below = (k + half + 1).min(n);
            let right = (k + 2 * half + 1).min(n);
            let pivot = (k..below)
                .max_by(|&a, &b| self.rows[at(a, k)].abs().total_cmp(&self.rows[at(b, k)].abs()));
            let Some(pivot) = pivot else { return false };
            let largest = self.rows[at(pivot, k)];
            if largest == 0.0 || !largest.is_finite() {
                return false;
            }
            if pivot != k {
                for column in k..right {
                    self.rows.swap(at(k, column), at(pivot, column));
                }
                rhs.swap(k, pivot);
            }
            let (upper, lower) = self.rows.split_at_mut((k + 1) * width);
            let pivot_row = &upper[k * width + half..k * width + half + right - k];
            for row in k + 1..below {
                let start = (row - k - 1) * width + half + k - row;
                let target = &mut lower[start..start + right - k];
                let factor = target[0] / pivot_row[0];
                if factor == 0.0 {
                    continue;
                }
                for (t, p) in target.iter_mut().zip(pivot_row) {
                    *t -= factor * p;
                }
                rhs[row] -= factor * rhs[k];
            }
        }
        for k in (0..n).rev() {
            let right = (k + 2 * half + 1).min(n);
            let row = &self.rows[at(k, k)..at(k, k) + right - k];
            let known: f64 = row.iter().zip(&rhs[k..right]).skip(1).map(|(m, x)| m * x).sum();
            rhs[k] = (rhs[k] - known) / row[0];
        }
        rhs.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_that_needs_pivoting_is_solved() {
        let (n, half) = (40, 3);
        let entry =
            |i: usize, j: usize| ((7 * i + 13 * j) % 11) as f64 - 5.0 + (i == j) as u8 as f64 * 0.1;
        let exact: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut band = Band::new(n, half);
        let mut row_sum = |i: usize| -> f64 {
            let row = i.saturating_sub(half)..(i + half + 1).min(n);
            row.map(|j| {
                band.add(i, j, entry(i, j));
                entry(i, j) * exact[j]
            })
            .sum()
        };
        let mut rhs: Vec<f64> = (0..n).map(&mut row_sum).collect();
        assert!(band.solve(&mut rhs));
        let worst = rhs.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
    }

    #[test]
    fn a_singular_system_is_refused() {
        assert!(!Band::new(4, 1).solve(&mut [1.0; 4]));
    }
}
