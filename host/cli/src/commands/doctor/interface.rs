//! Checks that a CAN interface is set as the device needs it.

use cathforce_link::interface::{BIT_RATE, BusState, Interface, Kind, QUEUE_FRAMES, Setup, ip_up};

use super::check::Check;
use crate::failure::Code;

/// Checks one interface; each problem comes with the command that fixes it.
pub fn checks(interface: &Interface) -> Vec<Check> {
    let Interface { name, kind, .. } = interface;
    let by_hand = ip_up(name, *kind, Setup::default());
    let fix = format!("sudo cathforce link up {name}   (by hand: {by_hand})");
    let wrong = |what: &str, found: String| {
        Check::wrong(format!("{name} {what}"), found, fix.clone(), Code::Link)
    };
    let good = |what: &str, found: String| Check::good(format!("{name} {what}"), found);
    let mut checks = Vec::new();
    if interface.is_up {
        checks.push(good("interface", format!("{}, up", kind.name())));
    } else {
        checks.push(wrong("interface", format!("{}, down", kind.name())));
    }
    match (kind, interface.bit_rate) {
        (Kind::Controller, Some(BIT_RATE)) => {
            checks.push(good("bit rate", format!("{BIT_RATE} bit/s")));
        }
        (Kind::Controller, Some(rate)) => {
            checks.push(wrong("bit rate", format!("{rate} bit/s instead of {BIT_RATE}")));
        }
        (Kind::Controller, None) => checks.push(wrong("bit rate", "not set".into())),
        (Kind::SerialLine, _) => {
            let found = "set when the adapter was attached; slcand's -s8 is 1 Mbit/s";
            checks.push(good("bit rate", found.into()));
        }
        (Kind::Virtual, _) => {}
    }
    checks.extend(interface.state.filter(|_| interface.is_up).map(|state| match state {
        BusState::ErrorActive | BusState::ErrorWarning => good("bus", state.name().into()),
        BusState::ErrorPassive | BusState::BusOff | BusState::Stopped => Check::wrong(
            format!("{name} bus"),
            state.name(),
            format!(
                "check that the device is powered, that both ends are terminated with 120 Ω and \
                 that all run at 1 Mbit/s; then: sudo cathforce link down {name} && sudo \
                 cathforce link up {name}"
            ),
            Code::Link,
        ),
    }));
    let queue = interface.queue_frames;
    checks.push(if queue >= QUEUE_FRAMES {
        good("queue", format!("{queue} frames"))
    } else {
        let found = format!("{queue} frames; {QUEUE_FRAMES} keep sending from waiting");
        let fix = format!("sudo ip link set {name} txqueuelen {QUEUE_FRAMES}");
        Check::doubtful(format!("{name} queue"), found, fix)
    });
    checks
}

#[cfg(test)]
mod tests {
    use super::super::check::Verdict;
    use super::*;

    fn interface() -> Interface {
        Interface {
            name: "can7".into(),
            kind: Kind::Controller,
            is_up: true,
            bit_rate: Some(BIT_RATE),
            state: Some(BusState::ErrorActive),
            restart_ms: Some(100),
            queue_frames: QUEUE_FRAMES,
        }
    }

    /// Verdicts and fixes of the checks that are not good.
    fn complaints(interface: Interface) -> Vec<(Verdict, String)> {
        let bad = checks(&interface).into_iter().filter(|check| check.verdict != Verdict::Good);
        bad.map(|check| (check.verdict, check.fix.unwrap_or_default())).collect()
    }

    #[test]
    fn an_interface_that_is_set_right_has_no_complaints() {
        assert_eq!(complaints(interface()), []);
        let kind = Kind::Virtual;
        assert_eq!(complaints(Interface { kind, bit_rate: None, state: None, ..interface() }), []);
    }

    #[test]
    fn each_slip_has_its_line() {
        let by_hand = "ip link set can7 type can bitrate 1000000 restart-ms 100";
        for wrong in [
            Interface { is_up: false, ..interface() },
            Interface { bit_rate: Some(500_000), ..interface() },
            Interface { bit_rate: None, ..interface() },
        ] {
            let [(Verdict::Wrong, fix)] = &complaints(wrong)[..] else { panic!() };
            assert!(fix.contains("cathforce link up can7") && fix.contains(by_hand), "{fix}");
        }
        let [(Verdict::Doubtful, fix)] =
            &complaints(Interface { queue_frames: 10, ..interface() })[..]
        else {
            panic!()
        };
        assert_eq!(fix, "sudo ip link set can7 txqueuelen 128");
        let [(Verdict::Wrong, fix)] =
            &complaints(Interface { state: Some(BusState::BusOff), ..interface() })[..]
        else {
            panic!()
        };
        assert!(fix.contains("120 Ω") && fix.contains("link down can7"), "{fix}");
    }
}
