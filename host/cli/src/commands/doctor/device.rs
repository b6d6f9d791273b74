//! Does the device behind a link fit this program, and does it keep time?

use std::time::{Duration, Instant};

use cathforce_bus::service::Status;
use cathforce_config::image::schema_hash;
use cathforce_control::{Mode, TICK_S};
use cathforce_link::qemu::find_firmware;
use cathforce_link::{Client, ClientError, Link, build_of, update, version_and_build};

use super::check::Check;
use crate::failure::{Code, Failure};

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// How long the device's clock is watched.
const WATCH: Duration = Duration::from_secs(1);
/// A crystal is right to 100 ppm. Ten times that leaves room for the jitter of asking; beyond it the
/// two clocks disagree.
const CLOCK_TOLERANCE: f64 = 1e-3;

pub fn checks(link: Box<dyn Link>) -> Vec<Check> {
    let is_here = link.name() == "sim";
    let mut client = match Client::connect(link) {
        Ok(client) => client,
        Err(error) => return vec![failed("device", error)],
    };
    let device = client.device().clone();
    let mut checks = vec![Check::good("device", device.board.as_str())];
    let of_same_version = format!("{} (version {VERSION})", update(&device.board));
    checks.push(if device.image_schema_hash != schema_hash() {
        let found = format!("{} reads images of another layout", device.firmware);
        Check::wrong("firmware", found, of_same_version, Code::Device)
    } else {
        firmware(&device.firmware, here().as_deref(), of_same_version)
    });
    let clock = client.status().and_then(|status| {
        checks.push(mode(&status));
        match is_here {
            true => Ok(Check::good("clock", "this computer's: the device is in this process")),
            false => clock(&mut client, &status),
        }
    });
    checks.push(clock.unwrap_or_else(|error| failed("clock", error)));
    checks
}

/// The build of the firmware that was built here last, if one was.
fn here() -> Option<String> {
    build_of(&find_firmware(None).ok()?)
}

fn firmware(device: &str, here: Option<&str>, of_same_version: String) -> Check {
    let (version, build) = version_and_build(device);
    match build.zip(here) {
        _ if version != VERSION => Check::doubtful("firmware", device, of_same_version),
        Some((build, here)) if build != here => Check::doubtful(
            "firmware",
            format!("{device}; the firmware that was built here is +{here}"),
            "load the firmware that was built here. If the other one is wanted, its figures and its \
             log belong to its own source",
        ),
        _ => Check::good("firmware", device),
    }
}

fn failed(name: &str, error: ClientError) -> Check {
    let Failure { code, message } = error.into();
    Check::wrong(name, message, "see above", code)
}

fn mode(status: &Status) -> Check {
    match Mode::from_codes(status.mode, status.fault) {
        None => Check::good("state", "not configured"),
        Some(mode) => match mode.fault() {
            None => Check::good("state", mode.name()),
            Some(fault) => Check::wrong(
                "state",
                format!("fault {}: {}", fault.name(), fault.cause()),
                format!("{}; cathforce fault clear {} --link …", fault.next_step(), fault.name()),
                Code::Device,
            ),
        },
    }
}

/// Compares the device's ticks with this computer's clock over a second. Asking takes as long before
/// as after, so only its jitter remains.
fn clock(client: &mut Client, first: &Status) -> Result<Check, ClientError> {
    if first.lock_step {
        return Ok(Check::good("clock", "stands still between grants: lock step"));
    }
    let before = (Instant::now(), client.status()?.tick);
    std::thread::sleep(WATCH);
    let after = (Instant::now(), client.status()?.tick);
    let ticks = after.1.wrapping_sub(before.1);
    Ok(rate(ticks, after.0 - before.0))
}

fn rate(ticks: u32, elapsed: Duration) -> Check {
    let off = f64::from(ticks) * f64::from(TICK_S) / elapsed.as_secs_f64() - 1.0;
    let found = format!("{ticks} ticks in {:.4} s", elapsed.as_secs_f64());
    if ticks == 0 {
        let fix = "restart the device: its tick does not run";
        Check::wrong("clock", found, fix, Code::Device)
    } else if off.abs() > CLOCK_TOLERANCE {
        let fix = "a busy computer asks late, so ask again; if it stays, the device's oscillator \
                   is not the one that its firmware was built for";
        Check::doubtful("clock", format!("{found}, {:+.2} % off", 100.0 * off), fix)
    } else {
        Check::good("clock", found)
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::Verdict;
    use super::*;

    #[test]
    fn another_version_and_another_build_are_told_apart() {
        let fix = || "use the same".to_owned();
        let check = |device: &str, here| firmware(device, here, fix());
        let same = format!("{VERSION}+0000000a");
        assert_eq!(check(VERSION, Some("0000000a")).verdict, Verdict::Good, "it does not know");
        assert_eq!(check(&same, None).verdict, Verdict::Good, "nothing to compare with");
        assert_eq!(check(&same, Some("0000000a")).verdict, Verdict::Good);
        let other = check(&same, Some("0000000b"));
        assert_eq!(other.verdict, Verdict::Doubtful);
        assert!(other.found.contains("+0000000a") && other.found.contains("+0000000b"));
        assert_eq!(check("9.9.9+0000000a", Some("0000000a")).verdict, Verdict::Doubtful);
    }

    #[test]
    fn a_clock_that_is_off_by_a_percent_is_seen_and_one_that_stands_is_wrong() {
        assert_eq!(rate(1000, Duration::from_secs(1)).verdict, Verdict::Good);
        let check = rate(990, Duration::from_secs(1));
        assert_eq!(check.verdict, Verdict::Doubtful);
        assert!(check.found.contains("-1.00 %"), "{}", check.found);
        assert_eq!(rate(0, Duration::from_secs(1)).verdict, Verdict::Wrong);
    }
}
