//! `cathforce latency`: the time from encoder to record, stage by stage, of a recording or a bus.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use cathforce_bus::Direction;
use cathforce_bus::master::Master;
use cathforce_recording::latency::{END_TO_END, Stage, stages};
use cathforce_recording::{BusClock, BusFrame, Recording, direction, has_checksum};

use crate::args::LatencyArguments;
use crate::failure::{Code, Failure};
use crate::open::open_recording;
use crate::session::interrupt_flag;
use crate::settings::master_of;
use crate::ui::Ui;

/// Longest wait for a frame between two looks for Ctrl-C.
const WAIT: Duration = Duration::from_millis(50);

pub fn run(ui: &Ui, arguments: &LatencyArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let stages = match (&arguments.source.recording, &arguments.source.link) {
        (Some(path), _) => {
            let recording = open_recording(ui, path)?;
            let lock_step = recording.info.lock_step;
            if lock_step {
                ui.warn(
                    "the recording was made in lock step, where time is virtual: it has no latency but \
                     the ages in the device",
                );
            }
            let Recording { frames, arrived_ns, logged_ns, .. } = &recording;
            stages(frames, arrived_ns, logged_ns, lock_step, recording.master())
        }
        (None, Some(link)) => {
            let master = master_of(arguments.source.settings.as_deref())?;
            let duration = Duration::from_secs_f64(arguments.duration);
            let (heard, arrived_ns) = listen(ui, link, duration, &master)?;
            stages(&heard, &arrived_ns, &[], false, master)
        }
        // The argument parser asks for one of the two.
        (None, None) => Vec::new(),
    };
    arguments.json_file.write(ui, &stages, text(&stages))?;
    let Some(budget_ms) = arguments.budget else { return Ok(()) };
    let whole = stages.iter().find(|stage| stage.name == END_TO_END);
    let Some(whole) = whole else {
        let message = "--budget cannot be checked without a time from end to end\n  fix: record ENCODER \
                       and DRIVE frames of a device that runs free (`cathforce run --free`)";
        return Err(Failure::input(message));
    };
    let p99_ms = 1e3 * whole.times.p99_s;
    if p99_ms > budget_ms {
        let message = format!(
            "the 99th percentile from end to end is {p99_ms:.3} ms, above the {budget_ms} ms of --budget"
        );
        return Err(Failure::new(Code::Threshold, message));
    }
    Ok(())
}

/// Frames a second that a bus of 1 Mbit/s carries at most: the shortest has 47 bits. A flood of more is
/// no bus, and must not fill the memory.
const MOST_PER_S: f64 = 1e6 / 47.0;

/// All frames on a bus for some time, and when each arrived \[ns\].
fn listen(
    ui: &Ui,
    address: &str,
    duration: Duration,
    master: &Master,
) -> Result<(Vec<BusFrame>, Vec<u64>), Failure> {
    let mut link = cathforce_link::open(address)?;
    let interrupted = interrupt_flag()?;
    let mut clock = BusClock::new(false);
    let (started, mut frames, mut arrived_ns) = (Instant::now(), Vec::new(), Vec::new());
    let most = (MOST_PER_S * (duration.as_secs_f64() + 1.0)) as usize;
    let mut beyond = 0_u64;
    while started.elapsed() < duration && !interrupted.load(Ordering::Relaxed) {
        let Some(frame) = link.receive(WAIT)? else { continue };
        if frames.len() == most {
            beyond += 1;
            continue;
        }
        let direction = direction(&frame, master).unwrap_or(Direction::ToHost);
        let at_ns = clock.stamp(direction, &frame);
        arrived_ns.push(clock.arrived_ns(at_ns, link.waited()));
        frames.push(BusFrame { at_ns, direction, frame });
    }
    let dropped = beyond + link.dropped();
    if dropped > 0 {
        ui.warn(format_args!(
            "{address}: frames came faster than a bus of 1 Mbit/s carries or than they were read; {dropped} \
             were dropped"
        ));
    }
    let own = frames.iter().filter(|frame| is_own(frame, master)).count();
    if own == 0 && !frames.is_empty() {
        let message = format!(
            "{address}: none of the {} frames in {:.1} s is one of ours: no device and no drive of \
             cathforce is on this bus\n  fix: check that a device runs on this bus with `cathforce doctor \
             --link {address}`; a master with frames of its own needs --settings",
            frames.len(),
            duration.as_secs_f64()
        );
        return Err(Failure::new(Code::Threshold, message));
    }
    match frames.is_empty() {
        false => Ok((frames, arrived_ns)),
        true => {
            let message = format!(
                "{address}: no frame came for {:.1} s\n  fix: check that a device runs on this bus with \
                 `cathforce doctor --link {address}`",
                duration.as_secs_f64()
            );
            Err(Failure::new(Code::Link, message))
        }
    }
}

/// Whether a frame has our checksum, or an identifier that the master's settings describe.
fn is_own(frame: &BusFrame, master: &Master) -> bool {
    has_checksum(&frame.frame).unwrap_or(false) || master.has(frame.frame.id())
}

fn text(stages: &[Stage]) -> String {
    let mut text =
        "ms                      p50        p99      p99.9        max      count\n".to_owned();
    for Stage { name, times, .. } in stages {
        let [p50, p99, p999, max] =
            [times.p50_s, times.p99_s, times.p999_s, times.max_s].map(|s| 1e3 * s);
        text += &format!(
            "{name:<17}{p50:>10.3} {p99:>10.3} {p999:>10.3} {max:>10.3} {:>10}\n",
            times.count
        );
    }
    for stage in stages {
        text += &format!("\n{}: {}", stage.name, stage.what);
    }
    text + "\n"
}
