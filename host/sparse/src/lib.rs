//! A symmetric sparse matrix with a fixed pattern, and its factorisation by `faer`.
//!
//! This is a crate of its own because the factorisation is compiled wherever it is used, which takes
//! most of a minute.
//!
//! The matrix of displacement and pressure is symmetric and quasi-definite: positive on the
//! displacements, negative on the pressures. Such a matrix has an LDLᵀ factorisation under every
//! order of elimination (Vanderbei, SIAM J. Optim. 5, 1995), so that no pivoting disturbs the order
//! that keeps the factor sparse. Under a load the first part may stop being positive; the solution is
//! therefore refined against the matrix, and a solve that refinement does not repair is an error.

#![forbid(unsafe_code)]

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

/// Rounds of refinement; each gains some six digits where the factor is good.
const REFINEMENTS: usize = 3;
/// Largest residual over right-hand side that is accepted.
const LARGEST_RESIDUAL: f64 = 1e-6;
/// Rounds with the factor of an earlier matrix: ten that leave half of the residual each, which is
/// [`EARLIER_SHRINK`], leave [`EARLIER_RESIDUAL`]. A round passes over the factor's entries twice; a
/// factorisation computes each of them from whole columns of others.
const EARLIER_ROUNDS: usize = 10;
/// Residual over right-hand side at which they end: a correction of Newton's method that is off by
/// this share leaves the same share of the residual, and a few such corrections cost less than a
/// factorisation (Dembo, Eisenstat and Steihaug, SIAM J. Numer. Anal. 19, 1982).
const EARLIER_RESIDUAL: f64 = 1e-3;
/// Each round must shrink the residual to this share, or the factor is of too different a matrix.
const EARLIER_SHRINK: f64 = 0.5;

/// The lower triangle, column by column.
pub struct SparseSymmetric {
    columns: Vec<usize>,
    rows: Vec<usize>,
    pub values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    is_factorised: bool,
    memory: MemBuffer,
}

/// A matrix that cannot be factorised or solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Singular;

impl SparseSymmetric {
    /// `entries`: pairs (column, row) with row ≥ column, in any order and number. Every diagonal
    /// entry must be among them.
    pub fn new(size: usize, mut entries: Vec<(u32, u32)>) -> Result<Self, Singular> {
        entries.sort_unstable();
        entries.dedup();
        let mut columns = vec![0; size + 1];
        for (column, _) in &entries {
            columns[*column as usize + 1] += 1;
        }
        for column in 0..size {
            columns[column + 1] += columns[column];
        }
        let rows: Vec<usize> = entries.iter().map(|(_, row)| *row as usize).collect();
        drop(entries);
        let pattern =
            SymbolicSparseColMat::new_checked(size, size, columns.clone(), None, rows.clone());
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| Singular)?;
        let factorise =
            symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let memory = MemBuffer::try_new(factorise.or(solve)).map_err(|_| Singular)?;
        let factor = vec![0.0; symbolic.len_val()];
        let values = vec![0.0; rows.len()];
        Ok(Self { columns, rows, values, symbolic, factor, is_factorised: false, memory })
    }

    /// Entries of the factor, which its cost grows with.
    pub fn factor_entries(&self) -> usize {
        self.factor.len()
    }

    /// Adds to the entry in this row and column, either of which may be the larger.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let (column, row) = (row.min(column), row.max(column));
        let range = self.columns[column]..self.columns[column + 1];
        if let Ok(at) = self.rows[range.clone()].binary_search(&row) {
            self.values[range.start + at] += value;
        }
    }

    pub fn factorise(&mut self) -> Result<(), Singular> {
        let size = self.columns.len() - 1;
        let pattern = faer::sparse::SymbolicSparseColMatRef::new_checked(
            size,
            size,
            &self.columns,
            None,
            &self.rows,
        );
        let matrix = SparseColMatRef::new(pattern, &self.values);
        let factorised = self
            .symbolic
            .factorize_numeric_ldlt(
                &mut self.factor,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map(|_| ())
            .map_err(|_| Singular);
        self.is_factorised = factorised.is_ok();
        factorised
    }

    /// Solves with the last factor, refined against the matrix.
    pub fn solve(&mut self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        let (solution, left) = self.refined(right, REFINEMENTS + 1, 1e-12, f64::INFINITY);
        if left <= LARGEST_RESIDUAL { Ok(solution) } else { Err(Singular) }
    }

    /// Solves to a thousandth with the factor of an earlier matrix, by refinement against today's.
    /// `None`: there is no such factor, or the matrices differ too much.
    pub fn solve_by_earlier_factor(&mut self, right: &[f64]) -> Option<Vec<f64>> {
        if !self.is_factorised {
            return None;
        }
        let (solution, left) =
            self.refined(right, EARLIER_ROUNDS, EARLIER_RESIDUAL, EARLIER_SHRINK);
        (left <= EARLIER_RESIDUAL).then_some(solution)
    }

    /// Adds corrections by the factor until the residual is `enough` of the right-hand side, at most
    /// `rounds` of them, while each leaves at most `shrink` of the residual. Gives the solution and
    /// what is left of the residual, as a share of the right-hand side.
    fn refined(
        &mut self,
        right: &[f64],
        rounds: usize,
        enough: f64,
        shrink: f64,
    ) -> (Vec<f64>, f64) {
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = norm(right);
        let mut solution = vec![0.0; right.len()];
        let mut residual = right.to_vec();
        let mut left = size;
        for _ in 0..rounds {
            let correction = self.solve_once(&residual);
            for (x, c) in solution.iter_mut().zip(&correction) {
                *x += c;
            }
            let product = self.times(&solution);
            for ((r, b), p) in residual.iter_mut().zip(right).zip(&product) {
                *r = b - p;
            }
            let before = left;
            left = norm(&residual);
            if left <= enough * size || left.is_nan() || left > shrink * before {
                break;
            }
        }
        // Nothing is left of nothing.
        (solution, if left == 0.0 { 0.0 } else { left / size })
    }

    fn solve_once(&mut self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        let size = x.len();
        let factor = LdltRef::new(&self.symbolic, &self.factor);
        factor.solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut x, size, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        x
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for column in 0..x.len() {
            for at in self.columns[column]..self.columns[column + 1] {
                let (row, value) = (self.rows[at], self.values[at]);
                product[row] += value * x[column];
                if row != column {
                    product[column] += value * x[row];
                }
            }
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs with a pressure at every second node: quasi-definite.
    fn chain(size: usize) -> SparseSymmetric {
        let mut entries = Vec::new();
        for k in 0..size as u32 {
            entries.push((k, k));
            if k > 0 {
                entries.push((k - 1, k));
            }
        }
        let mut matrix = SparseSymmetric::new(size, entries).unwrap();
        for k in 0..size {
            matrix.add(k, k, if k % 2 == 0 { 2.0 } else { -0.1 });
            if k > 0 {
                matrix.add(k, k - 1, 0.7);
            }
        }
        matrix
    }

    #[test]
    fn a_quasi_definite_matrix_is_solved() {
        for size in [1, 7, 400] {
            let mut matrix = chain(size);
            let expected: Vec<f64> = (0..size).map(|k| (k as f64 * 0.7).sin() + 0.1).collect();
            let right = matrix.times(&expected);
            matrix.factorise().unwrap();
            let found = matrix.solve(&right).unwrap();
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-12, "{size}: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_factor_serves_a_matrix_that_is_little_different() {
        let mut matrix = chain(60);
        let right: Vec<f64> = (0..60).map(|k| (k as f64 * 0.3).cos()).collect();
        assert_eq!(matrix.solve_by_earlier_factor(&right), None);
        matrix.factorise().unwrap();
        for (by, serves) in [(0.02, true), (-3.0, false)] {
            (0..60).step_by(2).for_each(|k| matrix.add(k, k, by));
            let found = matrix.solve_by_earlier_factor(&right);
            assert_eq!(found.is_some(), serves, "{by}");
            if let Some(found) = found {
                let product = matrix.times(&found);
                let off = product.iter().zip(&right).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                let size = right.iter().map(|x| x * x).sum::<f64>();
                assert!(off.sqrt() < 1e-3 * size.sqrt());
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let mut matrix = SparseSymmetric::new(2, vec![(0, 0), (1, 1), (0, 1)]).unwrap();
        for (row, column) in [(0, 0), (1, 1), (1, 0)] {
            matrix.add(row, column, 1.0);
        }
        let solved = matrix.factorise().and_then(|()| matrix.solve(&[1.0, 0.0]));
        assert_eq!(solved, Err(Singular));
    }
}
