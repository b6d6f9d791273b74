//! Tip and shape of an instrument from the pictures of a camera above its phantom.
//!
//! A lens is calibrated with a checkerboard ([`Calibration`]), the plane in which the instrument lies is
//! found from a board in it or from named points ([`read_plane`]), and each frame of a video or folder
//! ([`Frames`]) is searched for the instrument ([`Tracker`]): segmented by threshold, thinned, ordered
//! from the entry to the tip, measured across to a fraction of a pixel, and mapped into the vessel's frame.
//! A [`Sequence`] drops frames that contradict their neighbours.
//!
//! [`render`] makes pictures of known shapes, by which all of it is measured.

#![forbid(unsafe_code)]

mod board;
mod calibration;
mod corners;
mod decode;
mod error;
mod filter;
mod frames;
mod least_squares;
mod lens;
mod picture;
mod plane;
pub mod render;
mod sequence;
mod shape;

pub use board::{Board, LEAST_PICTURES, NoBoard};
pub use calibration::calibrate::{
    Calibrated, Calibration, CalibrationOptions, Quality, Used, calibrate,
};
pub use corners::find::find_board;
pub use error::{CameraError, why as why_no_board};
pub use frames::folder::{Folder, picture_files};
pub use frames::frame::Frame;
pub use frames::source::Frames;
pub use frames::video::{Ffmpeg, Video};
pub use lens::model::Lens;
pub use lens::pose::Pose;
pub use picture::Picture;
pub use plane::file::read_plane;
pub use plane::world::{Axes, Plane, PlaneQuality};
pub use sequence::{Dropped, Kept, Sequence, Why, follow};
pub use shape::contrast::Polarity;
pub use shape::track::{Entry, MOST_FROM_ENTRY_M, Miss, NoView, Sighting, TrackOptions, Tracker};
