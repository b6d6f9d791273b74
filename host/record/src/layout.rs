//! Names and schemas inside a recording, shared by writer and reader.

/// Raw frames in bus order; the message's sequence number is the frame's.
pub(crate) const FRAMES_TOPIC: &str = "/can/frames";
/// Encoding of the messages on [`FRAMES_TOPIC`].
pub(crate) const FRAMES_ENCODING: &str = "cathforce.can-frame/1";
/// What that encoding is, for whoever opens the file without this crate.
pub(crate) const FRAMES_LAYOUT: &str = "u8 direction (0 to the device, 1 to the host), \
     u8 length, u16 identifier, 8 data bytes; little endian; identifiers: cathforce.dbc";

/// Rows of the trial that was played.
pub(crate) const MEASURED_TOPIC: &str = "/measured";
pub(crate) const MEASURED_SCHEMA: (&str, &str) =
    ("cathforce.Measured", include_str!("measured.schema.json"));

/// One message a tick, decoded from the device's frames.
pub(crate) const ESTIMATE_TOPIC: &str = "/estimate";
pub(crate) const ESTIMATE_SCHEMA: (&str, &str) =
    ("cathforce.Estimate", include_str!("estimate.schema.json"));

/// One message for every pass of the device over its nodes.
pub(crate) const NODES_TOPIC: &str = "/nodes";
pub(crate) const NODES_SCHEMA: (&str, &str) =
    ("cathforce.Nodes", include_str!("nodes.schema.json"));

/// Metadata record with [`crate::RunInfo`].
pub(crate) const INFO: &str = "cathforce";

/// Metadata record with [`crate::RunResult`], at the end of a run that came to its end.
pub(crate) const RESULT: &str = "cathforce.result";

/// Attachments.
pub(crate) const IMAGE: &str = "device.cfim";
pub(crate) const RIG: &str = "rig.toml";
pub(crate) const DBC: &str = "cathforce.dbc";
