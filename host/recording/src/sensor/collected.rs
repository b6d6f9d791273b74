//! The packets that have arrived, and what was wrong with others.

use super::packet::Packet;
use crate::import::status;

/// Packets that are kept: an hour at 1000 Hz, in 140 MiB.
const MOST_PACKETS: usize = 4_000_000;

/// A packet that is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taken {
    /// Number since the first packet.
    pub(super) number: u64,
    /// When it arrived \[s\].
    pub(super) at_s: f64,
    pub(super) counts: [i32; 3],
}

/// What has arrived so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Collected {
    pub(super) taken: Vec<Taken>,
    /// Packets that did not arrive, as their numbers show.
    pub(super) lost: u64,
    /// Packets that came again or behind a later one.
    pub(super) late: u64,
    /// Status words of errors, and how many packets have them.
    pub(super) faulty: Vec<(u32, u64)>,
    /// Packets of another length.
    pub(super) malformed: u64,
    /// Packets beyond those that are kept.
    pub(super) beyond: u64,
    last: Option<(u32, u64)>,
}

impl Collected {
    /// Takes what arrived at a time \[s\].
    pub(super) fn take(&mut self, bytes: &[u8], at_s: f64) {
        let Some(packet) = Packet::read(bytes) else {
            self.malformed += 1;
            return;
        };
        let number = match self.last {
            None => 0,
            Some((sequence, number)) => {
                let step = packet.sequence.wrapping_sub(sequence);
                if step == 0 || step > u32::MAX / 2 {
                    self.late += 1;
                    return;
                }
                self.lost += u64::from(step) - 1;
                number + u64::from(step)
            }
        };
        self.last = Some((packet.sequence, number));
        if status::is_error(packet.status) {
            match self.faulty.iter_mut().find(|(word, _)| *word == packet.status) {
                Some((_, count)) => *count += 1,
                None => self.faulty.push((packet.status, 1)),
            }
            return;
        }
        if self.taken.len() >= MOST_PACKETS {
            self.beyond += 1;
            return;
        }
        self.taken.push(Taken { number, at_s, counts: packet.counts });
    }

    /// Packets that arrived, whatever became of them.
    pub(super) fn arrived(&self) -> u64 {
        let faulty: u64 = self.faulty.iter().map(|(_, count)| count).sum();
        self.taken.len() as u64 + self.late + faulty + self.malformed + self.beyond
    }

    /// What was left out, for a warning each.
    pub(super) fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let mut say = |count: u64, what: &str| {
            if count > 0 {
                remarks.push(format!("{count} packets {what}"));
            }
        };
        say(self.lost, "were lost on the way; their time is kept");
        say(self.late, "came again or behind a later one and are left out");
        say(self.malformed, "have not the 36 bytes of a measurement and are left out");
        say(self.beyond, "came after the 4000000 that are kept; set a lower RDT output rate");
        for (word, count) in &self.faulty {
            let text = status::text(*word);
            remarks.push(format!("{count} packets have the error status {text} and are left out"));
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(sequence: u32, status: u32) -> Vec<u8> {
        let mut bytes = [sequence, 0, status, 5, 6, 7].map(u32::to_be_bytes).concat();
        bytes.resize(36, 0);
        bytes
    }

    #[test]
    fn every_packet_is_counted_once() {
        let mut collected = Collected::default();
        let threshold = 1 << 16;
        let arrived = [
            packet(u32::MAX, 0),
            packet(0, threshold),
            packet(0, 0),
            packet(4, 0),
            packet(3, 0),
            packet(5, 0x8000_0004),
            packet(6, 0x8000_0004),
            vec![0; 35],
        ];
        for (k, bytes) in arrived.iter().enumerate() {
            collected.take(bytes, k as f64);
        }
        let numbers = collected.taken.iter().map(|taken| taken.number).collect::<Vec<_>>();
        assert_eq!(numbers, [0, 1, 5]);
        assert_eq!((collected.lost, collected.late, collected.malformed), (3, 2, 1));
        assert_eq!(collected.arrived(), arrived.len() as u64);
        let said = collected.remarks().join("\n");
        for says in ["3 packets were lost", "2 packets have the error status", "broken gage"] {
            assert!(said.contains(says), "{says}: {said}");
        }
    }
}
