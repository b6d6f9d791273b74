//! P25: a board that lives through round after round of load, faults, new settings and recordings.
//!
//! A round begins with another image, for which the device starts again. A trial is played while a second
//! talker sends frames of its own in every tick; then the samples stop, the device ramps down and names the fault,
//! and the host clears it. The round's recording is replayed, so that a bit that differs in the last hour is
//! found as well as one in the first.
//!
//! The suite plays two rounds on the board. `CATHFORCE_SOAK_ROUNDS_HOURS=4` plays four hours of virtual time,
//! `CATHFORCE_SOAK_ROUNDS_WALL_HOURS=1` goes on for an hour of this computer's time.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bundle::{ImageOptions, Trial};
use cathforce_bus::service::Status as Report;
use cathforce_bus::{Command, Counter, Frame, Id};
use cathforce_config::Settings;
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::{Rig, Tape, bundle, image_with, play_armed, steps};
use cathforce_link::qemu::Qemu;
use cathforce_link::{Client, Link, LinkError, Sim, Step};
use cathforce_recording::{Recording, replay};

const HOURS: &str = "CATHFORCE_SOAK_ROUNDS_HOURS";
const WALL_HOURS: &str = "CATHFORCE_SOAK_ROUNDS_WALL_HOURS";
const ROUNDS: u32 = 2;
/// How much of the example's first trial is played in a round of the suite, and of a long soak \[s\].
const ROUND_S: f64 = 1.0;
const LONG_ROUND_S: f64 = 9.0;
/// Frames of 8 bytes that the second talker sends in a tick. With those of the tick they fill three quarters of a
/// bus of 1 Mbit/s.
const FOREIGN: u32 = 3;
/// Ticks without a sample: a time-out of 5, and a ramp of 20.
const SILENT_TICKS: usize = 40;

/// A link on whose bus somebody else talks too, while the host grants ticks.
struct Shared<R> {
    rig: R,
    sent_foreign: u32,
    talks: bool,
}

impl<R: Rig> Link for Shared<R> {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        if self.talks && frame.id() == Id::Sync.raw() {
            for n in 0..FOREIGN {
                let id = 0x7F0 + n;
                self.rig.send(&Frame::new(id, &[n as u8; 8]).expect("8 bytes"))?;
            }
            self.sent_foreign += FOREIGN;
        }
        self.rig.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.rig.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.rig.receive(timeout)
    }

    fn name(&self) -> &str {
        self.rig.name()
    }
}

/// When a soak ends.
enum Until {
    Rounds(u32),
    Ticks(u64),
    Time(Instant),
}

impl Until {
    fn asked() -> Self {
        let hours = |name| std::env::var(name).ok().map(|text| text.parse::<f64>().expect(name));
        match (hours(HOURS), hours(WALL_HOURS)) {
            (None, None) => Self::Rounds(ROUNDS),
            (Some(hours), None) => Self::Ticks((3.6e6 * hours) as u64),
            (None, Some(hours)) => {
                Self::Time(Instant::now() + Duration::from_secs_f64(3600.0 * hours))
            }
            (Some(_), Some(_)) => panic!("give {HOURS} or {WALL_HOURS}"),
        }
    }

    fn is_reached(&self, rounds: u32, ticks: u64) -> bool {
        match self {
            Self::Rounds(most) => rounds >= *most,
            Self::Ticks(most) => ticks >= *most,
            Self::Time(end) => rounds > 0 && Instant::now() >= *end,
        }
    }
}

/// One round: new settings, a trial under load, a fault, and its recording.
fn round<R: Rig>(client: &mut Client<Shared<R>>, image: &[u8], trial: &Trial) -> Report {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("round.mcap");
    let sent = client.upload_image(image, |_| ControlFlow::Continue(()));
    sent.unwrap_or_else(|error| panic!("{error}"));
    client.reset_counters().expect("an answer");
    client.link_mut().sent_foreign = 0;

    let tape = Tape::start(client, &bundle().rig.name, image, &file);
    client.link_mut().talks = true;
    play_armed(client, steps(trial));
    let mut last = None;
    let silent = client.play([Step::default(); SILENT_TICKS], |tick| {
        last = Some(tick.haptic);
        ControlFlow::Continue(())
    });
    silent.expect("every tick is heard");
    let haptic = last.expect("40 ticks");
    let fault = Mode::Fault { cause: Fault::EncoderLost };
    assert_eq!(Mode::from_codes(haptic.mode, haptic.fault), Some(fault));
    assert_eq!((haptic.force.0, haptic.torque.0), (0, 0), "the output has ended");
    let command = Some(Command::ClearFault { token: Fault::EncoderLost.clear_token() });
    let cleared = client.run_tick(Step { command, ..Step::default() }).expect("a tick");
    assert_eq!(Mode::from_codes(cleared.haptic.mode, cleared.haptic.fault), Some(Mode::Boot));
    client.link_mut().talks = false;
    let report = tape.finish(client);

    assert_eq!(report.counters.get(Counter::Foreign), client.link().sent_foreign);
    assert_eq!(report.load.missed_ticks, 0);
    let bad = [Counter::Corrupt, Counter::Lost, Counter::Repeat, Counter::Reordered];
    for counter in bad {
        assert_eq!(report.counters.get(counter), 0, "{counter:?}");
    }
    let recording = Recording::open(&file).expect("just written");
    let (replayed, _) = replay(&recording).expect("in lock step");
    assert!(replayed.identical(), "{} bits differ", replayed.differing_bits);
    assert_eq!((replayed.ticks, replayed.digest), (u64::from(report.tick), report.digest));
    report
}

/// Plays rounds, and compares the first two with all that follow.
fn soak<R: Rig>(until: &Until) -> Vec<Report> {
    let seconds = if matches!(until, Until::Rounds(_)) { ROUND_S } else { LONG_ROUND_S };
    let mut trial = bundle().trial(0).expect("in the example").clone();
    let start_s = trial.t_s[0];
    trial.t_s.retain(|t_s| t_s - start_s <= seconds);
    let images = [0.5, 1.0].map(|force_gain| {
        let settings = Settings { force_gain, ..Settings::default() };
        image_with(&ImageOptions { cell_m: 2e-3, settings, ..ImageOptions::default() })
    });
    let shared = Shared { rig: R::boot(), sent_foreign: 0, talks: false };
    let mut client = Client::connect(shared).expect("a device");
    client.set_lock_step(true).expect("nothing is armed");

    let (mut rounds, mut ticks, mut firsts) = (0, 0, Vec::new());
    while !until.is_reached(rounds, ticks) {
        let report = round(&mut client, &images[rounds as usize % 2], &trial);
        ticks += u64::from(report.tick);
        let Some(first) = firsts.get(rounds as usize % 2) else {
            firsts.push(report);
            rounds += 1;
            continue;
        };
        // The same motion with the same settings gives the same bits, however many rounds were before.
        assert_eq!((report.tick, report.digest), (first.tick, first.digest), "round {rounds}");
        assert_eq!(report.load.stack_used_bytes, first.load.stack_used_bytes, "round {rounds}");
        rounds += 1;
    }
    println!("{rounds} rounds, {ticks} ticks ({:.2} h of virtual time)", ticks as f64 / 3.6e6);
    firsts
}

#[test]
fn p25_rounds_of_load_faults_settings_and_recordings_on_the_board() {
    let started = Instant::now();
    let firsts = soak::<Qemu>(&Until::asked());
    assert_ne!(firsts[0].digest, firsts[1].digest, "the settings differ");
    println!(
        "figure P25: {:.2} h of this computer's time, none missed, stack {} bytes",
        started.elapsed().as_secs_f64() / 3600.0,
        firsts[0].load.stack_used_bytes
    );
}

#[test]
fn p25_rounds_of_load_faults_settings_and_recordings_in_process() {
    let firsts = soak::<Sim>(&Until::Rounds(4));
    assert_ne!(firsts[0].digest, firsts[1].digest, "the settings differ");
}
