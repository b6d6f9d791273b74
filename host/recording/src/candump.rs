//! Logs of a bus: written as `candump -l` does, and read from any tool.
//!
//! The direction of a frame follows from its identifier.

use std::io::{self, Read, Write};

use cathforce_bus::master::Master;
use cathforce_bus::{Direction, Frame, Id, Placement, Process, Sync, Tick, crc8};

use crate::bus_log::{BusLog, LogError, LogFormat};
use crate::format::clock::BusClock;
use crate::format::frame::BusFrame;

/// A log: its frames, and what was found beside them.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct CandumpLog {
    /// Frames in the order of the log; the first one has time 0.
    pub frames: Vec<BusFrame>,
    /// Time of the first frame as the log states it \[ns\].
    pub started_ns: u64,
    /// Frames of other senders: remote, CAN FD, or of no identifier of ours.
    pub foreign: usize,
    /// Where the device began its ticks again.
    pub second_run: Option<SecondRun>,
    /// Where ticks of a device in lock step are first missing.
    pub gap: Option<Gap>,
    /// Frames with an identifier of ours that have our checksum, and those that have not.
    pub intact: usize,
    pub broken: usize,
    /// The tool that wrote the log; `None` without a log.
    pub format: Option<LogFormat>,
    /// The channel whose frames these are, if the log has several.
    pub channel: Option<String>,
    /// What was left out, with its place.
    pub remarks: Vec<String>,
}

/// A device that was configured or switched on again. Its ticks and counters began again, and its image
/// may be another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SecondRun {
    /// Line of the first frame that shows it, from 1.
    pub line: usize,
    /// Last line of the run before.
    pub last_before: usize,
    /// The device's last tick number before, and the number with which it continues.
    pub ticks: (u16, u16),
}

/// Ticks that are missing in the log of a device in lock step. Either the logger lost them, or the log
/// continues with another run whose beginning was cut off. If both hosts count alike, the frames do not
/// tell which, and in lock step the time does not tell the number of ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Line of the TICK frame after the gap, from 1, and of the one before.
    pub line: usize,
    pub line_before: usize,
    /// Numbers of that TICK frame and the one before.
    pub ticks: (u16, u16),
    /// Ticks with frames in the log since the TICK frame before.
    pub seen: u16,
}

/// Why a log cannot be put on the device's own time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoLockStep {
    /// The log's first tick is not the first of a configuration; `None`: the log has no tick.
    Begins(Option<u16>),
    /// Ticks are missing, so that a replay would lack their frames.
    Lacks(Gap),
}

/// Longest time without a frame that is not remarked \[ns\]: a device sends a thousand frames in it.
const SILENCE_NS: u64 = 1_000_000_000;

/// Writes frames like `candump -l`, sorted by time. In lock step frames to the device cross the bus before
/// the answers to earlier ticks.
///
/// `started_ns`: time of day at time 0 of the frames.
pub fn write_candump(
    frames: &[BusFrame],
    started_ns: u64,
    interface: &str,
    mut out: impl Write,
) -> io::Result<()> {
    let mut frames = frames.iter().collect::<Vec<_>>();
    frames.sort_by_key(|frame| frame.at_ns);
    for frame in frames {
        let us = started_ns.saturating_add(frame.at_ns) / 1000;
        let (s, us) = (us / 1_000_000, us % 1_000_000);
        writeln!(out, "({s:010}.{us:06}) {interface} {}", frame.frame)?;
    }
    out.flush()
}

/// Reads a log of any tool, see [`read_log`].
pub fn read_candump(mut log: impl Read, master: &Master) -> Result<CandumpLog, LogError> {
    let mut bytes = Vec::new();
    log.read_to_end(&mut bytes).map_err(|e| LogError {
        line: 1,
        problem: format!("cannot be read: {e}"),
        fix: "give a log that can be read",
    })?;
    read_log(&bytes, master, None, Placement::UNMOVED)
}

/// Reads a log of any tool. Frames with other identifiers than ours are taken if `master` describes them.
///
/// `placement`: where the identifiers lie on the logged bus.
///
/// Of several channels that one is taken which `channel` names, or the only one with frames of ours.
/// Errors: what stands there is no frame, time goes back, or several channels have frames of ours.
pub fn read_log(
    bytes: &[u8],
    master: &Master,
    channel: Option<&str>,
    placement: Placement,
) -> Result<CandumpLog, LogError> {
    let mut log = BusLog::read(bytes)?;
    for logged in &mut log.frames {
        logged.frame = logged.frame.map(|frame| placement.exchange(frame));
    }
    let channel = chosen(&log, master, channel)?;
    let several = log.channels.len() > 1;
    let mut found = CandumpLog {
        format: Some(log.format),
        channel: channel.filter(|_| several).map(|index| log.channels[index].clone()),
        remarks: log.remarks,
        ..CandumpLog::default()
    };
    let mut before_ns: Option<u64> = None;
    let mut runs = Runs::default();
    let own =
        log.frames.iter().filter(|logged| channel.is_none_or(|channel| channel == logged.channel));
    for logged in own {
        let at_ns = logged.at_ns;
        if before_ns.is_some_and(|before_ns| at_ns < before_ns) {
            return Err(LogError {
                line: logged.line,
                problem: "time goes back".into(),
                fix: "take the lines in the order in which they were logged, and logs of different \
                      times one by one",
            });
        }
        let waited_ns = before_ns.map_or(0, |before_ns| at_ns - before_ns);
        if waited_ns > SILENCE_NS {
            let seconds = waited_ns as f64 * 1e-9;
            found
                .remarks
                .push(format!("line {}: no frame for {seconds:.3} s before it", logged.line));
        }
        if before_ns.replace(at_ns).is_none() {
            found.started_ns = at_ns;
        }
        let known = logged.frame.and_then(|frame| Some((frame, direction(&frame, master)?)));
        let Some((frame, direction)) = known else {
            found.foreign += 1;
            continue;
        };
        match has_checksum(&frame) {
            Some(true) => found.intact += 1,
            Some(false) => found.broken += 1,
            None => {}
        }
        let at_ns = at_ns - found.started_ns;
        let frame = BusFrame { at_ns, direction, frame };
        found.second_run = found.second_run.or(runs.take(logged.line, &frame));
        found.frames.push(frame);
    }
    found.gap = runs.gap;
    // Without a day the log's time is no time of day.
    if log.started_ns == 0 {
        found.started_ns = 0;
    }
    Ok(found)
}

/// The index of the channel that is read; `None` for all frames of a log with one channel.
fn chosen(log: &BusLog, master: &Master, name: Option<&str>) -> Result<Option<usize>, LogError> {
    let wrong = |problem: String, fix| LogError { line: 1, problem, fix };
    let names =
        || log.channels.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if let Some(name) = name {
        let found = log.channels.iter().position(|channel| channel == name);
        let problem = || format!("there is no channel `{name}`; the log has {}", names());
        return found.map(Some).ok_or_else(|| wrong(problem(), "name one of them with --channel"));
    }
    if log.channels.len() < 2 {
        return Ok(None);
    }
    let is_own = |frame: &Frame| has_checksum(frame) == Some(true) || master.has(frame.id());
    let has_own = |index: &usize| {
        let mut frames = log.frames.iter().filter(|logged| logged.channel == *index);
        frames.any(|logged| logged.frame.is_some_and(|frame| is_own(&frame)))
    };
    match (0..log.channels.len()).filter(has_own).collect::<Vec<_>>()[..] {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        _ => {
            let problem = format!("several channels have frames of ours: the log has {}", names());
            Err(wrong(problem, "name the one that is meant with --channel"))
        }
    }
}

/// Whether a frame with an identifier of ours has our checksum; `None` if that identifier has none.
pub fn has_checksum(frame: &Frame) -> Option<bool> {
    let id = Id::from_raw(frame.id())?;
    if matches!(id, Id::ServiceRequest | Id::ServiceResponse) {
        return None;
    }
    let Some((crc, body)) = frame.data().split_last() else { return Some(false) };
    Some(
        body.first_chunk().is_some_and(|body: &[u8; 7]| {
            frame.data().len() == 8 && crc8(frame.id(), *body) == *crc
        }),
    )
}

/// Detects the tick at which a device begins again.
#[derive(Default)]
struct Runs {
    /// Number and digest of the last TICK frame.
    last: Option<Tick>,
    /// When that was \[ns\], and in which line.
    last_ns: u64,
    last_line: usize,
    /// Ticks seen since then.
    seen: u16,
    /// Ticks are granted by SYNC frames, so their number says nothing about time.
    in_lock_step: bool,
    grants: Grants,
    gap: Option<Gap>,
    /// The last line since then before a request to the device.
    quiet_until: Option<usize>,
}

impl Runs {
    fn take(&mut self, line: usize, frame: &BusFrame) -> Option<SecondRun> {
        let id = Id::from_raw(frame.frame.id())?;
        match id {
            Id::ServiceRequest => {
                self.quiet_until.get_or_insert(line - 1);
            }
            Id::Sync => {
                self.in_lock_step = true;
                if let Some(Process::Sync(sync)) = Process::decode(id, payload(frame)?) {
                    self.grants.take(sync);
                }
            }
            Id::Haptic => self.seen = self.seen.wrapping_add(1),
            Id::Tick => {
                let Some(Process::Tick(tick)) = Process::decode(id, payload(frame)?) else {
                    return None;
                };
                let last_before = self.quiet_until.take().unwrap_or(line - 1);
                let seen = std::mem::take(&mut self.seen);
                let waited_ns = frame.at_ns - std::mem::replace(&mut self.last_ns, frame.at_ns);
                let line_before = std::mem::replace(&mut self.last_line, line);
                let last = self.last.replace(tick)?;
                let ticks = (last.tick, tick.tick);
                let here = SecondRun { line, last_before, ticks };
                if begins_over(last, tick, seen) {
                    return Some(here);
                }
                if !self.in_lock_step {
                    return is_of_another_time(last, tick, seen, waited_ns).then_some(here);
                }
                if last.digest != 0 && tick.tick.wrapping_sub(last.tick) != seen {
                    self.gap.get_or_insert(Gap { line, line_before, ticks, seen });
                }
                return self.grants.other_host(tick.tick, here);
            }
            _ => {}
        }
        None
    }
}

/// How far a host's count of ticks is ahead of the device's.
///
/// A host that grants one tick at a time and counts them keeps a constant distance to the device's
/// numbers, apart from the ticks under way. Frames that the log has lost do not change it, since both
/// counts continue without them.
#[derive(Default)]
struct Grants {
    /// The host's number in the last SYNC.
    host_tick: Option<u32>,
    /// That number, if it follows the number of the SYNC before and is newer than the last TICK.
    counted: Option<u16>,
    ahead: Option<u16>,
    /// Another distance that was seen, and where it began.
    doubt: Option<(u16, SecondRun)>,
}

impl Grants {
    fn take(&mut self, sync: Sync) {
        let before = self.host_tick.replace(sync.host_tick);
        let follows = before.is_some_and(|before| before.wrapping_add(1) == sync.host_tick);
        self.counted = (sync.grant == 1 && follows).then_some(sync.host_tick as u16);
    }

    /// The place from which the device answers a host with another count: `here`, or where the doubt
    /// began. One TICK frame is no proof, since many frames may be lost between it and the last SYNC.
    fn other_host(&mut self, tick: u16, here: SecondRun) -> Option<SecondRun> {
        /// Largest number of ticks under way: the length of a device's queue of frames.
        const UNDER_WAY: u16 = 64;
        let ahead = self.counted.take()?.wrapping_sub(tick);
        let is_near =
            |other: u16| ahead.wrapping_sub(other).cast_signed().unsigned_abs() <= UNDER_WAY;
        if is_near(*self.ahead.get_or_insert(ahead)) {
            self.doubt = None;
            return None;
        }
        let (before, since) = *self.doubt.get_or_insert((ahead, here));
        let is_sure = since != here && is_near(before);
        self.doubt = Some((ahead, since));
        is_sure.then_some(since)
    }
}

/// Whether two TICK frames cannot belong to one run in which `seen` ticks were logged between them.
/// A device that is not configured has the digest 0 and counts ticks until its configuration.
fn begins_over(last: Tick, next: Tick, seen: u16) -> bool {
    const HALF: u16 = u16::MAX / 2;
    let is_back = next.tick.wrapping_sub(last.tick) > HALF;
    let is_first = next.tick == 0 && last.tick.wrapping_add(seen) != 0;
    last.digest != 0 && (next.digest == 0 || is_back || is_first)
}

/// Whether ticks are missing that do not match the time that has passed. Then two logs were joined, and
/// the later one lacks its beginning.
fn is_of_another_time(last: Tick, next: Tick, seen: u16, waited_ns: u64) -> bool {
    /// Largest delay of a time stamp on a busy computer.
    const LATE_MS: u64 = 200;
    let ticks = next.tick.wrapping_sub(last.tick);
    // The number has 16 bits.
    let passed_ms = waited_ns / 1_000_000;
    let apart = (passed_ms as u16).wrapping_sub(ticks).cast_signed().unsigned_abs();
    last.digest != 0 && ticks > seen && u64::from(apart) > LATE_MS + passed_ms / 100
}

/// Direction of a frame by its identifier; `None` for an identifier that is not ours.
pub fn direction(frame: &Frame, master: &Master) -> Option<Direction> {
    match Id::from_raw(frame.id()) {
        Some(id) if !id.is_from_host() => Some(Direction::ToHost),
        Some(_) => Some(Direction::ToDevice),
        None => master.has(frame.id()).then_some(Direction::ToDevice),
    }
}

impl CandumpLog {
    /// Whether most frames with our identifiers are not ours: the log is of another bus, whose drives and
    /// sensors use the same identifiers.
    pub fn is_foreign(&self) -> bool {
        self.broken > self.intact
    }

    /// The frames of a device in lock step on its own time, from the first tick of a configuration on,
    /// so that they can be replayed. `Err` says what prevents it.
    pub fn in_lock_step(&self) -> Result<Vec<BusFrame>, NoLockStep> {
        if let Some(gap) = self.gap {
            return Err(NoLockStep::Lacks(gap));
        }
        let number = |frame: &BusFrame| match Id::from_raw(frame.frame.id()).zip(payload(frame)) {
            Some((id, bytes)) => match Process::decode(id, bytes) {
                Some(Process::Tick(tick)) if tick.digest != 0 => Some(tick.tick),
                _ => None,
            },
            None => None,
        };
        let first = self.frames.iter().enumerate().find_map(|(at, f)| Some((at, number(f)?)));
        let Some((at, 0)) = first else {
            return Err(NoLockStep::Begins(first.map(|(_, number)| number)));
        };
        // The tick's HAPTIC frame comes before it, and its SYNC before that. No other frame of a tick
        // lies between the configuration and these.
        let is = |frame: &BusFrame, id| Id::from_raw(frame.frame.id()) == Some(id);
        let configured = self.frames[..at]
            .iter()
            .rposition(|f| is(f, Id::ServiceResponse))
            .map_or(0, |service| service + 1);
        let mut clock = BusClock::new(true);
        let frames = self.frames[configured..].iter();
        let on_its_time =
            |f: &BusFrame| BusFrame { at_ns: clock.stamp(f.direction, &f.frame), ..*f };
        Ok(frames.map(on_its_time).collect())
    }
}

fn payload(frame: &BusFrame) -> Option<[u8; 6]> {
    frame.frame.data().first_chunk().copied()
}

#[cfg(test)]
mod tests {
    use cathforce_bus::Sealer;

    use super::*;

    fn frames() -> Vec<BusFrame> {
        let frame = |at_ns, id, data: &[u8], direction| BusFrame {
            at_ns,
            direction,
            frame: Frame::new(id, data).unwrap(),
        };
        vec![
            frame(0, 0x100, &[1, 2, 3, 4, 5, 6, 7, 8], Direction::ToDevice),
            frame(1_000_000, 0x180, &[0xFF; 8], Direction::ToHost),
            frame(1_500_000, 0x580, &[], Direction::ToHost),
        ]
    }

    #[test]
    fn a_log_survives_its_text() {
        let started_ns = 1_700_000_000_123_456_000;
        let mut text = Vec::new();
        write_candump(&frames(), started_ns, "can0", &mut text).unwrap();
        let first = "(1700000000.123456) can0 100#0102030405060708";
        assert_eq!(String::from_utf8_lossy(&text).lines().next(), Some(first));
        let log = read_candump(&text[..], &Master::default()).unwrap();
        assert_eq!((log.frames, log.started_ns), (frames(), started_ns));
        assert_eq!((log.format, log.channel), (Some(LogFormat::Candump), None));
    }

    #[test]
    fn frames_of_others_are_counted_and_left_out() {
        let text = "(1.5) can0 7F3#00 T\n\n(1.5) can0 18FF50E5#0011\n(1.6) can0 100##300\n\
                    (1.7) vcan1 100#R8\n(1.8) can0 100#0102030405060708 R\n";
        let log = read_candump(text.as_bytes(), &Master::default()).unwrap();
        assert_eq!((log.foreign, log.frames.len()), (4, 1));
        assert_eq!(log.frames[0].at_ns, 300_000_000, "from the first line on");
    }

    #[test]
    fn the_log_of_another_bus_is_told_from_ours() {
        let text = "(1.0) can0 210#0102030405060708\n(1.1) can0 290#00FF\n";
        let log = read_candump(text.as_bytes(), &Master::default()).unwrap();
        assert_eq!((log.intact, log.broken, log.is_foreign()), (0, 2, true));
        let own = read_candump(run(&mut Sealer::default(), 0, 3, 7).as_bytes(), &Master::default());
        let own = own.unwrap();
        assert_eq!((own.intact, own.broken, own.is_foreign()), (4, 0, false));
    }

    #[test]
    fn of_several_channels_the_one_with_our_frames_is_taken() {
        let own = run(&mut Sealer::default(), 0, 3, 7);
        let other = "(1.5) can1 210#0102030405060708\n";
        let log = read_candump((own.clone() + other).as_bytes(), &Master::default()).unwrap();
        assert_eq!((log.frames.len(), log.channel.as_deref()), (4, Some("can0")));
        let both = own.clone() + &own.replace("can0", "can1");
        let error =
            read_log(both.as_bytes(), &Master::default(), None, Placement::UNMOVED).unwrap_err();
        assert!(
            error.problem.contains("`can0`, `can1`") && error.fix.contains("--channel"),
            "{error}"
        );
        let one = read_log(both.as_bytes(), &Master::default(), Some("can1"), Placement::UNMOVED)
            .unwrap();
        assert_eq!(one.frames.len(), 4);
        assert!(
            read_log(both.as_bytes(), &Master::default(), Some("can2"), Placement::UNMOVED)
                .is_err()
        );
    }

    #[test]
    fn a_long_silence_is_said() {
        let text = "(1.0) can0 100#00\n(1000001.5) can0 100#00\n";
        let log = read_candump(text.as_bytes(), &Master::default()).unwrap();
        assert_eq!(log.remarks, ["line 2: no frame for 1000000.500 s before it"]);
    }

    /// Lines of a device's HAPTIC and TICK frames, five ticks a TICK, as of `first`, at 1.5 s.
    fn run(sealer: &mut Sealer, first: u16, ticks: u16, digest: u32) -> String {
        run_at("(1.5)", sealer, first, ticks, digest)
    }

    fn run_at(time: &str, sealer: &mut Sealer, first: u16, ticks: u16, digest: u32) -> String {
        let ticks = (0..ticks).map(|k| first.wrapping_add(k)).flat_map(|tick| {
            let haptic = Process::Haptic(cathforce_bus::Haptic {
                force: Default::default(),
                torque: Default::default(),
                mode: 4,
                fault: 0,
            });
            let number = tick.is_multiple_of(5).then_some(Process::Tick(Tick { tick, digest }));
            [Some(haptic), number].into_iter().flatten()
        });
        let line = |process| {
            format!("{time} can0 {}\n", sealer.seal(process, cathforce_bus::Status::default()))
        };
        ticks.map(line).collect()
    }

    #[test]
    fn a_device_that_begins_over_is_seen_at_its_line() {
        let second =
            |text: &str| read_candump(text.as_bytes(), &Master::default()).unwrap().second_run;
        let mut sealer = Sealer::default();
        let whole = run(&mut sealer, 0, 21, 7);
        assert_eq!(second(&whole), None);
        // Ticks before the configuration, and after it.
        let before = run(&mut sealer, 40, 5, 0) + "(1.5) can0 600#00\n";
        assert_eq!(second(&(before.clone() + &whole)), None);
        let again = whole.clone() + "(1.5) can0 600#00\n(1.5) can0 580#00\n" + &whole;
        let expected = SecondRun { line: 30, last_before: 26, ticks: (20, 0) };
        assert_eq!(second(&again), Some(expected));
        // Switched off and on; without its first ticks; more than half of all numbers later.
        assert_eq!(second(&(whole.clone() + &before)).map(|run| run.line), Some(28));
        let late = run(&mut sealer, 10, 5, 9);
        assert_eq!(second(&(whole.clone() + &late)).map(|run| run.ticks), Some((20, 10)));
        let long = run(&mut sealer, 40_000, 5, 7) + &whole;
        assert_eq!(second(&long).map(|run| run.ticks), Some((40_000, 0)));
        // Lost frames and wrapped numbers are no new beginning.
        let mut after = |time| whole.clone() + &run_at(time, &mut sealer, 3000, 5, 9);
        assert_eq!(second(&after("(4.48)")), None);
        assert_eq!(second(&after("(70.1)")), None, "as many ticks and all numbers once");
        // A joined log of another run whose beginning is missing.
        for joined in ["(1.5)", "(4.0)", "(60.0)"] {
            assert_eq!(second(&after(joined)).map(|run| run.ticks), Some((20, 3000)), "{joined}");
        }
        let granted =
            after("(60.0)").replacen("(1.5)", "(1.5) can0 080#0000000000000000\n(1.5)", 1);
        assert_eq!(second(&granted), None, "in lock step time says nothing");
        let gap = read_candump(granted.as_bytes(), &Master::default()).unwrap().gap;
        assert_eq!(gap.map(|gap| (gap.ticks, gap.seen)), Some(((20, 3000), 1)));
        assert_eq!(second(&run(&mut sealer, u16::MAX - 5, 12, 7)), None);
    }

    /// Lines of a host that grants each tick of a run, `ahead` of the device in its count and 16
    /// ticks in time, and of the device.
    fn granted(ticks: std::ops::Range<u16>, ahead: u32) -> String {
        let mut sealer = Sealer::default();
        let mut sync = Sealer::default();
        let first = u32::from(ticks.start) + ahead;
        let ticks = ticks.map(|tick| {
            let grants = match u32::from(tick) + ahead {
                at if at == first => at..at + 16,
                at => at + 15..at + 16,
            };
            let grants = grants.map(|host_tick| {
                let granted = Process::Sync(Sync { grant: 1, host_tick });
                format!("(1.5) can0 {}\n", sync.seal(granted, cathforce_bus::Status::default()))
            });
            grants.collect::<String>() + &run(&mut sealer, tick, 1, 7)
        });
        ticks.collect()
    }

    #[test]
    fn a_log_in_lock_step_that_lacks_ticks_is_not_put_on_their_time() {
        let read = |text: &str| read_candump(text.as_bytes(), &Master::default()).unwrap();
        let whole = granted(0..500, 0);
        let log = read(&whole);
        assert_eq!((log.second_run, log.gap), (None, None));
        assert!(log.in_lock_step().is_ok());
        // It may be the tail of another run of the same program, or frames were lost; the log does not tell.
        let joined = whole.clone() + &granted(3000..3200, 0);
        let log = read(&joined);
        assert_eq!(log.second_run, None);
        let (found, of_whole) = (log.gap.unwrap(), whole.lines().count());
        assert_eq!((found.ticks, found.seen), ((495, 3000), 5));
        assert!(found.line_before <= of_whole && of_whole < found.line, "{found:?}");
        let shows = |line: usize, number| joined.lines().nth(line - 1).unwrap().contains(number);
        assert!(shows(found.line, " 1A0#B80B") && shows(found.line_before, " 1A0#EF01"));
        assert_eq!(log.in_lock_step().unwrap_err(), NoLockStep::Lacks(found));
        for begin in [20, 30, 31, 200] {
            let lossy = whole.lines().enumerate();
            let lossy = lossy.filter(|(i, _)| !(begin..begin + 300).contains(i));
            let lossy = lossy.map(|(_, line)| line.to_owned() + "\n").collect::<String>();
            let log = read(&lossy);
            assert_eq!(log.second_run, None, "{begin}");
            assert!(log.gap.is_some_and(|gap| gap.ticks.1 < 500), "{begin}");
        }
        // The tail of a run whose host had another count.
        for (begin, ahead) in [(3000, 700), (500, 65), (501, 40_000)] {
            let joined = whole.clone() + &granted(begin..begin + 200, ahead);
            let second = read(&joined).second_run.unwrap_or_else(|| panic!("{begin} {ahead}"));
            assert_eq!(second.ticks.0, 495);
            let (first, rest) = joined.split_at(whole.len());
            let line = first.lines().count();
            assert!((line..line + 40).contains(&second.line), "{second:?} of {line}");
            assert!(!rest.is_empty());
        }
        // The numbers of a host that grants several ticks at once, or does not count, prove nothing.
        for word in [" 080#0100", " 080#0200"] {
            let other = (whole.clone() + &granted(500..700, 900)).replace(" 080#0100", word);
            let uncounted = other.lines().map(|line| match line.find(" 080#") {
                Some(at) if word == " 080#0100" => format!("{}00000000\n", &line[..at + 9]),
                _ => line.to_owned() + "\n",
            });
            assert_eq!(read(&uncounted.collect::<String>()).second_run, None, "{word}");
        }
    }

    #[test]
    fn a_line_that_is_no_frame_is_named() {
        let wrong = |line: &str| {
            let text = format!("(1.0) can0 100#00\n{line}\n");
            read_candump(text.as_bytes(), &Master::default()).unwrap_err().to_string()
        };
        for (line, says) in [
            ("1.0 can0 100#00", "`1.0` is no time"),
            ("(1) can0 100#00", "`(1)` is no time"),
            ("(1.0) can0", "missing"),
            ("(1.0) can0 100", "`100` is no frame"),
            ("(1.0) can0 100#0", "`100#0` is no frame"),
            ("(1.0) can0 100#+1", "`100#+1` is no frame"),
            ("(1.0) can0 1#00", "`1#00` is no frame"),
            ("(1.0) can0 100#000000000000000000", "is no frame"),
            ("(1.0) can0 100#00 x", "`x` follows"),
            ("(0.9) can0 100#00", "time goes back"),
        ] {
            let text = wrong(line);
            assert!(text.starts_with("line 2: ") && text.contains(says), "{line}: {text}");
            assert!(text.contains("fix:"), "{text}");
        }
    }
}
