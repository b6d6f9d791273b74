//! HTML pages of a recording, of a diagnosis and of the reproduced publications.
//!
//! Each page is one file: its style, script and data are inside, and it loads nothing.

#![forbid(unsafe_code)]

mod diagnosis;
mod escape;
mod recording;
mod reproduced;
mod template;

pub use diagnosis::diagnosis_page;
pub use recording::{PageError, recording_page, vessel_data};
pub use reproduced::reproduced_page;
