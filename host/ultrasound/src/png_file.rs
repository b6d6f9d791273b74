//! Masks as PNG files.

use std::io::Cursor;
use std::path::Path;

use png::{ColorType, Transformations};

use crate::error::UltrasoundError;
use crate::raster::{Grid, Mask};

const SAVE: &str =
    "save the segmentation as a PNG of two grey values, dark tissue and a bright vessel";

/// Reads a mask: the brighter of its two values is the vessel.
///
/// Errors: the file is no PNG, has another size than `grid`, has more than two values, or shows no
/// vessel, nothing else, or one that reaches the edge of the picture.
pub fn read_mask(path: &Path, grid: Grid) -> Result<Mask, UltrasoundError> {
    let refused = |cause: String, fix: &str| UltrasoundError::file(path, cause, fix);
    let bytes = std::fs::read(path).map_err(|error| {
        refused(format!("cannot be read: {error}"), "check the path in the description")
    })?;
    let (size, grey) = grey(&bytes)
        .map_err(|error| refused(format!("it is not a PNG that can be read: {error}"), SAVE))?;
    if size != grid.size_px {
        let cause = format!(
            "the mask has {} × {} pixels, and the description says {} × {}",
            size[0], size[1], grid.size_px[0], grid.size_px[1]
        );
        let fix = "give masks of one size, neither cropped nor scaled, and state it as `size_px`";
        return Err(refused(cause, fix));
    }
    let mut is_there = [false; 256];
    grey.iter().for_each(|value| is_there[usize::from(*value)] = true);
    let values: Vec<usize> = (0..256).filter(|value| is_there[*value]).collect();
    let bright = match values[..] {
        [_, bright] => bright,
        [_] => {
            let cause = "the mask is empty: all its pixels have one value".to_owned();
            let fix = "leave the image out of the description, or segment its vessel";
            return Err(refused(cause, fix));
        }
        _ => {
            let cause = format!("it is not a mask: it has {} grey values", values.len());
            return Err(refused(cause, SAVE));
        }
    };
    let is_vessel: Vec<bool> = grey.iter().map(|value| usize::from(*value) == bright).collect();
    let [width, height] = size;
    let is_edge =
        |k: usize| [0, width - 1].contains(&(k % width)) || [0, height - 1].contains(&(k / width));
    if (0..is_vessel.len()).any(|k| is_vessel[k] && is_edge(k)) {
        let cause = "the vessel reaches the edge of the picture".to_owned();
        let fix = "take a picture that shows all of the vessel; if the tissue is bright in it, \
                   invert the mask";
        return Err(refused(cause, fix));
    }
    Ok(Mask { grid, is_vessel })
}

/// A mask as the bytes of a PNG of 0 and 255.
pub fn mask_png(mask: &Mask) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let [width, height] = mask.grid.size_px.map(|n| n as u32);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(ColorType::Grayscale);
    let grey: Vec<u8> = mask.is_vessel.iter().map(|vessel| u8::from(*vessel) * 255).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&grey)?;
    writer.finish()?;
    Ok(file)
}

/// Width, height, and one byte a pixel. Of a picture in colour, the first channel: the channels of a
/// mask are alike, and one that they are not in has many values.
fn grey(file: &[u8]) -> Result<([usize; 2], Vec<u8>), String> {
    let text = |error: png::DecodingError| error.to_string();
    let mut decoder = png::Decoder::new(Cursor::new(file));
    decoder.set_transformations(Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(text)?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let info = reader.next_frame(&mut bytes).map_err(text)?;
    let channels = info.color_type.samples();
    let grey = bytes[..info.buffer_size()].chunks(channels).map(|pixel| pixel[0]).collect();
    Ok(([info.width as usize, info.height as usize], grey))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { size_px: [12, 10], pixel_mm: 0.5, origin_mm: [0.0, 0.0] };

    fn file(folder: &Path, is_vessel: impl Fn(usize, usize) -> bool) -> std::path::PathBuf {
        let pixels = (0..120).map(|k| is_vessel(k % 12, k / 12)).collect();
        let path = folder.join("mask.png");
        std::fs::write(&path, mask_png(&Mask { grid: GRID, is_vessel: pixels }).unwrap()).unwrap();
        path
    }

    #[test]
    fn a_mask_comes_back_and_what_is_none_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let disc = |x: usize, y: usize| (3..8).contains(&x) && (2..6).contains(&y);
        let path = file(folder.path(), disc);
        let mask = read_mask(&path, GRID).unwrap();
        assert_eq!((mask.count(), mask.is_vessel[2 * 12 + 3]), (20, true));
        let why = |path: &Path, grid| read_mask(path, grid).unwrap_err().to_string();
        let other = Grid { size_px: [10, 12], ..GRID };
        assert!(why(&path, other).contains("12 × 10 pixels, and the description says 10 × 12"));
        assert!(why(&file(folder.path(), |_, _| false), GRID).contains("the mask is empty"));
        assert!(why(&file(folder.path(), |x, _| x > 4), GRID).contains("the edge of the picture"));
        std::fs::write(&path, "not a picture").unwrap();
        assert!(why(&path, GRID).contains("it is not a PNG"));
        assert!(why(&folder.path().join("none.png"), GRID).contains("cannot be read"));
        // A photograph has many values.
        let mut photograph = Vec::new();
        let mut encoder = png::Encoder::new(&mut photograph, 12, 10);
        encoder.set_color(ColorType::Grayscale);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&(0..120).collect::<Vec<u8>>()).unwrap();
        writer.finish().unwrap();
        std::fs::write(&path, photograph).unwrap();
        assert!(why(&path, GRID).contains("not a mask: it has 120 grey values"));
    }
}
