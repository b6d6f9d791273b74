//! The settings in a device image, and images with other settings.

use std::collections::BTreeMap;

use cathforce_bundle::tips::Tip;
use cathforce_config::image::{self, HEADER_BYTES, Header, ImageError, decode_head};
use cathforce_config::{ImageHead, Key, keys};
use serde_json::{Value, json};

/// Every number of an image that can be set, with what is known of it.
pub fn list(head: &ImageHead) -> Value {
    let entry = |key: Key| {
        let value = key.value(&head.description, &head.settings)?;
        let default = key.default();
        let [min, max] = key.range();
        let is_effect = matches!(key, Key::Parameter(_)) && default.is_some();
        Some(json!({
            "name": key.name(),
            "group": match key {
                Key::Setting(_) => "control",
                Key::Parameter(_) if is_effect => "effects",
                Key::Parameter(_) => "rig",
            },
            "unit": key.unit(),
            "text": key.doc(),
            "min": min,
            "max": max,
            "whole": key.is_whole(),
            "default": default,
            "value": value,
            // Compared by bits, because the device computes with bits.
            "modified": default.is_some_and(|default| default.to_bits() != value.to_bits()),
        }))
    };
    keys().filter_map(entry).collect()
}

/// An image with other settings.
#[derive(Debug)]
pub struct Changed {
    pub image: Vec<u8>,
    /// The image had a band, which belongs to the model before the change.
    pub band_dropped: bool,
}

/// What is changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// By name.
    pub settings: BTreeMap<String, f32>,
    /// Name of the catheter's tip.
    pub tip: Option<String>,
}

impl Changes {
    /// Number of what is changed.
    pub fn len(&self) -> usize {
        self.settings.len() + usize::from(self.tip.is_some())
    }
}

/// Changes settings of an image; `Err` names the setting and says what is wrong. Nothing is half changed.
pub fn change(image: &[u8], changes: &Changes) -> Result<Changed, String> {
    let unreadable = |error: ImageError| format!("the device's image cannot be read: {error}");
    let mut head = decode_head(image).map_err(unreadable)?;
    let mut changes_model = false;
    if let Some(name) = &changes.tip {
        let tip = Tip::find(name).ok_or_else(|| format!("there is no tip `{name}`"))?;
        head.description.instrument.precurve = tip.precurve().collect();
        changes_model = true;
    }
    for (name, &value) in &changes.settings {
        let key = Key::find(name).ok_or_else(|| format!("there is no setting `{name}`"))?;
        let [min, max] = key.range();
        let unit = Some(key.unit()).filter(|unit| *unit != "1");
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        let refused = || {
            let whole = if key.is_whole() { "a whole number " } else { "" };
            format!("{name} = {value} is refused: it must be {whole}from {min} to {max}{unit}")
        };
        key.check(value).map_err(|_| refused())?;
        match key {
            Key::Setting(info) => head.settings.set(info.name, value).map_err(|_| refused())?,
            Key::Parameter(info) => {
                head.description.set_parameter(info.key, value).map_err(|_| refused())?;
                changes_model = true;
            }
        }
    }
    let band_dropped = changes_model && head.band.take().is_some();
    let head_bytes = Header::read(image).map_err(unreadable)?.head_bytes as usize;
    let lumen = image.get((HEADER_BYTES + head_bytes).next_multiple_of(4)..).unwrap_or_default();
    let refused = |error: image::EncodeError| format!("the device would refuse these: {error}");
    let mut changed = vec![0; image::encoded_len(&head, lumen).map_err(refused)?];
    image::encode(&head, lumen, &mut changed).map_err(refused)?;
    Ok(Changed { image: changed, band_dropped })
}
