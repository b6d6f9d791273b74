//! The second bank of the flash, for saved images. The code lies in the first one, so that it runs on while the
//! second one is erased and written, and no interrupt is delayed.
//!
//! The driver of the HAL waits with interrupts masked, for up to seconds. This one polls in the task that saves.

use core::arch::asm;
use core::ops::Range;

use cortex_m::peripheral::SCB;
use embassy_stm32::pac;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// The second bank, and its sectors.
const BASE: usize = 0x0810_0000;
const BANK: usize = 1;
const SIZE: usize = 1 << 20;
const SECTOR: usize = 128 << 10;
/// A flash word of 256 bits, which carries its own error correction.
const WORD: usize = 32;
pub const SLOTS: [Range<u32>; 2] = [0..(SIZE / 2) as u32, (SIZE / 2) as u32..SIZE as u32];

/// The bank. There is one, which the task that saves owns.
pub struct SecondBank {
    working: fn(),
}

impl SecondBank {
    /// `working`: called while the flash works.
    pub fn new(working: fn()) -> Self {
        Self { working }
    }

    fn unlock(&mut self) {
        let bank = pac::FLASH.bank(BANK);
        if bank.cr().read().lock() {
            bank.keyr().write_value(0x4567_0123);
            bank.keyr().write_value(0xCDEF_89AB);
        }
        bank.ccr().write(|w| {
            w.set_clr_eop(true);
            w.set_clr_wrperr(true);
            w.set_clr_pgserr(true);
            w.set_clr_strberr(true);
            w.set_clr_incerr(true);
            w.set_clr_operr(true);
        });
    }

    /// Waits for the end of an operation, and ends the access.
    fn finish(&mut self) -> Result<(), NorFlashErrorKind> {
        let bank = pac::FLASH.bank(BANK);
        cortex_m::asm::dsb();
        while bank.sr().read().qw() {
            (self.working)();
        }
        let status = bank.sr().read();
        bank.cr().write(|w| w.set_lock(true));
        let failed = status.wrperr()
            || status.pgserr()
            || status.strberr()
            || status.incerr()
            || status.operr();
        if failed { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }

    /// Drops what the cache holds of a range: the flash changes behind it.
    fn forget(&mut self, offset: usize, len: usize) {
        let from = (BASE + offset) & !(WORD - 1);
        // SAFETY: nothing writes to these addresses through the cache, so nothing in it is lost.
        unsafe {
            let mut scb = cortex_m::Peripherals::steal().SCB;
            scb.clean_invalidate_dcache_by_address(from, len);
        }
    }
}

/// Reads a flash word.
///
/// One that was torn by a power cut contradicts its error correction, and reading it is a bus fault. Such faults
/// are ignored meanwhile: whoever asks finds by a CRC that the bytes are none of an image. The tick is masked for
/// eight reads, a fraction of a microsecond.
fn read_word(offset: usize) -> [u8; WORD] {
    const BUS_FAULTS_ARE_IGNORED: u32 = 1 << 8;
    let mut word = [0; WORD];
    // SAFETY: inside the bank, which is mapped into memory; the masks are as before afterwards.
    unsafe {
        let scb = &*SCB::PTR;
        scb.ccr.modify(|ccr| ccr | BUS_FAULTS_ARE_IGNORED);
        asm!("cpsid f", "dsb", "isb");
        for (i, quarter) in word.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let place = (BASE + offset + 4 * i) as *const u32;
            *quarter = place.read_volatile().to_le_bytes();
        }
        asm!("dsb", "cpsie f");
        scb.ccr.modify(|ccr| ccr & !BUS_FAULTS_ARE_IGNORED);
    }
    word
}

impl ErrorType for SecondBank {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for SecondBank {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        (self.working)();
        let mut at = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            let begin = at % WORD;
            let len = rest.len().min(WORD - begin);
            let word = read_word(at - begin);
            let (front, behind) = rest.split_at_mut(len);
            front.iter_mut().zip(word.iter().skip(begin)).for_each(|(to, from)| *to = *from);
            (rest, at) = (behind, at + len);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for SecondBank {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for sector in from as usize / SECTOR..to as usize / SECTOR {
            self.unlock();
            let bank = pac::FLASH.bank(BANK);
            bank.cr().write(|w| {
                w.set_ser(true);
                w.set_psize(3);
                w.set_snb(sector as u8);
            });
            bank.cr().modify(|w| w.set_start(true));
            let ended = self.finish();
            self.forget(sector * SECTOR, SECTOR);
            ended?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (i, word) in bytes.chunks(WORD).enumerate() {
            let at = offset as usize + i * WORD;
            self.unlock();
            pac::FLASH.bank(BANK).cr().write(|w| {
                w.set_pg(true);
                w.set_psize(3);
            });
            cortex_m::asm::isb();
            cortex_m::asm::dsb();
            for (j, quarter) in word.as_chunks::<4>().0.iter().enumerate() {
                let place = (BASE + at + 4 * j) as *mut u32;
                // SAFETY: inside the bank, which takes words of 32 bits until it has a whole one.
                unsafe { place.write_volatile(u32::from_le_bytes(*quarter)) };
            }
            let ended = self.finish();
            self.forget(at, WORD);
            ended?;
        }
        Ok(())
    }
}
