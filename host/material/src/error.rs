//! Errors of a tensile test: the file, the line, the cause and the fix.

use std::fmt::{Display, Formatter};
use std::path::PathBuf;

use thiserror::Error;

/// Fewest rows of different stretch: two parameters, and as many residuals as they take.
pub(crate) const LEAST_ROWS: usize = 6;

/// Why a curve is refused.
#[derive(Debug, Error)]
pub enum CurveCause {
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    #[error("is no table: {0}")]
    Csv(String),
    #[error("there is no column `{name}`{}", near(.nearest))]
    UnknownColumn { name: String, nearest: Option<&'static str> },
    #[error("column `{name}` has no unit that is known here; it takes {known}")]
    Unit { name: String, known: &'static str },
    #[error("the columns `{first}` and `{second}` say the same twice")]
    Twice { first: String, second: String },
    #[error("there is no column of {0}")]
    Missing(&'static str),
    #[error("column `{name}`: `{text}` is not a number")]
    NotANumber { name: String, text: String },
    #[error("column `{name}`: `{text}` is not a finite number")]
    NotFinite { name: String, text: String },
    #[error("column `{0}` has no value in this row")]
    Empty(String),
    #[error(
        "the stretch falls from {before:.4} to {now:.4}: the rows are not in the order of loading"
    )]
    Unsorted { before: f64, now: f64 },
    #[error("there are {rows} rows of different stretch, which is too few for a fit")]
    TooFewRows { rows: usize },
    #[error("a stretch of {0:.4} is not above 0")]
    NotPositive(f64),
    #[error(
        "column `{name}` goes to {largest:.4}, more than any elastomer stretches: it is in per cent"
    )]
    Percent { name: String, largest: f64 },
    #[error("column `{name}` begins at {first:.4}: a stretch begins near 1, a strain near 0")]
    StrainAsStretch { name: String, first: f64 },
    #[error(
        "the largest force would be a stress of {stress_mpa:.3e} MPa, more than any polymer bears: \
         column `{name}` is in counts, not in newtons"
    )]
    Counts { name: String, stress_mpa: f64 },
    #[error(
        "column `{0}` holds whole numbers only, up to {1}: that is a sensor's counts, not newtons"
    )]
    WholeNumbers(String, f64),
    #[error("the largest stress is {stress_mpa:.3e} MPa, more than any polymer bears")]
    Unit1000 { stress_mpa: f64 },
    #[error(
        "the stress does not grow with the stretch: its slope over the whole curve is {0:.3e} Pa"
    )]
    Falling(f64),
    #[error("column `{0}` does not say whether the stress is nominal or true")]
    Unstated(String),
    #[error("column `{0}` is the {1} stress, and `--stress {2}` says otherwise")]
    Contradiction(String, &'static str, &'static str),
    #[error("column `{0}` needs the specimen's {1}")]
    Specimen(String, &'static str),
}

fn near(nearest: &Option<&'static str>) -> String {
    nearest.map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

const COLUMNS: &str = "name the columns `stretch` or `strain` and `nominal_stress_MPa`, or \
     `extension_mm` and `force_N`";

impl CurveCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            Self::Io(_) => "check that the path is a file that may be read".into(),
            Self::Csv(_) => "save the curve as text with commas and one heading line".into(),
            Self::UnknownColumn { .. } => format!("{COLUMNS}, and remove other columns"),
            Self::Unit { .. } => "write the unit behind the name, as in `force_N`; convert counts \
                 with the sensor's calibration first"
                .into(),
            Self::Twice { .. } => "keep the column that was measured".into(),
            Self::Missing(_) => COLUMNS.into(),
            Self::NotANumber { .. } => "write a number with a decimal point".into(),
            Self::NotFinite { .. } | Self::Empty(_) => "remove the row, or repair the value".into(),
            Self::Unsorted { .. } => {
                "keep the loading of one pull, from the unloaded specimen on, in its order".into()
            }
            Self::TooFewRows { .. } => format!("give at least {} rows", LEAST_ROWS),
            Self::NotPositive(_) => "check the unloaded length and the sign of the strain".into(),
            Self::Percent { .. } => "name the column `strain_percent`, or divide it by 100".into(),
            Self::StrainAsStretch { .. } => {
                "name a strain `strain`; a stretch is the length over the unloaded length".into()
            }
            Self::Counts { .. } | Self::WholeNumbers(..) => {
                "divide by the counts per newton of the sensor's calibration; write newtons with a \
                 decimal point"
                    .into()
            }
            Self::Unit1000 { .. } => "check the unit in the heading: Pa, kPa or MPa".into(),
            Self::Falling(_) => {
                "check the sign of the force, and that the columns belong together".into()
            }
            Self::Unstated(_) => "name it `nominal_stress_…` (force over the unloaded area) or \
                 `true_stress_…`, or give --stress nominal or --stress true"
                .into(),
            Self::Contradiction(..) => "leave --stress out, or rename the column".into(),
            Self::Specimen(..) => {
                "give --gauge-mm (length between the marks) with an extension, and \
                 --area-mm2 (thickness times width) with a force"
                    .into()
            }
        }
    }
}

/// A curve that is refused, with everything that is wrong with it.
#[derive(Debug, Error)]
pub struct CurveError {
    pub file: PathBuf,
    /// Lines from 1, or 0 for the file as a whole, each with its cause; never empty.
    pub faults: Vec<(usize, CurveCause)>,
}

impl Display for CurveError {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        for (index, (line, cause)) in self.faults.iter().enumerate() {
            let new_line = if index > 0 { "\n" } else { "" };
            write!(f, "{new_line}{}", self.file.display())?;
            if *line > 0 {
                write!(f, ":{line}")?;
            }
            write!(f, ": {cause}\n  fix: {}", cause.fix())?;
        }
        Ok(())
    }
}
