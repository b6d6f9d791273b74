//! The corners of a board in one picture.

use nalgebra::Vector2;

use super::candidates::candidates;
use super::grid::largest;
use super::refine::refine;
use crate::board::{Board, NoBoard};
use crate::picture::Picture;

/// Largest reach of the window in which a corner is refined \[px\]: more would bend with the lens.
const MOST_REACH_PX: f64 = 8.0;
/// With less the window holds too few pixels of edges.
const LEAST_REACH_PX: f64 = 2.5;
/// Share of the distance to the nearest corner that a window may reach: half of it, less the blur of
/// its edges.
const REACH: f64 = 0.4;

/// The pixels of a board's corners, in the order of [`Board::corners_m`].
pub fn find_board(picture: &Picture, board: &Board) -> Result<Vec<[f64; 2]>, NoBoard> {
    let candidates = candidates(picture);
    let grid = largest(&candidates, board.columns * board.rows).ok_or(NoBoard::Nothing)?;
    let size = [board.columns, board.rows];
    let other = NoBoard::Size(grid.columns.max(grid.rows), grid.columns.min(grid.rows));
    let corners = grid.oriented(&candidates, size).ok_or(other)?;
    let places: Vec<_> = corners.iter().map(|i| Vector2::from(candidates[*i].pixel)).collect();
    let refined = |i: usize| {
        let (column, row) = (i % board.columns, i / board.columns);
        let neighbours = [
            (column > 0).then(|| i - 1),
            (column + 1 < board.columns).then(|| i + 1),
            (row > 0).then(|| i - board.columns),
            (row + 1 < board.rows).then(|| i + board.columns),
        ];
        let distances = neighbours.iter().flatten().map(|j| (places[*j] - places[i]).norm());
        let reach = REACH * distances.fold(f64::INFINITY, f64::min);
        if reach < LEAST_REACH_PX {
            return Err(NoBoard::Small);
        }
        refine(picture, places[i].into(), reach.min(MOST_REACH_PX)).ok_or(NoBoard::Nothing)
    };
    (0..places.len()).map(refined).collect()
}
