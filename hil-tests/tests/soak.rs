//! P25: hours of virtual time with occasional disturbances. Every disturbance must show in the expected
//! counter, and no other counter may change.
//!
//! The example's first trial is played to and fro on an armed device. The suite plays long enough for the
//! tick number to wrap; `CATHFORCE_SOAK_HOURS=4` plays 4 hours in process, `CATHFORCE_SOAK_BOARD_HOURS=1` an
//! hour on the board.

use std::fmt::Write as _;
use std::time::Instant;

use cathforce_bus::service::Status as Report;
use cathforce_bus::{Counter, Frame};
use cathforce_config::Settings;
use cathforce_control::Mode;
use cathforce_hil_tests::{Bench, Chance, Drive, LimitWatch, Rig, Tick, bundle, drives, image};
use cathforce_link::Sim;
use cathforce_link::qemu::Qemu;

const HOURS: &str = "CATHFORCE_SOAK_HOURS";
const BOARD_HOURS: &str = "CATHFORCE_SOAK_BOARD_HOURS";
/// Longer than the 65.5 s after which the numbers in TICK frames wrap.
const SIM_TICKS: usize = 80_000;
const BOARD_TICKS: usize = 2_000;
/// A disturbance once in so many ticks; 3 of 10 samples would be a fault.
const EVERY: u64 = 97;
/// Counters of segmented transfers, which requests to the device raise.
const SEGMENTS: [Counter; 1] = [Counter::Segment];

/// Disturbances on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Disturbance {
    /// A sample never arrives.
    Lost,
    /// It arrives with a flipped bit.
    Damaged,
    /// It arrives twice.
    Twice,
    /// The next one arrives with it.
    Early,
    /// The next one arrives before it.
    Overtaken,
    /// A frame of its identifier is too short.
    Short,
    /// A frame with an identifier that nobody on this bus uses.
    Foreign,
}

const ALL: [Disturbance; 7] = [
    Disturbance::Lost,
    Disturbance::Damaged,
    Disturbance::Twice,
    Disturbance::Early,
    Disturbance::Overtaken,
    Disturbance::Short,
    Disturbance::Foreign,
];

/// Expected counters of the device.
#[derive(Default)]
struct Expected {
    counts: [u32; Counter::COUNT],
    /// A sample is missing before the next one that arrives.
    hole: bool,
}

impl Expected {
    fn add(&mut self, counter: Counter) {
        self.counts[counter as usize] += 1;
    }

    /// Counts an accepted sample.
    fn taken(&mut self) {
        let after_loss = std::mem::take(&mut self.hole);
        self.add(if after_loss { Counter::AfterLoss } else { Counter::Accepted });
        if after_loss {
            self.add(Counter::Lost);
        }
    }

    /// How the device's counters differ from the expected ones; `None` if they do not.
    fn differs(&self, report: &Report) -> Option<String> {
        let mut text = String::new();
        for (counter, count) in report.counters.iter().filter(|(c, _)| !SEGMENTS.contains(c)) {
            let expected = self.counts[counter as usize];
            if count != expected {
                let _ = writeln!(text, "{counter:?}: {count}, foreseen {expected}");
            }
        }
        (!text.is_empty()).then_some(text)
    }
}

/// The frames of one tick, disturbed.
fn frames<R: Rig>(
    bench: &mut Bench<R>,
    at: Drive,
    disturbance: Option<Disturbance>,
    expected: &mut Expected,
) -> Vec<Frame> {
    let frame = bench.encoder(at);
    let cut = |frame: &Frame, bytes: &[u8]| Frame::new(frame.id(), bytes).expect("shorter");
    let Some(disturbance) = disturbance else {
        expected.taken();
        return vec![frame];
    };
    match disturbance {
        Disturbance::Lost => {
            expected.hole = true;
            vec![]
        }
        Disturbance::Damaged => {
            let mut bytes = frame.data().to_vec();
            bytes[0] ^= 1;
            expected.add(Counter::Corrupt);
            expected.hole = true;
            vec![cut(&frame, &bytes)]
        }
        Disturbance::Twice => {
            expected.taken();
            expected.add(Counter::Repeat);
            vec![frame, frame]
        }
        Disturbance::Early => {
            expected.taken();
            expected.taken();
            expected.add(Counter::Superseded);
            vec![frame, bench.encoder(at)]
        }
        Disturbance::Overtaken => {
            expected.hole = true;
            expected.taken();
            expected.add(Counter::Reordered);
            vec![bench.encoder(at), frame]
        }
        Disturbance::Short => {
            expected.taken();
            expected.add(Counter::WrongLength);
            vec![cut(&frame, &frame.data()[..7]), frame]
        }
        Disturbance::Foreign => {
            expected.taken();
            expected.add(Counter::Foreign);
            vec![Frame::new(0x7F3, &[1, 2, 3]).expect("a frame"), frame]
        }
    }
}

/// Observations of one lap to and fro.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Lap {
    /// Largest components of the force on the vessel and of the haptic force, in codes of their frames.
    force: u16,
    felt: u16,
}

impl Lap {
    fn see(&mut self, tick: &Tick) {
        let largest = tick.contact.force.iter().map(|f| f.0.unsigned_abs()).max();
        self.force = self.force.max(largest.unwrap_or(0));
        self.felt = self.felt.max(tick.haptic.force.0.unsigned_abs());
    }
}

/// Result of a soak.
struct Soaked {
    laps: Vec<Lap>,
    /// Reports after the first lap (or halfway, if no lap ends) and at the end.
    reports: [Report; 2],
    memory: [Option<u64>; 2],
}

fn soak<R: Rig>(ticks: usize) -> Soaked {
    let way = drives(bundle().trial(0).expect("in the example")).collect::<Vec<_>>();
    let lap_ticks = 2 * way.len();
    let way = way.iter().chain(way.iter().rev()).copied().cycle();
    let mut bench = Bench::<R>::armed(image(), *way.clone().next().as_ref().expect("rows"));
    let mut watch = LimitWatch::new(&Settings::default());
    bench.reset_counters();
    let (mut chance, mut expected) = (Chance::new(25), Expected::default());
    let (mut laps, mut since) = (Vec::new(), 0);
    let mut middle = None;
    let first = bench.report().tick;
    let middle_at = if ticks > 2 * lap_ticks { lap_ticks } else { ticks / 2 };
    for (i, at) in way.take(ticks).enumerate() {
        since += 1;
        // Disturbances are so far apart that no ten samples contain two.
        let disturbed = since > 10 && chance.once_in(EVERY);
        let disturbance = disturbed.then(|| chance.pick(&ALL));
        if disturbed {
            since = 0;
        }
        let frames = frames(&mut bench, at, disturbance, &mut expected);
        let tick = bench.tick(&frames);
        expected.add(Counter::Accepted); // its SYNC
        assert_eq!(tick.mode(), Some(Mode::Armed), "tick {i}: {tick:?}");
        watch.check(&tick);
        if i.is_multiple_of(lap_ticks) {
            laps.push(Lap::default());
        }
        laps.last_mut().expect("the first tick makes one").see(&tick);
        if i == middle_at {
            middle = Some((bench.report(), memory_bytes()));
        }
    }
    let (end, memory) = (bench.report(), memory_bytes());
    assert_eq!(end.tick.wrapping_sub(first), u32::try_from(ticks).expect("less than 49 days"));
    if let Some(why) = expected.differs(&end) {
        panic!("after {ticks} ticks\n{why}");
    }
    if laps.len() > 1 && !ticks.is_multiple_of(lap_ticks) {
        // An incomplete lap does not count.
        laps.pop();
    }
    let (middle, before) = middle.expect("there is a middle");
    Soaked { laps, reports: [middle, end], memory: [before, memory] }
}

/// Memory of this process, if the system reports it.
fn memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
}

/// This number of ticks, or that of the hours that a variable asks for.
fn asked(variable: &str, ticks: usize) -> usize {
    let hours = std::env::var(variable).ok().map(|hours| hours.parse::<f64>().expect("a number"));
    hours.map_or(ticks, |hours| (3.6e6 * hours) as usize)
}

fn say(what: &str, ticks: usize, started: Instant, soaked: &Soaked) {
    let [before, after] = soaked.memory.map(|bytes| bytes.unwrap_or(0) / 1024);
    println!(
        "{what}: {ticks} ticks ({:.2} h of virtual time) in {:.0} s, {} laps; memory {before} KiB, \
         then {after} KiB",
        ticks as f64 / 3.6e6,
        started.elapsed().as_secs_f64(),
        soaked.laps.len(),
    );
    let counts = soaked.reports[1].counters.iter().filter(|(_, count)| *count > 0);
    let counts = counts.map(|(counter, count)| format!("{counter:?} {count}"));
    println!("{}", counts.collect::<Vec<_>>().join(", "));
    println!(
        "first laps {:?}, last {:?}",
        &soaked.laps[..soaked.laps.len().min(3)],
        soaked.laps.last()
    );
}

#[test]
fn p25_hours_in_process_leave_every_counter_explained_and_no_memory_behind() {
    let (ticks, started) = (asked(HOURS, SIM_TICKS), Instant::now());
    let soaked = soak::<Sim>(ticks);
    say("in process", ticks, started, &soaked);
    assert_eq!(soaked.reports[1].load.missed_ticks, 0);
    if let [Some(before), Some(after)] = soaked.memory {
        assert!(after < before + (1 << 20), "{before} bytes, then {after}");
    }
    // Every lap has the same motion with other disturbances, so estimates neither grow nor fade.
    let (second, last) = (soaked.laps[1], soaked.laps[soaked.laps.len() - 1]);
    for (before, after) in [(second.force, last.force), (second.felt, last.felt)] {
        assert!(before.abs_diff(after) <= 1 + before / 5, "{second:?}, then {last:?}");
    }
}

#[test]
fn p25_the_board_misses_no_tick_and_its_stack_does_not_grow() {
    let (ticks, started) = (asked(BOARD_HOURS, BOARD_TICKS), Instant::now());
    let soaked = soak::<Qemu>(ticks);
    say("on the board", ticks, started, &soaked);
    let [middle, end] = soaked.reports.map(|report| report.load);
    println!(
        "worst tick {} instructions, stack {} bytes",
        end.worst_instructions, end.stack_used_bytes
    );
    assert_eq!(end.missed_ticks, 0);
    assert!(end.stack_used_bytes > 0 && end.stack_used_bytes == middle.stack_used_bytes);
}
