//! The values of every key in an image and on a device, and how two sets of them differ.

use std::collections::BTreeMap;

use cathforce_config::image::{HEADER_BYTES, decode_head, head_end};
use cathforce_config::{ImageHead, Key, keys};
use cathforce_link::{Client, ClientError};
use serde::Serialize;

use crate::failure::{Code, Failure};
use crate::settings::model::numbers;
use crate::settings::units::unit;

/// Every key with its value.
pub type Values = BTreeMap<&'static str, f32>;

/// The values in an image.
pub fn values(head: &ImageHead) -> Values {
    let value = |key: Key| Some((key.name(), key.value(&head.description, &head.settings)?));
    keys().filter_map(value).collect()
}

/// The default values; names that rig.toml states have none.
pub fn defaults() -> Values {
    keys().filter_map(|key| Some((key.name(), key.default()?))).collect()
}

/// The head of an image that was just built.
pub fn head_of(image: &[u8]) -> Result<ImageHead, Failure> {
    decode_head(image).map_err(Failure::input)
}

/// The head of the image that a device uses, read back from it; `None` while the device has no image.
pub fn head_on(client: &mut Client) -> Result<Option<ImageHead>, Failure> {
    let front = match client.read_image(|read| head_end(read).unwrap_or(HEADER_BYTES)) {
        Ok(front) => front,
        Err(ClientError::Refused { .. }) if client.status()?.image_crc32 == 0 => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let head = decode_head(&front).map_err(|error| {
        Failure::new(Code::Device, format!("the image on the device cannot be read: {error}"))
    })?;
    Ok(Some(head))
}

/// A value that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    pub name: &'static str,
    /// `None` where there was no value.
    pub old: Option<f32>,
    pub new: Option<f32>,
    pub unit: &'static str,
}

impl Change {
    pub fn text(&self) -> String {
        let key = Key::find(self.name);
        let number =
            |value: Option<f32>| value.map_or("none".to_owned(), |value| value.to_string());
        let unit = key.map_or(String::new(), unit);
        format!("{}: {} -> {}{unit}", self.name, number(self.old), number(self.new))
    }
}

/// What differs, in the order of the keys.
pub fn changes(old: &Values, new: &Values) -> Vec<Change> {
    let change = |key: Key| {
        let (name, unit) = (key.name(), key.unit());
        let (old, new) = (old.get(name).copied(), new.get(name).copied());
        // Compared by bits, because the device computes with bits.
        (old.map(f32::to_bits) != new.map(f32::to_bits)).then_some(Change { name, old, new, unit })
    };
    keys().filter_map(change).collect()
}

/// Every number of an image's head by its path, such as `entry.position_m.0`.
pub fn paths(head: &ImageHead) -> BTreeMap<String, String> {
    // The names of the description are those of rig.toml and of the keys.
    let alone = |(path, value): (String, String)| {
        (path.strip_prefix("description.").unwrap_or(&path).to_owned(), value)
    };
    numbers("", head).into_iter().map(alone).collect()
}
