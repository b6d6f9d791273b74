//! `cathforce demo`: a 10 s insertion on the emulated board, from nothing but this program, its firmware
//! and QEMU.

use std::path::Path;

use cathforce_recording::make_folder;

use super::bundle::check_folder;
use super::{export, report, run};
use crate::args::{Changes, DemoArguments, ExportArguments, Feel, PlayArguments, ReportArguments};
use crate::failure::Failure;
use crate::ui::Ui;

/// The bundle of the demo, which is a part of this program, so that it runs wherever it is.
const NAME: &str = "tapered-none";
macro_rules! files {
    ($( $name:literal ),+) => {
        [$( ($name, include_bytes!(concat!("../../../../examples/tapered-none/", $name)) as &[u8]) ),+]
    };
}
const FILES: [(&str, &[u8]); 5] =
    files!["README.md", "rig.toml", "vessel.stl", "centreline.csv", "trials/001.csv"];
/// The bundle's first trial is shorter than 10 s.
const TRIAL: u32 = 1;
const SECONDS: f64 = 10.0;

pub fn run(ui: &Ui, arguments: &DemoArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    if !(arguments.overwrite && out.is_dir()) {
        check_folder(out)?;
    }
    std::fs::create_dir_all(out).map_err(|e| Failure::write(out, e))?;
    let bundle = out.join(NAME);
    if !bundle.is_dir() {
        write_bundle(&bundle)?;
    }
    ui.say(format_args!(
        "{} is inserted for {SECONDS} s on `{}`, tick by tick; on the emulator that takes half a minute",
        bundle.display(),
        arguments.link
    ));
    let recording = out.join("run.mcap");
    let play = PlayArguments {
        bundle,
        trial: Some(TRIAL),
        out: Some(recording.clone()),
        overwrite: arguments.overwrite,
        feel: Feel::Catheter,
        duration: Some(SECONDS),
        summary: Some(out.join("summary.json")),
        changes: Changes {
            file: None,
            settings: Vec::new(),
            tip: None,
            guidewire_tip: None,
            cell: None,
        },
        max_error: None,
    };
    let on = run::On::device(&arguments.link);
    run::run_and(ui, on, &play, |_, _| Ok(()))?;
    let export = ExportArguments {
        recording: recording.clone(),
        csv: Some(out.join("ticks.csv")),
        nodes: Some(out.join("nodes.csv")),
        parquet: None,
        candump: None,
        bundle: None,
        overwrite: arguments.overwrite,
    };
    export::write(ui, &export)?;
    let page = out.join("report.html");
    let report =
        ReportArguments { recording, out: Some(page.clone()), overwrite: arguments.overwrite };
    report::write(ui, &report)?;
    ui.say(format_args!(
        "{NAME} was simulated by an independent simulator, not measured on a rig.\nRecording, CSV and \
         page: {}\nOpen {}",
        out.display(),
        page.display()
    ));
    Ok(())
}

fn write_bundle(folder: &Path) -> Result<(), Failure> {
    make_folder(folder, |new| {
        std::fs::create_dir_all(new.join("trials"))?;
        FILES.iter().try_for_each(|(name, bytes)| std::fs::write(new.join(name), bytes))
    })
    .map_err(|e| Failure::write(folder, e))
}
