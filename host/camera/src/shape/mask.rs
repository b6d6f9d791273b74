//! Which pixels show the catheter.

use super::contrast::Contrast;
use crate::filter::quantile;
use crate::picture::Picture;

/// Share of the catheter's own contrast that a pixel must have: half of it at some pixels …
const HIGH: f64 = 0.5;
/// … and a quarter at pixels that join those.
const LOW: f64 = 0.25;
/// Contrast above the ground's noise that chance does not reach in a picture of a million pixels, in
/// standard deviations; lower for pixels that must join others.
const HIGH_NOISE: f64 = 8.0;
const LOW_NOISE: f64 = 5.0;
/// The shortest catheter that is looked for, in widths: its pixels have the most contrast.
const SHORTEST_WIDTHS: f64 = 5.0;
/// Smaller things are dirt, in squares of the catheter's width.
const DIRT: f64 = 2.0;

/// Contrasts above which a pixel shows the catheter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    pub high: f64,
    pub low: f64,
}

/// Thresholds for a picture. `own` is the contrast that the user asks for.
///
/// `Err`: the largest contrast there is, and the one that noise alone might have.
pub fn thresholds(
    contrast: &Contrast,
    own: Option<f64>,
    width_px: f64,
) -> Result<Thresholds, [f64; 2]> {
    let [median, sd] = contrast.ground;
    let least = median + HIGH_NOISE * sd;
    let pixels = (SHORTEST_WIDTHS * width_px * width_px).min(contrast.smooth.grey.len() as f64);
    let share = 1.0 - pixels / contrast.smooth.grey.len() as f64;
    let mut values = contrast.smooth.grey.clone();
    let seen = f64::from(quantile(&mut values, share));
    if let Some(high) = own {
        let low = high * LOW / HIGH;
        return if seen > high { Ok(Thresholds { high, low }) } else { Err([seen, high]) };
    }
    // The catheter's own contrast must reach above noise by its low threshold, too.
    if seen < least {
        return Err([seen, least]);
    }
    let low = (LOW * seen).max(median + LOW_NOISE * sd);
    Ok(Thresholds { high: (HIGH * seen).max(low), low })
}

/// The parts of a picture that show something; each pixel has the number of its part, or 0.
#[derive(Clone, Debug)]
pub struct Mask {
    pub width: usize,
    pub height: usize,
    pub part: Vec<u16>,
}

/// Pixels above the high threshold and all above the low one that join them, without dirt, with small
/// holes filled. The border is never part of it, so that every pixel has eight neighbours.
pub fn mask(contrast: &Picture, thresholds: Thresholds, width_px: f64) -> Mask {
    let (width, height) = (contrast.width, contrast.height);
    let mut part = vec![0_u16; width * height];
    let is_inside = |i: usize| {
        let (x, y) = (i % width, i / width);
        x > 0 && y > 0 && x + 1 < width && y + 1 < height
    };
    let (high, low) = (thresholds.high as f32, thresholds.low as f32);
    let mut parts = 0;
    let mut pixels = Vec::new();
    for seed in 0..part.len() {
        if part[seed] != 0 || contrast.grey[seed] <= high || !is_inside(seed) {
            continue;
        }
        if parts == u16::MAX - 1 {
            break;
        }
        parts += 1;
        pixels.clear();
        pixels.push(seed);
        part[seed] = parts;
        let mut next = 0;
        while let Some(&i) = pixels.get(next) {
            next += 1;
            for j in neighbours(i, width) {
                if part[j] == 0 && contrast.grey[j] > low && is_inside(j) {
                    part[j] = parts;
                    pixels.push(j);
                }
            }
        }
        if (pixels.len() as f64) < DIRT * width_px * width_px {
            pixels.iter().for_each(|i| part[*i] = DROPPED);
            parts -= 1;
        }
    }
    part.iter_mut().filter(|part| **part == DROPPED).for_each(|part| *part = 0);
    let mut mask = Mask { width, height, part };
    mask.fill_holes((width_px * width_px) as usize);
    mask
}

/// Marks dirt while parts are sought, so that it is not sought again.
const DROPPED: u16 = u16::MAX;

/// The eight neighbours of a pixel that is not on the border, in a circle from the right.
pub fn neighbours(i: usize, width: usize) -> [usize; 8] {
    let (above, below) = (i - width, i + width);
    [i + 1, below + 1, below, below - 1, i - 1, above - 1, above, above + 1]
}

impl Mask {
    /// Fills holes of at most `most` pixels, such as the reflection of a lamp along the catheter.
    fn fill_holes(&mut self, most: usize) {
        let mut seen = vec![false; self.part.len()];
        let (width, height) = (self.width, self.height);
        let inside = |i: usize| {
            let (x, y) = (i % width, i / width);
            x > 0 && y > 0 && x + 1 < width && y + 1 < height
        };
        for start in 0..self.part.len() {
            // A hole has a pixel of a part to its left.
            if start == 0 || self.part[start] != 0 || self.part[start - 1] == 0 || seen[start] {
                continue;
            }
            let of = self.part[start - 1];
            let mut hole = vec![start];
            let mut next = 0;
            let mut is_open = !inside(start);
            seen[start] = true;
            while let Some(&i) = hole.get(next) {
                next += 1;
                if !inside(i) || hole.len() > most {
                    is_open = true;
                    break;
                }
                for j in [i + 1, i - 1, i + width, i - width] {
                    if self.part[j] == 0 && !seen[j] {
                        seen[j] = true;
                        hole.push(j);
                    }
                }
            }
            if !is_open && hole.len() <= most {
                hole.iter().for_each(|i| self.part[*i] = of);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weak_pixels_count_beside_strong_ones_dirt_does_not_and_holes_are_filled() {
        let mut contrast = Picture::uniform(40, 20, 0.0);
        let mut put = |x: usize, y: usize, value: f32| contrast.grey[y * 40 + x] = value;
        for x in 5..20 {
            for y in 5..10 {
                put(x, y, if x < 12 { 0.9 } else { 0.4 });
            }
        }
        put(8, 7, 0.0);
        put(30, 15, 0.9);
        put(35, 5, 0.4);
        let found = mask(&contrast, Thresholds { high: 0.5, low: 0.25 }, 4.0);
        let at = |x: usize, y: usize| found.part[y * 40 + x];
        assert_eq!((at(5, 5), at(19, 9), at(8, 7)), (1, 1, 1));
        assert_eq!((at(30, 15), at(35, 5), at(0, 0)), (0, 0, 0));
    }
}
