//! Plays a trial of a bundle over a rig's bus, or estimates it in process.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::EncoderReading;
use cathforce_bus::service::Status as Report;
use cathforce_bus::{Command, Process};
use cathforce_control::{Mode, TICK_S};
use cathforce_link::{Client, Link, Sim, Step};
use cathforce_recording::{
    Attachments, BusClock, BusFrame, Estimate, Recorder, RunInfo, RunResult, SensorNoise, Trial,
};

use crate::{Bench, Drive, Rig, bench};

/// A trial's rows, from time 0 on, and the sensor's stated noise.
pub fn measured(bundle: &Bundle, trial: &cathforce_bundle::Trial) -> Trial {
    let t_s: Vec<f64> = trial.t_s.iter().map(|t_s| t_s - trial.t_s[0]).collect();
    let columns = trial.catheter().expect("a catheter's trial");
    Trial { noise: SensorNoise::of(&bundle.rig.sensor), ..Trial::of(&t_s, columns) }
}

/// Position of the catheter's drive in each tick of a trial.
pub fn drives(trial: &cathforce_bundle::Trial) -> impl Iterator<Item = Drive> {
    times_s(trial).map(|t_s| drive(trial.encoder_at(t_s).expect("a catheter")))
}

/// Frames that the host sends in each tick of a trial; the operator holds the two buttons in turn for a
/// second each.
pub fn steps(trial: &cathforce_bundle::Trial) -> impl Iterator<Item = Step> {
    let sample = |at| match bench::encoder(drive(at)) {
        Process::Encoder(sample) => sample,
        other => unreachable!("{other:?} is no sample"),
    };
    times_s(trial).map(move |t_s| Step {
        encoder: trial.encoder_at(t_s).map(sample),
        guidewire: trial.guidewire_at(t_s).map(sample),
        guidewire_held: t_s as u32 % 2 == 1,
        ..Step::default()
    })
}

/// The trial's time in each tick.
fn times_s(trial: &cathforce_bundle::Trial) -> impl Iterator<Item = f64> {
    let ticks = (trial.duration_s() / f64::from(TICK_S)).round() as u32;
    let start_s = trial.t_s[0];
    (0..=ticks).map(move |tick| start_s + f64::from(tick) * 1e-3)
}

fn drive(at: EncoderReading) -> Drive {
    Drive { insertion_m: at.insertion_m, rotation_rad: at.rotation_rad }
}

/// Estimates of the device in this process for every tick of a trial.
pub fn estimates(image: &[u8], trial: &cathforce_bundle::Trial) -> Vec<Estimate> {
    let mut drives = drives(trial).peekable();
    let mut bench = Bench::<Sim>::armed(image, *drives.peek().expect("a trial has rows"));
    let mut estimates = Vec::new();
    for (tick, at) in drives.enumerate() {
        let frame = bench.encoder(at);
        assert_eq!(bench.tick(&[frame]).mode(), Some(Mode::Armed), "tick {tick}");
        let ticker = bench.ticker();
        let contact = ticker.outputs().expect("configured").contact;
        let tip_m = ticker.state().mechanics().node_position_m(0);
        estimates.push(Estimate {
            t_s: tick as f64 * 1e-3,
            force_n: contact.force_on_vessel_n.map(f64::from),
            drive_force_n: Some(f64::from(contact.drive_force_n)),
            guidewire_force_n: None,
            tip_m: tip_m.map(|tip| tip.map(f64::from)),
            unresolved: contact.unresolved,
            ..Estimate::default()
        });
    }
    estimates
}

/// Plays a trial on a rig and records its bus like `cathforce run`. Returns the device's report at the
/// end.
pub fn record<R: Rig>(
    bundle: &Bundle,
    trial: &cathforce_bundle::Trial,
    image: &[u8],
    out: &Path,
) -> Report {
    let fail = |error: &dyn std::fmt::Display| -> ! { panic!("{error}") };
    let mut client = Client::connect(R::boot()).unwrap_or_else(|e| fail(&e));
    client.set_lock_step(true).unwrap_or_else(|e| fail(&e));
    client.upload_image(image, |_| ControlFlow::Continue(())).unwrap_or_else(|e| fail(&e));
    client.reset_counters().unwrap_or_else(|e| fail(&e));

    let tape = Tape::start(&mut client, &bundle.rig.name, image, out);
    play_armed(&mut client, steps(trial));
    tape.finish(&mut client)
}

/// The bus of a device in lock step while it is recorded.
pub struct Tape(Arc<Mutex<Option<Recorder>>>);

impl Tape {
    /// Records from here on what the client sends and hears; `image` is what the device has in use.
    pub fn start<L: Link>(client: &mut Client<L>, rig: &str, image: &[u8], out: &Path) -> Self {
        let info = RunInfo {
            board: client.device().board.clone(),
            lock_step: true,
            rig: rig.to_owned(),
            tick_s: f64::from(TICK_S),
            ..RunInfo::default()
        };
        let attachments = Attachments { image, rig_toml: "", dbc: "", vessel: &[] };
        let recorder = Recorder::create(out, &info, attachments);
        let recorder = recorder.unwrap_or_else(|error| panic!("{error}"));
        let recorder = Arc::new(Mutex::new(Some(recorder)));
        let tapped = Arc::clone(&recorder);
        let mut clock = BusClock::new(true);
        client.set_tap(Some(Box::new(move |direction, frame, _| {
            let at_ns = clock.stamp(direction, frame);
            let frame = BusFrame { at_ns, direction, frame: *frame };
            let mut recorder = tapped.lock().expect("no panic");
            recorder.as_mut().expect("recording").frame(&frame, at_ns).expect("written");
        })));
        Self(recorder)
    }

    /// Asks the device for its report, and ends the recording with it.
    pub fn finish<L: Link>(self, client: &mut Client<L>) -> Report {
        let report = client.status().unwrap_or_else(|error| panic!("{error}"));
        client.set_tap(None);
        let result = RunResult {
            ticks: report.tick,
            digest: report.digest,
            missed_ticks: report.load.missed_ticks,
            worst_instructions: report.load.worst_instructions,
            ..RunResult::default()
        };
        let recorder = self.0.lock().expect("no panic").take().expect("recording");
        recorder.finish(Some(&result)).unwrap_or_else(|error| panic!("{error}"));
        report
    }
}

/// Tests and arms the device with the drive where the steps begin, and plays them; it stays armed.
pub fn play_armed<L: Link>(client: &mut Client<L>, steps: impl IntoIterator<Item = Step>) {
    let mut steps = steps.into_iter().peekable();
    let still = *steps.peek().expect("there is a step");
    hold(client, Step { command: Some(Command::SelfTest), ..still }, Mode::Ready);
    hold(client, Step { command: Some(Command::Arm), ..still }, Mode::Armed);
    let played = client.play(steps, |tick| {
        let mode = Mode::from_codes(tick.haptic.mode, tick.haptic.fault);
        assert_eq!(mode, Some(Mode::Armed), "tick {}", tick.tick);
        ControlFlow::Continue(())
    });
    played.unwrap_or_else(|error| panic!("{error}"));
}

/// Repeats a command every 50 ticks, with the drive at rest, until the device is in `wanted`.
fn hold<L: Link>(client: &mut Client<L>, first: Step, wanted: Mode) {
    let (mut reached, mut last) = (false, None);
    let steps =
        (0..10_000).map(|n| Step { command: first.command.filter(|_| n % 50 == 0), ..first });
    let played = client.play(steps, |tick| {
        last = Mode::from_codes(tick.haptic.mode, tick.haptic.fault);
        reached |= last == Some(wanted);
        if reached { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    played.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(last, Some(wanted));
}
