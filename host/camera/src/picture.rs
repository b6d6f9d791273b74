//! A grey picture, and reading it from a file.

use std::path::Path;

use crate::decode;
use crate::error::CameraError;

/// Grey values of a picture, 0 for black and 255 for white, row by row from the top.
///
/// Places are in pixels; (0, 0) is the middle of the top left pixel, x points right and y down.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    /// `width` × `height` values.
    pub grey: Vec<f32>,
}

impl Picture {
    /// A picture of one grey value.
    pub fn uniform(width: usize, height: usize, grey: f32) -> Self {
        Self { width, height, grey: vec![grey; width * height] }
    }

    /// From one byte a pixel. Returns `None` if the number of bytes is not `width` × `height`.
    pub fn from_bytes(width: usize, height: usize, bytes: &[u8]) -> Option<Self> {
        (bytes.len() == width * height).then(|| Self {
            width,
            height,
            grey: bytes.iter().map(|byte| f32::from(*byte)).collect(),
        })
    }

    /// Reads a PNG or JPEG file; colours become grey.
    pub fn read(path: &Path) -> Result<Self, CameraError> {
        let wrong = |problem: String| CameraError::Picture { path: path.to_owned(), problem };
        let file = std::fs::read(path).map_err(|e| wrong(e.to_string()))?;
        let ([width, height], bytes) = decode::grey(&file).map_err(wrong)?;
        let wrong = |problem: String| CameraError::Picture { path: path.to_owned(), problem };
        Self::from_bytes(width, height, &bytes).ok_or_else(|| wrong("it is cut off".into()))
    }

    /// Writes a PNG file.
    pub fn write(&self, path: &Path) -> Result<(), CameraError> {
        let bytes = self.grey.iter().map(|grey| grey.round().clamp(0.0, 255.0) as u8);
        let bytes: Vec<u8> = bytes.collect();
        let wrong = |problem: String| CameraError::Picture { path: path.to_owned(), problem };
        let file = decode::png(self.size(), &bytes).map_err(wrong)?;
        std::fs::write(path, file).map_err(|e| CameraError::Picture {
            path: path.to_owned(),
            problem: format!("cannot be written: {e}"),
        })
    }

    /// Width and height \[px\].
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The grey value of a pixel, which must be inside.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.grey[y * self.width + x]
    }

    /// Whether a place is inside by at least `margin` pixels.
    pub fn contains(&self, [x, y]: [f64; 2], margin: f64) -> bool {
        x >= margin
            && y >= margin
            && x <= self.width as f64 - 1.0 - margin
            && y <= self.height as f64 - 1.0 - margin
    }

    /// The value at a place between pixels, interpolated linearly; beyond the border the border's.
    pub fn sample(&self, [x, y]: [f64; 2]) -> f64 {
        let x = x.clamp(0.0, (self.width - 1) as f64);
        let y = y.clamp(0.0, (self.height - 1) as f64);
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(self.width - 1), (top + 1).min(self.height - 1));
        let (fx, fy) = (x - left as f64, y - top as f64);
        let mix = |a: f32, b: f32| f64::from(a) + fx * (f64::from(b) - f64::from(a));
        let above = mix(self.at(left, top), self.at(right, top));
        let below = mix(self.at(left, bottom), self.at(right, bottom));
        above + fy * (below - above)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_of_grey_is_interpolated_exactly() {
        let mut picture = Picture::uniform(5, 4, 0.0);
        for y in 0..4 {
            for x in 0..5 {
                picture.grey[y * 5 + x] = (10 * x + 3 * y) as f32;
            }
        }
        assert!((picture.sample([1.25, 2.5]) - 20.0).abs() < 1e-9);
        assert_eq!(picture.sample([-3.0, 9.0]), 9.0);
        assert!(picture.contains([1.0, 1.0], 1.0) && !picture.contains([3.5, 1.0], 1.0));
    }

    #[test]
    fn a_picture_survives_its_file_and_a_text_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let picture = Picture::from_bytes(2, 2, &[0, 100, 200, 255]).unwrap();
        picture.write(&path).unwrap();
        assert_eq!(Picture::read(&path).unwrap(), picture);
        std::fs::write(&path, "no picture").unwrap();
        let error = Picture::read(&path).unwrap_err().to_string();
        assert!(error.contains("a.png") && error.contains("fix:"), "{error}");
    }
}
