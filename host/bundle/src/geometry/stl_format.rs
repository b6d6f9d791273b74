//! What both forms of STL share: the unit, and why a file is refused.

use thiserror::Error;

/// STL has no unit of its own; its coordinates are read as millimetres.
pub(super) const METRES_PER_UNIT: f64 = 1e-3;

/// Why an STL file is refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StlCause {
    #[error(
        "the file has {found} bytes; a binary STL has a header of 84, and this is no ASCII STL"
    )]
    NoHeader { found: usize },
    #[error(
        "the header promises {promised} triangles, {expected} bytes; the file ends after {found}, \
         inside or before triangle {triangle}"
    )]
    Truncated { promised: usize, expected: usize, found: usize, triangle: usize },
    #[error("{extra} bytes follow the last of the {promised} triangles that the header promises")]
    TrailingBytes { promised: usize, extra: usize },
    #[error("this is no STL file; it begins with `{starts}`")]
    NotStl { starts: String },
    #[error("the surface has no triangles")]
    Empty,
    #[error("triangle {triangle} has a coordinate that is not a finite number")]
    NotFinite { triangle: usize },
    #[error("expected `{expected}`, found `{found}`")]
    Syntax { expected: &'static str, found: String },
    #[error("`{0}` is not a number")]
    NotANumber(String),
    #[error("`{0}` has a comma where a decimal point belongs")]
    DecimalComma(String),
    #[error("{}", truncated_ascii(.facet, .expected))]
    TruncatedAscii { facet: usize, expected: &'static str },
    #[error("this is {0}, and no STL file")]
    OtherFormat(&'static str),
}

fn truncated_ascii(facet: &usize, expected: &str) -> String {
    match expected {
        END => format!(
            "the file ends after {facet} facets without `{END}`: whether more belong to the surface \
             cannot be told"
        ),
        _ => format!("the file ends inside facet {facet}; `{expected}` is missing"),
    }
}

/// The last word of an ASCII file.
pub(super) const END: &str = "endsolid";

/// A short piece of a file's text for a message, without control characters.
pub(super) fn shown(text: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(text);
    let mut shown: String =
        text.chars().take(MOST).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().count() > MOST {
        shown.push('…');
    }
    shown
}

impl StlCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            StlCause::NoHeader { .. } | StlCause::Truncated { .. } => {
                "the file was cut short, or is no STL: export or copy it again".into()
            }
            StlCause::TrailingBytes { .. } => {
                "the triangle count in bytes 80 to 83 and the file disagree: export it again".into()
            }
            StlCause::NotStl { .. } => "export the surface as STL, binary if possible".into(),
            StlCause::Empty => "export the lumen surface again; nothing was selected".into(),
            StlCause::NotFinite { .. } => {
                "repair the mesh in the program that made it, and export it again".into()
            }
            StlCause::TruncatedAscii { expected: END, .. } => {
                "export or copy it again; if all facets are there, add a line `endsolid`".into()
            }
            StlCause::DecimalComma(_) => {
                "export the surface again as binary STL, or with decimal points (an English locale)"
                    .into()
            }
            StlCause::OtherFormat(_) => {
                "unpack or convert it: export the surface as STL, binary if possible".into()
            }
            StlCause::Syntax { .. } | StlCause::NotANumber(_) | StlCause::TruncatedAscii { .. } => {
                "export the surface again, as binary STL if possible".into()
            }
        }
    }
}
