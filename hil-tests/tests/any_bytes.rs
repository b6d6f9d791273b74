//! P03: any bytes with any id and any length raise one named counter, cause no panic and change no output.
//!
//! In process `CATHFORCE_EXECUTIONS` says how many frames are tried:
//! `CATHFORCE_EXECUTIONS=100000000 cargo test --release -p cathforce-hil-tests --test any_bytes`.

use std::collections::VecDeque;

use cathforce_bus::{Command, Counter, Counters, EXTENDED, Frame, Id, Process, Sync, crc8, slcan};
use cathforce_control::Mode;
use cathforce_hil_tests::{Bench, Chance, Drive, Rig, Tick, encoder, strong_image};
use cathforce_link::qemu::Qemu;
use cathforce_link::{Link, Sim};

const START: Drive = Drive { insertion_m: 0.03, rotation_rad: 0.0 };
const FEED_M: f64 = 20e-6;

/// Ids of protected frames, as listed in the book's page on frames.
const PROTECTED: [u32; 14] = [
    0x080, 0x100, 0x108, 0x10A, 0x10B, 0x110, 0x180, 0x190, 0x1A0, 0x1A8, 0x1B0, 0x1B8, 0x1C0,
    0x1C8,
];
/// Ids that the device listens to.
const OWN: [u32; 6] = [0x080, 0x100, 0x108, 0x10A, 0x10B, 0x110];
const SERVICE: u32 = 0x600;

fn frame(id: u32, data: &[u8]) -> Frame {
    Frame::new(id, data).expect("11 bits and 8 bytes")
}

/// A frame under `id`, one of [`OWN`], that is not valid for it, and the counter that it raises.
fn broken(chance: &mut Chance, id: u32) -> (Frame, Counter) {
    let len = if chance.once_in(2) { 8 } else { chance.below(9) as usize };
    let mut data = chance.bytes(len);
    let Ok(whole) = <[u8; 8]>::try_from(&data[..]) else {
        return (frame(id, &data), Counter::WrongLength);
    };
    let [body @ .., crc] = whole;
    if chance.once_in(4) {
        // Made for another id.
        data[7] = crc8(chance.pick(&PROTECTED), body);
    }
    if data[7] == crc8(id, body) {
        data[7] ^= 1 << (crc % 8);
    }
    let other = PROTECTED.iter().any(|&other| other != id && crc8(other, body) == data[7]);
    (frame(id, &data), if other { Counter::Masquerade } else { Counter::Corrupt })
}

/// A frame under an id that the device does not listen to.
fn foreign(chance: &mut Chance) -> Frame {
    loop {
        let id = match chance.below(4) {
            0 => chance.pick(&PROTECTED),
            // The same number with 29 bits is another identifier.
            1 => chance.pick(&PROTECTED) | EXTENDED,
            _ => chance.below(0x800) as u32,
        };
        if id != SERVICE && !OWN.contains(&id) {
            let len = chance.below(9) as usize;
            return frame(id, &chance.bytes(len));
        }
    }
}

/// A line of SLCAN that is no frame of ours, and the counter that it raises.
fn line(chance: &mut Chance) -> (Vec<u8>, Option<Counter>) {
    // Neither ends a line nor is ignored before it.
    let garbage = |chance: &mut Chance, n: usize| -> Vec<u8> {
        let bytes = chance.bytes(n).into_iter();
        bytes.map(|b| if matches!(b, b'\r' | b'\n' | 7) { b'?' } else { b }).collect()
    };
    let (mut line, counter) = match chance.below(8) {
        0 => (chance.pick(&["O", "C", "S8", "L", "z", ""]).into(), None),
        1 => {
            let foreign = ["T1ABCDEF02A5B6", "r1234", "R000000118", "T000001000"];
            (chance.pick(&foreign).into(), Some(Counter::Foreign))
        }
        2 => {
            let n = 31 + chance.below(200) as usize;
            (garbage(chance, n), Some(Counter::LineTooLong))
        }
        3 | 4 => {
            let broken = ["t", "t10", "t1009", "t10", "t1002A", "t8000", "tZZZ0", "S9", "Oh", "T"];
            (chance.pick(&broken).into(), Some(Counter::LineBroken))
        }
        5 => {
            // Cut off in the middle.
            let whole = slcan::encode(&frame(0x100, &[0x55; 8]));
            let cut = 1 + chance.below(whole.len() as u64 - 2) as usize;
            (whole[..cut].to_vec(), Some(Counter::LineBroken))
        }
        _ => {
            let n = chance.below(29) as usize;
            let mut bytes =
                vec![chance.pick(b"#abcdefghijklmnopquvwxyABDEFGHIJKMNPQUVWXY\0\xFF\x80")];
            bytes.extend(garbage(chance, n));
            (bytes, Some(Counter::LineUnknown))
        }
    };
    line.push(b'\r');
    (line, counter)
}

/// A frame under the service's id that belongs to no message, and the counter that it raises.
fn service(chance: &mut Chance) -> (Frame, &'static [Counter]) {
    let n = 1 + chance.below(7) as usize;
    let mut data = chance.bytes(n);
    let counters: &[Counter] = match chance.below(6) {
        0 => {
            data.clear();
            &[Counter::SegmentBroken]
        }
        1 => {
            data[0] |= 0x40;
            &[Counter::SegmentBroken]
        }
        2 => {
            data[0] = 0x20 | data[0] & 0xF;
            &[Counter::SegmentSequence]
        }
        3 => {
            data = vec![0x30, 0, 0];
            &[Counter::SegmentSequence]
        }
        4 => {
            data = vec![0x1F, 0xFF, 1, 2, 3, 4, 5, 6];
            &[Counter::MessageTooLong]
        }
        _ => {
            data.insert(0, n as u8);
            &[Counter::Segment, Counter::MessageBroken]
        }
    };
    (frame(SERVICE, &data), counters)
}

/// Noise on the board's bus, and the counters that it must have raised.
struct Noise {
    chance: Chance,
    expected: Counters,
    /// The drive's last frames, newest last.
    sent: VecDeque<Frame>,
}

impl Noise {
    fn make(&mut self, bench: &mut Bench<Qemu>) {
        for _ in 0..self.chance.below(9) {
            let chance = &mut self.chance;
            match chance.below(5) {
                0 => {
                    let frame = foreign(chance);
                    self.send(bench, frame, Counter::Foreign);
                }
                1 => {
                    let (frame, counter) = broken(chance, 0x080);
                    self.send(bench, frame, counter);
                }
                2 => {
                    let (frame, counters) = service(chance);
                    counters.iter().for_each(|&counter| self.expected.count(counter));
                    bench.link_mut().send(&frame).expect("alive");
                }
                3 if chance.once_in(4) => {
                    let nothing = Process::Sync(Sync { grant: 0, host_tick: 0 });
                    let frame = bench.seal(nothing);
                    self.send(bench, frame, Counter::BadValue);
                }
                _ => {
                    let (bytes, counter) = line(chance);
                    counter.into_iter().for_each(|counter| self.expected.count(counter));
                    bench.link_mut().send_bytes(&bytes);
                }
            }
        }
    }

    /// Noise under the ids that the output depends on, too little to cause a fault.
    fn make_close(&mut self, bench: &mut Bench<Qemu>) {
        let (frame, counter) = match self.chance.below(5) {
            0 | 1 => {
                let id = self.chance.pick(&[0x100, 0x108, 0x10A, 0x110]);
                broken(&mut self.chance, id)
            }
            2 => (self.sent[self.sent.len() - 1], Counter::Repeat),
            3 => (self.sent[self.chance.below(4) as usize], Counter::Reordered),
            _ => {
                // The next command, intact, with a code that means nothing.
                let sealed = bench.command(Command::Disarm);
                let mut data: [u8; 8] = sealed.data().try_into().expect("8 bytes");
                data[0] = 9;
                let [body @ .., _] = data;
                data[7] = crc8(0x110, body);
                (frame(0x110, &data), Counter::BadValue)
            }
        };
        self.send(bench, frame, counter);
    }

    fn send(&mut self, bench: &mut Bench<Qemu>, frame: Frame, counter: Counter) {
        self.expected.count(counter);
        bench.link_mut().send(&frame).expect("alive");
    }
}

fn changes(before: &Counters, after: &Counters) -> Vec<(&'static str, u32)> {
    let pairs = after.iter().map(|(counter, n)| (counter.name(), n - before.get(counter)));
    pairs.filter(|&(_, n)| n > 0).collect()
}

fn advance(at: &mut Drive) -> Drive {
    at.insertion_m += FEED_M;
    *at
}

fn clean<R: Rig>(ticks: usize) -> Vec<Tick> {
    let mut at = START;
    let mut bench = Bench::<R>::armed(strong_image(), at);
    bench.play((0..ticks).map(|_| vec![encoder(advance(&mut at))]))
}

#[test]
fn p03_noise_on_the_bus_of_the_armed_board_is_counted_by_name_and_changes_no_bit() {
    const TICKS: usize = 600;
    let expected = clean::<Sim>(TICKS);
    assert!(expected.iter().all(|tick| tick.mode() == Some(Mode::Armed)));
    assert!(expected.iter().filter(|tick| !tick.is_silent()).count() > TICKS / 2);

    let mut at = START;
    let mut bench = Bench::<Qemu>::armed(strong_image(), at);
    let (first, begin) = (bench.report().counters, bench.report().counters);
    let mut noise =
        Noise { chance: Chance::new(1), expected: Counters::default(), sent: VecDeque::new() };
    for (n, expected) in expected.iter().enumerate() {
        noise.make(&mut bench);
        if n >= 5 && n % 5 == 0 {
            noise.make_close(&mut bench);
        }
        let sample = bench.encoder(advance(&mut at));
        noise.sent.push_back(sample);
        if noise.sent.len() > 5 {
            noise.sent.pop_front();
        }
        assert_eq!(bench.tick(&[sample]).outputs(), expected.outputs(), "tick {n}");
    }
    // A report itself costs segments, as many as between the two reports before.
    let mut wanted = noise.expected;
    for (counter, n) in begin.iter() {
        wanted.add(counter, n - first.get(counter));
    }
    wanted.add(Counter::Accepted, 2 * TICKS as u32);
    let end = bench.report();
    assert_eq!(changes(&begin, &end.counters), changes(&Counters::default(), &wanted));
    assert_eq!(end.load.missed_ticks, 0);
    // The noise included every kind.
    let kinds = [
        Counter::Repeat,
        Counter::Reordered,
        Counter::Masquerade,
        Counter::Corrupt,
        Counter::WrongLength,
        Counter::BadValue,
        Counter::Foreign,
        Counter::LineUnknown,
        Counter::LineBroken,
        Counter::LineTooLong,
        Counter::SegmentSequence,
        Counter::SegmentBroken,
        Counter::MessageTooLong,
        Counter::MessageBroken,
    ];
    for kind in kinds {
        assert!(wanted.get(kind) > 0, "no {kind:?} in the noise");
    }
}

fn executions() -> u64 {
    let asked = std::env::var("CATHFORCE_EXECUTIONS");
    asked.map_or(2_000_000, |n| n.parse().expect("CATHFORCE_EXECUTIONS is a number"))
}

/// Frames between two ticks.
const EACH_TICK: u64 = 1000;
/// Range of the drive, which moves to and fro.
const WAY_TICKS: u64 = 2000;

#[test]
fn p03_any_frame_is_counted_once_and_changes_no_bit_in_process() {
    let mut chance = Chance::new(2);
    let at = |tick: u64| {
        let there = tick % (2 * WAY_TICKS);
        let steps = there.min(2 * WAY_TICKS - there);
        Drive { insertion_m: START.insertion_m + FEED_M * steps as f64, ..START }
    };
    let mut clean = Bench::<Sim>::armed(strong_image(), at(0));
    let mut noisy = Bench::<Sim>::armed(strong_image(), at(0));
    let counted = |bench: &Bench<Sim>| -> u64 {
        let counters = bench.ticker().counters();
        Counter::FRAME_KINDS.iter().map(|&kind| u64::from(counters.get(kind))).sum()
    };
    let (mut done, mut pushed) = (0, 0);
    for tick in 1..=executions().div_ceil(EACH_TICK) {
        for n in 0..EACH_TICK {
            let (frame, kind) = match chance.below(8) {
                0 => {
                    let len = chance.below(9) as usize;
                    (frame(SERVICE, &chance.bytes(len)), None)
                }
                1..3 => {
                    let (frame, kind) = broken(&mut chance, 0x080);
                    (frame, Some(kind))
                }
                _ if n == 0 && tick.is_multiple_of(4) => {
                    let id = chance.pick(&[0x100, 0x108, 0x10A, 0x110]);
                    let (frame, kind) = broken(&mut chance, id);
                    (frame, Some(kind))
                }
                _ => (foreign(&mut chance), Some(Counter::Foreign)),
            };
            let of_kind = |bench: &Bench<Sim>| kind.map(|k| bench.ticker().counters().get(k));
            let before = (counted(&noisy), of_kind(&noisy));
            noisy.link_mut().send(&frame).expect("in process");
            let after = (before.0 + u64::from(kind.is_some()), before.1.map(|n| n + 1));
            assert_eq!((counted(&noisy), of_kind(&noisy)), after, "{frame}");
            done += 1;
        }
        let [quiet, loud] = [&mut clean, &mut noisy].map(|bench| {
            let sample = bench.encoder(at(tick));
            bench.tick(&[sample])
        });
        assert_eq!(loud.outputs(), quiet.outputs(), "after {done} frames");
        assert_eq!(loud.mode(), Some(Mode::Armed), "after {done} frames");
        pushed += u64::from(!loud.is_silent());
    }
    assert!(done >= executions() && pushed * 2 * EACH_TICK > done, "{pushed} ticks with output");
    let digests = [&clean, &noisy].map(|bench| bench.ticker().outputs().map(|o| o.digest));
    assert_eq!(digests[0], digests[1]);
}

/// The board reads as many frames from a text as were written, whatever lies between them.
#[test]
fn p03_any_bytes_between_lines_lose_no_line_after_them() {
    let (mut chance, mut decoder) = (Chance::new(3), slcan::Decoder::default());
    for _ in 0..executions() / 50 {
        let id = chance.below(0x800) as u32;
        let len = chance.below(9) as usize;
        let wanted = frame(id, &chance.bytes(len));
        let (noise, counter) = line(&mut chance);
        let lines: Vec<_> = noise.iter().filter_map(|&byte| decoder.push(byte)).collect();
        let [found] = lines[..] else { panic!("{noise:?} is one line, not {lines:?}") };
        match found {
            slcan::Line::Bad(bad) => assert_eq!(Some(bad.counter()), counter, "{noise:?}"),
            slcan::Line::Frame(frame) if frame.is_extended() => {
                assert_eq!(counter, Some(Counter::Foreign), "{noise:?}");
            }
            slcan::Line::Foreign => assert_eq!(counter, Some(Counter::Foreign), "{noise:?}"),
            _ => assert_eq!(counter, None, "{noise:?}"),
        }
        let text = slcan::encode(&wanted);
        let found = text.iter().filter_map(|&byte| decoder.push(byte)).last();
        assert_eq!(found, Some(slcan::Line::Frame(wanted)));
        assert!(Id::from_raw(id).is_none_or(|known| known.raw() == id));
    }
}
