//! What the camera looks at: the rig's entry, the plane, the catheter.

use std::path::Path;

use cathforce_bundle::bundle::{CatheterRig, Plant};
use cathforce_camera::{
    Calibration, CameraError, Dropped, Entry, MOST_FROM_ENTRY_M, NoView, Picture, Polarity,
    Sequence, TrackOptions, Tracker, read_plane,
};

use crate::args::{CatheterColour, ImportCameraArguments};
use crate::failure::{Code, Failure};
use crate::open::open_bundle;
use crate::ui::Ui;

/// Arguments without which no frame can be understood.
pub struct Needed<'a> {
    bundle: &'a Path,
    plane: &'a Path,
}

impl<'a> Needed<'a> {
    /// All that are missing are named at once.
    pub fn of(arguments: &'a ImportCameraArguments) -> Result<Self, Failure> {
        let is_dry = arguments.dry_run;
        let missing = [
            (arguments.bundle.is_none(), "--bundle FOLDER, for the entry and the diameter"),
            (arguments.view.plane.is_none(), "--plane FILE.toml, for the catheter's plane"),
            (
                arguments.motion.is_none() && !is_dry,
                "--motion FILE, for the insertion at each frame",
            ),
            (arguments.out.is_none() && !is_dry, "--out FILE.csv, for the trial, or --dry-run"),
        ];
        let missing: Vec<&str> = missing
            .into_iter()
            .filter_map(|(is_missing, what)| is_missing.then_some(what))
            .collect();
        match (&arguments.bundle, &arguments.view.plane) {
            (Some(bundle), Some(plane)) if missing.is_empty() => Ok(Self { bundle, plane }),
            _ => {
                let message = format!("the import lacks\n  {}", missing.join("\n  "));
                Err(Failure::new(Code::Usage, message))
            }
        }
    }
}

/// The entry may lie so far from the plane of the catheter: it is the middle of a vessel \[m\].
const MOST_OFF_PLANE_M: f64 = 3e-3;

/// Looks for the catheter of a bundle in pictures of a size.
pub fn tracker(
    ui: &Ui,
    arguments: &ImportCameraArguments,
    needed: &Needed<'_>,
    calibration: &Calibration,
    size: [usize; 2],
) -> Result<Tracker, Failure> {
    let bundle = open_bundle(ui, needed.bundle)?;
    let rig = rig(&bundle.rig.plant, needed.bundle)?;
    let lens = &calibration.lens;
    if lens.size() != size {
        let first = ("the calibration".to_owned(), lens.size());
        let path = arguments.frames.as_ref().map(|path| path.display().to_string());
        return Err(CameraError::Sizes { first, other: (path.unwrap_or_default(), size) }.into());
    }
    let plane = read_plane(needed.plane, lens, &calibration.board)?;
    let mut entry =
        Entry { position_m: rig.entry.position_m.into(), direction: rig.entry.direction.into() };
    let height_m = plane.height_m(entry.position_m);
    if height_m.abs() > MOST_OFF_PLANE_M {
        ui.warn(format_args!(
            "{}: the plane is {:.1} mm from the entry of {}: lengths in it are measured wrong by the \
             perspective\n  fix: give offset_m, from the board towards the camera to the catheter",
            needed.plane.display(),
            1e3 * height_m.abs(),
            needed.bundle.join("rig.toml").display()
        ));
    }
    let tilt = plane.normal.dot(&entry.direction).abs();
    // At 20° to the plane a length is seen 6 % short.
    if tilt > 0.34 {
        ui.warn(format_args!(
            "{}: the entry's direction leaves the plane by {:.0} degrees: the catheter does not lie in it",
            needed.plane.display(),
            tilt.asin().to_degrees()
        ));
    }
    if let Some(pixel) = arguments.view.entry {
        entry.position_m = plane.place(pixel).ok_or_else(|| {
            Failure::new(Code::Usage, "--entry is where the lens shows nothing of the plane")
        })?;
    }
    let options = options(arguments)?;
    let diameter_m = rig.instrument.outer_diameter_m;
    Tracker::new(plane, entry, diameter_m, options).map_err(|why| no_view(why, needed, size))
}

fn rig<'a>(plant: &'a Plant, bundle: &Path) -> Result<&'a CatheterRig, Failure> {
    match plant {
        Plant::Catheter(rig) => Ok(rig),
        Plant::Drive(_) | Plant::Transmission(_) => Err(Failure::input(format!(
            "{}: its rig has no instrument\n  fix: give the bundle of a catheter",
            bundle.display()
        ))),
    }
}

fn options(arguments: &ImportCameraArguments) -> Result<TrackOptions, Failure> {
    let view = &arguments.view;
    let background = view.background.as_ref();
    Ok(TrackOptions {
        polarity: match view.polarity {
            CatheterColour::Dark => Polarity::Dark,
            CatheterColour::Light => Polarity::Light,
        },
        threshold: view.threshold,
        background: background.map(|path| Picture::read(path)).transpose()?,
        points: view.points,
        nose_m: 1e-3 * view.nose_mm,
    })
}

fn no_view(why: NoView, needed: &Needed<'_>, size: [usize; 2]) -> Failure {
    let rig = needed.bundle.join("rig.toml");
    let (rig, plane) = (rig.display(), needed.plane.display());
    let message = match why {
        NoView::EntryOutside(at) => {
            let at =
                at.map_or("behind the camera".into(), |[x, y]| format!("at pixel {x:.0}, {y:.0}"));
            format!(
                "{rig}: by {plane} the entry is {at}, outside of the {}x{} pixels\n  fix: give the plane in \
                 the vessel's frame, or the entry's pixel with --entry X,Y",
                size[0], size[1]
            )
        }
        NoView::Thin(width_px) => format!(
            "{rig}: the instrument is {width_px:.1} pixels wide, too thin to be measured\n  fix: move the \
             camera nearer, or record with more pixels"
        ),
        NoView::Background([width, height]) => format!(
            "--background has {width}x{height} pixels, the frames have {}x{}\n  fix: take it with the same \
             camera in the same mode",
            size[0], size[1]
        ),
    };
    Failure::input(message)
}

/// The failure of a recording in which no frame shows the catheter.
pub fn nothing_found(path: &Path, sequence: &Sequence) -> Failure {
    let lines = grouped(&sequence.dropped).into_iter();
    let lines = lines.map(|group| format!("\n  {}\n  fix: {}", group.text(), group.fix));
    Failure::input(format!(
        "{}: no frame shows the catheter{}",
        path.display(),
        lines.collect::<String>()
    ))
}

/// Dropped frames of one reason.
pub struct Group {
    pub numbers: Vec<usize>,
    /// The reason as the first of them has it.
    pub why: String,
    pub fix: &'static str,
}

impl Group {
    pub fn text(&self) -> String {
        let frames = if self.numbers.len() == 1 { "frame" } else { "frames" };
        format!("{frames} {}: {}", ranges(&self.numbers), self.why)
    }
}

/// Dropped frames by what helps.
pub fn grouped(dropped: &[Dropped]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for Dropped { number, why } in dropped {
        let fix = why.fix();
        match groups.iter_mut().find(|group| group.fix == fix) {
            Some(group) => group.numbers.push(*number),
            None => groups.push(Group { numbers: vec![*number], why: why.to_string(), fix }),
        }
    }
    groups
}

/// Numbers as ranges: `3, 7 to 9`.
fn ranges(numbers: &[usize]) -> String {
    let mut parts: Vec<[usize; 2]> = Vec::new();
    for number in numbers {
        match parts.last_mut() {
            Some([_, last]) if *number == *last + 1 => *last = *number,
            _ => parts.push([*number; 2]),
        }
    }
    const MOST: usize = 12;
    let part = |[first, last]: &[usize; 2]| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first} to {last}"),
    };
    let mut text: Vec<String> = parts.iter().take(MOST).map(part).collect();
    if parts.len() > MOST {
        text.push(format!("and others, {} in all", numbers.len()));
    }
    text.join(", ")
}

/// Beyond the corners of the calibration by this factor the distortion is a guess, by which a place may
/// be off by pixels …
const MOST_BEYOND: f64 = 1.15;
/// … and by this factor it is still an extrapolation.
const REMARK_BEYOND: f64 = 1.02;

/// Whether the catheter was seen where the calibration has seen the board.
pub fn check_covered(
    ui: &Ui,
    calibration: &Calibration,
    sequence: &Sequence,
) -> Result<(), Failure> {
    let covered = calibration.quality.covered_radius;
    let beyond = |factor: f64| {
        let kept = sequence.kept.iter().filter(|kept| kept.sighting.radius > factor * covered);
        kept.map(|kept| kept.number).collect::<Vec<_>>()
    };
    let message = |numbers: &[usize]| {
        format!(
            "frames {}: the catheter is seen farther from the middle than the board was in any calibration \
             picture, where the distortion is not known\n  fix: calibrate with the board in the corners of \
             the picture",
            ranges(numbers)
        )
    };
    let far = beyond(MOST_BEYOND);
    if !far.is_empty() {
        return Err(Failure::input(message(&far)));
    }
    let near = beyond(REMARK_BEYOND);
    if !near.is_empty() {
        ui.warn(message(&near));
    }
    Ok(())
}

/// The entry must be seen this near.
pub const ENTRY_REACH_M: f64 = MOST_FROM_ENTRY_M;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_as_ranges() {
        assert_eq!(ranges(&[3, 7, 8, 9, 12, 13]), "3, 7 to 9, 12, 13");
        let odd: Vec<usize> = (0..40).map(|k| 2 * k).collect();
        assert!(ranges(&odd).ends_with("20, 22, and others, 40 in all"), "{}", ranges(&odd));
    }
}
