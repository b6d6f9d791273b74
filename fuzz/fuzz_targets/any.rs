//! The target that `CATHFORCE_FUZZ` names, under libFuzzer.

#![no_main]

use std::sync::OnceLock;

use cathforce_fuzz::{TARGETS, Target, named};
use libfuzzer_sys::fuzz_target;

fn target() -> &'static Target {
    static TARGET: OnceLock<&Target> = OnceLock::new();
    TARGET.get_or_init(|| {
        let name = std::env::var("CATHFORCE_FUZZ").unwrap_or_default();
        named(&name).unwrap_or_else(|| {
            let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
            eprintln!("CATHFORCE_FUZZ names no target: give one of {}", names.join(", "));
            std::process::exit(2);
        })
    })
}

fuzz_target!(|data: &[u8]| (target().run)(data));
