//! `trials/NNN.csv`: what was measured in one trial.

mod cause;
pub mod columns;
mod drive;
mod foreign;
mod plausible;
mod read;
mod speed;
mod transmission;
mod types;

pub use cause::{LONGEST_GAP_S, TrialCause};
pub use foreign::{ColumnMap, Foreign, ForeignCause, LeftOut, read_foreign};
pub(crate) use plausible::warn_of_units;
pub use read::Holes;
pub(crate) use read::Parsed;
pub use speed::Rush;
pub use types::{
    CatheterTrial, DriveTrial, EncoderReading, GuidewireTrial, TransmissionTrial, Trial, TrialData,
    VectorColumn,
};
