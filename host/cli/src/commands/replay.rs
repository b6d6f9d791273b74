//! `cathforce replay`.

use cathforce_recording::{ReplayReport, replay};

use crate::args::ReplayArguments;
pub use crate::difference::difference;
use crate::failure::Failure;
use crate::open::open_recording;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &ReplayArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let recording = open_recording(ui, &arguments.recording)?;
    let (report, _) = replay(&recording)?;
    arguments.json_file.write(ui, &report, text(&report))?;
    if report.identical() { Ok(()) } else { Err(difference(&report, &recording.info)) }
}

fn text(report: &ReplayReport) -> String {
    let device = report.device_digest.map_or("not recorded".into(), |d| format!("{d:08x}"));
    let mut rows = vec![
        ("ticks replayed", report.ticks.to_string()),
        ("frames compared", report.frames_compared.to_string()),
        ("differing bits", report.differing_bits.to_string()),
        ("digest of all outputs, host", format!("{:08x}", report.digest)),
        ("digest of all outputs, device", device),
    ];
    if report.missing_frames + report.extra_frames > 0 {
        rows.push(("frames only on the host", report.missing_frames.to_string()));
        rows.push(("frames only in the recording", report.extra_frames.to_string()));
    }
    let rows = rows.into_iter().map(|(label, value)| (label.to_owned(), value));
    two_columns(&rows.collect::<Vec<_>>())
}
