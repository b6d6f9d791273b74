//! `cathforce doctor`: checks everything between this program and a device, with a fix for each
//! problem.

mod check;
mod device;
mod interface;
mod listen;

use std::path::Path;
use std::time::{Duration, Instant};

use cathforce_control::{ENCODER_TIMEOUT_HARD_TICKS, TICK_S};
use cathforce_link::interface as net;
use cathforce_link::{carrier, qemu};
use check::{Check, Verdict};

use crate::args::DoctorArguments;
use crate::failure::{Code, Failure};
use crate::session::REAL_TIME;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &DoctorArguments) -> Result<(), Failure> {
    let checks = match &arguments.link {
        Some(link) => link_checks(link, arguments.ask_anyway),
        None => computer_checks(),
    };
    ui.data(&checks, text(ui, &checks))?;
    let wrong = checks.iter().filter(|check| check.verdict == Verdict::Wrong);
    match wrong.clone().next() {
        Some(first) => {
            let message = match wrong.count() {
                1 => "1 check failed; its fix is printed beside it".to_owned(),
                failed => format!("{failed} checks failed; their fixes are printed beside them"),
            };
            Err(Failure::new(first.code, message))
        }
        None => Ok(()),
    }
}

/// Checks what this computer offers to reach a device. Nobody needs all of it.
fn computer_checks() -> Vec<Check> {
    let mut checks = Vec::new();
    match net::check_sockets() {
        Err(error) => {
            let fix = format!("needed for --link socketcan:… only. {}", error.fix());
            checks.push(Check::doubtful("CAN sockets", error.problem(), fix));
        }
        Ok(()) => {
            checks.push(Check::good("CAN sockets", "this kernel has them"));
            let interfaces = net::list();
            if interfaces.is_empty() {
                let fix = "plug in an adapter, or make a virtual one: cathforce link up vcan0";
                checks.push(Check::doubtful("CAN interfaces", "there is none", fix));
            }
            checks.extend(interfaces.iter().flat_map(interface::checks));
        }
    }
    checks.push(timers(latest_wake()));
    checks.push(match qemu::find_firmware(None) {
        Ok(elf) => Check::good("firmware for the emulated board", elf.display()),
        Err(error) => {
            let fix = format!("needed for --link qemu only. {}", error.fix());
            Check::doubtful("firmware for the emulated board", error.problem(), fix)
        }
    });
    checks
}

/// The largest delay of a wake-up over half a second of sleeps.
fn latest_wake() -> Duration {
    const SLEEP: Duration = Duration::from_millis(1);
    let woken = (0..500).map(|_| {
        let due = Instant::now() + SLEEP;
        std::thread::sleep(SLEEP);
        due.elapsed()
    });
    woken.max().unwrap_or_default()
}

/// Whether a device that runs free would get its frames in time.
fn timers(latest: Duration) -> Check {
    let found = format!("woken at most {:.1} ms late", 1e3 * latest.as_secs_f64());
    let silence_s = f64::from(ENCODER_TIMEOUT_HARD_TICKS) * f64::from(TICK_S);
    if latest.as_secs_f64() < silence_s {
        return Check::good("timers", found);
    }
    let fix = format!(
        "a device that runs free stops after {:.0} ms without encoder frames: {REAL_TIME}",
        1e3 * silence_s
    );
    Check::doubtful("timers", found, fix)
}

/// Everything between here and the device behind a link.
fn link_checks(link: &str, ask_anyway: bool) -> Vec<Check> {
    let mut checks = Vec::new();
    let (address, link) = (link, carrier(link));
    let is_moved = address != link;
    let is_wrong = |checks: &[Check]| checks.iter().any(|own| own.verdict == Verdict::Wrong);
    if let Some(name) = link.strip_prefix("socketcan:") {
        match net::check_sockets().and_then(|()| net::find(name)) {
            Ok(found) => checks.extend(interface::checks(&found)),
            Err(error) => return vec![Check::of("interface", &error)],
        }
        if is_wrong(&checks) {
            // A device that does not answer then is not to blame.
            return checks;
        }
    }
    if let Some(elf) = emulated(link) {
        checks.extend(emulator_checks(elf));
        if is_wrong(&checks) {
            return checks;
        }
    }
    match cathforce_link::open(address) {
        Ok(mut opened) => {
            checks.push(Check::good("link", format_args!("{address} can be opened")));
            // Others may be on a bus, and nothing is known of them before they are heard.
            if ["socketcan:", "slcan:"].iter().any(|bus| link.starts_with(bus)) {
                match listen::Heard::on(&mut *opened) {
                    Ok(heard) => checks.extend(heard.checks(is_moved)),
                    Err(error) => checks.push(Check::of("bus", &error)),
                }
                if is_wrong(&checks) && !ask_anyway {
                    return checks;
                }
            }
            checks.extend(device::checks(opened));
        }
        Err(error) => checks.push(Check::of("link", &error)),
    }
    checks
}

/// The firmware that the address of an emulated board names, if it is one and names it.
fn emulated(link: &str) -> Option<Option<&Path>> {
    match link.split_once(':') {
        Some(("qemu", elf)) => Some(Some(Path::new(elf))),
        _ => (link == "qemu").then_some(None),
    }
}

/// Whether there are firmware and an emulator, and whether its clocks are right.
fn emulator_checks(elf: Option<&Path>) -> Vec<Check> {
    let elf = match qemu::find_firmware(elf) {
        Ok(elf) => elf,
        Err(error) => return vec![Check::of("firmware for the emulated board", &error)],
    };
    let firmware = Check::good("firmware for the emulated board", elf.display());
    let clocks = "the emulator's clocks";
    let emulator = match qemu::self_test(&elf) {
        Ok(measured) if measured.passed() => Check::good(clocks, measured),
        Ok(measured) => Check::wrong(clocks, measured, qemu::INSTALL, Code::Link),
        Err(error) => Check::of("emulator", &error),
    };
    vec![firmware, emulator]
}

fn text(ui: &Ui, checks: &[Check]) -> String {
    let line = |check: &Check| {
        let mark = match check.verdict {
            Verdict::Good => "ok   ",
            Verdict::Doubtful => "note ",
            Verdict::Wrong => "WRONG",
        };
        let fix = check.fix.as_ref().map(|fix| format!("        fix: {fix}\n"));
        let found = check.found.replace('\n', "\n      ");
        format!("{mark}  {}: {found}\n{}", ui.bold(&check.name), fix.unwrap_or_default())
    };
    checks.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computer_that_wakes_too_late_is_told_what_to_do() {
        let check = timers(Duration::from_micros(400));
        assert_eq!((check.verdict, &check.found[..]), (Verdict::Good, "woken at most 0.4 ms late"));
        let check = timers(Duration::from_millis(7));
        assert_eq!(check.verdict, Verdict::Doubtful);
        assert!(check.fix.unwrap().contains("chrt -r 10"));
    }
}
