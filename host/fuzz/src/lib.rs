//! What takes bytes from outside, each as a function of bytes.
//!
//! A target must not panic, overflow, loop for ever or fill the memory, whatever it is given; and what it
//! accepts must keep the promise that stands in its code. Three things drive the targets:
//!
//! * the suite, with the seeds of `fuzz/seeds` and a fixed number of changed ones ([`changed`]),
//! * `cargo xtask fuzz`, which builds `fuzz/` for libFuzzer and lets it search by coverage,
//! * `cargo fuzz run any` in `fuzz/`, with the target's name in `CATHFORCE_FUZZ`.

#![forbid(unsafe_code)]

mod bus;
mod change;
mod device;
mod files;
mod store;

use std::path::PathBuf;

pub use change::changed;

/// Something that takes bytes from outside.
pub struct Target {
    pub name: &'static str,
    /// What the bytes are.
    pub about: &'static str,
    pub run: fn(&[u8]),
    /// Changed seeds that the suite tries. A target that takes milliseconds has fewer.
    pub in_suite: u64,
}

/// All of them: first what the device takes, then the files.
pub static TARGETS: [Target; 21] = [
    target("frames", "frames of the bus", bus::frames, 40_000),
    target("slcan", "text of an SLCAN adapter", bus::slcan, 40_000),
    target("service", "messages of the service, in an envelope that is right", bus::service, 4_000),
    target("master", "frames of a master's own layout", bus::master, 40_000),
    target("image", "a device image, whose checksum is put right", device::image, 3_000),
    target("step", "protected frames and ticks of the control step", device::step, 400),
    target("store", "a flash, and an image that is saved in it", store::store, 20_000),
    target("can-log", "a log of a CAN bus, in any of its formats", files::can_log, 20_000),
    target("force-log", "a log of a force sensor", files::force_log, 20_000),
    target("bag", "a bag of ROS 2: MCAP or SQLite", files::bag, 4_000),
    target("table", "a table of measurements", files::table, 20_000),
    target("filter", "a table that is filtered", files::filter, 20_000),
    target("mesh", "a surface or a line: VTP, VTU, OBJ, PLY, STL, markups", files::mesh, 20_000),
    target("stl", "the vessel of a bundle", files::stl, 10_000),
    target("centreline", "the centre line of a bundle", files::centreline, 20_000),
    target("lumen", "a centre line of which a lumen is built", files::lumen, 300),
    target("rig", "the rig.toml of a bundle", files::rig, 10_000),
    target("column", "how the columns of a table are named", files::column, 40_000),
    target("recording", "a recording", files::recording, 4_000),
    target("identify", "the description of a steerable catheter", files::identify, 10_000),
    target("firmware", "a firmware that is to be flashed", files::firmware, 20_000),
];

const fn target(name: &'static str, about: &'static str, run: fn(&[u8]), in_suite: u64) -> Target {
    Target { name, about, run, in_suite }
}

/// The target of this name.
pub fn named(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Where the seeds of a target lie.
pub fn seeds_folder(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds")).join(name)
}
