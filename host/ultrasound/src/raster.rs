//! Pixels: the share of each that a cross-section covers, and the overlap of two areas.

use nalgebra::Vector2;
use serde::Deserialize;

use crate::section::Section;

/// Lines on which a row of pixels is sampled. Along a line the covered length is exact.
const LINES: usize = 4;

/// The pixels of an image plane.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Width and height.
    pub size_px: [usize; 2],
    /// Side of a pixel \[mm\].
    pub pixel_mm: f64,
    /// Middle of the first pixel: lateral from the middle of the probe's face, and depth below the
    /// unloaded top face \[mm\].
    pub origin_mm: [f64; 2],
}

/// A mask: whether each pixel shows the vessel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    pub grid: Grid,
    pub is_vessel: Vec<bool>,
}

impl Grid {
    /// Middle of a pixel \[mm\].
    pub fn middle_mm(&self, column: usize, row: usize) -> Vector2<f64> {
        Vector2::from(self.origin_mm) + Vector2::new(column as f64, row as f64) * self.pixel_mm
    }

    /// The share of every pixel that lies inside a section, from 0 to 1, row by row.
    ///
    /// Inside is where a line across has met the curves an odd number of times. The share depends
    /// continuously on the section, which a count of whole pixels does not.
    pub fn coverage(&self, section: &Section) -> Vec<f32> {
        let [width, height] = self.size_px;
        let mut covered = vec![0.0_f32; width * height];
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); height * LINES];
        // In pixels from the outer corner of the first one; lines lie in the middles of their strips.
        let corner = Vector2::from(self.origin_mm) - Vector2::repeat(0.5 * self.pixel_mm);
        let line_of = |depth: f64| depth * LINES as f64 - 0.5;
        for segment in &section.segments_mm {
            let [p, q] = segment.map(|p| (p - corner) / self.pixel_mm);
            let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
            let first = line_of(p.y).ceil().max(0.0) as usize;
            let end = line_of(q.y).ceil().clamp(0.0, crossings.len() as f64) as usize;
            for (line, crossings) in crossings.iter_mut().enumerate().take(end).skip(first) {
                let depth = (line as f64 + 0.5) / LINES as f64;
                crossings.push(p.x + (q.x - p.x) * (depth - p.y) / (q.y - p.y));
            }
        }
        for (line, crossings) in crossings.iter_mut().enumerate() {
            crossings.sort_by(f64::total_cmp);
            let row = &mut covered[line / LINES * width..][..width];
            for pair in crossings.chunks_exact(2) {
                cover(row, pair[0].clamp(0.0, width as f64), pair[1].clamp(0.0, width as f64));
            }
        }
        covered
    }
}

/// Adds the part of a line between two places to the pixels of its row.
fn cover(row: &mut [f32], from: f64, to: f64) {
    const SHARE: f32 = 1.0 / LINES as f32;
    let (first, last) = (from as usize, to as usize);
    if first == last {
        if let Some(pixel) = row.get_mut(first) {
            *pixel += SHARE * (to - from) as f32;
        }
        return;
    }
    row[first] += SHARE * (1.0 - (from - first as f64)) as f32;
    row[first + 1..last].iter_mut().for_each(|pixel| *pixel += SHARE);
    if let Some(pixel) = row.get_mut(last) {
        *pixel += SHARE * (to - last as f64) as f32;
    }
}

impl Mask {
    /// Number of pixels of the vessel.
    pub fn count(&self) -> usize {
        self.is_vessel.iter().filter(|pixel| **pixel).count()
    }

    /// Area of the vessel \[mm²\] and its centroid \[mm\].
    pub fn area_and_centroid_mm(&self) -> (f64, Vector2<f64>) {
        let width = self.grid.size_px[0];
        let places = self.is_vessel.iter().enumerate().filter(|(_, pixel)| **pixel);
        let sum: Vector2<f64> =
            places.map(|(k, _)| self.grid.middle_mm(k % width, k / width)).sum();
        let count = self.count() as f64;
        (count * self.grid.pixel_mm.powi(2), sum / count)
    }

    /// Overlap with an area: intersection over union, |A ∩ B|/|A ∪ B| = Σ min(m, c)/Σ max(m, c) over
    /// the pixels, with the mask m of 0 and 1 and the covered share c (Jaccard 1912; Ružička 1958 for
    /// shares). 1 where both are the same, 0 where they do not meet.
    pub fn overlap(&self, covered: &[f32]) -> f64 {
        let (mut both, mut either) = (0.0_f64, 0.0_f64);
        for (is_vessel, covered) in self.is_vessel.iter().zip(covered) {
            let covered = f64::from(*covered);
            if *is_vessel {
                both += covered;
                either += 1.0;
            } else {
                either += covered;
            }
        }
        both / either
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    const GRID: Grid = Grid { size_px: [60, 50], pixel_mm: 0.2, origin_mm: [-6.0, 5.0] };

    fn circle(centre: Vector2<f64>, radius: f64) -> Section {
        let at = |k: usize| {
            let angle = TAU * k as f64 / 400.0;
            centre + Vector2::new(angle.cos(), angle.sin()) * radius
        };
        Section { segments_mm: (0..400).map(|k| [at(k), at(k + 1)]).collect() }
    }

    fn mask(section: &Section) -> Mask {
        let is_vessel = GRID.coverage(section).iter().map(|share| *share > 0.5).collect();
        Mask { grid: GRID, is_vessel }
    }

    #[test]
    fn the_covered_area_is_that_of_the_section() {
        let section = circle(Vector2::new(0.03, 9.96), 3.1);
        let covered = GRID.coverage(&section);
        let area: f64 = covered.iter().map(|share| f64::from(*share)).sum::<f64>() * 0.04;
        assert!((area / (PI * 3.1 * 3.1) - 1.0).abs() < 1e-3, "{area}");
        assert!(covered.iter().all(|share| (-1e-6..=1.0 + 1e-6).contains(share)));
        let (area, centroid) = mask(&section).area_and_centroid_mm();
        assert!((area / (PI * 3.1 * 3.1) - 1.0).abs() < 0.01, "{area}");
        assert!((centroid - Vector2::new(0.03, 9.96)).norm() < 0.02, "{centroid}");
        // What lies outside the image is left out.
        let aside = GRID.coverage(&circle(Vector2::new(-6.1, 9.0), 2.0));
        let area: f64 = aside.iter().map(|share| f64::from(*share)).sum::<f64>() * 0.04;
        assert!((area - 0.5 * PI * 4.0).abs() < 0.05, "{area}");
    }

    /// Two circles of radius r at a distance d share 2r² acos(d/2r) − (d/2)√(4r² − d²).
    #[test]
    fn the_overlap_of_circles_is_that_of_the_formula() {
        let (r, d) = (3.0_f64, 1.0_f64);
        let mask = mask(&circle(Vector2::new(0.0, 10.0), r));
        let both = 2.0 * r * r * (0.5 * d / r).acos() - 0.5 * d * (4.0 * r * r - d * d).sqrt();
        let expected = both / (2.0 * PI * r * r - both);
        let found = mask.overlap(&GRID.coverage(&circle(Vector2::new(d, 10.0), r)));
        assert!((found - expected).abs() < 0.01, "{found}, not {expected}");
        let same = mask.overlap(&GRID.coverage(&circle(Vector2::new(0.0, 10.0), r)));
        // The mask has whole pixels only.
        assert!(same > 0.96, "{same}");
        assert_eq!(mask.overlap(&GRID.coverage(&circle(Vector2::new(40.0, 10.0), r))), 0.0);
    }
}
