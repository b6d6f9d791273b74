//! A client and a device, over the carriers that this computer has.

#[path = "../../../shared/device/tests/support/mod.rs"]
mod support;

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cathforce_bus::slcan::{self, Decoder, Line};
use cathforce_bus::{Command, Counter, Encoder, Frame, Insertion, MODE_UNCONFIGURED, Rotation};
use cathforce_control::{Fault, Mode};
use cathforce_link::{
    Client, ClientError, Direction, Link, LinkError, Sim, Step, TickReport, open,
};

const START_M: f64 = 0.012;

fn encoder(insertion_m: f64) -> Option<Encoder> {
    let insertion = Insertion::from_m(insertion_m);
    Some(Encoder { insertion, rotation: Rotation::from_rad(0.0) })
}

fn mode(report: &TickReport) -> Option<Mode> {
    Mode::from_codes(report.haptic.mode, report.haptic.fault)
}

/// Uploads, self-test, settles, arms: every tick on the way.
fn arm<L: Link>(client: &mut Client<L>) -> Vec<TickReport> {
    client.set_lock_step(true).unwrap();
    client.upload_image(&support::image(), |_| ControlFlow::Continue(())).unwrap();
    let step = |command| Step { encoder: encoder(START_M), command, ..Step::default() };
    let mut ticks = vec![client.run_tick(step(Some(Command::SelfTest))).unwrap()];
    while mode(ticks.last().unwrap()) != Some(Mode::Ready) {
        assert!(ticks.len() < 10_000, "never ready");
        ticks.push(client.run_tick(step(None)).unwrap());
    }
    ticks.push(client.run_tick(step(Some(Command::Arm))).unwrap());
    assert_eq!(ticks.last().and_then(mode), Some(Mode::Armed));
    ticks
}

fn feed(ticks: usize) -> impl Iterator<Item = Step> {
    (1..=ticks).map(|i| Step { encoder: encoder(START_M + 1e-5 * i as f64), ..Step::default() })
}

fn play<L: Link>(client: &mut Client<L>, ticks: usize) -> Vec<TickReport> {
    let mut reports = Vec::new();
    let sent = client.play(feed(ticks), |report| {
        reports.push(*report);
        ControlFlow::Continue(())
    });
    assert_eq!(sent.unwrap(), ticks);
    reports
}

/// A device behind an SLCAN server, for one client.
fn serve() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("slcan:tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        let (mut sim, mut decoder, mut buffer) = (Sim::new(), Decoder::default(), [0; 512]);
        loop {
            let read = match stream.read(&mut buffer) {
                Ok(0) => return,
                Ok(n) => n,
                Err(_) => 0,
            };
            let mut answer = Vec::new();
            for line in buffer[..read].iter().filter_map(|&byte| decoder.push(byte)) {
                match line {
                    Line::Frame(frame) => sim.send(&frame).unwrap(),
                    Line::Bad(_) => answer.extend_from_slice(slcan::ANSWER_ERROR),
                    _ => answer.extend_from_slice(slcan::ANSWER_DONE),
                }
            }
            while let Some(frame) = sim.receive(Duration::ZERO).unwrap() {
                answer.extend_from_slice(&slcan::encode(&frame));
            }
            if stream.write_all(&answer).is_err() {
                return;
            }
        }
    });
    address
}

#[test]
fn a_device_is_configured_armed_and_fed_in_process() {
    let mut client = Client::connect(Sim::new()).unwrap();
    assert_eq!(client.device().board, "sim");
    assert_eq!(client.device().mode, MODE_UNCONFIGURED);
    let mut progress = Vec::new();
    let image = support::image();
    client
        .upload_image(&image, |sent| {
            progress.push(sent);
            ControlFlow::Continue(())
        })
        .unwrap();
    assert!(progress.is_sorted() && progress.last() == Some(&image.len()));

    arm(&mut client);
    let before = client.status().unwrap();
    let reports = play(&mut client, 200);
    assert!(reports.iter().all(|r| mode(r) == Some(Mode::Armed)));
    assert!(reports.windows(2).all(|w| w[1].tick == w[0].tick + 1));
    let after = client.status().unwrap();
    assert_eq!(after.tick - before.tick, 200);
    assert_eq!(after.counters.get(Counter::Corrupt) + after.counters.get(Counter::Lost), 0);
    assert_eq!(client.counters().get(Counter::Lost), 0);
    // The digest that the device sent is the one it has.
    assert_eq!(client.link().ticker().outputs().unwrap().digest, after.digest);
}

#[test]
fn p17_an_armed_device_takes_no_image_and_stays_armed() {
    let mut client = Client::connect(Sim::new()).unwrap();
    arm(&mut client);
    let error = client.upload_image(&support::image(), |_| ControlFlow::Continue(())).unwrap_err();
    assert!(error.to_string().contains("disarm it first"), "{error}");
    assert!(client.set_lock_step(false).is_err());
    assert_eq!(mode(&play(&mut client, 3)[2]), Some(Mode::Armed));
}

#[test]
fn an_image_the_device_refuses_leaves_the_old_one_in_use() {
    let mut client = Client::connect(Sim::new()).unwrap();
    arm(&mut client);
    client.command(Command::Disarm).unwrap();
    while mode(&client.run_tick(Step { encoder: encoder(START_M), ..Step::default() }).unwrap())
        != Some(Mode::Ready)
    {}
    let before = client.status().unwrap();
    let mut image = support::image();
    image[40_000] ^= 4;
    let error = client.upload_image(&image, |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, ClientError::Refused { .. }));
    assert!(error.to_string().contains("at byte 18"), "{error}");
    let after = client.status().unwrap();
    assert_eq!((after.tick, after.digest, after.mode), (before.tick, before.digest, before.mode));
    let stop = |sent| if sent < 1000 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    let error = client.upload_image(&support::image(), stop).unwrap_err();
    assert!(matches!(error, ClientError::Stopped));
    assert_eq!(client.status().unwrap().digest, before.digest);
    let error = client.upload_image(&vec![0; 3 << 20], |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, ClientError::ImageTooLong { capacity: 2_097_152, .. }));
    arm(&mut client);
}

#[test]
fn p22_slcan_over_tcp_and_the_call_in_process_give_the_same_ticks() {
    let address = serve();
    let mut over_tcp = Client::connect(open(&address).unwrap()).unwrap();
    let mut in_process = Client::connect(open("sim").unwrap()).unwrap();
    assert_eq!(arm(&mut over_tcp), arm(&mut in_process));
    assert_eq!(play(&mut over_tcp, 500), play(&mut in_process, 500));
    let status = over_tcp.status().unwrap();
    assert_eq!(status.digest, in_process.status().unwrap().digest);
    assert_eq!(over_tcp.counters().get(Counter::Lost), 0);
}

/// What the tap saw is enough to do it all again.
#[test]
fn p22_a_recording_of_raw_frames_replays_bit_for_bit() {
    let mut client = Client::connect(Sim::new()).unwrap();
    client.set_lock_step(true).unwrap();
    client.upload_image(&support::image(), |_| ControlFlow::Continue(())).unwrap();
    let seen = Arc::new(Mutex::new((Vec::new(), Vec::new())));
    let log = Arc::clone(&seen);
    client.set_tap(Some(Box::new(move |direction, frame: &Frame, _| {
        let mut log = log.lock().unwrap();
        match direction {
            Direction::ToDevice => log.0.push(*frame),
            Direction::ToHost => log.1.push(*frame),
        }
    })));
    let mut steps: Vec<Step> = feed(400).collect();
    steps[0].command = Some(Command::SelfTest);
    client.play(steps, |_| ControlFlow::Continue(())).unwrap();

    let (sent, received) = &*seen.lock().unwrap();
    let image = support::image();
    let config = cathforce_config::image::decode(&image).unwrap();
    let mut ticker = cathforce_device::ControlLoop::new();
    assert!(ticker.set_lock_step(true));
    let mut replayed = Vec::new();
    for frame in sent {
        ticker.on_frame(frame);
        while ticker.granted() > 0 {
            replayed.extend(ticker.tick(Some(&config), None).into_iter().flatten());
        }
    }
    assert_eq!(&replayed, received);
    assert_eq!(replayed.len(), 3 * 400);
}

#[test]
fn play_ends_when_it_is_told_to_and_loses_no_tick() {
    let mut client = Client::connect(Sim::new()).unwrap();
    arm(&mut client);
    let mut reports = 0;
    let sent = client.play(feed(1000), |_| {
        reports += 1;
        if reports == 50 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let sent = sent.unwrap();
    assert!((50..100).contains(&sent));
    assert_eq!(reports, sent);
}

/// Running free, the device's time is the clock; here only what does not depend on it.
#[test]
fn a_device_that_runs_free_is_fed_by_the_clock() {
    let mut client = Client::connect(Sim::new()).unwrap();
    client.upload_image(&support::image(), |_| ControlFlow::Continue(())).unwrap();
    client.reset_counters().unwrap();
    let mut steps: Vec<Step> = feed(50).collect();
    steps[0].command = Some(Command::SelfTest);
    let mut ticks = Vec::new();
    let sent = client.play(steps, |report| {
        ticks.push(report.tick);
        ControlFlow::Continue(())
    });
    assert_eq!(sent.unwrap(), 50);
    assert!(ticks.windows(2).all(|w| w[1] == w[0] + 1), "{ticks:?}");
    let status = client.status().unwrap();
    let missed = status.load.missed_ticks;
    assert!(ticks.len() + missed as usize >= 45, "{} and {missed} missed", ticks.len());
    assert!(!status.lock_step);
    assert_eq!(status.counters.get(Counter::Accepted), 51);
}

/// On a computer that had no time for it, or whose ticks take longer than theirs, a device still
/// answers: what it cannot make up for, it counts.
#[test]
fn a_device_that_is_late_misses_ticks_and_says_so() {
    let mut sim = Sim::new();
    std::thread::sleep(Duration::from_millis(200));
    assert!(sim.receive(Duration::ZERO).unwrap().is_some());
    assert!(sim.ticker().ticks() <= 8, "made up for {} ticks at once", sim.ticker().ticks());
    let status = Client::connect(sim).unwrap().status().unwrap();
    assert!(status.load.missed_ticks >= 190, "{status:?}");
    assert!(status.load.missed_ticks + status.tick >= 199, "{status:?}");
}

#[test]
fn p01_a_host_that_stops_feeding_sees_the_ramp_and_clears_the_fault() {
    let mut client = Client::connect(Sim::new()).unwrap();
    arm(&mut client);
    let silent = Step::default();
    let reports: Vec<_> = (0..40).map(|_| client.run_tick(silent).unwrap()).collect();
    let cause = Fault::EncoderLost;
    assert_eq!(mode(&reports[39]), Some(Mode::Fault { cause }));
    let token = cause.clear_token();
    let clear = Step {
        encoder: encoder(START_M),
        command: Some(Command::ClearFault { token }),
        ..Step::default()
    };
    assert_eq!(mode(&client.run_tick(clear).unwrap()), Some(Mode::Boot));
}

#[test]
fn a_refused_connection_names_the_link_and_what_to_check() {
    // A port that was free a moment ago.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let error = open(&format!("slcan:tcp:127.0.0.1:{port}")).err().unwrap();
    assert!(matches!(error, LinkError::Open { .. }));
    let text = error.to_string();
    assert!(text.contains(&port.to_string()) && text.contains("is running and listens"), "{text}");
    let text = open("slcan:/dev/ttyNOPE7").err().unwrap().to_string();
    assert!(text.contains("/dev/ttyNOPE7") && text.contains("plugged in"), "{text}");
}

#[test]
fn a_connection_that_ends_is_a_lost_link() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("slcan:tcp:{}", listener.local_addr().unwrap());
    let hang_up = std::thread::spawn(move || {
        let (mut stream, _): (TcpStream, _) = listener.accept().unwrap();
        let mut first = [0; 4];
        stream.read_exact(&mut first).unwrap();
    });
    let error = Client::connect(open(&address).unwrap()).err().unwrap();
    hang_up.join().unwrap();
    assert!(matches!(error, ClientError::Link(LinkError::Lost { .. })), "{error}");
}
