//! Recordings begin and end, between two ticks.

use cathforce_link::{Client, ClientError};
use cathforce_recording::RunResult;
use serde_json::Value;

use super::in_use::InUse;
use crate::live::bus::Bus;
use crate::live::record::NewRecording;

/// Begins or ends a recording; gives its file and length, or says why not.
pub(super) fn record(
    client: &mut Client<&mut Bus>,
    in_use: &InUse,
    new: Option<&NewRecording>,
    on: bool,
) -> Result<Value, String> {
    if !on {
        // A device that does not answer leaves a recording without its own figures.
        let said = said(client).ok();
        return client.link_mut().gather.end_recording(said);
    }
    let new = new.ok_or("this program was started without a place for recordings")?;
    let image = in_use.get().ok_or("the device has no configuration, so nothing is recorded")?;
    client.link_mut().gather.begin_recording(new, &image)
}

/// What the device says of itself. The recording knows its own time.
fn said(client: &mut Client<&mut Bus>) -> Result<RunResult, ClientError> {
    Ok(RunResult::of(&client.status()?, 0))
}
