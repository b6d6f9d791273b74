//! What is on a bus before this program sends anything.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use cathforce_bus::{Frame, Id, IdDigits};
use cathforce_link::{Link, LinkError};

use super::check::Check;
use crate::canopen;
use crate::failure::Code;

/// How long a bus is listened to: a heartbeat of CANopen comes once a second at the latest in most drives.
const LISTEN: Duration = Duration::from_millis(1200);
/// Bits a second of a bus that the device shares.
const BUS_BITS_PER_S: f64 = 1e6;
/// Foreign identifiers that are printed.
const SHOWN: usize = 6;

/// Frames that were heard.
#[derive(Debug, Default)]
pub struct Heard {
    /// By identifier.
    counts: BTreeMap<u32, usize>,
    bits: u64,
    over: Duration,
}

impl Heard {
    /// Listens and sends nothing.
    pub fn on(link: &mut dyn Link) -> Result<Self, LinkError> {
        let (begun, mut heard) = (Instant::now(), Self::default());
        while let Some(left) = LISTEN.checked_sub(begun.elapsed()) {
            if let Some(frame) = link.receive(left)? {
                heard.add(&frame);
            }
        }
        heard.over = begun.elapsed();
        Ok(heard)
    }

    fn add(&mut self, frame: &Frame) {
        *self.counts.entry(frame.id()).or_default() += 1;
        self.bits += u64::from(frame.most_bits());
    }

    /// What follows from it. Where a check is wrong, nothing may be sent on this bus.
    ///
    /// `is_moved`: our identifiers were moved to where no node of CANopen has its own.
    pub fn checks(&self, is_moved: bool) -> Vec<Check> {
        let mut checks = vec![self.of_bus()];
        checks.extend(self.of_other_hosts());
        if !is_moved {
            checks.extend(self.of_canopen());
        }
        checks
    }

    fn of_bus(&self) -> Check {
        let frames: usize = self.counts.values().sum();
        let seconds = self.over.as_secs_f64().max(f64::MIN_POSITIVE);
        let load = 100.0 * self.bits as f64 / seconds / BUS_BITS_PER_S;
        let foreign: Vec<String> = self.foreign().map(|id| format!("0x{}", IdDigits(id))).collect();
        let others = match foreign.len() {
            0 => String::new(),
            1..=SHOWN => format!("; of others: {}", foreign.join(", ")),
            more => {
                format!("; of others: {} and {} more", foreign[..SHOWN].join(", "), more - SHOWN)
            }
        };
        let found = match frames {
            0 => format!("nothing was heard for {seconds:.1} s"),
            _ => format!("{frames} frames in {seconds:.1} s, {load:.0} % of 1 Mbit/s{others}"),
        };
        Check::good("bus", found)
    }

    fn foreign(&self) -> impl Iterator<Item = u32> {
        self.counts.keys().copied().filter(|id| Id::from_raw(*id).is_none())
    }

    /// Frames that only a host sends come from another program.
    fn of_other_hosts(&self) -> Option<Check> {
        let is_host =
            |id: &Id| matches!(id, Id::Sync | Id::Encoder | Id::Command | Id::ServiceRequest);
        let ids = self.counts.keys().filter_map(|id| Id::from_raw(*id)).filter(is_host);
        let names: Vec<String> = ids.map(|id| format!("{id:?}")).collect();
        (!names.is_empty()).then(|| {
            Check::doubtful(
                "other hosts",
                format!("another program sends {}", names.join(", ")),
                "end it before you run the device from here; `cathforce monitor` and `dash` can watch \
                 beside it",
            )
        })
    }

    /// Nodes of CANopen, which say that they are there by a heartbeat.
    fn of_canopen(&self) -> impl Iterator<Item = Check> {
        let nodes = self.foreign().filter_map(|id| match canopen::object(id) {
            Some(("heartbeat", node)) => Some(node),
            _ => None,
        });
        nodes.map(|node| {
            let name = format!("CANopen node {node}");
            let collisions = canopen::collisions(node);
            if collisions.is_empty() {
                return Check::good(name, "none of its usual identifiers is one of ours");
            }
            let found = format!("of its usual identifiers, {}. Nothing was sent", collisions.join("; "));
            let free = (1..=canopen::LAST_NODE).find(|&own| canopen::collisions(own).is_empty());
            let free = free.map_or(String::new(), |own| format!("give it the number {own}, "));
            let fix = format!(
                "{free}give its PDOs other identifiers (objects 0x1400 to 0x1A00) and ask again with \
                 `--ask-anyway`, or put it on a bus of its own"
            );
            Check::wrong(name, found, fix, Code::Link)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::Verdict;
    use super::*;

    fn heard(ids: &[u32]) -> Vec<Check> {
        let mut heard = Heard { over: LISTEN, ..Heard::default() };
        ids.iter().for_each(|id| heard.add(&Frame::new(*id, &[0]).unwrap()));
        heard.checks(false)
    }

    #[test]
    fn a_node_whose_pdos_are_ours_is_named_and_nothing_is_sent() {
        let checks = heard(&[0x180, 0x190, 0x701, 0x77F]);
        let wrong = checks.iter().find(|check| check.verdict == Verdict::Wrong).unwrap();
        assert_eq!(wrong.name, "CANopen node 1");
        assert!(wrong.found.contains("RPDO1 and our Shape(1)"), "{}", wrong.found);
        let fix = wrong.fix.as_ref().unwrap();
        let free = fix.split("number ").nth(1).and_then(|rest| rest.split(',').next()).unwrap();
        assert!(canopen::collisions(free.parse().unwrap()).is_empty(), "{fix}");
        let other = checks.iter().find(|check| check.name == "CANopen node 127").unwrap();
        assert_eq!(other.verdict, Verdict::Good);
    }

    #[test]
    fn another_host_is_named_and_a_device_is_no_host() {
        let own = heard(&[0x180, 0x190, 0x1A0, 0x200]);
        assert!(own.len() == 1 && own[0].verdict == Verdict::Good, "{own:?}");
        let other = heard(&[0x100, 0x180, 0x123]);
        assert!(other[0].found.contains("of others: 0x123"), "{other:?}");
        assert_eq!(other[1].verdict, Verdict::Doubtful);
        assert!(other[1].found.contains("Encoder"), "{other:?}");
        assert!(heard(&[])[0].found.contains("nothing was heard"));
    }
}
