//! A stand-in for a real board: the device's code at the other end of a TCP link, with a program in the
//! place of `probe-rs` that resets it.
//!
//! Its ticks follow the host's samples, or come [`ALONE`] apart when there are none. A computer that is too busy
//! for a millisecond then makes the test slower, and does not take the device's samples away.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_bus::{Id, Process, Sealer, Status, Sync};
use cathforce_link::{Hub, Link, LinkError, Sim};

use super::Wiring;

/// From one tick to the next without a sample.
const ALONE: Duration = Duration::from_millis(100);

/// A device in a thread of its own. It ends with this value.
pub struct VirtualBoard {
    folder: tempfile::TempDir,
    wiring: Wiring,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl VirtualBoard {
    /// Switches it on.
    pub fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let probe_rs = probe_rs(folder.path());
        let mut hub = Hub::listen("slcan:listen", "127.0.0.1:0").expect("a free port");
        let link = hub.name().replace("slcan:listen:", "slcan:tcp:");
        let wiring =
            Wiring { link, board: "sim".into(), chip: "SIM".into(), probe: None, probe_rs };
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, button) = (Arc::clone(&stop), button(folder.path()));
        let thread = std::thread::spawn(move || {
            let mut device = Device::new();
            while !stopped.load(Ordering::Relaxed) {
                if button.exists() {
                    device = Device::new();
                    fs::remove_file(&button).expect("ours");
                }
                // A host that goes away is no concern of a board's.
                let _ = device.serve(&mut hub);
            }
        });
        Self { folder, wiring, stop, thread: Some(thread) }
    }

    /// How to reach it.
    pub fn wiring(&self) -> Wiring {
        self.wiring.clone()
    }

    /// The commands that the program in the place of `probe-rs` was given, one a line.
    pub fn probed(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }
}

impl Drop for VirtualBoard {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A file that is there while the button is pressed.
fn button(folder: &Path) -> PathBuf {
    folder.join("reset")
}

/// Writes the program that presses the button, and waits until the device has seen it.
fn probe_rs(folder: &Path) -> PathBuf {
    let path = folder.join("probe-rs");
    let (log, button) = (folder.join("log"), button(folder));
    let script = format!(
        "#!/bin/sh\necho \"$@\" >> '{log}'\n: > '{button}'\nwhile [ -e '{button}' ]; do sleep 0.01; done\n",
        log = log.display(),
        button = button.display()
    );
    fs::write(&path, script).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("ours");
    path
}

struct Device {
    sim: Sim,
    sealer: Sealer,
    host_tick: u32,
    due: Instant,
}

impl Device {
    fn new() -> Self {
        let (sim, sealer) = (Sim::in_lock_step(), Sealer::default());
        Self { sim, sealer, host_tick: 0, due: Instant::now() + ALONE }
    }

    /// Takes a frame from the bus, or waits until a tick is due.
    fn serve(&mut self, bus: &mut Hub) -> Result<(), LinkError> {
        let left = self.due.saturating_duration_since(Instant::now());
        let frame = bus.receive(left)?;
        if let Some(frame) = frame {
            self.sim.send(&frame)?;
        }
        let sampled = frame.is_some_and(|frame| Id::from_raw(frame.id()) == Some(Id::Encoder));
        if sampled || frame.is_none() {
            let sync = Process::Sync(Sync { grant: 1, host_tick: self.host_tick });
            self.host_tick += 1;
            self.sim.send(&self.sealer.seal(sync, Status::default()))?;
            self.due = Instant::now() + ALONE;
        }
        while let Some(frame) = self.sim.receive(Duration::ZERO)? {
            bus.send(&frame)?;
        }
        bus.flush()
    }
}
