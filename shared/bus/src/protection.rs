//! End-to-end protection by bytes 6 and 7 of every process frame.
//!
//! Byte 6 holds the status in its high nibble, and in its low nibble a counter from 0 to 15 for each id.
//! Byte 7 is a CRC-8 SAE J1850 over the id's low byte, the id's high byte and bytes 0 to 6. Because the
//! CRC includes the id, a frame that appears under another id is detected.
//!
//! A 4-bit counter distinguishes lost from repeated frames. It cannot detect the loss of 16 frames in a
//! row; the freshness check detects such long gaps.

use crate::process::{Id, MAX_NODES, Process, TENDON_PAIRS};
use crate::{Counter, Counters, Frame};

const CRC8: crc::Crc<u8, crc::Table<1>> = crc::Crc::<u8, crc::Table<1>>::new(&crc::CRC_8_SAE_J1850);

/// CRC of a process frame, over its id, which has 11 bits, and bytes 0 to 6.
pub fn crc8(id: u32, body: [u8; 7]) -> u8 {
    let mut digest = CRC8.digest();
    digest.update(&(id as u16).to_le_bytes());
    digest.update(&body);
    digest.finalize()
}

/// The status nibble. Bits that a frame does not use are `false`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Status {
    /// From the device: the model did not resolve this tick, so its forces are uncertain.
    pub unresolved: bool,
    /// From the device: the output was limited in this tick.
    pub limited: bool,
    /// From the device: this is the last frame of the tick.
    pub last: bool,
    /// From the host. In GUIDEWIRE: the operator holds the guidewire's button. In ENCODER: the operator
    /// has let go of the handle.
    pub hand: bool,
}

impl Status {
    fn bits(self) -> u8 {
        let bits = [self.unresolved, self.limited, self.last, self.hand];
        bits.into_iter().rev().fold(0, |nibble, bit| nibble << 1 | u8::from(bit))
    }

    fn from_bits(bits: u8) -> Self {
        let bit = |k: u8| bits >> k & 1 != 0;
        Self { unresolved: bit(0), limited: bit(1), last: bit(2), hand: bit(3) }
    }
}

/// Number of ids with counter and CRC. Each has its own counter.
const SLOTS: usize = 12 + 2 * MAX_NODES as usize + TENDON_PAIRS as usize;

fn slot(id: Id) -> Option<usize> {
    let node = |node: u8| usize::from(node % MAX_NODES);
    Some(match id {
        Id::Sync => 0,
        Id::Encoder => 1,
        Id::Command => 2,
        Id::Haptic => 3,
        Id::Contact => 4,
        Id::Tick => 5,
        Id::Drive => 6,
        Id::Moment => 7,
        Id::Guidewire => 8,
        Id::GuidewireDrive => 9,
        Id::Band => 10,
        Id::Heartbeat => 11,
        Id::Shape(k) => 12 + node(k),
        Id::Force(k) => 12 + usize::from(MAX_NODES) + node(k),
        Id::Tendons(pair) => 12 + 2 * usize::from(MAX_NODES) + usize::from(pair % TENDON_PAIRS),
        Id::ServiceRequest | Id::ServiceResponse => return None,
    })
}

/// The sending side: the next counter of each id.
#[derive(Clone, Debug)]
pub struct Sealer {
    next: [u8; SLOTS],
}

impl Default for Sealer {
    fn default() -> Self {
        Self { next: [0; SLOTS] }
    }
}

impl Sealer {
    /// Protects a frame with the next counter of its id.
    pub fn seal(&mut self, process: Process, status: Status) -> Frame {
        let id = process.id();
        let mut counter = 0;
        if let Some(next) = slot(id).and_then(|slot| self.next.get_mut(slot)) {
            counter = *next & 0xF;
            *next = (counter + 1) & 0xF;
        }
        let [a, b, c, d, e, f] = process.payload();
        let g = status.bits() << 4 | counter;
        let crc = crc8(id.raw(), [a, b, c, d, e, f, g]);
        Frame::full(id.raw(), [a, b, c, d, e, f, g, crc])
    }

    /// Continues at the counter of an earlier sender of this id.
    pub fn continue_at(&mut self, id: Id, counter: u8) {
        if let Some(next) = slot(id).and_then(|slot| self.next.get_mut(slot)) {
            *next = counter & 0xF;
        }
    }
}

/// An accepted frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Accepted {
    pub process: Process,
    pub status: Status,
    /// Number of frames of this id that were lost before it.
    pub lost: u8,
}

/// Why a frame is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rejection {
    /// Not 8 bytes.
    WrongLength,
    /// Its CRC fits no id of ours.
    Corrupt,
    /// Its CRC belongs to this other id.
    Masquerade(Id),
    /// The same counter as the frame before.
    Repeat,
    /// Older than the frame before.
    Reordered,
    /// Intact, but with an invalid payload.
    BadValue,
}

impl Rejection {
    /// Counter of this rejection.
    pub fn counter(self) -> Counter {
        match self {
            Self::WrongLength => Counter::WrongLength,
            Self::Corrupt => Counter::Corrupt,
            Self::Masquerade(_) => Counter::Masquerade,
            Self::Repeat => Counter::Repeat,
            Self::Reordered => Counter::Reordered,
            Self::BadValue => Counter::BadValue,
        }
    }
}

/// Ids against which a wrong CRC is tried, to distinguish a masquerade from corruption.
///
/// The 128 ids of nodes are left out, because nearly every corrupt frame would fit one of them by its
/// 8-bit CRC.
const MASQUERADES: [Id; 14] = [
    Id::Sync,
    Id::Encoder,
    Id::Guidewire,
    Id::Tendons(0),
    Id::Tendons(1),
    Id::Command,
    Id::Haptic,
    Id::Contact,
    Id::Tick,
    Id::Drive,
    Id::Moment,
    Id::GuidewireDrive,
    Id::Band,
    Id::Heartbeat,
];

/// The receiving side: the last counter of each id.
#[derive(Clone, Debug)]
pub struct Protection {
    last: [Option<u8>; SLOTS],
}

impl Default for Protection {
    fn default() -> Self {
        Self { last: [None; SLOTS] }
    }
}

impl Protection {
    /// Checks a frame, and adds to exactly one of [`Counter::FRAME_KINDS`].
    ///
    /// `id`: meaning of `frame.id()`. The first frame of an id may have any counter.
    ///
    /// Errors: why the frame is rejected.
    pub fn receive(
        &mut self,
        id: Id,
        frame: &Frame,
        counters: &mut Counters,
    ) -> Result<Accepted, Rejection> {
        let result = self.check(id, frame);
        match result {
            Ok(Accepted { lost: 0, .. }) => counters.count(Counter::Accepted),
            Ok(Accepted { lost, .. }) => {
                counters.count(Counter::AfterLoss);
                counters.add(Counter::Lost, u32::from(lost));
            }
            Err(rejection) => counters.count(rejection.counter()),
        }
        result
    }

    fn check(&mut self, id: Id, frame: &Frame) -> Result<Accepted, Rejection> {
        let &[a, b, c, d, e, f, g, crc] = frame.data() else {
            return Err(Rejection::WrongLength);
        };
        let body = [a, b, c, d, e, f, g];
        if crc8(id.raw(), body) != crc {
            let made_for = MASQUERADES.into_iter().find(|other| crc8(other.raw(), body) == crc);
            return Err(made_for.map_or(Rejection::Corrupt, Rejection::Masquerade));
        }
        let counter = g & 0xF;
        let last = slot(id).and_then(|slot| self.last.get_mut(slot)).ok_or(Rejection::BadValue)?;
        let ahead = last.map_or(1, |last| counter.wrapping_sub(last) & 0xF);
        if ahead == 0 {
            return Err(Rejection::Repeat);
        }
        if ahead > 8 {
            return Err(Rejection::Reordered);
        }
        // An intact frame was received even if its payload is invalid.
        *last = Some(counter);
        let process = Process::decode(id, [a, b, c, d, e, f]).ok_or(Rejection::BadValue)?;
        Ok(Accepted { process, status: Status::from_bits(g >> 4), lost: ahead - 1 })
    }

    /// The counter that the next frame of this id should carry.
    pub fn expected(&self, id: Id) -> u8 {
        let last = slot(id).and_then(|slot| *self.last.get(slot)?);
        last.map_or(0, |last| (last + 1) & 0xF)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::{Encoder, Insertion, Rotation, Sync};
    use proptest::prelude::*;
    use std::vec::Vec;

    fn encoder(n: u32) -> Process {
        Process::Encoder(Encoder {
            insertion: Insertion::from_m(f64::from(n) * 1e-5),
            rotation: Rotation::from_rad(-0.25),
        })
    }

    fn stream(n: u32) -> Vec<Frame> {
        let mut sealer = Sealer::default();
        (0..n).map(|i| sealer.seal(encoder(i), Status::default())).collect()
    }

    fn receive_all<'f>(frames: impl IntoIterator<Item = &'f Frame>) -> Counters {
        let (mut protection, mut counters) = (Protection::default(), Counters::default());
        for frame in frames {
            let _ = protection.receive(Id::Encoder, frame, &mut counters);
        }
        counters
    }

    fn assert_counts(counters: Counters, expected: &[(Counter, u32)]) {
        for counter in Counter::ALL {
            let n = expected.iter().find(|e| e.0 == counter).map_or(0, |e| e.1);
            assert_eq!(counters.get(counter), n, "{}", counter.name());
        }
    }

    #[test]
    fn crc_is_that_of_the_catalogue() {
        // The check value of CRC-8/SAE-J1850 is over "123456789".
        assert_eq!(crc8(u16::from_le_bytes(*b"12").into(), *b"3456789"), 0x4B);
    }

    #[test]
    fn p04_a_clean_stream_is_accepted() {
        assert_counts(receive_all(&stream(100)), &[(Counter::Accepted, 100)]);
    }

    #[test]
    fn p04_each_fault_has_its_own_counter() {
        let clean = stream(10);

        let mut repeated = clean.clone();
        repeated.insert(5, clean[4]);
        assert_counts(receive_all(&repeated), &[(Counter::Accepted, 10), (Counter::Repeat, 1)]);

        let mut skipped = clean.clone();
        skipped.drain(3..6);
        assert_counts(
            receive_all(&skipped),
            &[(Counter::Accepted, 6), (Counter::AfterLoss, 1), (Counter::Lost, 3)],
        );

        let mut swapped = clean.clone();
        swapped.swap(4, 5);
        // 5 comes before 4: a gap, then an old frame, then a clean stream from 6 on.
        assert_counts(
            receive_all(&swapped),
            &[
                (Counter::Accepted, 8),
                (Counter::AfterLoss, 1),
                (Counter::Lost, 1),
                (Counter::Reordered, 1),
            ],
        );

        let mut corrupt = clean.clone();
        let mut bytes: [u8; 8] = corrupt[4].data().try_into().unwrap();
        bytes[1] ^= 0x10;
        corrupt[4] = Frame::full(0x100, bytes);
        assert_counts(
            receive_all(&corrupt),
            &[
                (Counter::Accepted, 8),
                (Counter::Corrupt, 1),
                (Counter::AfterLoss, 1),
                (Counter::Lost, 1),
            ],
        );

        let foreign = Sealer::default()
            .seal(Process::Sync(Sync { grant: 1, host_tick: 7 }), Status::default());
        let mut masquerade = clean.clone();
        masquerade.insert(4, Frame::new(0x100, foreign.data()).unwrap());
        assert_counts(
            receive_all(&masquerade),
            &[(Counter::Accepted, 10), (Counter::Masquerade, 1)],
        );

        for len in 0..8 {
            let mut short = clean.clone();
            short.insert(4, Frame::new(0x100, &clean[4].data()[..len]).unwrap());
            assert_counts(
                receive_all(&short),
                &[(Counter::Accepted, 10), (Counter::WrongLength, 1)],
            );
        }
    }

    /// Of the 64 bits, three look like the id of another frame: 8 bits of CRC cannot do better.
    #[test]
    fn every_flipped_bit_is_found_and_rejected() {
        for frame in stream(16) {
            for bit in 0..64 {
                let mut bytes = u64::from_le_bytes(frame.data().try_into().unwrap());
                bytes ^= 1 << bit;
                let broken = Frame::full(0x100, bytes.to_le_bytes());
                let result =
                    Protection::default().receive(Id::Encoder, &broken, &mut Counters::default());
                let expected = match bit {
                    3 => Rejection::Masquerade(Id::Moment),
                    15 => Rejection::Masquerade(Id::Tendons(1)),
                    20 => Rejection::Masquerade(Id::Contact),
                    53 => Rejection::Masquerade(Id::Heartbeat),
                    _ => Rejection::Corrupt,
                };
                assert_eq!(result, Err(expected), "bit {bit}");
            }
        }
    }

    #[test]
    fn p04_every_frame_under_another_id_is_a_masquerade() {
        for made_for in MASQUERADES {
            for (payload, id) in [[0; 6], [9, 8, 7, 6, 5, 4]].into_iter().zip(MASQUERADES) {
                let [a, b, c, d, e, f] = payload;
                let crc = crc8(made_for.raw(), [a, b, c, d, e, f, 0]);
                let frame = Frame::full(id.raw(), [a, b, c, d, e, f, 0, crc]);
                let result = Protection::default().receive(id, &frame, &mut Counters::default());
                if id != made_for {
                    assert_eq!(result, Err(Rejection::Masquerade(made_for)));
                }
            }
        }
    }

    #[test]
    fn a_sender_that_starts_over_is_heard_again_within_nine_frames() {
        for old in 0..16 {
            let mut protection = Protection::default();
            let mut counters = Counters::default();
            for frame in &stream(old + 1) {
                let _ = protection.receive(Id::Encoder, frame, &mut counters);
            }
            let heard = stream(9)
                .iter()
                .any(|frame| protection.receive(Id::Encoder, frame, &mut counters).is_ok());
            assert!(heard, "last counter {old}");
        }
    }

    proptest! {
        /// P03: whatever arrives, it is counted once, and a rejected frame changes nothing
        /// but the count.
        #[test]
        fn p03_any_frame_is_counted_once(
            frames in prop::collection::vec((0u32..=0x7FF, prop::collection::vec(any::<u8>(), 0..=8)), 0..64)
        ) {
            let (mut protection, mut counters) = (Protection::default(), Counters::default());
            let mut received = 0;
            for (raw, data) in frames {
                let frame = Frame::new(raw, &data).unwrap();
                if let Some(id) = Id::from_raw(raw) {
                    received += 1;
                    let _ = protection.receive(id, &frame, &mut counters);
                }
            }
            let counted: u32 = Counter::FRAME_KINDS.iter().map(|&c| counters.get(c)).sum();
            prop_assert_eq!(counted, received);
        }

        #[test]
        fn what_is_sealed_is_received(raw in 0u32..=0x7FF, payload: [u8; 6], unresolved: bool, limited: bool) {
            let decoded = Id::from_raw(raw).and_then(|id| Some((id, Process::decode(id, payload)?)));
            if let Some((id, process)) = decoded {
                let status = Status { unresolved, limited, last: unresolved, hand: limited };
                let frame = Sealer::default().seal(process, status);
                let accepted = Protection::default().receive(id, &frame, &mut Counters::default());
                prop_assert_eq!(accepted, Ok(Accepted { process, status, lost: 0 }));
            }
        }
    }
}
