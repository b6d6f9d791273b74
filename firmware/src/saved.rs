//! The saved images: which one the device boots with, and saving another one.

use cathforce_bus::service::{Refusal, Saved, SavedState, crc32};
use cathforce_device::refused_header;
use cathforce_storage::{Layout, SaveError, State, Store};

use crate::board::{self, Board};
use crate::{device, watch};

/// Ticks that the device runs with a saved image before it counts as one that it can boot with: a second,
/// longer than any watchdog waits.
const PROOF_TICKS: u32 = 1000;

type Flash = <board::This as Board>::Flash;

/// The saved images.
pub struct SavedImages {
    store: Store<Flash>,
    saved: Saved<'static>,
    /// The image in use is the one that the device boots with.
    is_in_use: bool,
    /// CRC-32 of the image that was read last.
    read_crc32: u32,
    /// CRC-32 of an image that turned out not to fit, and why.
    unfit: Option<(u32, &'static str)>,
}

impl SavedImages {
    pub fn new(board: board::This) -> Self {
        let layout = Layout { slots: board::This::SAVED_IMAGES };
        match Store::new(board.flash(watch::service_works), layout) {
            Some(store) => Self {
                store,
                saved: Saved::default(),
                is_in_use: false,
                read_crc32: 0,
                unfit: None,
            },
            None => panic!("the places for saved images do not fit this board's flash"),
        }
    }

    /// Reads the newest image that can be used into a buffer; returns its length, 0 without one.
    pub fn read(&mut self, into: &mut [u8]) -> usize {
        let (unfit, mut refused) = (self.unfit, "");
        let found = self.store.load(into, |image| {
            let why = match unfit {
                Some((crc, why)) if crc == crc32(image) => Some(why),
                _ => refused_header(image),
            };
            refused = why.unwrap_or(refused);
            why.is_none()
        });
        let Ok(found) = found else {
            self.saved = Saved {
                state: SavedState::Lost,
                refused: "the flash cannot be read",
                ..Saved::default()
            };
            return 0;
        };
        let state = match found.state {
            State::Empty => SavedState::Empty,
            State::Good => SavedState::Good,
            State::Fallback => SavedState::Fallback,
            State::Lost => SavedState::Lost,
        };
        self.saved = Saved { state, on_trial: found.on_trial, refused, image_crc32: 0 };
        self.read_crc32 = crc32(into.get(..found.len).unwrap_or_default());
        found.len
    }

    /// The device uses the image that was read.
    pub fn fits(&mut self) {
        self.saved.image_crc32 = self.read_crc32;
        self.is_in_use = true;
    }

    /// The device cannot use the image that was read.
    pub fn does_not_fit(&mut self, why: &'static str) {
        self.unfit = Some((self.read_crc32, why));
        self.saved = Saved { state: SavedState::Lost, refused: why, ..Saved::default() };
    }

    /// The device uses another image, which is not saved.
    pub fn left(&mut self) {
        self.is_in_use = false;
    }

    /// Saves the image in use.
    pub fn save(&mut self, image: &[u8], image_crc32: u32) -> Result<(), Refusal<'static>> {
        self.store.save(image).map_err(|error| match error {
            SaveError::TooLong { capacity } => Refusal::TooLong { capacity },
            SaveError::ReadBack => {
                Refusal::Flash { reason: "it reads other bytes than were written" }
            }
            SaveError::Flash(_) => Refusal::Flash { reason: "it cannot be erased or written" },
        })?;
        self.saved = Saved { state: SavedState::Good, image_crc32, on_trial: true, refused: "" };
        self.is_in_use = true;
        Ok(())
    }

    /// What the host is told.
    pub fn state(&self) -> Saved<'static> {
        self.saved
    }

    /// The device has run long enough with the image that it boots with, and has not written so yet.
    pub fn is_proven(&self) -> bool {
        self.is_in_use && self.saved.on_trial && device::ticks() >= PROOF_TICKS
    }

    /// Writes down that the image is proven.
    pub fn confirm(&mut self) {
        self.saved.on_trial = false;
        if self.store.confirm().is_err() {
            defmt::warn!("the flash does not take the mark of a proven image");
        }
    }
}
