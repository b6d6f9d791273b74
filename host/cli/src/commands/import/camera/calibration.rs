//! The calibration that an import uses.

use std::path::Path;

use cathforce_camera::{
    Board, Calibrated, Calibration, CalibrationOptions, Picture, calibrate, picture_files,
    why_no_board,
};
use cathforce_recording::write_whole;
use serde_json::json;

use crate::args::CalibrationArguments;
use crate::failure::{Code, Failure};
use crate::open::read_text;
use crate::output::{check_new, shown};
use crate::ui::{Ui, two_columns};

/// Calibrates, saves, and prints how good it is.
pub fn alone(ui: &Ui, arguments: &CalibrationArguments) -> Result<(), Failure> {
    let calibrated = get(ui, arguments)?;
    let rows = rows(&calibrated);
    let mut json = json(&calibrated);
    json["path"] = json!(arguments.save_calibration.as_ref().map(shown));
    ui.data(&json, two_columns(&rows))
}

/// Reads a saved calibration, or makes one and saves it where that is asked for.
pub fn get(ui: &Ui, arguments: &CalibrationArguments) -> Result<Calibrated, Failure> {
    if let Some(path) = &arguments.calibration {
        let calibration = Calibration::parse(&read_text(path)?).map_err(|problem| {
            let path = path.display();
            Failure::input(format!(
                "{path}: {problem}\n  fix: save the calibration again with --save-calibration"
            ))
        })?;
        return Ok(Calibrated { calibration, used: Vec::new(), left_out: Vec::new() });
    }
    let (Some(folder), Some(board)) = (&arguments.pictures, board(arguments)) else {
        let message = "the camera is not calibrated\n  fix: give --calibration FILE.toml, or --pictures \
                       FOLDER, --board COLUMNSxROWS and --square-mm MILLIMETRES";
        return Err(Failure::new(Code::Usage, message));
    };
    if let Some(path) = &arguments.save_calibration {
        check_new(path)?;
    }
    let calibrated = from_pictures(ui, arguments, folder, &board)?;
    if let Some(path) = &arguments.save_calibration {
        let text = calibrated.calibration.to_toml();
        let text = text.map_err(|e| Failure::write(path, e))?;
        write_whole(path, |out| std::io::Write::write_all(out, text.as_bytes()))
            .map_err(|e| Failure::write(path, e))?;
        ui.say(format_args!("calibration: {}", path.display()));
    }
    Ok(calibrated)
}

fn from_pictures(
    ui: &Ui,
    arguments: &CalibrationArguments,
    folder: &Path,
    board: &Board,
) -> Result<Calibrated, Failure> {
    let mut pictures = Vec::new();
    for path in picture_files(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        pictures.push((name, Picture::read(&path)?));
    }
    let options = CalibrationOptions { with_k3: arguments.k3 };
    let calibrated = calibrate(&pictures, board, options)
        .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
    for (name, reason) in &calibrated.left_out {
        let why = why_no_board(*reason, board);
        ui.warn(format_args!("{}: left out: {why}", folder.join(name).display()));
    }
    for used in calibrated.used.iter().filter(|used| used.is_outlier) {
        ui.warn(format_args!(
            "{}: its corners are {:.2} px from where they are expected, more than those of the others; \
             it may be blurred, or the board bent: take it out and calibrate again",
            folder.join(&used.name).display(),
            used.error_px
        ));
    }
    Ok(calibrated)
}

/// Draws the board for a printer.
pub fn draw_board(ui: &Ui, arguments: &CalibrationArguments, path: &Path) -> Result<(), Failure> {
    check_new(path)?;
    // The arguments ask for both numbers.
    let Some(board) = board(arguments) else {
        return Err(Failure::new(Code::Usage, "give --board COLUMNSxROWS and --square-mm"));
    };
    if !board.has_one_orientation() {
        ui.warn(
            "this board looks the same after half a turn: it calibrates a lens, but a plane needs an odd \
             and an even number of inner corners",
        );
    }
    write_whole(path, |out| std::io::Write::write_all(out, board.svg().as_bytes()))
        .map_err(|e| Failure::write(path, e))?;
    let json = json!({ "path": shown(path), "board": board });
    ui.data(&json, format_args!("board of {board}: {}\n", path.display()))
}

fn board(arguments: &CalibrationArguments) -> Option<Board> {
    let ([columns, rows], square_mm) = arguments.board.zip(arguments.square_mm)?;
    Some(Board { columns, rows, square_mm })
}

/// What is printed of a calibration.
pub fn rows(calibrated: &Calibrated) -> Vec<(String, String)> {
    let Calibration { lens, quality, board, .. } = &calibrated.calibration;
    let left_out = match calibrated.left_out.len() {
        0 => String::new(),
        n => format!(", {n} left out"),
    };
    let [fx, fy] = lens.focal_px;
    let [sx, sy] = quality.focal_sd_px;
    let mut distortion =
        format!("k1 {:+.4}, k2 {:+.4}, p1 {:+.5}, p2 {:+.5}", lens.k1, lens.k2, lens.p1, lens.p2);
    if lens.k3 != 0.0 {
        distortion += &format!(", k3 {:+.4}", lens.k3);
    }
    [
        ("board", format!("{board}, {} pictures{left_out}", quality.pictures)),
        (
            "reprojection",
            format!(
                "{:.3} px, worst picture {:.3} px",
                quality.reprojection_rms_px, quality.worst_picture_px
            ),
        ),
        ("focal length", format!("{fx:.1} ± {sx:.1} px, {fy:.1} ± {sy:.1} px")),
        ("centre", format!("{:.1}, {:.1} px", lens.centre_px[0], lens.centre_px[1])),
        ("distortion", distortion),
    ]
    .map(|(label, value)| (label.to_owned(), value))
    .to_vec()
}

pub fn json(calibrated: &Calibrated) -> serde_json::Value {
    let pictures = calibrated.used.iter();
    let pictures = pictures.map(|used| json!({ "name": used.name, "error_px": used.error_px }));
    let board = &calibrated.calibration.board;
    let left_out = calibrated.left_out.iter();
    let left_out =
        left_out.map(|(name, why)| json!({ "name": name, "why": why_no_board(*why, board) }));
    json!({
        "calibration": calibrated.calibration,
        "pictures": pictures.collect::<Vec<_>>(),
        "left_out": left_out.collect::<Vec<_>>(),
    })
}
