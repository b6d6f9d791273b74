//! HTML pages of a recording and of a diagnosis.
//!
//! Each page is one file: its style, script and data are inside, and it loads nothing.

#![forbid(unsafe_code)]

mod diagnosis;
mod escape;
mod recording;
mod template;

pub use diagnosis::diagnosis_page;
pub use recording::{PageError, recording_page};
