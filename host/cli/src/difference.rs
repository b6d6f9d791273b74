//! Says how a device and its replay on the host differ, and what the likely cause is.

use cathforce_link::qemu::find_firmware;
use cathforce_link::{build_of, version_and_build};
use cathforce_recording::{ReplayReport, RunInfo};

use crate::failure::{Code, Failure};
use crate::run_info::CANDUMP;

/// The failure of a replay in which device and host do not agree.
pub fn difference(report: &ReplayReport, info: &RunInfo) -> Failure {
    let message = match &report.first_difference {
        Some(first) => format!(
            "device and host differ in {} bits, first in tick {}: {}: recorded {}, replayed {}",
            report.differing_bits, first.tick, first.field, first.recorded, first.replayed
        ),
        None if report.frames_compared == 0 => {
            "nothing was compared because the recording has no tick".to_owned()
        }
        None if report.missing_frames + report.extra_frames > 0 => format!(
            "device and host sent different numbers of frames: {} only on the host, {} only in \
             the recording",
            report.missing_frames, report.extra_frames
        ),
        None => format!(
            "every frame agrees, but the digests over all outputs differ: device {:08x}, host {:08x}",
            report.device_digest.unwrap_or_default(),
            report.digest
        ),
    };
    Failure::new(Code::Failed, message + &likely_cause(info))
}

/// A likely cause of a difference: another version of the firmware, or an image that the device did
/// not have. Empty where none is known.
fn likely_cause(info: &RunInfo) -> String {
    let recorded = &info.firmware_version;
    if info.link == CANDUMP {
        return "\n  fix: the image was made when the log was imported, and the device may have had \
                another one; import the log again with the --bundle, --settings, --set and --cell \
                with which the device ran"
            .to_owned();
    }
    let (version, build) = version_and_build(recorded);
    let host = env!("CARGO_PKG_VERSION");
    let here = find_firmware(None).ok().and_then(|elf| build_of(&elf));
    match (build, here) {
        _ if version != host => format!(
            "\n  fix: the device ran firmware {recorded} and this program is {host}; replay with the \
             program of the same version"
        ),
        (Some(build), Some(here)) if build != here => format!(
            "\n  fix: the device ran {recorded} and the firmware built here is +{here}; replay with \
             the program that was built with the device's firmware"
        ),
        _ => String::new(),
    }
}
