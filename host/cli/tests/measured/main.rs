//! Commands on what was measured: `cathforce filter` and `cathforce calibrate`.

mod calibrate;
mod filter;
#[path = "../support/mod.rs"]
mod support;
