//! One frame.

use std::path::PathBuf;

use crate::error::CameraError;
use crate::picture::Picture;

/// A frame that is decoded when it is needed, so that several can be at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Number in the file's name, or counted from 0.
    pub number: usize,
    /// Time since the first frame \[s\].
    pub t_s: f64,
    pub content: Content,
}

/// Where the pixels of a frame are.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    File(PathBuf),
    /// One byte a pixel, row by row.
    Grey {
        size: [usize; 2],
        bytes: Vec<u8>,
    },
}

impl Frame {
    pub fn picture(&self) -> Result<Picture, CameraError> {
        match &self.content {
            Content::File(path) => Picture::read(path),
            Content::Grey { size: [width, height], bytes } => {
                Picture::from_bytes(*width, *height, bytes).ok_or_else(|| {
                    let problem = format!("frame {} has the wrong size", self.number);
                    CameraError::Video(problem, "record the video again".into())
                })
            }
        }
    }
}
