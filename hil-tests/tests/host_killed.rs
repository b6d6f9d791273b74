//! P23: a killed host leaves no process behind on this computer; and a device whose host is killed, while
//! the device lives on, ramps to zero.
//!
//! In lock step a device without a host stands still, so the test grants the ticks from there on.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use cathforce_bus::{Command as DeviceCommand, Frame, Haptic, Id, Process};
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::{Chance, EXAMPLE, Rig, program};
use cathforce_link::qemu::Qemu;
use cathforce_link::{Client, Hub, Link, Step};

/// Long for an emulator to start or to end, however busy the computer is.
const PATIENCE: Duration = Duration::from_secs(60);

/// Processes whose parent is `parent`, and their names.
fn children(parent: u32) -> Vec<(u32, String)> {
    let entries = fs::read_dir("/proc").expect("Linux");
    let pids = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    pids.filter_map(|pid| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        // `pid (name) state parent …`; the name may have spaces and brackets.
        let (head, tail) = stat.rsplit_once(") ")?;
        let name = head.split_once('(')?.1.to_owned();
        let of: u32 = tail.split(' ').nth(1)?.parse().ok()?;
        (of == parent).then_some((pid, name))
    })
    .collect()
}

fn wait<T>(what: &str, mut f: impl FnMut() -> Option<T>) -> T {
    let until = Instant::now() + PATIENCE;
    loop {
        if let Some(value) = f() {
            return value;
        }
        assert!(Instant::now() < until, "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Ends the host if the test does not.
struct Host(Child);

impl Drop for Host {
    fn drop(&mut self) {
        // Fails only if it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn p23_a_host_that_is_killed_leaves_no_emulator_behind() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = Command::new(program());
    let recording = folder.path().join("run.mcap");
    command.args(["--quiet", "run", "--link", "qemu", EXAMPLE, "--out"]).arg(&recording);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut host = Host(command.spawn().expect("the program starts"));
    // The first emulator measures its clocks and ends by itself; the second is the board. When the
    // recording has begun, it is the board that runs. An empty file is there for a moment before,
    // to see whether it can be written.
    wait("no recording was begun", || fs::metadata(&recording).ok().filter(|file| file.len() > 0));
    let (emulator, _) = wait("no emulator was started", || {
        children(host.0.id()).into_iter().find(|(_, name)| name.starts_with("qemu"))
    });
    // SIGKILL: nothing of the host runs any more.
    host.0.kill().expect("it runs");
    host.0.wait().expect("it has ended");
    wait("the emulator goes on without its host", || {
        let stat = fs::read_to_string(format!("/proc/{emulator}/stat"));
        // Nobody here may be its parent now to wait for it: a zombie has ended too.
        let is_gone = stat.map_or(true, |stat| stat.contains(") Z "));
        is_gone.then_some(())
    });
}

/// Kills in the suite; `CATHFORCE_BOARD_KILLS` sets another number.
const KILLS: usize = 2;
/// Ticks with output after which a host is killed, at most.
const MOST_OUTPUT_TICKS: u64 = 2000;
/// A time-out of 5 ms, and a ramp of 20.
const ZERO_WITHIN_TICKS: usize = 25;
/// The fault is on the bus within 10 ms more.
const TOLD_WITHIN_TICKS: usize = 35;

/// The board and a bus that hosts join, while somebody passes frames on.
struct Bus {
    board: Qemu,
    hub: Hub,
}

impl Bus {
    /// Passes frames on until `stop`; counts the ticks with output.
    fn pass_on(&mut self, stop: &AtomicBool, output_ticks: &AtomicUsize) {
        let mut quiet_since = Instant::now();
        // After the end the ticks that were granted come in.
        while !stop.load(Ordering::Relaxed) || quiet_since.elapsed() < Duration::from_millis(500) {
            let from_host = self.hub.receive(Duration::from_millis(1)).expect("a hub");
            for frame in from_host.into_iter().chain(waiting(&mut self.hub)) {
                self.board.send(&frame).expect("a board");
                quiet_since = Instant::now();
            }
            self.board.flush().expect("a board");
            for frame in waiting(&mut self.board) {
                quiet_since = Instant::now();
                let haptic = haptic(&frame);
                let has_output = haptic.is_some_and(|haptic| haptic.force.0 != 0);
                output_ticks.fetch_add(usize::from(has_output), Ordering::Relaxed);
                // Nobody is there between two hosts.
                let _ = self.hub.send(&frame);
            }
            self.hub.flush().expect("a hub");
        }
    }
}

fn waiting(link: &mut impl Link) -> Vec<Frame> {
    std::iter::from_fn(|| link.receive(Duration::ZERO).expect("it is there")).collect()
}

fn haptic(frame: &Frame) -> Option<Haptic> {
    let payload = frame.data().first_chunk::<6>()?;
    match Process::decode(Id::from_raw(frame.id())?, *payload)? {
        Process::Haptic(haptic) => Some(haptic),
        _ => None,
    }
}

/// Lets a host play the example, and kills it after so many ticks with output.
fn play_and_kill(bus: &mut Bus, after: usize) {
    let (stop, output_ticks) = (AtomicBool::new(false), AtomicUsize::new(0));
    let address = bus.hub.name().replace("listen", "tcp");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = folder.path().join("said");
    let mut command = Command::new(program());
    command.args(["--quiet", "run", "--link", &address, EXAMPLE, "--out"]);
    command.arg(folder.path().join("run.mcap")).stdout(Stdio::null());
    command.stderr(fs::File::create(&said).expect("a file"));
    let shared = Mutex::new(bus);
    std::thread::scope(|scope| {
        scope.spawn(|| shared.lock().expect("no panic").pass_on(&stop, &output_ticks));
        let mut host = Host(command.spawn().expect("the program starts"));
        wait("no output in time", || {
            if let Some(status) = host.0.try_wait().expect("a child") {
                stop.store(true, Ordering::Relaxed);
                panic!(
                    "the host has ended: {status}: {}",
                    fs::read_to_string(&said).expect("said")
                );
            }
            (output_ticks.load(Ordering::Relaxed) >= after).then_some(())
        });
        drop(host);
        stop.store(true, Ordering::Relaxed);
    });
}

#[test]
fn p23_a_board_whose_host_is_killed_ramps_to_zero_and_says_why() {
    let kills = std::env::var("CATHFORCE_BOARD_KILLS").ok();
    let kills = kills.map_or(KILLS, |kills| kills.parse().expect("a number"));
    let hub = Hub::listen("host", "127.0.0.1:0").expect("a port");
    let mut bus = Bus { board: <Qemu as Rig>::boot(), hub };
    let mut chance = Chance::new(23);
    for kill in 0..kills {
        let after = 1 + chance.below(MOST_OUTPUT_TICKS) as usize;
        play_and_kill(&mut bus, after);
        let mut client = Client::connect(bus.board).expect("the board lives on");
        let ticks: Vec<_> = (0..TOLD_WITHIN_TICKS)
            .map(|_| client.run_tick(Step::default()).expect("a tick").haptic)
            .collect();
        let silent = ticks.iter().position(|haptic| (haptic.force.0, haptic.torque.0) == (0, 0));
        let told = ticks.iter().position(|haptic| haptic.fault == Fault::EncoderLost.code());
        println!(
            "kill {kill} after {after} ticks with output: zero after {silent:?}, told after {told:?}"
        );
        let silent = silent.expect("the output ends");
        assert!(silent <= ZERO_WITHIN_TICKS, "{ticks:?}");
        assert!(ticks[silent..].iter().all(|haptic| haptic.force.0 == 0 && haptic.torque.0 == 0));
        assert!(told.is_some(), "{ticks:?}");
        let last = ticks[ticks.len() - 1];
        let mode = Mode::from_codes(last.mode, last.fault);
        assert_eq!(mode, Some(Mode::Fault { cause: Fault::EncoderLost }));
        let token = Fault::EncoderLost.clear_token();
        let command = Some(DeviceCommand::ClearFault { token });
        client.run_tick(Step { command, ..Step::default() }).expect("a tick");
        bus = Bus { board: client.into_link(), hub: bus.hub };
    }
}
