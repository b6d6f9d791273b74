//! The firmware on an emulated board: QEMU started here, ended with the link.
//!
//! UART 0 is joined by TCP on the loopback interface. `mux=on` gives the emulated UART,
//! which takes one byte at a time, a buffer that the processor empties without waiting for
//! QEMU's main loop (measured in firmware/README.md). UART 1, the log, is QEMU's standard
//! output.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cathforce_bus::Frame;

pub use crate::firmware::{FIRMWARE_VARIABLE, find_firmware};
use crate::firmware_log::FirmwareLog;
use crate::reader::{READ_TIMEOUT, is_timeout};
use crate::{Link, LinkError, Slcan};

/// The emulator.
pub const PROGRAM: &str = "qemu-system-arm";

const LINK: &str = "qemu";
/// What to do without an emulator that works.
pub const INSTALL: &str = match option_env!("CATHFORCE_DIST") {
    None => "`cargo xtask setup --yes` installs one that works",
    Some(_) => {
        "QEMU 10 works: `apt-get install qemu-system-arm` installs it on Debian 13, and with \
         `-t bookworm-backports` on Debian 12"
    }
};
const BUILD: &str = match option_env!("CATHFORCE_DIST") {
    None => "`cargo xtask firmware` builds it",
    Some(_) => "Install program and firmware again, from one package",
};

/// 2 ns an instruction: 500 000 of them in a tick of 1 ms.
const INSTRUCTION_COUNTING: &str = "shift=1,align=off,sleep=off";
const INSTRUCTION_NS: u64 = 2;
/// The board's memory outside of the chip.
const LARGE_MEMORY_MIB: u32 = 16;
/// The board's clock, 25 MHz.
const CLOCK_COUNT_NS: u64 = 40;

const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);
const SELF_TEST_TIMEOUT: Duration = Duration::from_secs(20);

/// The clocks of an emulator, as the firmware measured them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SelfTest {
    /// Instructions executed.
    pub instructions: u64,
    /// Counts of the board's 25 MHz counter meanwhile.
    pub counter: u64,
    /// Counts of the tick timer meanwhile.
    pub timer: u64,
}

impl SelfTest {
    /// Counts that an emulator with the right clocks gives.
    pub fn expected_counts(&self) -> u64 {
        self.instructions * INSTRUCTION_NS / CLOCK_COUNT_NS
    }

    /// Whether both clocks are right to 1 %. Emulators that get them wrong are off by a factor.
    pub fn passed(&self) -> bool {
        let expected = self.expected_counts();
        [self.counter, self.timer].iter().all(|n| n.abs_diff(expected) * 100 <= expected)
    }
}

/// Boots the firmware in its self-test, which counts instructions by the emulated clocks.
pub fn self_test(elf: &Path) -> Result<SelfTest, LinkError> {
    let mut child = Emulator::spawn(
        command(elf, "self-test").args(["-no-reboot", "-serial", "null"]).stderr(Stdio::piped()),
    )?;
    let stderr = child.0.stderr.take();
    let output = std::thread::spawn(move || {
        let mut text = String::new();
        stderr.map(|mut pipe| pipe.read_to_string(&mut text));
        text
    });
    let deadline = Instant::now() + SELF_TEST_TIMEOUT;
    while child.0.try_wait().is_ok_and(|status| status.is_none()) && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    drop(child);
    let output = output.join().unwrap_or_default();
    parse_self_test(&output).ok_or_else(|| {
        let said = match output.trim() {
            "" => "nothing".to_owned(),
            said => format!("`{said}`"),
        };
        wrong(format!("the firmware did not finish its self-test; QEMU said {said}"), INSTALL)
    })
}

fn parse_self_test(output: &str) -> Option<SelfTest> {
    let line = output.lines().find_map(|line| line.strip_prefix("self-test "))?;
    let value = |name| {
        let mut words = line.split_whitespace().filter_map(|word| word.split_once('='));
        words.find(|(key, _)| *key == name).and_then(|(_, value)| value.parse().ok())
    };
    Some(SelfTest {
        instructions: value("instructions")?,
        counter: value("counter")?,
        timer: value("timer")?,
    })
}

fn wrong(problem: String, fix: &str) -> LinkError {
    LinkError::Emulator { link: LINK.into(), problem, fix: fix.into() }
}

/// How a board is started, for those that test it.
#[derive(Clone, Debug, Default)]
pub struct BoardOptions {
    /// Ticks follow the board's own clock, and are not granted.
    pub runs_free: bool,
    /// A reset by the board itself starts it again, as on a real one. Otherwise it ends the emulation.
    pub reboots: bool,
    /// Port on this computer on which a debugger listens, to which the emulator connects.
    pub debugger: Option<u16>,
    /// File that holds the board's large memory, and with it what the board has saved, while no emulator runs.
    /// It is made when it is not there.
    pub memory: Option<PathBuf>,
}

fn command(elf: &Path, argument: &str) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(["-machine", "mps2-an500", "-display", "none", "-monitor", "none"]);
    command.args(["-icount", INSTRUCTION_COUNTING]);
    command.arg("-semihosting-config");
    command.arg(format!("enable=on,target=native,arg=cathforce,arg={argument}"));
    command.arg("-kernel").arg(elf);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    in_a_group_of_its_own(&mut command);
    end_with_this_process(&mut command);
    command
}

/// Ctrl-C in a terminal goes to a whole process group. The board must survive it, because this
/// program disarms it first.
#[cfg(unix)]
fn in_a_group_of_its_own(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    command.process_group(0);
}

#[cfg(windows)]
fn in_a_group_of_its_own(command: &mut Command) {
    use std::os::windows::process::CommandExt as _;
    /// Of `CreateProcess`.
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}

/// However this process ends, by `kill -9` too, the emulator ends with it: nobody else ends it.
#[cfg(target_os = "linux")]
fn end_with_this_process(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;

    use rustix::process::{Signal, getppid, set_parent_process_death_signal};
    let host = rustix::process::getpid();
    let before_it_starts = move || {
        set_parent_process_death_signal(Some(Signal::KILL))?;
        // If the host has ended meanwhile, nobody sends the signal.
        match getppid() == Some(host) {
            true => Ok(()),
            false => Err(io::ErrorKind::BrokenPipe.into()),
        }
    };
    // SAFETY: two system calls, which a process may make between fork and exec.
    unsafe { command.pre_exec(before_it_starts) };
}

#[cfg(not(target_os = "linux"))]
fn end_with_this_process(_: &mut Command) {}

/// A running emulator; dropping it ends it.
struct Emulator(Child);

impl Emulator {
    fn spawn(command: &mut Command) -> Result<Self, LinkError> {
        command.spawn().map(Self).map_err(|e| match e.kind() {
            io::ErrorKind::NotFound => wrong(format!("{PROGRAM} is not installed"), INSTALL),
            _ => wrong(format!("{PROGRAM} cannot be started: {e}"), INSTALL),
        })
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Fails only if it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl fmt::Display for SelfTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { instructions, counter, timer } = self;
        let expected = self.expected_counts();
        write!(
            f,
            "after {instructions} instructions the counter stands at {counter} and the timer at \
             {timer}; right is {expected}"
        )
    }
}

/// The firmware, on an emulator whose clocks are right.
fn trusted_firmware(elf: Option<&Path>) -> Result<PathBuf, LinkError> {
    let elf = find_firmware(elf)?;
    let measured = self_test(&elf)?;
    if measured.passed() {
        return Ok(elf);
    }
    Err(wrong(format!("this QEMU's clocks are wrong: {measured}"), INSTALL))
}

/// Starts the board with its UART joined to a socket that is open already.
/// `socket` is `host=…,port=…` or `path=…`, as QEMU takes it.
fn spawn_board(elf: &Path, socket: &str, options: BoardOptions) -> Result<Emulator, LinkError> {
    let mut command = command(elf, if options.runs_free { "run-free" } else { "lock-step" });
    if let Some(path) = &options.memory {
        let size = LARGE_MEMORY_MIB;
        let path = path.display();
        let memory = format!("memory-backend-file,id=large,size={size}M,mem-path={path},share=on");
        command.args(["-object", &memory, "-machine", "memory-backend=large"]);
    }
    if !options.reboots {
        command.arg("-no-reboot");
    }
    if let Some(port) = options.debugger {
        let debugger = format!("socket,id=debugger,host=127.0.0.1,port={port},nodelay=on");
        command.args(["-chardev", &debugger, "-gdb", "chardev:debugger"]);
    }
    // The multiplexer's escape character is byte 0x100, which cannot occur, so nothing on the bus
    // is taken for one of its commands.
    command.args(["-chardev", &format!("socket,id=bus,{socket},mux=on")]);
    command.args(["-serial", "chardev:bus", "-echr", "0x100"]);
    command.args(["-chardev", "stdio,id=log,signal=off", "-serial", "chardev:log"]);
    Emulator::spawn(command.stdout(Stdio::piped()).stderr(Stdio::piped()))
}

/// Discards QEMU's warnings while the board runs; they are about idling.
fn drain(emulator: &mut Emulator) {
    if let Some(stderr) = emulator.0.stderr.take() {
        std::thread::spawn(move || io::copy(&mut { stderr }, &mut io::sink()));
    }
}

/// A booted board whose UART another program uses, such as another emulator's serial port.
pub struct JoinedBoard {
    emulator: Emulator,
    log: FirmwareLog,
}

impl JoinedBoard {
    /// Boots the firmware and joins its UART to the Unix socket at `path`. Without `elf` the
    /// firmware is the one of [`find_firmware`].
    pub fn boot(elf: Option<&Path>, path: &Path) -> Result<Self, LinkError> {
        let elf = trusted_firmware(elf)?;
        let mut emulator =
            spawn_board(&elf, &format!("path={}", path.display()), BoardOptions::default())?;
        let log = FirmwareLog::follow(&elf, emulator.0.stdout.take());
        drain(&mut emulator);
        Ok(Self { emulator, log })
    }

    /// What the firmware logged last, to explain why it is silent.
    pub fn last_words(&mut self) -> Vec<String> {
        let ended = self.emulator.0.try_wait().ok().flatten();
        let ended = ended.map(|status| format!("QEMU has ended ({status})"));
        ended.into_iter().chain(self.log.last_words()).collect()
    }
}

/// The link to a booted board.
pub struct Qemu {
    slcan: Slcan,
    emulator: Emulator,
    log: FirmwareLog,
}

impl Qemu {
    /// Boots the firmware in QEMU, in lock step, and links to its UART. Without `elf` the
    /// firmware is the one of [`find_firmware`].
    pub fn boot(elf: Option<&Path>) -> Result<Self, LinkError> {
        Self::boot_with(elf, BoardOptions::default())
    }

    /// [`Qemu::boot`] of a board that is started otherwise.
    pub fn boot_with(elf: Option<&Path>, options: BoardOptions) -> Result<Self, LinkError> {
        Self::start(&trusted_firmware(elf)?, options)
    }

    /// Sends any bytes among the frames, as a broken host might.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.slcan.send_bytes(bytes);
    }

    /// How often the board has opened its channel, as it does after bus-off.
    pub fn openings(&self) -> u32 {
        self.slcan.openings()
    }

    fn start(elf: &Path, options: BoardOptions) -> Result<Self, LinkError> {
        let lost = |e| LinkError::lost(LINK, e);
        let listener = TcpListener::bind(("127.0.0.1", 0)).map_err(lost)?;
        let port = listener.local_addr().map_err(lost)?.port();
        let socket = format!("host=127.0.0.1,port={port},nodelay=on");
        let mut emulator = spawn_board(elf, &socket, options)?;
        let log = FirmwareLog::follow(elf, emulator.0.stdout.take());
        listener.set_nonblocking(true).map_err(lost)?;
        let deadline = Instant::now() + CONNECT_TIMEOUT;
        let stream = loop {
            match listener.accept() {
                Ok((stream, _)) => break stream,
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                Err(e) => return Err(lost(e)),
            }
            let ended = emulator.0.try_wait().map_err(lost)?.is_some();
            if ended || Instant::now() >= deadline {
                return Err(wrong(
                    format!("QEMU did not start the board: {}", complaint(&mut emulator)),
                    INSTALL,
                ));
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        stream.set_nonblocking(false).map_err(lost)?;
        stream.set_nodelay(true).map_err(lost)?;
        stream.set_read_timeout(Some(READ_TIMEOUT)).map_err(lost)?;
        // QEMU's multiplexer keeps bytes that come before the firmware has set up its UART
        // until the next one comes: the firmware's first byte says when to begin.
        let mut ready = [0];
        while let Err(e) = (&stream).read_exact(&mut ready) {
            if !is_timeout(&e) || Instant::now() >= deadline {
                return Err(wrong(
                    format!("the firmware did not start: {}", complaint(&mut emulator)),
                    BUILD,
                ));
            }
        }
        drain(&mut emulator);
        let slcan = Slcan::new(LINK, stream.try_clone().map_err(lost)?, stream)?;
        Ok(Self { slcan, emulator, log })
    }

    /// Adds what the firmware said before it fell silent.
    fn explain(&mut self, error: LinkError) -> LinkError {
        let LinkError::Lost { link, source } = error else { return error };
        let state = match self.emulator.0.try_wait() {
            Ok(Some(status)) => format!("QEMU has ended ({status})"),
            _ => format!("{source}"),
        };
        let source = match self.log.last_words() {
            words if words.is_empty() => io::Error::new(source.kind(), state),
            words => io::Error::new(
                source.kind(),
                format!("{state}; the firmware's last words: {}", words.join("; ")),
            ),
        };
        LinkError::Lost { link, source }
    }
}

fn complaint(emulator: &mut Emulator) -> String {
    let _ = emulator.0.kill();
    let first = emulator.0.stderr.take().and_then(|e| BufReader::new(e).lines().next());
    first.and_then(Result::ok).unwrap_or_else(|| "it said nothing".into())
}

impl Link for Qemu {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.slcan.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.slcan.flush().map_err(|e| self.explain(e))
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.slcan.receive(timeout).map_err(|e| self.explain(e))
    }

    fn name(&self) -> &str {
        LINK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_emulator_with_half_the_tick_rate_is_refused() {
        let test = |text| parse_self_test(text).unwrap().passed();
        assert!(test("self-test instructions=100000 counter=5001 timer=5000\n"));
        assert!(!test("self-test instructions=100000 counter=5001 timer=2500\n"));
        assert!(!test("self-test instructions=100000 counter=0 timer=0\n"));
    }

    #[test]
    fn output_without_the_measurement_is_none() {
        for text in ["", "warning: x\n", "self-test instructions=1 counter=2\n"] {
            assert_eq!(parse_self_test(text), None, "{text}");
        }
    }
}
