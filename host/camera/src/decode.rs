//! Pixels of PNG and JPEG files as grey values.
//!
//! The decoders are used directly: the crate `image` brings colour management and other formats, which
//! take longer to build than all the rest.

use std::io::Cursor;

use png::{BitDepth, ColorType, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The first bytes of every PNG file.
const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
/// The first bytes of every JPEG file.
const JPEG: [u8; 2] = [0xFF, 0xD8];
/// Weights of red, green and blue in a grey value, by ITU-R BT.601, in shares of 1000.
const WEIGHTS: [u32; 3] = [299, 587, 114];

/// Width and height, from the file's heading.
pub fn size(file: &[u8]) -> Result<[usize; 2], String> {
    if file.starts_with(&PNG) {
        let mut decoder = png::Decoder::new(Cursor::new(file));
        let info = decoder.read_header_info().map_err(|e| e.to_string())?;
        return Ok([info.width as usize, info.height as usize]);
    }
    let mut decoder = jpeg(file)?;
    decoder.decode_headers().map_err(|e| format!("{e:?}"))?;
    let (width, height) = decoder.dimensions().ok_or("its heading is cut off")?;
    Ok([width, height])
}

/// Width, height, and one byte a pixel, row by row from the top.
pub fn grey(file: &[u8]) -> Result<([usize; 2], Vec<u8>), String> {
    if file.starts_with(&PNG) {
        return png_grey(file).map_err(|e| e.to_string());
    }
    let mut decoder = jpeg(file)?;
    let bytes = decoder.decode().map_err(|e| format!("{e:?}"))?;
    let (width, height) = decoder.dimensions().ok_or("its heading is cut off")?;
    match bytes.len() == width * height {
        true => Ok(([width, height], bytes)),
        false => Err("its colours cannot be made grey".into()),
    }
}

fn jpeg(file: &[u8]) -> Result<JpegDecoder<ZCursor<&[u8]>>, String> {
    if !file.starts_with(&JPEG) {
        return Err("it is neither PNG nor JPEG".into());
    }
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::Luma);
    Ok(JpegDecoder::new_with_options(ZCursor::new(file), options))
}

fn png_grey(file: &[u8]) -> Result<([usize; 2], Vec<u8>), png::DecodingError> {
    let mut decoder = png::Decoder::new(Cursor::new(file));
    // One byte a channel, whatever the file has.
    decoder.set_transformations(Transformations::normalize_to_color8());
    let mut reader = decoder.read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().unwrap_or(0)];
    let info = reader.next_frame(&mut bytes)?;
    bytes.truncate(info.buffer_size());
    debug_assert_eq!(info.bit_depth, BitDepth::Eight);
    let channels = info.color_type.samples();
    let grey = match info.color_type {
        ColorType::Grayscale | ColorType::GrayscaleAlpha => {
            bytes.chunks(channels).map(|pixel| pixel[0]).collect()
        }
        _ => bytes.chunks(channels).map(luma).collect(),
    };
    Ok(([info.width as usize, info.height as usize], grey))
}

fn luma(pixel: &[u8]) -> u8 {
    let sum: u32 = pixel.iter().zip(WEIGHTS).map(|(x, weight)| u32::from(*x) * weight).sum();
    // At most 255, because the weights sum up to 1000.
    ((sum + 500) / 1000) as u8
}

/// A PNG file of one byte a pixel.
pub fn png(size: [usize; 2], grey: &[u8]) -> Result<Vec<u8>, String> {
    let mut file = Vec::new();
    let side = |n: usize| u32::try_from(n).map_err(|_| "it is too large".to_owned());
    let mut encoder = png::Encoder::new(&mut file, side(size[0])?, side(size[1])?);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    // Noise does not compress: time is better spent.
    encoder.set_compression(png::Compression::Fast);
    let write = |writer: png::Writer<_>| {
        let mut writer = writer;
        writer.write_image_data(grey)?;
        writer.finish()
    };
    encoder.write_header().and_then(write).map_err(|e| e.to_string())?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_sixteen_bits_become_grey() {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Sixteen);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[255, 0, 0, 0, 0, 0, 100, 0, 100, 0, 100, 0]).unwrap();
        writer.finish().unwrap();
        assert_eq!(grey(&file), Ok(([2, 1], vec![76, 100])));
        assert_eq!(size(&file), Ok([2, 1]));
    }

    #[test]
    fn a_jpeg_is_read_in_colour_and_a_broken_file_is_not() {
        let file = include_bytes!("../tests/data/ramp.jpg");
        assert_eq!(size(file), Ok([32, 16]));
        let ([width, height], grey) = grey(file).unwrap();
        assert_eq!((width, height), (32, 16));
        // A ramp from 0 to 248 from left to right, in colour, with a loss of quality.
        for (i, value) in grey.iter().enumerate() {
            assert!((f64::from(*value) - 8.0 * (i % 32) as f64).abs() < 6.0, "{i} {value}");
        }
        assert!(super::grey(b"GIF89a").unwrap_err().contains("neither"));
        assert!(super::grey(&file[..60]).is_err() && size(&PNG).is_err());
    }
}
