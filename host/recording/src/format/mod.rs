//! What a recording holds: names, messages, frames, rows and where it comes from.

pub(crate) mod clock;
pub(crate) mod dropout;
pub(crate) mod frame;
pub(crate) mod info;
pub(crate) mod layout;
pub(crate) mod messages;
pub(crate) mod trial;
