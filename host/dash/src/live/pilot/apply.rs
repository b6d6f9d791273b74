//! Settings are sent, and read back.

use std::ops::ControlFlow;

use cathforce_bus::service::crc32;
use cathforce_config::image::{HEADER_BYTES, decode_head, head_end};
use cathforce_link::{Client, ClientError};
use serde_json::{Value, json};

use super::in_use::InUse;
use crate::live::bus::Bus;
use crate::settings;

/// Sends an image with other settings, and reads back what the device uses then.
pub(super) fn apply(
    client: &mut Client<&mut Bus>,
    in_use: &InUse,
    changes: &settings::Changes,
    lock_step: bool,
) -> Result<Value, String> {
    let image = in_use.get().ok_or("the device has no configuration, so nothing can be changed")?;
    let changed = settings::change(&image, changes)?;
    let said = |error: ClientError| error.to_string();
    client.upload_image(&changed.image, |_| ControlFlow::Continue(())).map_err(said)?;
    let front = client.read_image(|read| head_end(read).unwrap_or(HEADER_BYTES)).map_err(said)?;
    let [sent, used] = [decode_head(&changed.image), decode_head(&front)];
    let used = used.map_err(|error| format!("what the device uses cannot be read: {error}"))?;
    let crc = client.status().map_err(said)?.image_crc32;
    if sent.as_ref() != Ok(&used) || crc != crc32(&changed.image) {
        return Err("the device does not read back what it was sent; apply it again".into());
    }
    client.link_mut().gather.image(&changed.image, lock_step);
    in_use.set(changed.image);
    Ok(json!({
        "applied": changes.len(),
        "verified": true,
        "band_dropped": changed.band_dropped,
        "settings": settings::list(&used),
    }))
}
