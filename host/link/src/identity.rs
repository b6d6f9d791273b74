//! What a firmware file says of itself: for which board it is, and which messages and images it takes.
//!
//! `cargo xtask dist` writes it into a section of the ELF that is not loaded. It is text, one
//! `key=value` a line, so that `readelf -p .cathforce` shows it.

use std::path::Path;

use object::read::elf::ElfFile32;
use object::{Endianness, Object as _, ObjectSection as _};

use crate::build::build_in;

/// Name of the section.
pub const SECTION: &str = ".cathforce";
/// A longer section is none of ours.
const MOST_BYTES: u64 = 4096;

/// What a firmware file says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Name of the board, as the device reports it.
    pub board: String,
    /// Version of the firmware.
    pub version: String,
    /// Build of the firmware, as the device reports it after a `+`.
    pub build: String,
    /// Hash of its messages and frames.
    pub protocol_hash: u64,
    /// Hash of the schema of the device images that it reads.
    pub image_schema_hash: u32,
}

/// Why a file cannot be flashed.
#[derive(Debug, thiserror::Error)]
pub enum IdentityError {
    #[error("cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
    #[error("not an ELF file for a 32-bit processor")]
    NotElf,
    #[error("it has no section {SECTION}, which says for which board a firmware is")]
    Anonymous,
    #[error("its section {SECTION} is damaged: {0}")]
    Malformed(String),
    #[error("it says that it is build {stated}, and its code is build {found}: it was changed")]
    Changed { stated: String, found: String },
}

impl Identity {
    /// What the file says, compared with the code in it.
    pub fn of_elf(path: &Path) -> Result<Self, IdentityError> {
        Self::of_bytes(&std::fs::read(path)?)
    }

    /// The same, of the file's contents.
    pub fn of_bytes(bytes: &[u8]) -> Result<Self, IdentityError> {
        let file = ElfFile32::<Endianness>::parse(bytes).map_err(|_| IdentityError::NotElf)?;
        let section = file.section_by_name(SECTION).ok_or(IdentityError::Anonymous)?;
        let malformed = |why: &str| IdentityError::Malformed(why.into());
        if section.size() > MOST_BYTES {
            return Err(malformed("it is too long"));
        }
        let text = section.data().map_err(|error| malformed(&error.to_string()))?;
        let text = std::str::from_utf8(text).map_err(|_| malformed("it is not text"))?;
        let identity = Self::parse(text)?;
        let found = build_in(bytes).ok_or(IdentityError::NotElf)?;
        match found == identity.build {
            true => Ok(identity),
            false => Err(IdentityError::Changed { stated: identity.build, found }),
        }
    }

    fn parse(text: &str) -> Result<Self, IdentityError> {
        let value = |key: &str| {
            let mut pairs = text.lines().filter_map(|line| line.split_once('='));
            let found = pairs.find(|(name, value)| *name == key && !value.is_empty());
            let missing = || IdentityError::Malformed(format!("it has no `{key}`"));
            found.map(|(_, value)| value.to_owned()).ok_or_else(missing)
        };
        let wrong = |key: &str| IdentityError::Malformed(format!("`{key}` is no hash"));
        Ok(Self {
            board: value("board")?,
            version: value("version")?,
            build: value("build")?,
            protocol_hash: u64::from_str_radix(&value("protocol")?, 16)
                .map_err(|_| wrong("protocol"))?,
            image_schema_hash: u32::from_str_radix(&value("image-schema")?, 16)
                .map_err(|_| wrong("image-schema"))?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "board=mps2-an500\nversion=0.1.0\nbuild=0123abcd\n\
                        protocol=0123456789abcdef\nimage-schema=89abcdef\n";

    #[test]
    fn each_line_is_needed_and_read() {
        let identity = Identity::parse(TEXT).unwrap();
        assert_eq!(identity.board, "mps2-an500");
        assert_eq!((identity.version.as_str(), identity.build.as_str()), ("0.1.0", "0123abcd"));
        assert_eq!(identity.protocol_hash, 0x0123_4567_89ab_cdef);
        assert_eq!(identity.image_schema_hash, 0x89ab_cdef);
        for line in TEXT.lines() {
            let key = line.split('=').next().unwrap();
            let error = Identity::parse(&TEXT.replace(line, "")).unwrap_err().to_string();
            assert!(error.contains(&format!("`{key}`")), "{key}: {error}");
        }
        let error =
            Identity::parse(&TEXT.replace("=89abcdef\n", "=far\n")).unwrap_err().to_string();
        assert!(error.contains("`image-schema` is no hash"), "{error}");
    }

    #[test]
    fn a_file_that_is_no_firmware_is_named_as_such() {
        let own = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert!(matches!(Identity::of_bytes(&own), Err(IdentityError::NotElf)));
        assert!(matches!(Identity::of_bytes(b""), Err(IdentityError::NotElf)));
    }
}
