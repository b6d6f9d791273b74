extern crate std;
use super::*;
use proptest::prelude::*;
use std::vec::Vec as StdVec;

type Pair = (Endpoint<4095, 64>, Endpoint<64, 4095>, Counters);

fn pair(block_size: u8) -> Pair {
    (Endpoint::new(0x580, block_size), Endpoint::new(0x600, 0), Counters::default())
}

/// Lets both sides talk until they are silent. Returns what the device got and how many
/// frames arrived there between two of its own.
fn talk((device, host, counters): &mut Pair) -> (StdVec<StdVec<u8>>, usize) {
    let (mut messages, mut longest_burst) = (StdVec::new(), 0);
    loop {
        let mut burst = 0;
        while let Some(frame) = host.next_frame(0) {
            burst += 1;
            messages.extend(device.receive(&frame, counters).map(<[u8]>::to_vec));
        }
        longest_burst = longest_burst.max(burst);
        let mut answered = false;
        while let Some(frame) = device.next_frame(0) {
            answered = true;
            host.receive(&frame, counters);
        }
        if burst == 0 && !answered {
            return (messages, longest_burst);
        }
    }
}

#[test]
fn messages_of_every_length_arrive_and_no_block_is_exceeded() {
    for len in (1..40).chain([62, 63, 64, 700, 1037, 4094, 4095]) {
        let message: StdVec<u8> = (0..len).map(|i| (i * 7) as u8).collect();
        let mut pair = pair(16);
        pair.1.send(&message).unwrap();
        let (messages, longest_burst) = talk(&mut pair);
        assert_eq!(messages, [message], "length {len}");
        assert!(longest_burst <= 16, "length {len}: {longest_burst}");
        assert!(!pair.1.is_sending());
        assert_eq!(pair.2.get(Counter::SegmentSequence) + pair.2.get(Counter::SegmentBroken), 0);
    }
}

#[test]
fn what_is_too_long_is_refused_on_both_sides() {
    let (_, mut host, mut counters) = pair(8);
    assert_eq!(host.send(&[]), Err(BadLength));
    assert_eq!(host.send(&[0; 4096]), Err(BadLength));
    host.send(&[0; 100]).unwrap();
    let mut small = Endpoint::<64, 64>::new(0x580, 8);
    small.receive(&host.next_frame(0).unwrap(), &mut counters);
    host.receive(&small.next_frame(0).unwrap(), &mut counters);
    assert!(!host.is_sending());
    assert_eq!(counters.get(Counter::MessageTooLong), 2);
    // The 32-bit length of longer messages.
    let escape = Frame::new(0x600, &[0x10, 0, 0, 0, 0x20, 0, 1, 2]).unwrap();
    assert_eq!(small.receive(&escape, &mut counters), None);
    assert_eq!(small.next_frame(0).unwrap().data(), [0x32, 8, 0]);
}

#[test]
fn a_lost_segment_drops_the_message_and_the_next_one_arrives() {
    let mut pair = pair(0);
    pair.1.send(&[7; 100]).unwrap();
    let first = pair.1.next_frame(0).unwrap();
    pair.0.receive(&first, &mut pair.2);
    let go_on = pair.0.next_frame(0).unwrap();
    pair.1.receive(&go_on, &mut pair.2);
    let _lost = pair.1.next_frame(0).unwrap();
    assert_eq!(talk(&mut pair).0, StdVec::<StdVec<u8>>::new());
    assert!(pair.2.get(Counter::SegmentSequence) > 0);
    pair.1.send_again();
    assert_eq!(talk(&mut pair).0, [[7; 100]]);
}

#[test]
fn a_separation_time_is_kept() {
    let (_, mut host, mut counters) = pair(0);
    host.send(&[1; 30]).unwrap();
    host.next_frame(0).unwrap();
    let go_on = |st| Frame::new(0x580, &[0x30, 0, st]).unwrap();
    host.receive(&go_on(2), &mut counters);
    let start = u32::MAX - 500;
    assert!(host.next_frame(start).is_some());
    assert!(host.next_frame(start.wrapping_add(1999)).is_none());
    assert!(host.next_frame(start.wrapping_add(2000)).is_some());
    assert_eq!([0x7F, 0xF1, 0xF9, 0x80].map(separation_us), [127_000, 100, 900, 127_000]);
}

#[test]
fn few_frames_carry_an_image() {
    // 7 of 8 bytes of a segment are payload: 1 kB takes 147 segments, a first one included.
    let mut pair = pair(crate::service::BLOCK_SIZE);
    pair.1.send(&[3; 1030]).unwrap();
    talk(&mut pair);
    assert_eq!(pair.2.get(Counter::Segment), 1 + 147 + 3);
}

proptest! {
    /// P03: whatever arrives in whatever order, nothing panics and every frame is counted.
    #[test]
    fn p03_any_frames_are_counted(
        frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=8), 0..200),
        sending: bool,
    ) {
        let mut endpoint = Endpoint::<64, 64>::new(0x580, 4);
        let mut counters = Counters::default();
        if sending {
            endpoint.send(&[1; 60]).unwrap();
        }
        for data in &frames {
            endpoint.receive(&Frame::new(0x600, data).unwrap(), &mut counters);
            endpoint.next_frame(0);
        }
        let counted: u32 = counters.iter().map(|(_, n)| n).sum();
        prop_assert_eq!(counted as usize, frames.len());
    }

    #[test]
    fn a_message_arrives_after_any_garbage(
        garbage in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=8), 0..20),
        message in prop::collection::vec(any::<u8>(), 1..300),
    ) {
        let mut pair = pair(4);
        for data in &garbage {
            pair.0.receive(&Frame::new(0x600, data).unwrap(), &mut pair.2);
        }
        while pair.0.next_frame(0).is_some() {}
        pair.1.send(&message).unwrap();
        prop_assert_eq!(talk(&mut pair).0, [message]);
    }
}
