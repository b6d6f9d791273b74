//! Decodes frames into quantities, and publishes these as messages for other tools.

pub(crate) mod live;
pub(crate) mod tick;
pub(crate) mod topics;
