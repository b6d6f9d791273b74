//! P23: a killed host leaves no process behind on this computer.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cathforce_hil_tests::{EXAMPLE, program};

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
