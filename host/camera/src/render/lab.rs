//! Writes what a lab would have: pictures of a board, the plane, frames, the drive's motion, and the
//! bundle of the rig. All of it is rendered, so that the true tip is known.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use super::film::Film;
use super::stand::{DIAMETER_M, Stand};
use crate::error::CameraError;

/// Frames a second, and the feed.
pub const RATE_HZ: f64 = 30.0;
const SPEED_M_PER_S: f64 = 0.023;
/// So much is past the entry for the first second.
const START_M: f64 = 0.06;
/// The camera was started so much later than the drive's log.
pub const OFFSET_S: f64 = 0.5;

/// Length past the entry \[m\] at a time of the drive's log \[s\].
pub fn length_m(t_s: f64) -> f64 {
    START_M + SPEED_M_PER_S * (t_s - 1.0).max(0.0)
}

/// Fills a new folder:
///
/// | file | what it holds |
/// | --- | --- |
/// | `pictures/` | twelve pictures of the board |
/// | `plane.png`, `plane.toml` | the board in the plane of the catheter |
/// | `background.png` | the phantom without the catheter |
/// | `frames/` | so many frames at 30 Hz |
/// | `motion.csv` | the drive at 250 Hz |
/// | `rig/` | a bundle without trials |
/// | `truth.csv` | the true tip in each frame |
pub fn write(folder: &Path, frames: usize) -> Result<(), CameraError> {
    let wrong = |e: io::Error| CameraError::File {
        path: folder.to_owned(),
        problem: format!("cannot be written: {e}"),
        fix: "give the name of a new folder".into(),
    };
    for inside in ["pictures", "frames", "rig/trials"] {
        fs::create_dir_all(folder.join(inside)).map_err(wrong)?;
    }
    let (stand, film) = (Stand::webcam(), Film::webcam());
    for (name, picture) in stand.calibration_pictures(&film) {
        picture.write(&folder.join("pictures").join(name))?;
    }
    stand.plane_picture(&film).write(&folder.join("plane.png"))?;
    stand.background(&film, 4242).write(&folder.join("background.png"))?;
    let mut truth = String::from("frame,t_s,length_m,tip_x_m,tip_y_m,tip_z_m\n");
    for k in 0..frames {
        let t_s = OFFSET_S + k as f64 / RATE_HZ;
        let frame = stand.frame(length_m(t_s), &film, k as u64);
        frame.write(&folder.join(format!("frames/{k:04}.png")))?;
        let line = stand.catheter(length_m(t_s));
        let tip = line[line.len() - 1];
        let _ = writeln!(truth, "{k},{t_s:.4},{:.6},{:.6},{:.6},0", length_m(t_s), tip.x, tip.y);
    }
    let text = |name: &str, text: String| fs::write(folder.join(name), text).map_err(wrong);
    text("truth.csv", truth)?;
    text("plane.toml", plane())?;
    text("motion.csv", motion(OFFSET_S + frames as f64 / RATE_HZ))?;
    text("rig/rig.toml", rig(&stand))?;
    text("rig/centreline.csv", centreline(&stand))
}

fn plane() -> String {
    let [origin, x, y] = Stand::PLANE_BOARD;
    format!(
        "# The board lay in the plane of the catheter.\n[board]\npicture = \"plane.png\"\n\
         origin_m = {origin:?}   # its first corner, in the vessel's frame\n\
         x = {x:?}            # along a row\ny = {y:?}           # along a column\n"
    )
}

fn motion(until_s: f64) -> String {
    let mut motion = String::from("t_s,insertion_m,rotation_rad\n");
    for k in 0..=(250.0 * until_s).ceil() as usize {
        let t_s = k as f64 / 250.0;
        let _ = writeln!(motion, "{t_s},{:.7},0", length_m(t_s));
    }
    motion
}

/// A rig whose vessel is straight: an import takes its entry and its diameter.
fn rig(stand: &Stand) -> String {
    let entry = stand.entry_m;
    format!(
        r#"format = "trial-bundle/1"
name = "camera-stand"

[instrument]
length_m = 0.80
outer_diameter_m = {DIAMETER_M}
inner_diameter_m = 0.97e-3
density_kg_per_m3 = 1550.0
poissons_ratio = 0.4
sections = [{{ length_m = 0.80, youngs_modulus_Pa = 600.0e6 }}]
tip_precurve = [{{ length_m = 0.0098, curvature_per_m = 125.0 }}]

[entry]
position_m = [{}, {}, 0.0]
direction = [1.0, 0.0, 0.0]
up = [0.0, -1.0, 0.0]

[vessel]
friction_coefficient = 0.3
wall_stiffness_N_per_m = 4000.0
wall_contact_spacing_m = 0.005

[environment]
gravity_m_per_s2 = [0.0, 0.0, -9.81]
fluid = "none"

[sensor]
force_rate_hz = 250.0
"#,
        entry.x, entry.y
    )
}

fn centreline(stand: &Stand) -> String {
    let entry = stand.entry_m;
    let mut centreline = String::from("branch,s_m,x_m,y_m,z_m,radius_m\n");
    for k in 0..=25 {
        let s = 0.01 * f64::from(k);
        let _ = writeln!(centreline, "main,{s},{},{},0,0.0095", entry.x + s, entry.y);
    }
    centreline
}
