//! Version and build of the firmware, as it reports them.

use core::fmt::Write as _;

use cathforce_bus::service;
use heapless::String;
use static_cell::StaticCell;

/// Room for a version, `+`, and eight digits.
const MOST_BYTES: usize = 32;

unsafe extern "C" {
    /// Linker symbols: begin of the code, initial values of variables in flash, and the variables.
    static __stext: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// Version and build, such as `0.1.0+89abcdef`. Called once; takes a few milliseconds.
///
/// The build is the CRC-32 of code, constants and initial values in flash, so nobody has to maintain a
/// number. The host computes the same from an ELF file.
pub fn firmware() -> &'static str {
    static PLACE: StaticCell<String<MOST_BYTES>> = StaticCell::new();
    let name = PLACE.init(String::new());
    // A longer name would be truncated, which is no reason not to start.
    let _ = write!(name, "{}+{:08x}", env!("CARGO_PKG_VERSION"), service::crc32(flash()));
    name
}

fn flash() -> &'static [u8] {
    let from = &raw const __stext;
    let data = (&raw const __edata) as usize - (&raw const __sdata) as usize;
    let len = (&raw const __sidata) as usize + data - from as usize;
    // SAFETY: everything from the begin of the code to the end of the initial values is flash, which
    // nothing writes to.
    unsafe { core::slice::from_raw_parts(from, len) }
}
