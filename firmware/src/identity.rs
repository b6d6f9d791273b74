//! Which build this is, as it answers whoever asks.

use core::fmt::Write as _;

use cathforce_bus::service;
use heapless::String;
use static_cell::StaticCell;

/// A version, `+`, and eight digits.
const MOST_BYTES: usize = 32;

unsafe extern "C" {
    /// The linker's: where the code begins, where the initial values of variables lie in flash, and
    /// the variables themselves.
    static __stext: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// Version and build: `0.1.0+89abcdef`. The build is the CRC-32 of code, constants and initial
/// values as they lie in flash, so it needs no bookkeeping and cannot be forgotten; the host
/// computes the same of an ELF. Called once, takes a few milliseconds.
pub fn firmware() -> &'static str {
    static PLACE: StaticCell<String<MOST_BYTES>> = StaticCell::new();
    let name = PLACE.init(String::new());
    // Longer than the place it would be cut short; a name is no reason not to start.
    let _ = write!(name, "{}+{:08x}", env!("CARGO_PKG_VERSION"), service::crc32(flash()));
    name
}

fn flash() -> &'static [u8] {
    let from = &raw const __stext;
    let data = (&raw const __edata) as usize - (&raw const __sdata) as usize;
    let len = (&raw const __sidata) as usize + data - from as usize;
    // SAFETY: from the beginning of the code to the end of the initial values all is flash, which
    // nobody writes to.
    unsafe { core::slice::from_raw_parts(from, len) }
}
