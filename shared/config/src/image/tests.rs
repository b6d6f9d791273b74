//! An image goes there and back whole, and anything else is refused whole.

extern crate std;

#[path = "../../../control/tests/support/wire.rs"]
pub(crate) mod wire;

use std::string::ToString;
use std::vec;
use std::vec::Vec;

use cathforce_mechanics::{FREE, LUMEN_LAYOUT, OUTSIDE, PrecurvePiece, Section};
use proptest::prelude::*;
use wire::wire;

use super::*;

fn head() -> ImageHead {
    let mut description = wire();
    let section = description.instrument.sections[0];
    let tip = Section { length_m: 0.3, ..section };
    description.instrument.sections.insert(0, tip).expect("room for two");
    description.instrument.precurve = [PrecurvePiece {
        length_m: 0.02,
        curvature_per_m: 125.0,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: 1.0,
    }]
    .into_iter()
    .collect();
    description.entry.position_m = [0.01, 0.0, -0.02];
    let lumen = LumenHeader {
        origin_m: [0.0; 3],
        cell_m: 1e-3,
        distance_unit_m: 1e-6,
        bricks: [3, 1, 1],
        stored: 0,
    };
    ImageHead {
        description,
        lumen,
        settings: Settings::default(),
        master: Master::default(),
        band: None,
    }
}

fn lumen_bytes() -> Vec<u8> {
    [FREE, FREE, OUTSIDE].iter().flat_map(|b| b.to_le_bytes()).collect()
}

fn encoded(head: &ImageHead, lumen: &[u8]) -> Result<Vec<u8>, EncodeError> {
    let mut image = vec![0xAA; encoded_len(head, lumen)?];
    let written = encode(head, lumen, &mut image)?;
    assert_eq!(written, image.len());
    Ok(image)
}

fn image() -> Vec<u8> {
    encoded(&head(), &lumen_bytes()).expect("a valid image")
}

/// Writes the right length and CRC into a header, for images that are wrong elsewhere.
fn seal(image: &mut [u8]) {
    let total = image.len() as u32;
    image[10..14].copy_from_slice(&total.to_le_bytes());
    let crc = CRC.checksum(&image[HEADER_BYTES..]);
    image[18..22].copy_from_slice(&crc.to_le_bytes());
}

#[test]
fn the_schema_can_be_traced() {
    assert_ne!(schema_hash(), 0);
    let head = schema::hash::<ImageHead>().expect("types that the schema sees");
    assert_eq!(head.wrapping_add(LUMEN_LAYOUT), schema_hash());
}

#[test]
fn an_image_goes_there_and_back() {
    let (head, lumen, image) = (head(), lumen_bytes(), image());
    let config = decode(&image).expect("a valid image");
    assert_eq!(config.settings, head.settings);
    assert_eq!(config.model.description(), &head.description);
    assert_eq!(config.lumen.header(), &head.lumen);
    let header = Header::read(&image).expect("a header");
    assert_eq!((header.version, header.total_bytes), (VERSION, image.len() as u32));
    assert!(image.ends_with(&lumen) && (image.len() - lumen.len()).is_multiple_of(4));
}

#[test]
fn p16_every_single_bit_flip_is_refused() {
    let mut image = image();
    for bit in 0..8 * image.len() {
        image[bit / 8] ^= 1 << (bit % 8);
        assert!(decode(&image).is_err(), "bit {bit}");
        image[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(decode(&image).is_ok());
}

#[test]
fn p16_every_truncation_and_extension_is_refused() {
    let mut image = image();
    for len in 0..image.len() {
        let error = decode(&image[..len]).expect_err("truncated");
        let expected = if len < HEADER_BYTES {
            ImageError::TooShort { found: len }
        } else {
            ImageError::Length { stated: image.len() as u32, found: len }
        };
        assert_eq!(error, expected);
    }
    image.push(0);
    assert!(matches!(decode(&image), Err(ImageError::Length { .. })));
}

#[test]
fn each_part_of_the_header_has_its_own_error() {
    let good = image();
    let damaged = |at: usize| {
        let mut image = good.clone();
        image[at] ^= 1;
        decode(&image).expect_err("damaged")
    };
    assert!(matches!(damaged(0), ImageError::Magic { found } if &found == b"BFIM"));
    assert_eq!(damaged(4), ImageError::Version { expected: 1, found: 0 });
    assert!(matches!(damaged(6), ImageError::Schema { .. }));
    assert!(matches!(damaged(10), ImageError::Length { .. }));
    assert!(matches!(damaged(17), ImageError::HeadLength { .. }));
    assert!(matches!(damaged(18), ImageError::Crc { .. }));
    assert!(matches!(damaged(good.len() - 1), ImageError::Crc { .. }));
}

#[test]
fn bytes_left_over_in_the_postcard_part_are_refused_where_they_begin() {
    let mut image = image();
    let head_bytes = Header::read(&image).expect("a header").head_bytes as usize;
    // Four bytes keep the lumen aligned.
    let end = HEADER_BYTES + head_bytes;
    image.splice(end..end, [0; 4]);
    image[14..18].copy_from_slice(&(head_bytes as u32 + 4).to_le_bytes());
    seal(&mut image);
    assert_eq!(decode(&image).expect_err("remainder"), ImageError::TrailingBytes { offset: end });
}

#[test]
fn padding_must_be_zero() {
    // A count of one byte or of two: at least one of the images has padding.
    let images = [100, 10_000].map(|settle_timeout_ticks| {
        let settings = Settings { settle_timeout_ticks, ..Settings::default() };
        encoded(&ImageHead { settings, ..head() }, &lumen_bytes()).expect("a valid image")
    });
    let end =
        |image: &Vec<u8>| HEADER_BYTES + Header::read(image).expect("a header").head_bytes as usize;
    let padded = images.into_iter().find(|image| !end(image).is_multiple_of(4));
    let mut image = padded.expect("an image with padding");
    let end = end(&image);
    image[end] = 1;
    seal(&mut image);
    assert_eq!(decode(&image).expect_err("padding"), ImageError::Padding { offset: end });
}

/// What is wrong in meaning is refused by encoder and decoder alike, by name.
#[test]
fn p16_numbers_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut ImageHead), expected: ImageError| {
        let mut head = head();
        change(&mut head);
        let mut front = [0; 1024];
        let front = postcard::to_slice(&head, &mut front).expect("short");
        let offset = lumen_offset(front.len()).expect("short");
        let expected = match expected {
            ImageError::Lumen { error, .. } => ImageError::Lumen { offset, error },
            other => other,
        };
        let error = encoded(&head, &lumen_bytes()).expect_err("out of range");
        assert_eq!(error, EncodeError::Refused(expected));

        // The same bytes from an encoder that does not check.
        let mut image = image();
        image.truncate(HEADER_BYTES);
        image.extend(&*front);
        image.resize(offset, 0);
        image.extend(lumen_bytes());
        image[14..18].copy_from_slice(&(front.len() as u32).to_le_bytes());
        seal(&mut image);
        assert_eq!(decode(&image).expect_err("out of range"), expected);
    };
    refused(
        |h| h.settings.force_limit_n = f32::NAN,
        ImageError::Setting(SettingError::NotFinite("force_limit_n")),
    );
    refused(
        |h| h.settings.force_limit_n = 11.0,
        ImageError::Setting(SettingError::Range("force_limit_n")),
    );
    refused(
        |h| h.settings.force_slew_n_per_s = 10.0,
        ImageError::Setting(SettingError::RampTooSlow("force_limit_n")),
    );
    refused(|h| h.description.solver.tick_s = 2e-3, ImageError::Tick);
    refused(|h| h.description.solver.tick_s = f32::NAN, ImageError::Tick);
    let overlong = ImageError::Overlong;
    refused(|h| h.description.solver.substeps = 3, overlong("solver.substeps above 2"));
    refused(
        |h| {
            let (wire, solver) = (&mut h.description.guidewire, &mut h.description.solver);
            *wire = Some(h.description.instrument.clone());
            solver.solves = 2;
        },
        overlong("solver.solves = 2 with a guidewire"),
    );
    refused(
        |h| {
            h.description.guidewire = Some(h.description.instrument.clone());
            (h.description.solver.solves, h.description.solver.substeps) = (1, 2);
        },
        overlong("half ticks, which a near-rigid wall asks for, with a guidewire"),
    );
    refused(
        |h| (h.description.solver.solves, h.description.solver.substeps) = (2, 2),
        overlong("solver.solves = 2 with half ticks, which a near-rigid wall asks for"),
    );
    refused(
        |h| {
            let solver = &mut h.description.solver;
            (solver.solves, solver.substeps) = (1, 2);
            h.settings.max_insertion_m =
                (most_links(1, 2, false) as f32 + 0.5) * solver.link_length_m;
        },
        overlong("more links than half ticks have time for"),
    );
    refused(
        |h| {
            let solver = &mut h.description.solver;
            (solver.solves, solver.substeps) = (2, 1);
            h.settings.max_insertion_m =
                (most_links(2, 1, true) as f32 + 0.5) * solver.link_length_m;
            h.description.effects.fluid.drag.along_n_per_m = 0.1;
        },
        overlong("more links than two solves with effects have time for"),
    );
    refused(
        |h| h.description.wall.friction_coefficient = f32::INFINITY,
        ImageError::Description(DescriptionError::Range("wall.friction_coefficient")),
    );
    refused(
        |h| h.lumen.cell_m = f32::NAN,
        ImageError::Lumen { offset: 0, error: LumenError::Header("cell_m") },
    );
}

#[test]
fn errors_say_where_and_what() {
    let mut head = head();
    head.settings.force_limit_n = 11.0;
    let error = encoded(&head, &lumen_bytes()).expect_err("out of range");
    assert_eq!(error.to_string(), "settings: force_limit_n must be between 0 and 10 N");

    let mut lumen = lumen_bytes();
    lumen[2..4].copy_from_slice(&5u16.to_le_bytes());
    let error = encoded(&self::head(), &lumen).expect_err("no such brick");
    let at = image().len() - lumen.len() + 2;
    let text = "entry 1 of the lumen's directory names brick 5, which is not stored";
    assert_eq!(error.to_string(), std::format!("byte {at}: {text}"));
}

#[test]
fn a_buffer_that_is_too_small_is_left_alone() {
    let needed = image().len();
    let mut short = vec![7; needed - 1];
    let error = encode(&head(), &lumen_bytes(), &mut short);
    assert_eq!(error, Err(EncodeError::BufferTooSmall { needed }));
    assert!(short.iter().all(|&b| b == 7));
}

proptest! {
    #[test]
    fn p03_any_bytes_are_refused_without_a_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..600),
        with_header: bool,
    ) {
        let mut bytes = bytes;
        if with_header && bytes.len() >= HEADER_BYTES {
            // Past the header's checks, into the postcard part.
            let head_bytes = (bytes.len() - HEADER_BYTES) as u32 / 4 * 4;
            bytes[..4].copy_from_slice(&MAGIC);
            bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
            bytes[6..10].copy_from_slice(&schema_hash().to_le_bytes());
            bytes[14..18].copy_from_slice(&head_bytes.to_le_bytes());
            seal(&mut bytes);
        }
        prop_assert!(decode(&bytes).is_err());
    }
}
