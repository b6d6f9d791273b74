//! A flash that this board does not have, in memory that no boot clears.
//!
//! It obeys the rules of a flash whose words and blocks are those of the STM32H743: erasing sets all bits of a
//! block, and writing only clears bits. The memory holds the complement of each byte, so that an emulator that
//! has just been started, with zeros in its memory, has an erased flash. It survives a reset, and an emulator
//! whose memory is a file keeps it while it does not run (`BoardOptions::memory` of the link).

use core::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// Longest image that fits into a slot and a buffer \[bytes\].
pub const LONGEST_IMAGE: usize = 2 << 20;

const BLOCK: usize = 128 << 10;
const WORD: usize = 32;
/// An image, and a block for what the store keeps beside it.
const SLOT: usize = LONGEST_IMAGE + BLOCK;
const SIZE: usize = 2 * SLOT;
pub const SLOTS: [Range<u32>; 2] = [0..SLOT as u32, SLOT as u32..SIZE as u32];

unsafe extern "C" {
    /// Linker symbol: memory for the flash alone, longer than [`SIZE`].
    static mut _saved_images: [u8; SIZE];
}

/// The flash.
pub struct MemoryFlash {
    working: fn(),
}

impl MemoryFlash {
    /// `working`: called in each operation.
    pub fn new(working: fn()) -> Self {
        Self { working }
    }

    fn cells(&mut self, offset: u32, len: usize) -> Option<&mut [u8]> {
        (self.working)();
        // SAFETY: memory of the flash alone, of which there is one; any bits are bytes.
        let all: &mut [u8; SIZE] = unsafe {
            let all = &raw mut _saved_images;
            &mut *all
        };
        all.get_mut(offset as usize..)?.get_mut(..len)
    }
}

impl ErrorType for MemoryFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let cells = self.cells(offset, bytes.len()).ok_or(NorFlashErrorKind::OutOfBounds)?;
        bytes.iter_mut().zip(cells).for_each(|(byte, cell)| *byte = !*cell);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for MemoryFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = BLOCK;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for block in (from..to).step_by(BLOCK) {
            self.cells(block, BLOCK).ok_or(NorFlashErrorKind::OutOfBounds)?.fill(0);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let cells = self.cells(offset, bytes.len()).ok_or(NorFlashErrorKind::OutOfBounds)?;
        cells.iter_mut().zip(bytes).for_each(|(cell, byte)| *cell |= !byte);
        Ok(())
    }
}
