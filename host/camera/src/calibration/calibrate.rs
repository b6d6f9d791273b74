//! A lens from pictures of a board.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::bundle_adjustment::{Corners, Views};
use super::zhang::first_values;
use crate::board::{Board, LEAST_PICTURES, NoBoard};
use crate::corners::find::find_board;
use crate::error::CameraError;
use crate::lens::model::{Lens, PARAMETERS};
use crate::lens::pose::{homography, plane_pose};
use crate::picture::Picture;

/// The only format of a file with a calibration.
pub const FORMAT: &str = "camera-calibration/1";
/// The focal length must be known to a hundredth: then 1 mm at half a metre is not mistaken by more than
/// the plane's own board corrects.
const MOST_FOCAL_SD: f64 = 0.01;
/// A picture whose corners lie so much farther off than those of the others is remarked upon.
const OUTLIER: f64 = 2.5;

/// A calibrated lens and how well it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The file's format, [`FORMAT`].
    pub format: String,
    pub lens: Lens,
    pub quality: Quality,
    pub board: Board,
}

/// How well a calibration fits its pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    pub pictures: usize,
    /// Root of the mean squared distance between the corners found and those expected \[px\].
    pub reprojection_rms_px: f64,
    /// The same of the worst picture.
    pub worst_picture_px: f64,
    /// Standard deviations of the focal lengths \[px\].
    pub focal_sd_px: [f64; 2],
    /// Distance from the lens's axis up to which corners were seen, as the tangent of the angle.
    pub covered_radius: f64,
}

/// A picture of the board that was used, with its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Used {
    pub name: String,
    pub error_px: f64,
    /// Whether it fits much worse than the others do.
    pub is_outlier: bool,
}

/// A calibration with what is to be said about its pictures.
#[derive(Clone, Debug)]
pub struct Calibrated {
    pub calibration: Calibration,
    pub used: Vec<Used>,
    /// Pictures without the board, and why.
    pub left_out: Vec<(String, NoBoard)>,
}

/// What is fitted beside k1, k2, p1 and p2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CalibrationOptions {
    /// Fit k3 too, for lenses of wide angle.
    pub with_k3: bool,
}

/// Calibrates a lens from pictures of a board, given by their names.
///
/// All pictures have one size. Those in which the board is not found are left out and named.
pub fn calibrate(
    pictures: &[(String, Picture)],
    board: &Board,
    options: CalibrationOptions,
) -> Result<Calibrated, CameraError> {
    let size = one_size(pictures)?;
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for (name, picture) in pictures {
        match find_board(picture, board) {
            Ok(pixels) => found.push((name.clone(), pixels)),
            Err(why) => left_out.push((name.clone(), why)),
        }
    }
    if found.len() < LEAST_PICTURES {
        return Err(CameraError::TooFewBoards { found: found.len(), board: *board, left_out });
    }
    let (names, pixels): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    let (calibration, errors_px) = fit(&pixels, size, board, options)?;
    let used = names.into_iter().zip(errors_px.iter()).enumerate().map(|(i, (name, error_px))| {
        let others = errors_px.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, e)| e * e);
        let others = (others.sum::<f64>() / (errors_px.len() - 1) as f64).sqrt();
        Used { name, error_px: *error_px, is_outlier: *error_px > OUTLIER * others }
    });
    Ok(Calibrated { used: used.collect(), calibration, left_out })
}

/// Calibrates a lens from the pixels of a board's corners in each picture. Returns the error of each
/// picture, too \[px\].
pub fn fit(
    pixels: &[Vec<[f64; 2]>],
    size: [usize; 2],
    board: &Board,
    options: CalibrationOptions,
) -> Result<(Calibration, Vec<f64>), CameraError> {
    let corners_m = board.corners_m();
    let homographies: Vec<_> =
        pixels.iter().filter_map(|pixels| homography(&corners_m, pixels)).collect();
    let [focal, centre] = first_values(&homographies, size).ok_or(CameraError::OneDirection)?;
    let pinhole = Lens::pinhole(size, focal, centre);
    let poses = pixels.iter().map(|pixels| plane_pose(&pinhole, &corners_m, pixels));
    let poses = poses.collect::<Option<Vec<_>>>().ok_or(CameraError::OneDirection)?;
    let points_m: Vec<_> = corners_m.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
    // From the outside in: k3 is the last number, and is left alone unless it is asked for.
    let fitted = if options.with_k3 { PARAMETERS } else { PARAMETERS - 1 };
    let corners = Corners { points_m: &points_m, pixels, fitted };
    let views = corners.fit(Views { lens: pinhole, poses });
    let errors_px = corners.errors_px(&views);
    let rms =
        |errors: &[f64]| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let sd = corners.lens_sd(&views);
    let lens = views.lens;
    let focal_sd_px = [sd[0], sd[1]];
    if !(0..2).all(|k| focal_sd_px[k] < MOST_FOCAL_SD * lens.focal_px[k]) {
        return Err(CameraError::OneDirection);
    }
    let radius = |pixel: &[f64; 2]| lens.direction(*pixel).map(|[x, y]| x.hypot(y));
    let radii = pixels.iter().flatten().filter_map(radius);
    let quality = Quality {
        pictures: pixels.len(),
        reprojection_rms_px: rms(&errors_px),
        worst_picture_px: errors_px.iter().copied().fold(0.0, f64::max),
        focal_sd_px,
        covered_radius: radii.fold(0.0, f64::max),
    };
    let calibration = Calibration { format: FORMAT.into(), lens, quality, board: *board };
    Ok((calibration, errors_px))
}

/// The size of all pictures.
fn one_size(pictures: &[(String, Picture)]) -> Result<[usize; 2], CameraError> {
    let Some((first, picture)) = pictures.first() else {
        return Err(CameraError::NoPictures);
    };
    match pictures.iter().find(|(_, other)| other.size() != picture.size()) {
        None => Ok(picture.size()),
        Some((other, of_other)) => Err(CameraError::Sizes {
            first: (first.clone(), picture.size()),
            other: (other.clone(), of_other.size()),
        }),
    }
}
