//! Commands on what was measured: `cathforce filter` and `cathforce calibrate`.

mod calibrate;
mod filter;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../support/mod.rs"]
mod support;
