//! ASCII STL files of various programs, and other files that are mistaken for STL.

mod support;

use cathforce_bundle::Place;
use cathforce_bundle::geometry::{StlCause, Triangle, read_stl};
use support::{ascii_stl, tube};

fn surface() -> Vec<Triangle> {
    tube()[..20].to_vec()
}

fn text() -> String {
    ascii_stl(&surface())
}

fn assert_reads(bytes: &[u8]) {
    let read = read_stl(bytes).unwrap();
    assert_eq!(read, read_stl(text().as_bytes()).unwrap());
    assert_eq!(read.len(), surface().len());
}

#[test]
fn a_text_is_read_whatever_ends_its_lines() {
    assert_reads(text().replace('\n', "\r\n").as_bytes());
    assert_reads(text().replace('\n', "\r").as_bytes());
    // A name may contain `facet`.
    assert_reads(text().replace('\n', " ").as_bytes());
    let two = [text(), text()].concat();
    let in_lines = read_stl(two.as_bytes()).unwrap();
    assert_eq!(in_lines.len(), 2 * surface().len());
    assert_eq!(read_stl(two.replace('\n', " ").as_bytes()).unwrap(), in_lines);
}

#[test]
fn marks_of_editors_and_systems_around_a_text_are_no_fault() {
    assert_reads(&["\u{feff}", &text()].concat().into_bytes());
    assert_reads(&[&text(), "\u{1a}"].concat().into_bytes());
}

#[test]
fn normals_that_are_no_numbers_are_not_looked_at() {
    let normal = "facet normal 0 0 nan";
    assert!(text().contains(normal));
    for written in ["-nan(ind) -nan(ind) -nan(ind)", "-1.#IND 0 1.#QNAN", "NaN inf -Infinity"] {
        assert_reads(text().replace(normal, &format!("facet normal {written}")).as_bytes());
    }
    // The third number is missing; the fault is at the word in its place.
    let short = text().replacen(normal, "facet normal 0 0", 1);
    let (place, cause) = read_stl(short.as_bytes()).unwrap_err();
    assert_eq!((place, cause), (Place::Line(3), StlCause::NotANumber("outer".into())));
}

#[test]
fn a_line_is_counted_by_returns_too() {
    let number = text().replacen("vertex ", "vertex x", 1).replace('\n', "\r");
    let (place, cause) = read_stl(number.as_bytes()).unwrap_err();
    assert_eq!(place, Place::Line(4));
    assert!(matches!(cause, StlCause::NotANumber(_)), "{cause:?}");
}

#[test]
fn a_missing_last_line_is_called_so() {
    let whole = text();
    let cut = whole.rsplit_once("endsolid").unwrap().0;
    let (_, cause) = read_stl(cut.as_bytes()).unwrap_err();
    let says = cause.to_string();
    assert!(says.contains("ends after 20 facets without `endsolid`"), "{says}");
}

#[test]
fn a_decimal_comma_is_called_so() {
    let number = text().lines().nth(3).unwrap().split_whitespace().nth(1).unwrap().to_owned();
    let comma = text().replacen(&number, &number.replace('.', ","), 1);
    let (place, cause) = read_stl(comma.as_bytes()).unwrap_err();
    assert_eq!(place, Place::Line(4));
    assert!(matches!(&cause, StlCause::DecimalComma(word) if word.contains(',')), "{cause:?}");
}

#[test]
fn files_of_other_formats_are_named() {
    let utf_16: Vec<u8> =
        [0xFEFF].into_iter().chain(text().encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let with = |first: &[u8]| [first, &[7; 300]].concat();
    for (bytes, says) in [
        (with(b"PK\x03\x04"), "ZIP archive"),
        (with(b"\x1F\x8B\x08"), "gzip archive"),
        (utf_16, "UTF-16"),
    ] {
        let (place, cause) = read_stl(&bytes).unwrap_err();
        assert!(cause.to_string().contains(says), "{cause}");
        assert_eq!(place, Place::Whole);
    }
    // A file of the right length is binary, whatever its header begins with.
    let mut binary = support::binary_stl(&surface());
    binary[..4].copy_from_slice(b"PK\x03\x04");
    assert_eq!(read_stl(&binary).unwrap().len(), surface().len());
}

#[test]
fn what_a_file_holds_is_shown_without_its_control_characters() {
    let escape = text().replacen("outer", &format!("\u{1b}[2J{}", "x".repeat(200)), 1);
    // Within the first bytes it would be no text at all.
    let long = escape.replacen("solid a", &format!("solid {}", "a".repeat(1100)), 1);
    let (_, cause) = read_stl(long.as_bytes()).unwrap_err();
    let says = cause.to_string();
    assert!(says.contains("found `\u{fffd}[2J"), "{says:?}");
    assert!(!says.contains('\u{1b}') && says.chars().count() < 100, "{says:?}");
}
