//! `cathforce config save` without a file: the device keeps its image in its flash.

use cathforce_bus::service::SavedState;
use cathforce_link::Client;
use serde_json::json;

use super::show::NOT_CONFIGURED;
use crate::failure::{Code, Failure};
use crate::session::{output_is_on, still_on};
use crate::ui::Ui;

/// Lets the device save what it uses, and checks that it says so.
pub fn save(ui: &Ui, link: &str) -> Result<(), Failure> {
    let device_failure = |message: String| Failure::new(Code::Device, message);
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let used = client.status()?.image_crc32;
    if used == 0 {
        return Err(device_failure(NOT_CONFIGURED.into()));
    }
    if let Some(mode) = output_is_on(&client) {
        return Err(device_failure(still_on(mode, link)));
    }
    let Some(before) = client.saved()? else {
        let message = format!(
            "the device ({}) cannot save anything\n  fix: send it its configuration after each start \
             with `cathforce config apply`",
            client.device()
        );
        return Err(device_failure(message));
    };
    client.save_image()?;
    let saved = client.saved()?.filter(|saved| saved.state == SavedState::Good);
    if saved.is_none_or(|saved| saved.image_crc32 != used) {
        let message = "the device does not say that it has saved its image\n  fix: save it again; if that \
                       does not help, check the device's flash";
        return Err(device_failure(message.into()));
    }
    let was = match before.image_crc32 {
        0 => "nothing was saved before".to_owned(),
        crc if crc == used => "the same was saved before".to_owned(),
        crc => format!("before, it was the one of CRC {crc:08x}"),
    };
    let json = json!({ "image_crc32": format!("{used:08x}"), "saved": true });
    ui.data(&json, format!("saved: the device boots with its image of CRC {used:08x}; {was}\n"))
}
