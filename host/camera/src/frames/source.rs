//! A folder or a video.

use std::path::Path;

use super::folder::Folder;
use super::frame::Frame;
use super::video::{Ffmpeg, Video};
use crate::error::CameraError;

/// Frames in the order of their times.
pub enum Frames {
    Folder(Folder),
    Video(Video),
}

impl Frames {
    /// Opens a folder of pictures, which needs a rate, or a video, whose own times a rate replaces.
    pub fn open(path: &Path, rate_hz: Option<f64>, ffmpeg: &Ffmpeg) -> Result<Self, CameraError> {
        let wrong = |problem: &str, fix: &str| CameraError::File {
            path: path.to_owned(),
            problem: problem.into(),
            fix: fix.into(),
        };
        if !path.exists() {
            return Err(wrong("is not there", "check the path"));
        }
        if !path.is_dir() {
            return Ok(Self::Video(Video::open(ffmpeg, path, rate_hz)?));
        }
        let rate_hz = rate_hz.ok_or_else(|| {
            wrong("pictures do not say when they were taken", "give the frame rate with --rate")
        })?;
        Ok(Self::Folder(Folder::open(path, rate_hz)?))
    }

    /// Width and height \[px\].
    pub fn size(&self) -> [usize; 2] {
        match self {
            Self::Folder(folder) => folder.size,
            Self::Video(video) => video.size,
        }
    }

    /// How many frames there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Folder(folder) => folder.count(),
            Self::Video(video) => video.count(),
        }
    }

    /// Numbers of frames that are missing.
    pub fn missing(&self) -> &[usize] {
        match self {
            Self::Folder(folder) => &folder.missing,
            Self::Video(_) => &[],
        }
    }

    /// The next frame; `None` after the last.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        match self {
            Self::Folder(folder) => Ok(folder.next_frame()),
            Self::Video(video) => video.next_frame(),
        }
    }
}
