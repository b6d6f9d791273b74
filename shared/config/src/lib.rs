//! The device image: the complete configuration of a device in one checked block of bytes.

#![no_std]
#![forbid(unsafe_code)]

pub mod image;
mod key;
mod schema;

pub use cathforce_bus::master;
pub use cathforce_control::{
    BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow, SETTINGS, SettingError, SettingInfo,
    Settings,
};
pub use image::{EncodeError, ImageError, ImageHead};
pub use key::{Key, KeyError, keys};
