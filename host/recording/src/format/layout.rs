//! Names inside a recording, shared by writer and reader.

/// MCAP profile: topics carry ROS 2 messages.
pub(crate) const PROFILE: &str = "ros2";
pub(crate) const SCHEMA_ENCODING: &str = "ros2msg";
pub(crate) const MESSAGE_ENCODING: &str = "cdr";

/// Frames to the device. The sequence number of a message is that of the frame on the bus,
/// counted over both directions.
pub(crate) const TO_DEVICE: &str = "/cathforce/to_can_bus";
/// Frames from the device.
pub(crate) const TO_HOST: &str = "/cathforce/from_can_bus";
/// Rows of the trial that was played.
pub(crate) const MEASURED: &str = "/cathforce/measured";
/// Frames that are missing.
pub(crate) const DROPOUTS: &str = "/cathforce/dropouts";

// For other tools, never read back.
pub(crate) const STATUS: &str = "/cathforce/status";
pub(crate) const DRIVE: &str = "/catheter/measured_js";
pub(crate) const DRIVE_LOAD: &str = "/catheter/estimated/measured_js";
pub(crate) const FORCE: &str = "/catheter/estimated/spatial/measured_cf";
pub(crate) const SHAPE: &str = "/catheter/estimated/shape";
pub(crate) const STATE: &str = "/catheter/operating_state";
pub(crate) const WIRE: &str = "/guidewire/measured_js";
pub(crate) const WIRE_LOAD: &str = "/guidewire/estimated/measured_js";
pub(crate) const TENDONS: &str = "/tendons/measured_js";
pub(crate) const OPERATOR: &str = "/operator/servo_cf";
pub(crate) const SENSOR: &str = "/phantom/spatial/measured_cf";
pub(crate) const TRANSFORMS: &str = "/tf_static";

/// Metadata record with [`crate::RunInfo`].
pub(crate) const INFO: &str = "cathforce";

/// Metadata record with [`crate::RunResult`], written when a run ends.
pub(crate) const RESULT: &str = "cathforce.result";

/// Attachments.
pub(crate) const IMAGE: &str = "device.cfim";
pub(crate) const LUMEN: &str = "lumen.bin";
pub(crate) const RIG: &str = "rig.toml";
pub(crate) const DBC: &str = "cathforce.dbc";
/// Attachments that describe the vessel, with their names in a trial bundle.
pub const VESSEL_FILES: [&str; 2] = ["vessel.stl", "centreline.csv"];
