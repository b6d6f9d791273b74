//! Arguments of `cathforce import camera`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::positive;

#[derive(Debug, Args)]
pub struct ImportCameraArguments {
    /// Video, or folder of PNG or JPEG frames. Without it the camera is calibrated and nothing else.
    #[arg(value_name = "VIDEO|FOLDER", required_unless_present_any = ["save_calibration", "draw_board"])]
    pub frames: Option<PathBuf>,
    /// Trial bundle of the rig: its entry, and the diameter of its instrument.
    #[arg(long, value_name = "FOLDER")]
    pub bundle: Option<PathBuf>,
    /// Motion of the drive: a trial's CSV or a recording.
    #[arg(long, value_name = "FILE")]
    pub motion: Option<PathBuf>,
    /// Time of the motion at which the first frame was taken.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub offset: f64,
    /// New trial, for example BUNDLE/trials/004.csv.
    #[arg(long, value_name = "FILE.csv")]
    pub out: Option<PathBuf>,
    /// Search all frames, say what was understood, and write nothing.
    #[arg(long)]
    pub dry_run: bool,
    #[command(flatten)]
    pub calibration: CalibrationArguments,
    #[command(flatten)]
    pub view: ViewArguments,
}

/// How the lens is calibrated.
#[derive(Debug, Args)]
#[command(next_help_heading = "Calibration")]
pub struct CalibrationArguments {
    /// Calibration that an earlier import has saved.
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["pictures", "save_calibration"])]
    pub calibration: Option<PathBuf>,
    /// Folder with pictures of the board, taken by this camera in this mode.
    #[arg(long, value_name = "FOLDER", requires = "board")]
    pub pictures: Option<PathBuf>,
    /// Inner corners of the board, where four squares meet: in a row, and in a column.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = board, requires = "square_mm")]
    pub board: Option<[usize; 2]>,
    /// Side of a square of the board.
    #[arg(long, value_name = "MILLIMETRES", value_parser = millimetres)]
    pub square_mm: Option<f64>,
    /// Fit the third radial coefficient too, for lenses of wide angle.
    #[arg(long)]
    pub k3: bool,
    /// Save the calibration into this file.
    #[arg(long, value_name = "FILE.toml", requires = "pictures")]
    pub save_calibration: Option<PathBuf>,
    /// Draw the board for a printer, at its true size.
    #[arg(long, value_name = "FILE.svg", requires = "board", conflicts_with = "frames")]
    pub draw_board: Option<PathBuf>,
}

/// How the catheter is found.
#[derive(Debug, Args)]
#[command(next_help_heading = "Catheter")]
pub struct ViewArguments {
    /// The plane in which the catheter lies: a board in it, or four named points or more.
    #[arg(long, value_name = "FILE.toml")]
    pub plane: Option<PathBuf>,
    /// Frames per second of a folder, or instead of a video's own times.
    #[arg(long, value_name = "HZ", value_parser = hertz)]
    pub rate: Option<f64>,
    /// Take every Nth frame only.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub every: u32,
    /// Points of the shape, tip and entry included; 0 for the tip alone.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = points)]
    pub points: usize,
    /// Whether the catheter is darker or lighter than the ground.
    #[arg(long, value_enum, default_value_t = CatheterColour::Dark)]
    pub polarity: CatheterColour,
    /// Contrast from which a pixel counts as catheter, from 0 to 1 [default: half of the catheter's own]
    #[arg(long, value_name = "CONTRAST", value_parser = contrast)]
    pub threshold: Option<f64>,
    /// Picture of the same view without the catheter.
    #[arg(long, value_name = "FILE")]
    pub background: Option<PathBuf>,
    /// Pixel at which the catheter comes in [default: where rig.toml says]
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true)]
    pub entry: Option<[f64; 2]>,
    /// Length of the catheter beyond the end of its centre line, such as a rounded nose.
    #[arg(long, value_name = "MILLIMETRES", default_value_t = 0.0, value_parser = nose)]
    pub nose_mm: f64,
}

/// What the catheter looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CatheterColour {
    /// Darker than the ground.
    Dark,
    /// Lighter than the ground.
    Light,
}

fn board(text: &str) -> Result<[usize; 2], String> {
    let wanted = "give two numbers from 2 to 100, as in 9x6";
    let (columns, rows) = text.split_once(['x', 'X', '×']).ok_or(wanted)?;
    let number = |text: &str| text.trim().parse().ok().filter(|n| (2..=100).contains(n));
    Ok([number(columns).ok_or(wanted)?, number(rows).ok_or(wanted)?])
}

fn pixel(text: &str) -> Result<[f64; 2], String> {
    let wanted = "give two numbers, as in 120,360";
    let (x, y) = text.split_once(',').ok_or(wanted)?;
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    Ok([number(x).ok_or(wanted)?, number(y).ok_or(wanted)?])
}

fn points(text: &str) -> Result<usize, String> {
    // The columns are numbered with four digits at most.
    let number = text.parse().ok().filter(|n| *n != 1 && *n <= 1000);
    number.ok_or_else(|| "give 0, or a number from 2 to 1000".into())
}

fn contrast(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| *x > 0.0 && *x < 1.0);
    number.ok_or_else(|| "give a number between 0 and 1".into())
}

fn nose(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.0..100.0).contains(x));
    number.ok_or_else(|| "give a number of millimetres from 0 to 100".into())
}

fn millimetres(text: &str) -> Result<f64, String> {
    positive(text, "a number of millimetres above 0")
}

fn hertz(text: &str) -> Result<f64, String> {
    positive(text, "a rate in Hz above 0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_pixels_and_points_are_read_and_checked() {
        assert_eq!(board("9x6"), Ok([9, 6]));
        assert!(board("9").is_err() && board("9x1").is_err() && board("x6").is_err());
        assert_eq!(pixel("12.5, -3"), Ok([12.5, -3.0]));
        assert!(pixel("12").is_err() && pixel("nan,1").is_err());
        assert!(points("1").is_err() && points("0").is_ok() && points("16").is_ok());
        assert!(contrast("0").is_err() && contrast("0.2").is_ok() && contrast("20").is_err());
    }
}
