//! The checkerboard by which a camera is calibrated.

use serde::{Deserialize, Serialize};

/// Fewest pictures of a board: two determine a lens in theory, three leave something to judge it by.
pub const LEAST_PICTURES: usize = 3;

/// Why a board was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoBoard {
    /// No grid of crossings at all.
    Nothing,
    /// A grid of this many columns and rows.
    Size(usize, usize),
    /// The squares are too small in the picture for their corners to be told apart.
    Small,
}

/// A checkerboard, counted by its inner corners: where four squares meet.
///
/// The board's frame: the first corner is the origin, x runs along a row of `columns` corners, y
/// along a column of `rows`. The square outside of the first corner, towards −x and −y, is black.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    pub columns: usize,
    pub rows: usize,
    pub square_mm: f64,
}

impl Board {
    /// Places of all corners \[m\], row by row.
    pub fn corners_m(&self) -> Vec<[f64; 2]> {
        let square_m = 1e-3 * self.square_mm;
        let corner =
            |i: usize| [(i % self.columns) as f64 * square_m, (i / self.columns) as f64 * square_m];
        (0..self.columns * self.rows).map(corner).collect()
    }

    /// Whether it looks different after half a turn, so that its first corner can be told.
    ///
    /// The squares outside of the first and the last corner differ in colour if one number is odd
    /// and the other even.
    pub fn has_one_orientation(&self) -> bool {
        (self.columns + self.rows) % 2 == 1
    }

    /// A drawing of the board for a printer, at its true size, with a margin of one square.
    pub fn svg(&self) -> String {
        use std::fmt::Write as _;
        let square = self.square_mm;
        let (across, down) = (self.columns + 1, self.rows + 1);
        let (width, height) = ((across + 2) as f64 * square, (down + 2) as f64 * square);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
             viewBox=\"0 0 {width} {height}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for (i, j) in (0..across).flat_map(|i| (0..down).map(move |j| (i, j))) {
            if (i + j) % 2 == 0 {
                let (x, y) = ((i + 1) as f64 * square, (j + 1) as f64 * square);
                let _ = writeln!(
                    svg,
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{square}\" height=\"{square}\"/>"
                );
            }
        }
        let _ = writeln!(
            svg,
            "<text x=\"{square}\" y=\"{}\" font-size=\"{}\">{} x {} inner corners, squares of \
             {square} mm; the first corner is at the top left</text>\n</svg>",
            height - 0.3 * square,
            0.3 * square,
            self.columns,
            self.rows
        );
        svg
    }
}

impl std::fmt::Display for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{} corners of {} mm", self.columns, self.rows, self.square_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_counted_row_by_row_and_the_first_square_is_black() {
        let board = Board { columns: 3, rows: 2, square_mm: 10.0 };
        assert_eq!(board.corners_m()[4], [0.01, 0.01]);
        assert!(board.has_one_orientation());
        assert!(!Board { columns: 4, ..board }.has_one_orientation());
        let svg = board.svg();
        assert!(svg.contains("width=\"60mm\" height=\"50mm\""), "{svg}");
        assert_eq!(svg.matches("<rect x=").count(), 6);
    }
}
