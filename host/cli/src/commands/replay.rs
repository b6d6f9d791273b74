//! `cathforce replay`.

use cathforce_link::qemu::find_firmware;
use cathforce_link::{build_of, version_and_build};
use cathforce_recording::{ReplayReport, RunInfo, replay};

use super::import::CANDUMP;
use crate::args::ReplayArguments;
use crate::failure::{Code, Failure};
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &ReplayArguments) -> Result<(), Failure> {
    let recording = super::open_recording(ui, &arguments.recording)?;
    let (report, _) = replay(&recording)?;
    ui.data(&report, text(&report))?;
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

/// Device and host do not agree.
pub fn difference(report: &ReplayReport, info: &RunInfo) -> Failure {
    let message = match &report.first_difference {
        Some(first) => format!(
            "device and host differ in {} bits, first in tick {}: {}: recorded {}, replayed {}",
            report.differing_bits, first.tick, first.field, first.recorded, first.replayed
        ),
        None if report.frames_compared == 0 => {
            "the recording has no tick, so nothing was compared".to_owned()
        }
        None if report.missing_frames + report.extra_frames > 0 => format!(
            "device and host sent different numbers of frames: {} only on the host, {} only in \
             the recording",
            report.missing_frames, report.extra_frames
        ),
        None => format!(
            "every frame agrees, but not the digest over all outputs: device {:08x}, host {:08x}",
            report.device_digest.unwrap_or_default(),
            report.digest
        ),
    };
    Failure::new(Code::Failed, message + &firmware(info))
}

/// Whose fault a difference may be: of a firmware that is not built from what replays it, or of an
/// image that is not the device's.
fn firmware(info: &RunInfo) -> String {
    let recorded = &info.firmware_version;
    if info.link == CANDUMP {
        return "\n  fix: its image was made when the log was imported, of a bundle and settings that \
                nobody compared with the device: import it again with the --bundle, --settings, \
                --set and --cell with which the device ran"
            .to_owned();
    }
    let (version, build) = version_and_build(recorded);
    let host = env!("CARGO_PKG_VERSION");
    let here = find_firmware(None).ok().and_then(|elf| build_of(&elf));
    match (build, here) {
        _ if version != host => format!(
            "\n  fix: the device ran firmware {recorded}, this program is {host}: replay with the \
             program of the same version"
        ),
        (Some(build), Some(here)) if build != here => format!(
            "\n  fix: the device ran {recorded}, the firmware built here is +{here}: replay with \
             the program that was built beside it"
        ),
        _ => String::new(),
    }
}
