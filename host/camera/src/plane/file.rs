//! The file that says which plane the catheter lies in.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::world::{Axes, Plane};
use crate::board::Board;
use crate::corners::find::find_board;
use crate::error::{CameraError, why};
use crate::lens::model::Lens;
use crate::picture::Picture;

/// Reference points lie in one plane to this much, which is half of what the tip may be off by \[m\].
const MOST_OFF_PLANE_M: f64 = 0.5e-3;
/// A point whose pixel says another place by more is a mistake, such as two names swapped \[m\].
const MOST_ERROR_M: f64 = 3.0e-3;
/// Axes of unit length and at right angles, to what people write with three digits.
const MOST_SKEW: f64 = 5e-3;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneFile {
    board: Option<Spanned<BoardTable>>,
    #[serde(default)]
    point: Vec<Spanned<PointTable>>,
    /// Towards the camera from what the board or the points show.
    #[serde(default)]
    offset_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardTable {
    picture: std::path::PathBuf,
    columns: Option<usize>,
    rows: Option<usize>,
    square_mm: Option<f64>,
    origin_m: [f64; 3],
    x: [f64; 3],
    y: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointTable {
    name: String,
    pixel: [f64; 2],
    position_m: [f64; 3],
}

/// Faults of one file, with the text that their lines are counted in.
struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Reader<'_> {
    fn line<T>(&self, of: &Spanned<T>) -> usize {
        1 + self.text[..of.span().start].matches('\n').count()
    }

    fn wrong(&self, line: Option<usize>, problem: impl Into<String>, fix: &str) -> CameraError {
        let mut path = self.path.as_os_str().to_owned();
        if let Some(line) = line {
            path.push(format!(":{line}"));
        }
        CameraError::File { path: path.into(), problem: problem.into(), fix: fix.into() }
    }
}

/// Reads the file of a plane and fits it. `board` is the one of the calibration, for a file that does not
/// say another.
pub fn read_plane(path: &Path, lens: &Lens, board: &Board) -> Result<Plane, CameraError> {
    let read = std::fs::read_to_string(path);
    let text = read.map_err(|e| CameraError::File {
        path: path.to_owned(),
        problem: format!("cannot be read: {e}"),
        fix: "check the path".into(),
    })?;
    let reader = Reader { path, text: &text };
    let parsed: PlaneFile = toml::from_str(&text).map_err(|e| {
        let line = e.span().map(|span| 1 + text[..span.start].matches('\n').count());
        let fix = "write [board] with picture, origin_m, x, y, or [[point]] four times or more with name, \
                   pixel, position_m";
        reader.wrong(line, e.message().to_owned(), fix)
    })?;
    let PlaneFile { board: of_board, point, offset_m } = parsed;
    match (of_board, &point[..]) {
        (Some(table), []) => from_board(&reader, &table, lens, board, offset_m),
        (None, [_, ..]) => from_points(&reader, &point, lens, offset_m),
        (None, []) => {
            let fix = "write [board], or [[point]] four times or more";
            Err(reader.wrong(None, "says nothing about a plane", fix))
        }
        (Some(table), _) => {
            let line = Some(reader.line(&table));
            Err(reader.wrong(line, "has both [board] and [[point]]", "take one of them out"))
        }
    }
}

fn from_board(
    reader: &Reader<'_>,
    spanned: &Spanned<BoardTable>,
    lens: &Lens,
    usual: &Board,
    offset_m: f64,
) -> Result<Plane, CameraError> {
    let (line, table) = (Some(reader.line(spanned)), spanned.get_ref());
    let board = Board {
        columns: table.columns.unwrap_or(usual.columns),
        rows: table.rows.unwrap_or(usual.rows),
        square_mm: table.square_mm.unwrap_or(usual.square_mm),
    };
    if !board.has_one_orientation() {
        let problem = format!(
            "a board of {}x{} corners looks the same after half a turn, so that its origin is not known",
            board.columns, board.rows
        );
        let fix = "use a board with an odd and an even number of inner corners, or [[point]]";
        return Err(reader.wrong(line, problem, fix));
    }
    let (x, y) = (Vector3::from(table.x), Vector3::from(table.y));
    let is_unit = |axis: &Vector3<f64>| (axis.norm() - 1.0).abs() < MOST_SKEW;
    if !is_unit(&x) || !is_unit(&y) || x.dot(&y).abs() > MOST_SKEW {
        let problem = "x and y are not unit vectors at right angles";
        let fix = "give the directions of the board's rows and columns in the vessel's frame, as in \
                   x = [1, 0, 0], y = [0, 0, 1]";
        return Err(reader.wrong(line, problem, fix));
    }
    let x = x.normalize();
    let y = (y - x * x.dot(&y)).normalize();
    let axes = Axes { origin_m: table.origin_m.into(), x, y };
    let place = reader.path.parent().unwrap_or(Path::new(".")).join(&table.picture);
    let picture = Picture::read(&place)?;
    if picture.size() != lens.size() {
        return Err(CameraError::Sizes {
            first: ("the calibration".into(), lens.size()),
            other: (place.display().to_string(), picture.size()),
        });
    }
    let pixels = find_board(&picture, &board).map_err(|reason| {
        let problem = format!("{}: {}", place.display(), why(reason, &board));
        reader.wrong(line, problem, "show the whole board, sharp and evenly lit")
    })?;
    let plane = Plane::fit(lens, axes, &board.corners_m(), &pixels, offset_m);
    let plane = plane.ok_or_else(|| {
        reader.wrong(
            line,
            "the board lies where the lens is not calibrated",
            "calibrate up to there",
        )
    })?;
    if plane.quality.worst_m > MOST_ERROR_M {
        let problem = format!(
            "a corner of the board is {:.1} mm from where the calibration expects it",
            1e3 * plane.quality.worst_m
        );
        let fix = "check square_mm, that the board is flat, and that neither focus nor zoom has changed \
                   since the calibration";
        return Err(reader.wrong(line, problem, fix));
    }
    Ok(plane)
}

fn from_points(
    reader: &Reader<'_>,
    points: &[Spanned<PointTable>],
    lens: &Lens,
    offset_m: f64,
) -> Result<Plane, CameraError> {
    let line = |i: usize| points.get(i).map(|point| reader.line(point));
    let name = |i: usize| points.get(i).map_or("", |point| &point.get_ref().name[..]);
    if points.len() < 4 {
        let problem = format!("{} points do not determine a plane before the camera", points.len());
        return Err(reader.wrong(line(0), problem, "give four points or more, no three on a line"));
    }
    let places: Vec<Vector3<f64>> = points.iter().map(|p| p.get_ref().position_m.into()).collect();
    let (axes, off) = axes_of(&places);
    if let Some((worst, off_m)) = off.filter(|(_, off_m)| *off_m > MOST_OFF_PLANE_M) {
        let problem = format!(
            "point `{}` lies {:.2} mm outside of the plane of the others",
            name(worst),
            1e3 * off_m
        );
        let fix = "give points of one plane; offset_m moves it to the height of the catheter";
        return Err(reader.wrong(line(worst), problem, fix));
    }
    let in_plane = |p: &Vector3<f64>| {
        let from = p - axes.origin_m;
        [from.dot(&axes.x), from.dot(&axes.y)]
    };
    let in_plane: Vec<_> = places.iter().map(in_plane).collect();
    let pixels: Vec<_> = points.iter().map(|p| p.get_ref().pixel).collect();
    let plane = Plane::fit(lens, axes, &in_plane, &pixels, offset_m).ok_or_else(|| {
        let fix = "check each pixel and position_m, that no two points are swapped, and that no three of \
                   four lie on a line";
        reader.wrong(line(0), "no plane before the camera shows the points at their pixels", fix)
    })?;
    let worst = plane.quality.worst;
    if plane.quality.worst_m > MOST_ERROR_M {
        let problem = format!(
            "point `{}` is {:.1} mm from where its pixel says it is",
            name(worst),
            1e3 * plane.quality.worst_m
        );
        let fix = "check its pixel and position_m, and that no two points are swapped";
        return Err(reader.wrong(line(worst), problem, fix));
    }
    Ok(plane)
}

/// Axes of the plane through points that fits them best, and the point that lies farthest off it \[m\].
fn axes_of(points_m: &[Vector3<f64>]) -> (Axes, Option<(usize, f64)>) {
    let mean = points_m.iter().sum::<Vector3<f64>>() / points_m.len() as f64;
    let spread: Matrix3<f64> = points_m.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let spread = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| spread.eigenvalues[*b].total_cmp(&spread.eigenvalues[*a]));
    let axis = |k: usize| spread.eigenvectors.column(order[k]).into_owned();
    let (x, y) = (axis(0), axis(1));
    let normal = x.cross(&y);
    let off = points_m.iter().map(|p| (p - mean).dot(&normal).abs()).enumerate();
    let worst = off.max_by(|a, b| a.1.total_cmp(&b.1));
    (Axes { origin_m: mean, x, y }, worst)
}
