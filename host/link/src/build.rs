//! The build of a firmware ELF, as a device that runs it reports it.

use std::path::Path;

use cathforce_bus::service::crc32;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader as _};
use object::{Endianness, Object as _, ObjectSymbol as _};

/// Where the hash begins (firmware/src/identity.rs).
const BEGINS: &str = "__stext";
/// Flash ends here on every board; what is loaded above is memory.
const FLASH_END: u64 = 0x2000_0000;

/// The eight digits after the `+` of its version; `None` if it is no firmware that has them.
pub fn build_of(elf: &Path) -> Option<String> {
    build_in(&std::fs::read(elf).ok()?)
}

/// The same, of the file's contents.
pub(crate) fn build_in(elf: &[u8]) -> Option<String> {
    let file = ElfFile32::<Endianness>::parse(elf).ok()?;
    let begins = file.symbols().find(|symbol| symbol.name() == Ok(BEGINS))?.address();
    let flash = flash(&file, begins)?;
    Some(format!("{:08x}", crc32(&flash)))
}

/// The contents of flash from `begins` on; gaps are zero.
fn flash(file: &ElfFile32<'_>, begins: u64) -> Option<Vec<u8>> {
    let endian = file.endian();
    let mut flash = Vec::new();
    for header in file.elf_program_headers() {
        let at = u64::from(header.p_paddr(endian));
        if header.p_type(endian) != PT_LOAD || at >= FLASH_END {
            continue;
        }
        let data = header.data(endian, file.data()).ok()?;
        // A segment may begin before: only the rest of it counts.
        let skipped = usize::try_from(begins.saturating_sub(at)).ok()?.min(data.len());
        let from = usize::try_from((at + skipped as u64).checked_sub(begins)?).ok()?;
        let end = from + data.len() - skipped;
        flash.resize(flash.len().max(end), 0);
        flash[from..end].copy_from_slice(&data[skipped..]);
    }
    (!flash.is_empty()).then_some(flash)
}

/// Splits the version that a device reports, `0.1.0+0123abcd`, into version and build.
pub fn version_and_build(firmware: &str) -> (&str, Option<&str>) {
    firmware.split_once('+').map_or((firmware, None), |(version, build)| (version, Some(build)))
}
