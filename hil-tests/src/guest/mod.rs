//! A Linux machine in QEMU with SocketCAN, which this computer's kernel may lack.
//!
//! It boots Debian's kernel from memory, runs one shell script and powers off. The script has `cathforce` and
//! can-utils; `step NAME COMMAND…` runs a command and reports its output and status.
//!
//! `cargo xtask setup` provides the kernel, the tools and the program; without them a test fails with that
//! advice.

mod initramfs;
mod transcript;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub use transcript::{Step, Transcript};

/// The emulator.
const PROGRAM: &str = "qemu-system-x86_64";
/// Variable that names the folder filled by `cargo xtask setup`, if it is not the usual one.
const FOLDER_VARIABLE: &str = "CATHFORCE_GUEST";
/// Longest time of a script, which takes half a minute on a computer that is not busy.
const PATIENCE: Duration = Duration::from_secs(600);
const INSTALL: &str = "`cargo xtask setup --yes` provides it";

/// Hardware and files of the guest.
#[derive(Clone, Copy, Debug, Default)]
pub struct Machine<'a> {
    /// Two `kvaser_pci` controllers on one bus of their own: `can0` and `can1`.
    pub controllers: bool,
    /// A second serial port, `/dev/ttyS1`, to which another emulator connects by this path.
    pub serial_port: Option<&'a Path>,
    /// The guest's clock counts instructions, a billion a second, and jumps while the guest is idle. It
    /// then measures its own time, independent of this computer's load.
    pub virtual_time: bool,
    /// Files and folders of this computer with their paths in the guest.
    pub files: &'a [(&'a Path, &'a str)],
}

/// A guest that is running its script.
pub struct Guest {
    emulator: Child,
    // Holds the guest's memory image while it boots.
    _folder: tempfile::TempDir,
}

impl Guest {
    /// Boots the machine and starts the script.
    pub fn boot(machine: &Machine, script: &str) -> Self {
        let provided = provided();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let initramfs = folder.path().join("initramfs");
        initramfs::write(&initramfs, &provided, script, machine.files);
        let mut command = Command::new(PROGRAM);
        command.args(["-accel", "tcg", "-cpu", "max", "-m", "384", "-nic", "none"]);
        command.args(["-display", "none", "-monitor", "none", "-no-reboot"]);
        command.arg("-kernel").arg(provided.join("vmlinuz"));
        command.arg("-initrd").arg(&initramfs);
        // A guest that panics ends with its reason instead of waiting.
        command.args(["-append", "console=ttyS0 quiet loglevel=1 panic=-1"]);
        command.args(["-serial", "stdio"]);
        if let Some(path) = machine.serial_port {
            let path = path.display();
            command.arg("-chardev");
            command.arg(format!("socket,id=uart,path={path},server=on,wait=off"));
            command.args(["-serial", "chardev:uart"]);
        }
        if machine.virtual_time {
            command.args(["-icount", "shift=0,sleep=off"]);
        }
        if machine.controllers {
            command.args(["-object", "can-bus,id=bus"]);
            command.args(["-device", "kvaser_pci,canbus=bus"]);
            command.args(["-device", "kvaser_pci,canbus=bus"]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let emulator = command
            .spawn()
            .unwrap_or_else(|e| panic!("{PROGRAM} cannot be started: {e}; {INSTALL}"));
        Self { emulator, _folder: folder }
    }

    /// Waits for the script's end and returns its transcript.
    pub fn transcript(mut self) -> Transcript {
        let read = |pipe: Option<Box<dyn std::io::Read + Send>>| {
            std::thread::spawn(move || {
                let mut bytes = Vec::new();
                // The transcript up to an error is still judged.
                let _ = pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
                String::from_utf8_lossy(&bytes).into_owned()
            })
        };
        let console = read(self.emulator.stdout.take().map(|pipe| Box::new(pipe) as _));
        let complaints = read(self.emulator.stderr.take().map(|pipe| Box::new(pipe) as _));
        let deadline = Instant::now() + PATIENCE;
        while self.emulator.try_wait().is_ok_and(|ended| ended.is_none()) {
            if Instant::now() > deadline {
                let _ = self.emulator.kill();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let console = console.join().expect("read");
        let complaints = complaints.join().expect("read");
        Transcript::parse(&console).unwrap_or_else(|| {
            panic!("the guest did not end its script within {PATIENCE:?}:\n{console}\n{complaints}")
        })
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        // This fails only if the process has ended already.
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

/// The folder with kernel, modules, tools and the program.
fn provided() -> PathBuf {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from);
    let folder = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| workspace.join(target).join("guest"));
    assert!(folder.join("vmlinuz").is_file(), "no guest in {}: {INSTALL}", folder.display());
    folder
}
