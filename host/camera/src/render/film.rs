//! Light on a scene, and what a sensor makes of it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::filter::blur;
use crate::picture::Picture;

/// The reflection of a lamp, which adds light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glare {
    pub pixel: [f64; 2],
    /// Standard deviation of its Gaussian \[px\].
    pub radius_px: f64,
    /// Grey values that are added in its middle.
    pub grey: f64,
}

/// Light, lens blur and noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Grey value of a white surface in the middle of the picture.
    pub white: f64,
    /// Relative change of the light from the middle to the right and to the lower border.
    pub gradient: [f64; 2],
    /// Relative loss of light in the corners.
    pub vignette: f64,
    pub glare: Vec<Glare>,
    /// Standard deviation of the lens's blur \[px\]; 0 for none.
    pub blur_px: f64,
    /// Standard deviation of the noise of each pixel, in grey values.
    pub noise: f64,
}

impl Film {
    /// Even light, no blur, no noise.
    pub const PLAIN: Self = Self {
        white: 220.0,
        gradient: [0.0; 2],
        vignette: 0.0,
        glare: Vec::new(),
        blur_px: 0.0,
        noise: 0.0,
    };

    /// What a webcam in a lit room makes: a third less light on one side, darker corners, blur of 0.7
    /// pixels, noise of 3 grey values.
    pub fn webcam() -> Self {
        Self { gradient: [0.2, -0.12], vignette: 0.25, blur_px: 0.7, noise: 3.0, ..Self::PLAIN }
    }

    /// The picture of a scene, given by its reflectance from 0 to 1, in whole grey values.
    pub fn expose(&self, reflectance: &Picture, seed: u64) -> Picture {
        let [width, height] = reflectance.size();
        let mut lit = reflectance.clone();
        for (y, row) in lit.grey.chunks_mut(width).enumerate() {
            let v = 2.0 * y as f64 / (height - 1) as f64 - 1.0;
            for (x, grey) in row.iter_mut().enumerate() {
                let u = 2.0 * x as f64 / (width - 1) as f64 - 1.0;
                let slope = 1.0 + self.gradient[0] * u + self.gradient[1] * v;
                let corner = 1.0 - self.vignette * 0.5 * (u * u + v * v);
                *grey *= (self.white * slope * corner) as f32;
            }
        }
        for glare in &self.glare {
            glare.add(&mut lit);
        }
        let mut picture = if self.blur_px > 0.0 { blur(&lit, self.blur_px) } else { lit };
        self.disturb(&mut picture, seed);
        picture
    }

    /// Adds noise, and rounds as a sensor of eight bits does.
    fn disturb(&self, picture: &mut Picture, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for pair in picture.grey.chunks_mut(2) {
            // Two normal numbers from two even ones, by Box and Muller.
            let radius = (-2.0 * (1.0 - random.random::<f32>()).ln()).sqrt() * self.noise as f32;
            let (sine, cosine) = (std::f32::consts::TAU * random.random::<f32>()).sin_cos();
            for (grey, part) in pair.iter_mut().zip([sine, cosine]) {
                *grey = (*grey + radius * part).round().clamp(0.0, 255.0);
            }
        }
    }
}

impl Glare {
    fn add(&self, picture: &mut Picture) {
        let width = picture.width;
        for (y, row) in picture.grey.chunks_mut(width).enumerate() {
            let dy = y as f64 - self.pixel[1];
            if dy.abs() > 4.0 * self.radius_px {
                continue;
            }
            for (x, grey) in row.iter_mut().enumerate() {
                let dx = x as f64 - self.pixel[0];
                let square = (dx * dx + dy * dy) / (self.radius_px * self.radius_px);
                *grey += (self.grey * (-0.5 * square).exp()) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_standard_deviation_and_light_its_slope() {
        let white = Picture::uniform(200, 100, 0.5);
        let film = Film { noise: 4.0, gradient: [0.2, 0.0], ..Film::PLAIN };
        let picture = film.expose(&white, 1);
        let column = |x: usize| {
            let values: Vec<f64> = (0..100).map(|y| f64::from(picture.at(x, y))).collect();
            let mean = values.iter().sum::<f64>() / 100.0;
            let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 99.0;
            (mean, square)
        };
        let (left, right) = (column(0).0, column(199).0);
        assert!((left - 88.0).abs() < 2.0 && (right - 132.0).abs() < 2.0, "{left} {right}");
        let variance = (0..200).map(|x| column(x).1).sum::<f64>() / 200.0;
        assert!((variance.sqrt() - 4.0).abs() < 0.15, "{}", variance.sqrt());
    }
}
