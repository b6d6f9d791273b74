//! A force sensor beside the device: `run --sensor`, with a stand-in that speaks the sensor's protocol.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_recording::Recording;

use crate::{assert_fails, command, example, stderr, text};

/// Counts of one newton.
const COUNTS_PER_N: i32 = 10_000;
/// Every so many packets one is lost, and another one has an error status with a wild force.
const LOST_EVERY: u32 = 50;
const FAULTY_EVERY: u32 = 40;

/// A sensor that streams from a request on until it is dropped or told to stop.
struct StandIn {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<bool>>,
}

impl StandIn {
    fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let (address, stop) = (socket.local_addr().unwrap(), Arc::new(AtomicBool::new(false)));
        let ended = Arc::clone(&stop);
        let thread = Some(std::thread::spawn(move || serve(&socket, &ended)));
        Self { address, stop, thread }
    }

    /// Whether the sensor was told to stop its stream.
    fn end(mut self) -> bool {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

fn serve(socket: &UdpSocket, ended: &AtomicBool) -> bool {
    socket.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    let mut request = [0; 64];
    let peer = loop {
        if ended.load(Ordering::Relaxed) {
            return false;
        }
        if let Ok((8, peer)) = socket.recv_from(&mut request) {
            assert_eq!(request[..8], [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
            break peer;
        }
    };
    socket.set_nonblocking(true).unwrap();
    let (began, mut sequence) = (Instant::now(), 0_u32);
    while !ended.load(Ordering::Relaxed) {
        if let Ok((8, _)) = socket.recv_from(&mut request) {
            assert_eq!(request[..8], [0x12, 0x34, 0, 0, 0, 0, 0, 0]);
            return true;
        }
        // Its own steady clock, at 1000 Hz.
        while sequence < u32::try_from(began.elapsed().as_millis()).unwrap() {
            sequence += 1;
            if sequence % LOST_EVERY == 0 {
                continue;
            }
            let is_faulty = sequence % FAULTY_EVERY == 1;
            let status = if is_faulty { 0x8000_0004 } else { 0 };
            let force = if is_faulty { i32::MAX } else { COUNTS_PER_N };
            let words = [sequence, 7 * sequence, status, force.cast_unsigned(), 0, 0, 0, 0, 0];
            // A program that has ended takes no more.
            let _ = socket.send_to(&words.map(u32::to_be_bytes).concat(), peer);
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    false
}

#[test]
fn a_sensor_of_the_network_measures_the_force_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sensed.mcap");
    let sensor = StandIn::new();
    let address = format!("netft:{}", sensor.address);
    let example = example();
    let run =
        ["run", "--link", "sim", "--free", text(&example), "--duration", "0.6", "--cell", "3"];
    let options = ["--sensor", &address, "--counts-per-n", "10000", "--axes=+y,-x,+z"];
    let output = command().args(run).args(options).args(["--out", text(&file)]).output().unwrap();
    // A busy computer may miss the 5 ms after which the device ramps down; forces are kept of it as well.
    assert!(matches!(output.status.code(), Some(0 | 5)), "{}", stderr(&output));
    assert!(sensor.end(), "its stream was stopped");
    let said = stderr(&output);
    for says in [
        "10000 counts are one newton by --counts-per-n",
        "packets were lost on the way; their time is kept",
        "have the error status 0x80000004 (broken gage) and are left out",
        "by their numbers and this computer's clock: ",
    ] {
        assert!(said.contains(says), "{says}: {said}");
    }
    let recording = Recording::open(&file).unwrap();
    let rows = &recording.trial.rows;
    assert!(rows.is_sorted_by(|a, b| a.t_s < b.t_s), "rows have their order");
    assert!(rows.last().unwrap().t_s <= 0.6, "what was not played is not there");
    let forces = rows.iter().filter_map(|row| Some((row.t_s, row.force_n?))).collect::<Vec<_>>();
    assert!(forces.len() > 30, "{}", forces.len());
    // The sensor's x is the vessel's −y; the wild forces of an error are not among them.
    let expected = [0.0, -1.0, 0.0];
    for (t_s, force_n) in &forces {
        let differs =
            force_n.iter().zip(expected).any(|(found, wanted)| (found - wanted).abs() > 1e-9);
        assert!(!differs, "{t_s}: {force_n:?}");
    }
    // A lost packet keeps its time, by the stand-in's clock, whatever the load of this computer.
    let steps = forces.windows(2).map(|pair| pair[1].0 - pair[0].0).collect::<Vec<_>>();
    for step_s in steps {
        let ticks = (1e3 * step_s).round();
        assert!((1.0..=3.0).contains(&ticks) && (1e3 * step_s - ticks).abs() < 0.2, "{step_s}");
    }
}

#[test]
fn a_sensor_that_cannot_be_used_is_refused_with_the_way_out() {
    let example = example();
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = format!("netft:{}", silent.local_addr().unwrap());
    let run = |more: &[&str]| {
        let mut run = command();
        run.args(["run", "--link", "sim", text(&example), "--cell", "3", "--duration", "0.1"]);
        run.args(["--sensor", &address]).args(more).output().unwrap()
    };
    assert_fails(&run(&["--counts-per-n", "1"]), 2, &["measures in real time", "add --free"]);
    let no_packet = run(&["--free", "--counts-per-n", "1"]);
    assert_fails(&no_packet, 4, &["no packet came in 2s", "comm.htm"]);
    let wrong =
        command().args(["run", "--link", "sim", "--sensor", "udp:x", text(&example)]).output();
    assert_fails(&wrong.unwrap(), 2, &["`udp:x` is no sensor: write netft:HOST"]);
    let nobody = command().args(["run", "--link", "sim", "--tare", "1", text(&example)]).output();
    assert_fails(&nobody.unwrap(), 2, &["--sensor"]);
}
