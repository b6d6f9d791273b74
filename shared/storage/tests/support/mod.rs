//! A NOR flash in memory whose power can be cut.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

pub const WORD: usize = 4;
pub const BLOCK: usize = 256;

/// A flash of whole words: writing clears bits, erasing sets those of a block.
#[derive(Clone)]
pub struct Flash {
    pub bytes: Vec<u8>,
    /// Words and blocks that can be written and erased before the power is cut.
    pub fuel: Option<usize>,
    /// Words written and blocks erased so far.
    pub done: usize,
    /// Decides which bits a word or block has changed when the power is cut.
    pub seed: u64,
    pub is_off: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    PowerCut,
    OutOfBounds,
    NotAligned,
    /// A word that was not erased was written.
    NotErased,
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            _ => NorFlashErrorKind::Other,
        }
    }
}

impl Flash {
    pub fn new(blocks: usize) -> Self {
        Self { bytes: vec![0xFF; blocks * BLOCK], fuel: None, done: 0, seed: 1, is_off: false }
    }

    /// The same flash after the power has come back.
    pub fn powered(mut self) -> Self {
        (self.fuel, self.is_off) = (None, false);
        self
    }

    fn random(&mut self) -> u64 {
        self.seed = self
            .seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.seed >> 33
    }

    /// Whether the next operation is the one in which the power is cut.
    fn is_cut(&mut self) -> bool {
        let cut = self.fuel == Some(self.done);
        self.done += 1;
        self.is_off |= cut;
        cut
    }

    fn check(&self, from: usize, to: usize, unit: usize) -> Result<(), Failure> {
        if self.is_off {
            return Err(Failure::PowerCut);
        }
        if from > to || to > self.bytes.len() {
            return Err(Failure::OutOfBounds);
        }
        if !from.is_multiple_of(unit) || !to.is_multiple_of(unit) {
            return Err(Failure::NotAligned);
        }
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Failure;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let from = offset as usize;
        self.check(from, from + bytes.len(), 1)?;
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = BLOCK;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        self.check(from as usize, to as usize, BLOCK)?;
        for block in (from as usize..to as usize).step_by(BLOCK) {
            let cut = self.is_cut();
            for at in block..block + BLOCK {
                // A cut erase has set some of the bits.
                let set = if cut { self.random() as u8 } else { 0xFF };
                self.bytes[at] |= set;
            }
            if cut {
                return Err(Failure::PowerCut);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let from = offset as usize;
        self.check(from, from + bytes.len(), WORD)?;
        for (i, word) in bytes.chunks(WORD).enumerate() {
            let at = from + i * WORD;
            if self.bytes[at..at + WORD] != [0xFF; WORD] {
                return Err(Failure::NotErased);
            }
            let cut = self.is_cut();
            for (place, byte) in (at..).zip(word) {
                // A torn word has lost some of the bits that it should lose.
                let kept = if cut { self.random() as u8 } else { 0 };
                self.bytes[place] &= byte | kept;
            }
            if cut {
                return Err(Failure::PowerCut);
            }
        }
        Ok(())
    }
}
