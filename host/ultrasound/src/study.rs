//! Images of one block, and how well a stiffness explains them.

use cathforce_wall::WallMesh;
use nalgebra::Vector2;
use serde::Deserialize;

use crate::error::UltrasoundError;
use crate::probe::Pose;
use crate::raster::Mask;
use crate::response::{Law, Loaded, Response, Tissue};
use crate::section::Section;

/// One image: a vessel's mask under a force.
#[derive(Clone, Debug)]
pub struct Image {
    pub name: String,
    /// Place in [`Study::poses`].
    pub pose: usize,
    pub force_n: f64,
    pub mask: Mask,
}

/// Whether the images' place in the block, and the place of the outline in an image, are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Registration {
    /// Up to a shift in the image plane, the same for all images of a pose, and to a distance by which
    /// the segmentation draws all outlines too far out or in.
    #[default]
    Fit,
    Given,
}

/// Bounds between which a stiffness is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub youngs_modulus_kpa: [f64; 2],
    pub poissons_ratio: [f64; 2],
}

/// Everything that a fit is made from.
pub struct Study {
    pub mesh: WallMesh,
    /// Sides of the probe's face, along the lateral axis and across it \[mm\].
    pub face_mm: [f64; 2],
    pub poses: Vec<Pose>,
    pub images: Vec<Image>,
    pub bounds: Bounds,
    pub law: Law,
    pub registration: Registration,
    pub seed: u64,
}

/// A study whose block can be loaded with any stiffness within the bounds.
pub struct Prepared<'a> {
    pub study: &'a Study,
    pub response: Response,
    /// Area \[mm²\] and centroid \[mm\] of each mask.
    masks: Vec<(f64, Vector2<f64>)>,
}

/// What a stiffness makes of the images.
#[derive(Clone, Debug)]
pub struct Explained {
    /// By image, moved by the shift of its pose.
    pub sections: Vec<Section>,
    /// By pose: what the images are moved by against the block \[mm\].
    pub shifts_mm: Vec<Vector2<f64>>,
    /// How far the segmentation draws the outlines too far out \[mm\].
    pub growth_mm: f64,
}

/// The first guess of Young's modulus is looked for in so many steps of equal ratio.
const GUESSES: usize = 24;
/// The softest tissue whose large strains are solved, over the first guess; if it collapses, the next.
/// Linear elasticity is off by less than this at strains that a vessel survives.
const SOFTEST: [f64; 3] = [0.7, 0.85, 0.95];

impl<'a> Prepared<'a> {
    /// Computes the response of the block, or takes one that was computed for the same block, poses,
    /// forces, law and bounds.
    pub fn new(study: &'a Study, known: Option<Response>) -> Result<Self, UltrasoundError> {
        let is_known = known.is_some();
        let compute = || {
            let loaded = Loaded::new(study.mesh.clone(), &study.poses, study.face_mm)?;
            Response::linear(loaded, study.bounds.poissons_ratio)
        };
        let response = known.map_or_else(compute, Ok)?;
        let masks = study.images.iter().map(|image| image.mask.area_and_centroid_mm());
        let mut prepared = Self { study, response, masks: masks.collect() };
        if study.law == Law::NeoHookean && !is_known {
            let guess_kpa = prepared.guess_kpa();
            prepared.solve_large_strains(guess_kpa)?;
        }
        Ok(prepared)
    }

    /// Solves large strains up to tissue that is softer than `around_kpa`.
    pub fn solve_large_strains(&mut self, around_kpa: f64) -> Result<(), UltrasoundError> {
        let force_n = self.study.images.iter().map(|image| image.force_n).fold(0.0, f64::max);
        let mut solved = Ok(());
        for softest in SOFTEST {
            solved = self.response.large_strains(force_n, softest * around_kpa);
            if solved.is_ok() {
                break;
            }
        }
        solved
    }

    /// Young's modulus that explains the images best in linear elasticity, at the middle Poisson's
    /// ratio, to the step of the guesses.
    fn guess_kpa(&self) -> f64 {
        let [low, high] = self.study.bounds.youngs_modulus_kpa;
        let [least, most] = self.study.bounds.poissons_ratio;
        let guess = |k: usize| low * (high / low).powf(k as f64 / GUESSES as f64);
        let overlap = |youngs_modulus_kpa: f64| {
            let tissue = Tissue { youngs_modulus_kpa, poissons_ratio: 0.5 * (least + most) };
            self.overlap(tissue).unwrap_or(0.0)
        };
        let all = (0..=GUESSES).map(guess).map(|own| (own, overlap(own)));
        all.fold((high, 0.0), |best, own| if own.1 > best.1 { own } else { best }).0
    }

    /// The cross-sections that a stiffness gives. `None` where one of them is empty or turned over.
    ///
    /// With [`Registration::Fit`] the images of a pose are moved together by the mean distance of their
    /// masks' centroids from those of the sections, and all outlines by the mean difference of the radii
    /// of circles of the same areas, which are shift and growth of least squares for outlines that differ
    /// by these and by noise. A blurred image that is cut at half of its contrast shrinks a vessel of
    /// radius R by σ²/(2R): by 8 µm for 0.25 mm and 4 mm, where a modulus to 3 % asks for 14 µm.
    pub fn explained(&self, tissue: Tissue) -> Option<Explained> {
        let Study { images, poses, registration, .. } = self.study;
        let loaded = &self.response.loaded;
        let radius = |area: f64| (area / std::f64::consts::PI).sqrt();
        let mut sections = Vec::with_capacity(images.len());
        let mut shifts_mm = vec![Vector2::zeros(); poses.len()];
        let mut counts = vec![0.0; poses.len()];
        let mut growth_mm = 0.0;
        for (image, (mask_area, centroid_mm)) in images.iter().zip(&self.masks) {
            let places = self.response.places_mm(tissue, image.pose, image.force_n);
            let section = Section::of(&loaded.triangles, &places, &poses[image.pose]);
            let (area, middle) = section.area_and_centroid_mm();
            // Crossing curves of a collapsed vessel have no area to speak of, and no centroid.
            if area.is_nan() || area < 0.01 * mask_area {
                return None;
            }
            shifts_mm[image.pose] += centroid_mm - middle;
            counts[image.pose] += 1.0;
            growth_mm += (radius(*mask_area) - radius(area)) / images.len() as f64;
            sections.push(section);
        }
        if *registration == Registration::Given {
            let shifts_mm = vec![Vector2::zeros(); poses.len()];
            return Some(Explained { sections, shifts_mm, growth_mm: 0.0 });
        }
        for (shift, count) in shifts_mm.iter_mut().zip(&counts) {
            // A pose without images has no shift.
            *shift /= f64::max(*count, 1.0);
        }
        for (section, image) in sections.iter_mut().zip(images) {
            *section = section.moved(shifts_mm[image.pose]).grown(growth_mm);
        }
        Some(Explained { sections, shifts_mm, growth_mm })
    }

    /// Overlap of each image's mask with its section.
    pub fn overlaps(&self, explained: &Explained) -> Vec<f64> {
        let images = self.study.images.iter().zip(&explained.sections);
        images
            .map(|(image, section)| image.mask.overlap(&image.mask.grid.coverage(section)))
            .collect()
    }

    /// Mean overlap over all images.
    pub fn overlap(&self, tissue: Tissue) -> Option<f64> {
        let overlaps = self.overlaps(&self.explained(tissue)?);
        Some(overlaps.iter().sum::<f64>() / overlaps.len() as f64)
    }
}
