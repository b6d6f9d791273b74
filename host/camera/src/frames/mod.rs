//! The frames of a video or of a folder of pictures, with their times.

pub mod folder;
pub mod frame;
pub mod source;
pub mod video;
