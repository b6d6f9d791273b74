//! Tells a settings file from other files.

use toml::de::DeTable;

/// The keys that a settings file may have at its top.
pub const TOP: [&str; 5] = ["schema_version", "rig", "set", "master", "band"];

/// Whether a text is a settings file, right or wrong: it has keys of one, and no others.
pub fn is_settings(text: &str) -> bool {
    DeTable::parse(text).is_ok_and(|table| {
        let keys = table.get_ref().keys();
        let mut known = keys.map(|key| TOP.contains(&key.get_ref().as_ref())).peekable();
        known.peek().is_some() && known.all(|known| known)
    })
}
