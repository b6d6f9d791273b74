//! Masks of a known truth, from another discretisation than the fit's.

use std::path::Path;

use crate::block::Elements;
use crate::description::{Description, ImageEntry};
use crate::error::UltrasoundError;
use crate::noise::{Draws, ImageNoise, clean_mask, noisy_mask};
use crate::response::{Loaded, Tissue};
use crate::section::Section;
use crate::study::Image;

/// A truth's elements are so many times as many, on each axis, as those of a search.
const FINER: f64 = 1.25;

/// The elements of a truth.
pub fn finer(own: Elements) -> Elements {
    let more = |count: usize| (FINER * count as f64).ceil() as usize;
    Elements { outwards: more(own.outwards), around: more(own.around), along: more(own.along) }
}

/// The cross-section of every image of a description, without noise. This tissue is solved for itself
/// on a mesh of [`finer`] elements, so that neither the mesh of a fit is in it nor its interpolation
/// between tissues.
/// `folder`: of the description.
pub fn sections(
    description: &Description,
    folder: &Path,
    tissue: Tissue,
) -> Result<Vec<Section>, UltrasoundError> {
    let mesh = description.mesh(folder, finer(description.elements))?;
    let loaded = Loaded::new(mesh, &description.poses, description.probe.face_mm)?;
    let loads: Vec<(usize, f64)> =
        description.images.iter().map(|image| (image.pose - 1, image.force_n)).collect();
    let places = loaded.solved_mm(description.law, tissue, &loads)?;
    let section = |(places, (pose, _)): (&Vec<_>, &(usize, f64))| {
        Section::of(&loaded.triangles, places, &description.poses[*pose])
    };
    Ok(places.iter().zip(&loads).map(section).collect())
}

/// The images of a truth, from its sections. `noise`: with its seed.
pub fn render(
    description: &Description,
    sections: &[Section],
    noise: Option<(ImageNoise, u64)>,
) -> Vec<Image> {
    let grid = description.masks;
    let mut draws = Draws::of_seed(noise.map_or(0, |(_, seed)| seed));
    let registration_mm = noise.map_or(0.0, |(noise, _)| noise.registration_mm);
    let shifts: Vec<_> =
        description.poses.iter().map(|_| draws.shift_mm(registration_mm)).collect();
    let image = |(entry, section): (&ImageEntry, &Section)| {
        let mask = match &noise {
            None => clean_mask(grid, section),
            Some((noise, _)) => {
                let shift = shifts[entry.pose - 1] + draws.shift_mm(noise.repeatability_mm);
                noisy_mask(grid, &section.moved(shift), noise, &mut draws)
            }
        };
        let name = entry.mask.display().to_string();
        Image { name, pose: entry.pose - 1, force_n: entry.force_n, mask }
    };
    description.images.iter().zip(sections).map(image).collect()
}
