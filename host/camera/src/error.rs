//! Why pictures cannot be used, and what to do about it.

use std::path::PathBuf;

use crate::board::{Board, LEAST_PICTURES, NoBoard};

/// A fault of the camera's pictures or of a file that describes them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    #[error("{}: cannot be read as a picture: {problem}\n  fix: give PNG or JPEG files", .path.display())]
    Picture { path: PathBuf, problem: String },
    #[error("{}: {problem}\n  fix: {fix}", .path.display())]
    File { path: PathBuf, problem: String, fix: String },
    #[error("no pictures were given\n  fix: give a folder with PNG or JPEG files")]
    NoPictures,
    #[error(
        "the pictures have different sizes: {} has {}x{} pixels, {} has {}x{}\n  fix: take all pictures \
         with one camera in one mode, and neither crop nor scale them",
        .first.0, .first.1[0], .first.1[1], .other.0, .other.1[0], .other.1[1]
    )]
    Sizes { first: (String, [usize; 2]), other: (String, [usize; 2]) },
    #[error("{}", too_few(*.found, .board, .left_out))]
    TooFewBoards { found: usize, board: Board, left_out: Vec<(String, NoBoard)> },
    #[error(
        "the pictures of the board do not determine the lens: they show it from one direction, or too \
         few of them are tilted\n  fix: take ten pictures or more; tilt the board by 20 to 40 degrees to \
         each side, and bring it into each corner of the picture"
    )]
    OneDirection,
    #[error("{0}\n  fix: {1}")]
    Video(String, String),
}

/// Why a board was not found, in words.
pub fn why(reason: NoBoard, board: &Board) -> String {
    let Board { columns, rows, .. } = board;
    match reason {
        NoBoard::Nothing => "no checkerboard is seen whole and sharp".into(),
        NoBoard::Size(a, b) if [a + 1, b + 1] == [*columns.max(rows), *columns.min(rows)] => {
            format!(
                "a board of {a}x{b} inner corners is seen: --board counts inner corners, not squares"
            )
        }
        NoBoard::Size(a, b) => format!("only {a}x{b} of {columns}x{rows} inner corners are seen"),
        NoBoard::Small => "its squares are too small in the picture".into(),
    }
}

fn too_few(found: usize, board: &Board, left_out: &[(String, NoBoard)]) -> String {
    let lines =
        left_out.iter().map(|(name, reason)| format!("\n  {name}: {}", why(*reason, board)));
    format!(
        "the board of {}x{} inner corners was found in {found} of {} pictures; at least {} are needed{}\n  \
         fix: show the whole board with its white margin, sharp and evenly lit, with squares of at least \
         10 pixels; --board counts inner corners, not squares",
        board.columns,
        board.rows,
        found + left_out.len(),
        LEAST_PICTURES,
        lines.collect::<String>()
    )
}
