//! A device image in flash, in two slots, so that a power cut at any time leaves exactly the old image or
//! the new one.
//!
//! A slot holds a header, marks, and the bytes of an image. An image is written into the slot that does
//! not hold the newest good one and read back; only then is its header written. Whatever is cut short
//! before leaves a slot without a header and the other one as it was. A word that was torn in the middle
//! is found by the CRC of the header or of the image.
//!
//! A new image is on trial: each boot that takes it uses up one of [`TRIALS`] by writing a mark, until
//! [`Store::confirm`] says that the device has run with it. An image whose trials are used up is left for
//! the one before it, so that an image with which a device cannot start does not keep it from starting.
//!
//! Nothing relies on a word being written whole. The map of the library `sequential-storage` does: with
//! the tests' flash, whose words and erases are torn when the power is cut, it lost both records or left
//! a word that could not be written again.

#![no_std]
#![forbid(unsafe_code)]

mod header;
mod store;

use crc::{CRC_32_ISO_HDLC, Crc, Table};

pub use header::TRIALS;
pub use store::{Found, Layout, SaveError, State, Store};

static CRC32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
