//! Every target takes its seeds and a fixed number of changed ones.
//!
//! `CATHFORCE_EXECUTIONS=100000` tries so many of each target; `cargo xtask fuzz` searches by coverage.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use cathforce_fuzz::{TARGETS, Target, changed, named, seeds_folder};

fn seeds(target: &Target) -> Vec<Vec<u8>> {
    let folder = seeds_folder(target.name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{} has no seed", folder.display());
    files.iter().map(|file| fs::read(file).unwrap()).collect()
}

/// Runs the target; on a panic the input is kept for the one who mends it.
fn try_one(target: &Target, input: &[u8], what: &str) {
    let outcome = catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
    if outcome.is_err() {
        let file = std::env::temp_dir().join(format!("cathforce-fuzz-{}-{what}", target.name));
        fs::write(&file, input).unwrap();
        panic!(
            "the target `{}` panics; its input is {}. Put it into {} once it is mended",
            target.name,
            file.display(),
            seeds_folder(target.name).display()
        );
    }
}

fn check(name: &str) {
    let target = named(name).unwrap();
    let seeds = seeds(target);
    for (number, seed) in seeds.iter().enumerate() {
        try_one(target, seed, &format!("seed-{number}"));
    }
    let asked = std::env::var("CATHFORCE_EXECUTIONS").ok().and_then(|text| text.parse().ok());
    for nth in 0..asked.unwrap_or(target.in_suite) {
        try_one(target, &changed(&seeds, nth), &nth.to_string());
    }
}

macro_rules! targets {
    ($( $function:ident: $name:literal, )+) => {
        const TESTED: &[&str] = &[$( $name ),+];
        $(
            #[test]
            fn $function() {
                check($name);
            }
        )+
    };
}

// A test each, so that they run side by side.
targets! {
    frames_of_the_bus: "frames",
    text_of_an_slcan_adapter: "slcan",
    messages_of_the_service: "service",
    frames_of_a_master: "master",
    device_images: "image",
    the_control_step: "step",
    the_store_in_flash: "store",
    logs_of_a_can_bus: "can-log",
    logs_of_a_force_sensor: "force-log",
    bags_of_ros: "bag",
    tables_of_measurements: "table",
    tables_that_are_filtered: "filter",
    surfaces_and_lines: "mesh",
    the_vessel_of_a_bundle: "stl",
    the_centre_line_of_a_bundle: "centreline",
    a_lumen_of_a_centre_line: "lumen",
    the_rig_of_a_bundle: "rig",
    names_of_columns: "column",
    recordings: "recording",
    descriptions_of_experiments: "identify",
    firmware_files: "firmware",
}

#[test]
fn every_target_is_tested_and_no_seed_has_none() {
    assert_eq!(TESTED, TARGETS.each_ref().map(|target| target.name));
    for entry in fs::read_dir(seeds_folder("")).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        assert!(named(&name).is_some(), "fuzz/seeds/{name} belongs to no target");
    }
}
