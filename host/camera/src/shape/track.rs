//! Tip and shape of the catheter in one frame.

use nalgebra::{Vector2, Vector3};

use super::centreline::{arc, at_arc, centre_line, with_end};
use super::contrast::{Polarity, background, contrast};
use super::mask::{mask, thresholds};
use super::path::{Path, longest_path};
use super::thin::thin;
use crate::picture::Picture;
use crate::plane::world::Plane;

/// Where the instrument comes into the vessel, vessel frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    pub position_m: Vector3<f64>,
    /// Unit vector into the vessel.
    pub direction: Vector3<f64>,
}

/// How the catheter is found.
#[derive(Clone, Debug, Default)]
pub struct TrackOptions {
    pub polarity: Polarity,
    /// Contrast that counts as catheter, from 0 to 1; else half of the catheter's own.
    pub threshold: Option<f64>,
    /// The same view without the catheter.
    pub background: Option<Picture>,
    /// Points of the shape, tip and entry included; 0 for the tip alone.
    pub points: usize,
    /// Length of the catheter beyond the end of the rig's centre line, such as a rounded nose \[m\].
    pub nose_m: f64,
}

/// What one frame shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// End of the centre line, vessel frame \[m\].
    pub tip_m: [f64; 3],
    /// Points at equal steps of length, from the tip to the entry, vessel frame \[m\].
    pub shape_m: Vec<[f64; 3]>,
    /// Length of the centre line from the entry to the tip \[m\].
    pub length_m: f64,
    /// Length of gaps that were bridged \[m\].
    pub bridged_m: f64,
    /// Length of the entry's side that was not seen \[m\].
    pub unseen_at_entry_m: f64,
    /// Length of the longest branch that was left out \[m\].
    pub side_branch_m: f64,
    /// Contrast from which on pixels count as catheter.
    pub threshold: f64,
    /// The largest tangent of the angle from the lens's axis.
    pub radius: f64,
}

/// Why a frame shows no catheter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Miss {
    /// The largest contrast there is, and the one that is needed.
    NoCatheter { seen: f64, needed: f64 },
    /// Something is seen, but it begins this far from the entry \[m\].
    NotAtEntry { distance_m: f64 },
    /// The end of the catheter is not seen: it is faint, hidden, or outside of the picture.
    NoEnd,
    /// Too little of it is past the entry.
    TooShort,
    /// Part of it is seen where the lens's distortion folds.
    OutsideLens,
}

/// The catheter must be seen this near to the entry \[m\]: twice the outer radius of a common guide.
pub const MOST_FROM_ENTRY_M: f64 = 5e-3;
/// What is behind the entry plane and within this distance of the entry is the catheter before it comes
/// in \[m\]; farther away the catheter may have turned back.
const BEFORE_ENTRY_M: f64 = 30e-3;
/// This much before the entry plane is kept, so that the line can be cut there, in widths.
const KEPT_BEFORE_WIDTHS: f64 = 2.0;
/// A shorter line has no direction, in widths.
const SHORTEST_WIDTHS: f64 = 4.0;

/// Finds the catheter in frames of one view.
pub struct Tracker {
    plane: Plane,
    entry: Entry,
    options: TrackOptions,
    /// The entry's pixel, and the catheter's width and the size of a pixel there.
    entry_px: [f64; 2],
    width_px: f64,
    pixel_m: f64,
    background: Option<Picture>,
}

/// Why frames of a view cannot be searched at all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoView {
    /// The entry is seen at a pixel outside of the picture, or not at all.
    EntryOutside(Option<[f64; 2]>),
    /// The catheter is so many pixels wide; one and a half are needed for a middle.
    Thin(f64),
    /// The background has another size.
    Background([usize; 2]),
}

/// Narrower than that a middle is not better than a pixel \[px\].
const LEAST_WIDTH_PX: f64 = 1.5;

impl Tracker {
    /// `diameter_m` is the catheter's outer diameter.
    pub fn new(
        plane: Plane,
        entry: Entry,
        diameter_m: f64,
        options: TrackOptions,
    ) -> Result<Self, NoView> {
        let size = plane.lens.size();
        let entry_px = plane.pixel(entry.position_m);
        let seen = entry_px
            .filter(|[x, y]| *x >= 0.0 && *y >= 0.0 && *x < size[0] as f64 && *y < size[1] as f64);
        let pixel_m = seen.and_then(|pixel| plane.pixel_m(pixel));
        let Some((entry_px, pixel_m)) = seen.zip(pixel_m) else {
            return Err(NoView::EntryOutside(entry_px));
        };
        let width_px = diameter_m / pixel_m;
        if width_px < LEAST_WIDTH_PX {
            return Err(NoView::Thin(width_px));
        }
        let given = options.background.as_ref();
        if let Some(other) = given.filter(|picture| picture.size() != size) {
            return Err(NoView::Background(other.size()));
        }
        let background = given.map(|picture| background(picture, width_px));
        Ok(Self { plane, entry, options, entry_px, width_px, pixel_m, background })
    }

    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Width of the catheter at the entry \[px\].
    pub fn width_px(&self) -> f64 {
        self.width_px
    }

    /// Size of a pixel at the entry \[m\].
    pub fn pixel_m(&self) -> f64 {
        self.pixel_m
    }

    /// The pixel of the entry.
    pub fn entry_px(&self) -> [f64; 2] {
        self.entry_px
    }

    /// Finds the catheter in a frame, which has the size of the calibration.
    pub fn track(&self, frame: &Picture) -> Result<Sighting, Miss> {
        let (options, width_px) = (&self.options, self.width_px);
        let contrast = contrast(frame, self.background.as_ref(), options.polarity, width_px);
        let thresholds = thresholds(&contrast, options.threshold, width_px)
            .map_err(|[seen, needed]| Miss::NoCatheter { seen, needed })?;
        let mut skeleton = thin(&mask(&contrast.smooth, thresholds, width_px));
        let start = self.cut_before_entry(&mut skeleton.part, skeleton.width);
        let most_px = MOST_FROM_ENTRY_M / self.pixel_m + KEPT_BEFORE_WIDTHS * width_px;
        let path = longest_path(&skeleton, start, most_px, width_px)
            .map_err(|px| Miss::NotAtEntry { distance_m: px * self.pixel_m })?;
        if (path.pixels.len() as f64) < SHORTEST_WIDTHS * width_px {
            return Err(Miss::TooShort);
        }
        let line = centre_line(&path.pixels, &contrast, thresholds, width_px);
        let line = with_end(&line, &contrast, width_px).ok_or(Miss::NoEnd)?;
        self.in_vessel(&line, &path, thresholds.high)
    }

    /// Takes away what is seen of the catheter before it comes in. Returns the pixel near which what is
    /// left begins.
    fn cut_before_entry(&self, part: &mut [u16], width: usize) -> [f64; 2] {
        let ahead = self.plane.pixel(self.entry.position_m + 1e-3 * self.entry.direction);
        let entry = Vector2::from(self.entry_px);
        let ahead = ahead.and_then(|ahead| (Vector2::from(ahead) - entry).try_normalize(1e-9));
        // An entry that points at the camera has no direction in the picture.
        let Some(ahead) = ahead else { return self.entry_px };
        let (near, kept) = (BEFORE_ENTRY_M / self.pixel_m, KEPT_BEFORE_WIDTHS * self.width_px);
        for (i, part) in part.iter_mut().enumerate().filter(|(_, part)| **part != 0) {
            let from = Vector2::new((i % width) as f64, (i / width) as f64) - entry;
            if from.dot(&ahead) < -kept && from.norm() < near {
                *part = 0;
            }
        }
        (entry - kept * ahead).into()
    }

    /// The line in the vessel's frame, cut at the entry plane.
    fn in_vessel(
        &self,
        line: &[Vector2<f64>],
        path: &Path,
        threshold: f64,
    ) -> Result<Sighting, Miss> {
        let place = |p: &Vector2<f64>| self.plane.place((*p).into()).ok_or(Miss::OutsideLens);
        let places = line.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let radius = |p: &Vector2<f64>| self.plane.lens.direction((*p).into());
        let radius = line.iter().filter_map(radius).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        let past = |p: &Vector3<f64>| (p - self.entry.position_m).dot(&self.entry.direction);
        // The last crossing of the entry plane that is near the entry.
        let is_near =
            |p: &Vector3<f64>| (p - self.entry.position_m).norm() < 2.0 * MOST_FROM_ENTRY_M;
        let crossing = places
            .windows(2)
            .take_while(|pair| is_near(&pair[0]))
            .enumerate()
            .filter(|(_, pair)| past(&pair[0]) <= 0.0 && past(&pair[1]) > 0.0)
            .last();
        let (first, rest) = match crossing {
            Some((i, pair)) => {
                let share = past(&pair[0]) / (past(&pair[0]) - past(&pair[1]));
                (pair[0] + share * (pair[1] - pair[0]), &places[i + 1..])
            }
            None => {
                // The guide hides the beginning: the instrument is held at the entry.
                let height_m = self.plane.height_m(self.entry.position_m);
                (self.entry.position_m - height_m * self.plane.normal, &places[..])
            }
        };
        let unseen_at_entry_m = match crossing {
            Some(_) => 0.0,
            None => rest.first().map_or(0.0, |p| (p - first).norm()),
        };
        if unseen_at_entry_m > MOST_FROM_ENTRY_M {
            return Err(Miss::NotAtEntry { distance_m: unseen_at_entry_m });
        }
        let whole: Vec<Vector3<f64>> = std::iter::once(first).chain(rest.iter().copied()).collect();
        let lengths = arc(&whole);
        let length_m = lengths.last().copied().unwrap_or(0.0) - self.options.nose_m;
        if whole.len() < 2 || length_m <= 0.0 {
            return Err(Miss::TooShort);
        }
        let steps = self.options.points.saturating_sub(1).max(1) as f64;
        let point = |k: usize| -> [f64; 3] {
            at_arc(&whole, &lengths, length_m * (1.0 - k as f64 / steps)).into()
        };
        Ok(Sighting {
            tip_m: point(0),
            shape_m: (0..self.options.points).map(point).collect(),
            length_m,
            bridged_m: path.bridged_px * self.pixel_m,
            unseen_at_entry_m,
            side_branch_m: path.side_branch_px * self.pixel_m,
            threshold,
            radius,
        })
    }
}

impl std::fmt::Display for Miss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoCatheter { seen, needed } => write!(
                f,
                "no catheter is seen: the largest contrast is {seen:.2}, and {needed:.2} is needed"
            ),
            Self::NotAtEntry { distance_m } if distance_m.is_infinite() => {
                write!(f, "no catheter is seen: nothing is long enough")
            }
            Self::NotAtEntry { distance_m } => {
                write!(
                    f,
                    "the catheter is not seen at the entry, but {:.1} mm from it",
                    1e3 * distance_m
                )
            }
            Self::NoEnd => write!(f, "the end of the catheter is not seen"),
            Self::TooShort => write!(f, "too little of the catheter is past the entry"),
            Self::OutsideLens => write!(f, "it is seen where the calibration's distortion folds"),
        }
    }
}

impl Miss {
    /// What helps.
    pub fn fix(&self) -> &'static str {
        match self {
            Self::NoCatheter { .. } => {
                "give --polarity light for a light catheter, a lower --threshold, or more light"
            }
            Self::NotAtEntry { .. } => {
                "check the entry of rig.toml, the plane and --polarity, give --entry X,Y, or a --background \
                 picture without the catheter"
            }
            Self::NoEnd => "keep the tip inside of the picture, and lamps from shining on it",
            Self::TooShort => "begin the recording when a few millimetres are past the entry",
            Self::OutsideLens => {
                "calibrate with the board in the corners of the picture, or move the camera back"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_miss_says_what_helps() {
        for miss in [
            Miss::NoCatheter { seen: 0.1, needed: 0.2 },
            Miss::NotAtEntry { distance_m: 0.01 },
            Miss::NotAtEntry { distance_m: f64::INFINITY },
            Miss::NoEnd,
            Miss::TooShort,
            Miss::OutsideLens,
        ] {
            assert!(!miss.to_string().contains("inf") && !miss.fix().is_empty());
        }
    }
}
