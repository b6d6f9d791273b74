//! Errors of an image as the bus carries them: byte offset, reason and field.

use cathforce_bus::service::Refusal;
use cathforce_config::{ImageError, SettingError, image::HEADER_BYTES};
use cathforce_mechanics::{DescriptionError, LumenError};

pub(crate) fn refusal(error: ImageError) -> Refusal<'static> {
    let (offset, reason, field) = match error {
        ImageError::TooShort { found } => (found, "shorter than its header", ""),
        ImageError::Magic { .. } => (0, "does not begin with CFIM", ""),
        ImageError::Version { .. } => (4, "a format version that this firmware does not know", ""),
        ImageError::Schema { .. } => (6, "made for another version of this firmware", ""),
        ImageError::Length { .. } => (10, "is not as long as it says", ""),
        ImageError::HeadLength { .. } => (14, "its head is longer than itself", ""),
        ImageError::Crc { .. } => (18, "its check does not fit its bytes", ""),
        ImageError::Postcard => (HEADER_BYTES, "its head cannot be read", ""),
        ImageError::TrailingBytes { offset } => (offset, "its head goes on past its end", ""),
        ImageError::Padding { offset } => (offset, "padding that is not zero", ""),
        ImageError::Description(error) => {
            let (reason, field) = match error {
                DescriptionError::Range(field) => ("out of range", field),
                DescriptionError::NoSections => ("no section", "instrument.sections"),
                DescriptionError::EntryFrame => ("not orthonormal", "entry.direction, entry.up"),
            };
            (HEADER_BYTES, reason, field)
        }
        ImageError::Tick => (HEADER_BYTES, "not the tick of the device", "solver.tick_s"),
        ImageError::Overlong(_) => {
            (HEADER_BYTES, "a tick would take too long", "solver.solves, solver.substeps")
        }
        ImageError::Lumen { offset, error } => match error {
            LumenError::Header(field) => (HEADER_BYTES, "lumen out of range", field),
            LumenError::Length { .. } => (offset, "lumen not as long as its header says", ""),
            LumenError::Directory { entry, .. } => {
                (offset.saturating_add(2 * entry), "lumen names a brick that is not stored", "")
            }
        },
        ImageError::Master(error) => (HEADER_BYTES, error.text(), "master"),
        ImageError::Band(field) => (HEADER_BYTES, "band out of range", field),
        ImageError::Setting(error) => {
            let reason = match error {
                SettingError::Unknown => "unknown setting",
                SettingError::NotFinite(_) => "not finite",
                SettingError::Range(_) => "out of range",
                SettingError::NotWhole(_) => "not a whole number",
                SettingError::RampTooSlow(_) => "ramp to zero would take too long",
            };
            (HEADER_BYTES, reason, error.name().unwrap_or(""))
        }
    };
    Refusal::Image { offset: u32::try_from(offset).unwrap_or(u32::MAX), reason, field }
}
