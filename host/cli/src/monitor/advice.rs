//! What to do next, while a bus shows no forces.

use cathforce_control::Fault;
use cathforce_link::carrier;

/// What has been heard lately, as far as advice depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heard {
    /// In the last second, of anybody.
    pub frames: usize,
    /// In the last second, of a device.
    pub ticks: usize,
    /// The device's ticks were granted one by one.
    pub lock_step: bool,
    /// What the device last said of itself.
    pub is_configured: Option<bool>,
    pub fault: Option<Fault>,
}

/// One or two sentences for somebody who watches `link`; `None` when there is nothing to do.
pub fn advice(link: &str, heard: Heard) -> Option<String> {
    // A device in this very process, which no other program can reach.
    let own = carrier(link);
    let is_private = own == "sim" || own == "qemu" || own.starts_with("qemu:");
    let others = match link.strip_prefix("slcan:listen:") {
        Some(address) => format!("slcan:tcp:{address}"),
        None => link.to_owned(),
    };
    if heard.ticks == 0 && heard.lock_step {
        return Some(
            "The device is in lock step: it stands still until a program grants it ticks, as \
             `cathforce run` does."
                .into(),
        );
    }
    if heard.frames == 0 {
        return Some(format!(
            "Nothing is on the bus. Is the device powered, and do all run at 1 Mbit/s? `cathforce \
             doctor --link {others}` looks. Without hardware, `cathforce link serve \
             slcan:listen:5555` is a device."
        ));
    }
    if heard.ticks == 0 {
        return Some(format!(
            "No device answers, only other members are heard. Is it powered? `cathforce doctor \
             --link {others}` looks."
        ));
    }
    if heard.is_configured == Some(false) {
        return Some(match is_private {
            true => "The device is not configured, and no other program can reach it here. Start \
                     one that others reach: `cathforce link serve slcan:listen:5555`."
                .into(),
            false => format!(
                "The device is not configured: it has no rig and no vessel. `cathforce run --link \
                 {others} BUNDLE` configures it and plays a trial{}.",
                if is_serial(link) { ", once this program has let go of the port" } else { "" }
            ),
        });
    }
    let fault = heard.fault?;
    Some(format!(
        "{}. Then: `cathforce fault clear {} --link {others}`.",
        capitalised(fault.next_step()),
        fault.name()
    ))
}

/// Behind a port that one program alone can open.
fn is_serial(link: &str) -> bool {
    link.strip_prefix("slcan:")
        .is_some_and(|rest| !rest.starts_with("tcp:") && !rest.starts_with("listen:"))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_state_has_its_next_step_and_a_good_one_has_none() {
        let tcp = "slcan:tcp:127.0.0.1:5555";
        let nothing = Heard::default();
        let ticking = Heard { frames: 3000, ticks: 1000, ..nothing };
        let fresh = Heard { is_configured: Some(false), ..ticking };
        let configured = Heard { is_configured: Some(true), ..ticking };
        let faulty = Heard { fault: Some(Fault::EncoderLost), ..configured };
        let said = |link, heard| advice(link, heard).unwrap();
        assert!(said(tcp, nothing).contains("doctor --link slcan:tcp:127.0.0.1:5555"));
        assert!(said(tcp, nothing).contains("link serve"));
        assert!(said(tcp, Heard { lock_step: true, ..nothing }).contains("lock step"));
        assert!(said(tcp, Heard { frames: 100, ..nothing }).contains("No device answers"));
        assert!(said(tcp, fresh).contains("cathforce run --link slcan:tcp:127.0.0.1:5555 BUNDLE"));
        assert!(said("slcan:listen:127.0.0.1:7", fresh).contains("--link slcan:tcp:127.0.0.1:7 "));
        assert!(said("slcan:/dev/ttyACM0", fresh).contains("let go of the port"));
        assert!(said("sim", fresh).contains("link serve"));
        assert!(said(tcp, faulty).contains("cathforce fault clear EncoderLost --link slcan:tcp"));
        assert_eq!(advice(tcp, configured), None);
    }
}
