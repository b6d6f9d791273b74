//! The file that describes a block, the probe and the images.

use std::path::{Path, PathBuf};

use cathforce_wall::{WallMesh, read_gmsh};
use serde::Deserialize;

use crate::block::{Block, Elements};
use crate::error::UltrasoundError;
use crate::png_file::read_mask;
use crate::probe::Pose;
use crate::raster::Grid;
use crate::response::Law;
use crate::study::{Bounds, Image, Registration, Study};

/// The format that this reads.
pub const FORMAT: &str = "ultrasound/1";

/// Most pixels of a mask: more than any scanner shows, few enough to be held ten times.
const MOST_PIXELS: usize = 4_000_000;

/// Elements of a search: `reproduce` measures what finer ones change.
const ELEMENTS: Elements = Elements { outwards: 4, around: 20, along: 12 };

/// A description as it is written.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    pub format: String,
    #[serde(default)]
    pub law: Law,
    pub block: Option<Block>,
    /// A mesh of Gmsh in place of the block, with the physical surfaces `inner` (the vessel's wall) and
    /// `fixed` (the base); z points up, and the highest face is z = 0.
    pub mesh: Option<PathBuf>,
    pub probe: Probe,
    pub masks: Grid,
    #[serde(rename = "pose")]
    pub poses: Vec<Pose>,
    #[serde(rename = "image")]
    pub images: Vec<ImageEntry>,
    pub search: Search,
    #[serde(default = "default_elements")]
    pub elements: Elements,
}

fn default_elements() -> Elements {
    ELEMENTS
}

/// The probe's face.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Along the image plane and across it \[mm\].
    pub face_mm: [f64; 2],
}

/// An image.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageEntry {
    /// Number of the pose, from 1.
    pub pose: usize,
    pub force_n: f64,
    /// PNG, beside the description.
    pub mask: PathBuf,
}

/// How a stiffness is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// From the softest to the stiffest.
    pub youngs_modulus_kpa: [f64; 2],
    pub poissons_ratio: [f64; 2],
    #[serde(default)]
    pub registration: Registration,
    #[serde(default = "one")]
    pub seed: u64,
}

fn one() -> u64 {
    1
}

impl Description {
    /// Reads a description. Errors: the file cannot be read, is no TOML, or says what cannot be.
    pub fn read(path: &Path) -> Result<Self, UltrasoundError> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            UltrasoundError::file(path, format!("cannot be read: {error}"), "check the path")
        })?;
        let own: Self = toml::from_str(&text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let place = PathBuf::from(format!("{}:{line}", path.display()));
            let fix = "compare with the description in the how-to page on ultrasound";
            UltrasoundError::file(place, error.message(), fix)
        })?;
        match own.fault() {
            Some((cause, fix)) => Err(UltrasoundError::file(path, cause, fix)),
            None => Ok(own),
        }
    }

    /// What is wrong, and its fix.
    fn fault(&self) -> Option<(String, &'static str)> {
        if self.format != FORMAT {
            let cause = format!("the format is `{}`, not `{FORMAT}`", self.format);
            return Some((cause, "give the description of an ultrasound measurement"));
        }
        match (&self.block, &self.mesh) {
            (Some(block), None) => {
                if let Some(fault) = block.fault() {
                    return Some(fault);
                }
            }
            (None, Some(_)) => {}
            _ => {
                let cause = "it must have either a [block] or a `mesh`".to_owned();
                return Some((cause, "leave one of them out, and give the other"));
            }
        }
        let Elements { outwards, around, along } = self.elements;
        if !((1..=12).contains(&outwards)
            && (8..=64).contains(&around)
            && (2..=64).contains(&along))
        {
            let cause = "the numbers of elements are out of range".to_owned();
            return Some((cause, "give outwards 1 to 12, around 8 to 64, along 2 to 64"));
        }
        let is_size = |x: f64| x > 0.0 && x.is_finite();
        if !self.probe.face_mm.into_iter().all(is_size) {
            let cause = "`face_mm` of the probe must be two numbers above 0".to_owned();
            return Some((cause, "give the length of the array and its width in millimetres"));
        }
        let Grid { size_px: [width, height], pixel_mm, origin_mm } = self.masks;
        let is_place = origin_mm.into_iter().all(f64::is_finite) && is_size(pixel_mm);
        if width < 3 || height < 3 || width.saturating_mul(height) > MOST_PIXELS || !is_place {
            let cause = "[masks] does not describe a picture".to_owned();
            let fix = "give `size_px` of at least 3 by 3 pixels and at most 4 million of them, \
                       `pixel_mm` above 0 and `origin_mm`";
            return Some((cause, fix));
        }
        self.fault_of_images().or_else(|| self.fault_of_search())
    }

    fn fault_of_images(&self) -> Option<(String, &'static str)> {
        let of_pose = |pose: &Pose| pose.at_mm.into_iter().chain([pose.turn_deg]);
        if !self.poses.iter().flat_map(of_pose).all(f64::is_finite) {
            return Some((
                "a pose is not a finite number".to_owned(),
                "give millimetres and degrees",
            ));
        }
        if self.images.is_empty() {
            let cause = "it names no image".to_owned();
            return Some((cause, "give images with `pose`, `force_n` and `mask`"));
        }
        for image in &self.images {
            let ImageEntry { pose, force_n, mask } = image;
            if !(1..=self.poses.len()).contains(pose) {
                let cause = format!(
                    "image {} has pose {pose}, and there are {}",
                    mask.display(),
                    self.poses.len()
                );
                return Some((cause, "number the [[pose]] tables from 1 in their order"));
            }
            if !(*force_n > 0.0 && force_n.is_finite()) {
                let cause = format!("image {} has a force of {force_n} N", mask.display());
                return Some((cause, "give the force of the probe on the tissue, above 0"));
            }
        }
        let mut names: Vec<&PathBuf> = self.images.iter().map(|image| &image.mask).collect();
        names.sort();
        let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
        twice.map(|pair| {
            let cause = format!("the mask {} is named twice", pair[0].display());
            (cause, "give each image a file of its own")
        })
    }

    fn fault_of_search(&self) -> Option<(String, &'static str)> {
        let Search { youngs_modulus_kpa: [soft, stiff], poissons_ratio: [low, high], .. } =
            self.search;
        // In this form NaN is refused.
        if !(soft > 0.0 && soft < stiff && stiff.is_finite()) {
            let cause = format!("`youngs_modulus_kpa` runs from {soft} to {stiff}");
            return Some((cause, "give two moduli above 0, the smaller one first"));
        }
        // Below 0 tissue would widen when it is stretched; at 0.5 the compressibility is gone, with
        // what its difference is taken of.
        if !(low >= 0.0 && low < high && high < 0.5) {
            let cause = format!("`poissons_ratio` runs from {low} to {high}");
            return Some((cause, "give two ratios from 0 to below 0.5, the smaller one first"));
        }
        None
    }

    /// The block's mesh with these elements, or the mesh of Gmsh. `folder`: of the description.
    pub fn mesh(&self, folder: &Path, elements: Elements) -> Result<WallMesh, UltrasoundError> {
        match (&self.block, &self.mesh) {
            (Some(block), _) => Ok(block.mesh(elements)?),
            (None, Some(file)) => Ok(read_gmsh(&folder.join(file))?),
            // `fault` has refused this.
            (None, None) => Err(cathforce_wall::MeshError::Empty.into()),
        }
    }

    /// Everything that a fit needs, with the masks from their files. `folder`: of the description.
    pub fn study(&self, folder: &Path) -> Result<Study, UltrasoundError> {
        // The masks first: they are what people get wrong.
        let read = |entry: &ImageEntry| {
            let ImageEntry { pose, force_n, mask } = entry;
            let name = mask.display().to_string();
            let mask = read_mask(&folder.join(mask), self.masks)?;
            Ok(Image { name, pose: pose - 1, force_n: *force_n, mask })
        };
        let images = self.images.iter().map(read).collect::<Result<_, UltrasoundError>>()?;
        Ok(self.study_of(self.mesh(folder, self.elements)?, images))
    }

    /// Everything that a fit needs, with masks from elsewhere.
    pub fn study_of(&self, mesh: WallMesh, images: Vec<Image>) -> Study {
        Study {
            mesh,
            face_mm: self.probe.face_mm,
            poses: self.poses.clone(),
            images,
            bounds: Bounds {
                youngs_modulus_kpa: self.search.youngs_modulus_kpa,
                poissons_ratio: self.search.poissons_ratio,
            },
            law: self.law,
            registration: self.search.registration,
            seed: self.search.seed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A description that is right, with one line changed.
    fn changed(from: &str, to: &str) -> Result<Description, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.toml");
        let text = crate::EXAMPLE.replace(from, to);
        assert!(from.is_empty() || text != crate::EXAMPLE, "`{from}` is not in the example");
        std::fs::write(&path, text).unwrap();
        Description::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn the_example_is_read() {
        let own = changed("", "").unwrap();
        assert_eq!((own.poses.len(), own.images.len()), (2, 34));
        assert_eq!(own.search.youngs_modulus_kpa, [60.0, 850.0]);
    }

    #[test]
    fn what_is_wrong_is_refused_with_its_place_cause_and_fix() {
        for (from, to, words) in [
            ("ultrasound/1", "trial-bundle/1", "the format is `trial-bundle/1`"),
            ("pixel_mm = 0.05", "pixel = 0.05", "unknown field `pixel`"),
            ("pixel_mm = 0.05", "pixel_mm = 0.0", "[masks]"),
            ("vessel_depth_mm = 9.0", "vessel_depth_mm = 4.5", "0.50 mm of tissue"),
            ("pose = 2, force_n = 10.0", "pose = 3, force_n = 10.0", "has pose 3, and there are 2"),
            ("force_n = 2.0", "force_n = -2.0", "has a force of -2 N"),
            ("pose2-10.0n.png", "pose1-2.0n.png", "named twice"),
            ("[60.0, 850.0]", "[850.0, 60.0]", "runs from 850 to 60"),
            ("[0.47, 0.49]", "[0.47, 0.5]", "runs from 0.47 to 0.5"),
            ("face_mm = [38.0, 5.0]", "face_mm = [38.0, 0.0]", "`face_mm`"),
        ] {
            let error = changed(from, to).unwrap_err();
            assert!(error.contains(words), "`{words}` in: {error}");
            assert!(error.contains("block.toml") && error.contains("\n  fix: "), "{error}");
        }
        let missing = Description::read(Path::new("/nowhere/block.toml")).unwrap_err().to_string();
        assert!(missing.contains("/nowhere/block.toml: cannot be read"), "{missing}");
    }
}
