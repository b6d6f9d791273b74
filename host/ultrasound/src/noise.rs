//! What an ultrasound image and its segmentation do to a cross-section.
//!
//! The section is blurred by the point-spread function of the scanner, speckle is added, and the image
//! is cut at half of its contrast, of which the largest piece is kept with its holes filled, as
//! segmentations do.

use nalgebra::Vector2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::raster::{Grid, Mask};
use crate::section::Section;

/// Noise of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageNoise {
    /// Standard deviation of the point-spread function \[mm\].
    pub blur_mm: f64,
    /// Standard deviation of the speckle, which is as fine as the blur lets it be, over the contrast
    /// between tissue and vessel.
    pub speckle: f64,
    /// Standard deviation of the shift of all images of a pose, on either axis \[mm\].
    pub registration_mm: f64,
    /// Standard deviation of the shift of each image beside that, on either axis \[mm\].
    pub repeatability_mm: f64,
}

impl ImageNoise {
    /// A linear array of 5 to 12 MHz has a wavelength of 0.2 mm at 8 MHz; its beam is about two of them
    /// wide (full width at half maximum), and its pulse as long: 0.4 mm/2.35 = 0.17 mm, and as much
    /// again for the segmentation, make 0.25 mm. With speckle of a tenth of the contrast the outline is
    /// off by 0.1 × 0.25 mm × √(2π) = 0.06 mm (one standard deviation). A calibrated probe is known to
    /// about 0.3 mm in the frame of its robot; the data sheet of the UR3e says that it comes back to a
    /// pose within ±0.03 mm, three standard deviations.
    pub const TYPICAL: Self =
        Self { blur_mm: 0.25, speckle: 0.1, registration_mm: 0.3, repeatability_mm: 0.01 };
}

/// Random numbers of the images; the same seed gives the same.
pub struct Draws(ChaCha8Rng);

impl Draws {
    pub fn of_seed(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Of standard deviation 1 (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let u: f64 = self.0.random_range(f64::MIN_POSITIVE..1.0);
        let angle = std::f64::consts::TAU * self.0.random::<f64>();
        (-2.0 * u.ln()).sqrt() * angle.cos()
    }

    /// A shift with this standard deviation on either axis.
    pub fn shift_mm(&mut self, sd_mm: f64) -> Vector2<f64> {
        Vector2::new(sd_mm * self.normal(), sd_mm * self.normal())
    }
}

/// The mask of a section without noise: pixels that it covers by half or more.
pub fn clean_mask(grid: Grid, section: &Section) -> Mask {
    let is_vessel = grid.coverage(section).iter().map(|share| *share >= 0.5).collect();
    Mask { grid, is_vessel }
}

/// The mask that is segmented from a noisy image of a section.
pub fn noisy_mask(grid: Grid, section: &Section, noise: &ImageNoise, draws: &mut Draws) -> Mask {
    let covered: Vec<f64> = grid.coverage(section).iter().map(|share| f64::from(*share)).collect();
    let mut image = blurred(&covered, grid, noise.blur_mm);
    let white: Vec<f64> = covered.iter().map(|_| draws.normal()).collect();
    let speckle = blurred(&white, grid, noise.blur_mm);
    let size = (speckle.iter().map(|x| x * x).sum::<f64>() / speckle.len() as f64).sqrt();
    image.iter_mut().zip(&speckle).for_each(|(pixel, x)| *pixel += noise.speckle * x / size);
    let is_vessel: Vec<bool> = image.iter().map(|pixel| *pixel > 0.5).collect();
    Mask { grid, is_vessel: one_piece(&is_vessel, grid.size_px) }
}

/// Blurred by a Gaussian, row by row and column by column. Beyond the edges pixels are as at the edge.
fn blurred(image: &[f64], grid: Grid, sd_mm: f64) -> Vec<f64> {
    let sd = sd_mm / grid.pixel_mm;
    let reach = (3.0 * sd).ceil() as isize;
    let weights: Vec<f64> =
        (-reach..=reach).map(|k| (-0.5 * (k as f64 / sd).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let [width, height] = grid.size_px;
    let along = |image: &[f64], axis: usize| -> Vec<f64> {
        let at = |k: usize, by: isize| {
            let (x, y) = (k % width, k / width);
            let clamped = |at: usize, size: usize| (at as isize + by).clamp(0, size as isize - 1);
            match axis {
                0 => image[y * width + clamped(x, width) as usize],
                _ => image[clamped(y, height) as usize * width + x],
            }
        };
        let pixel = |k: usize| {
            let all = weights.iter().zip(-reach..);
            all.map(|(weight, by)| weight * at(k, by)).sum::<f64>() / sum
        };
        (0..image.len()).map(pixel).collect()
    };
    along(&along(image, 0), 1)
}

/// The largest connected piece, with its holes filled.
fn one_piece(is_vessel: &[bool], size: [usize; 2]) -> Vec<bool> {
    let pieces = pieces(is_vessel, size);
    let Some(largest) = pieces.iter().max_by_key(|piece| piece.len()) else {
        return is_vessel.to_vec();
    };
    let mut outside = vec![true; is_vessel.len()];
    largest.iter().for_each(|k| outside[*k] = false);
    // Whatever of the outside is not connected with the edge of the picture is a hole.
    let [width, height] = size;
    let is_edge =
        |k: &usize| [0, width - 1].contains(&(k % width)) || [0, height - 1].contains(&(k / width));
    let mut filled = vec![true; is_vessel.len()];
    for piece in self::pieces(&outside, size) {
        if piece.iter().any(is_edge) {
            piece.iter().for_each(|k| filled[*k] = false);
        }
    }
    filled
}

/// Pixels of each connected piece; neighbours share a side.
fn pieces(is_in: &[bool], [width, height]: [usize; 2]) -> Vec<Vec<usize>> {
    let mut is_left = is_in.to_vec();
    let mut pieces = Vec::new();
    for start in 0..is_in.len() {
        if !is_left[start] {
            continue;
        }
        is_left[start] = false;
        let (mut piece, mut next) = (vec![start], 0);
        while let Some(&k) = piece.get(next) {
            next += 1;
            let (x, y) = (k % width, k / width);
            let neighbours = [
                (x > 0).then(|| k - 1),
                (x + 1 < width).then_some(k + 1),
                (y > 0).then(|| k - width),
                (y + 1 < height).then_some(k + width),
            ];
            for near in neighbours.into_iter().flatten() {
                if is_left[near] {
                    is_left[near] = false;
                    piece.push(near);
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { size_px: [120, 110], pixel_mm: 0.1, origin_mm: [-6.0, 5.0] };

    fn circle(radius: f64) -> Section {
        let at = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 300.0;
            Vector2::new(radius * angle.cos(), 10.0 + radius * angle.sin())
        };
        Section { segments_mm: (0..300).map(|k| [at(k), at(k + 1)]).collect() }
    }

    #[test]
    fn noise_roughens_the_outline_and_leaves_one_piece() {
        let section = circle(4.0);
        let mut draws = Draws::of_seed(3);
        let noise = ImageNoise { speckle: 0.3, ..ImageNoise::TYPICAL };
        let mask = noisy_mask(GRID, &section, &noise, &mut draws);
        let overlap = mask.overlap(&GRID.coverage(&section));
        assert!((0.9..0.97).contains(&overlap), "{overlap}");
        assert_eq!(pieces(&mask.is_vessel, GRID.size_px).len(), 1);
        let (area, _) = mask.area_and_centroid_mm();
        // The speckle cuts pieces off the outline: 3.7 % here.
        assert!((area / 50.27 - 1.0).abs() < 0.04, "{area}");
        let clean = clean_mask(GRID, &section).overlap(&GRID.coverage(&section));
        assert!(clean > 0.98, "{clean}");
    }

    #[test]
    fn a_ring_is_filled_and_a_speck_is_left_out() {
        let size = [9, 8];
        let ring = |x: usize, y: usize| (2..7).contains(&x) && (2..7).contains(&y);
        let hole = |x: usize, y: usize| (x, y) == (4, 4);
        let at = |k: usize| (k % 9, k / 9);
        let drawn: Vec<bool> =
            (0..72).map(at).map(|(x, y)| (ring(x, y) && !hole(x, y)) || (x, y) == (0, 0)).collect();
        let expected: Vec<bool> = (0..72).map(at).map(|(x, y)| ring(x, y)).collect();
        assert_eq!(one_piece(&drawn, size), expected);
    }
}
