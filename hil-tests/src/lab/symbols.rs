//! Where the firmware's functions and variables are.

use std::path::Path;

use object::{Object as _, ObjectSymbol as _};

/// The symbols of an ELF.
pub struct Symbols(Vec<(String, u32)>);

impl Symbols {
    pub fn of(elf: &Path) -> Self {
        let bytes = std::fs::read(elf).unwrap_or_else(|e| panic!("{}: {e}", elf.display()));
        let file =
            object::File::parse(&*bytes).unwrap_or_else(|e| panic!("{}: {e}", elf.display()));
        // Names with a dollar sign mark code and data within a function.
        let symbols = file.symbols().filter_map(|symbol| {
            if symbol.name().is_ok_and(|name| name.is_empty() || name.starts_with('$')) {
                return None;
            }
            let name = rustc_demangle::demangle(symbol.name().ok()?).to_string();
            Some((name, symbol.address() as u32))
        });
        Self(symbols.collect())
    }

    /// Where the next symbol after an address is.
    pub fn after(&self, at: u32) -> u32 {
        let next = self.0.iter().map(|(_, other)| other & !1).filter(|&other| other > at).min();
        next.unwrap_or_else(|| panic!("nothing is behind {at:08x}"))
    }

    /// Address of the only symbol with this path, as `device::CORE` or `Reset`; of a function, without the
    /// bit that says that it is Thumb code.
    pub fn address(&self, path: &str) -> u32 {
        // A demangled name ends in `::h` and a hash; the optimiser may have added a suffix.
        let is_it = |name: &str| {
            let name = name.split(" (").next().unwrap_or(name);
            let name = name.rsplit_once("::h").map_or(name, |(name, _)| name);
            name == path || name.ends_with(&format!("::{path}"))
        };
        let found: Vec<u32> =
            self.0.iter().filter(|(name, _)| is_it(name)).map(|(_, at)| *at).collect();
        match found[..] {
            [at] => at & !1,
            ref many => panic!("{} symbols are named {path}", many.len()),
        }
    }
}
