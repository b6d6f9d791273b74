//! `monitor` on a terminal: a pseudo-terminal with a session of its own, as SSH gives one.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Termios, Winsize, tcgetattr, tcsetwinsize};

/// Long for a picture, however busy the computer is.
const PATIENCE: Duration = Duration::from_secs(30);
const LEAVES: &str = "\x1b[?1049l";
const SHOWS_CURSOR: &str = "\x1b[?25h";

struct Terminal {
    keys: File,
    /// The other end, which keeps its settings when the program has gone.
    screen: OwnedFd,
    bytes: Receiver<Vec<u8>>,
    shown: String,
}

impl Terminal {
    fn new(columns: u16, rows: u16) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let keys = openpt(flags).unwrap();
        grantpt(&keys).unwrap();
        unlockpt(&keys).unwrap();
        let path = ptsname(&keys, Vec::new()).unwrap().into_string().unwrap();
        let screen = OpenOptions::new().read(true).write(true).open(path).unwrap().into();
        let keys = File::from(keys);
        let (sender, bytes) = channel();
        let mut reader = keys.try_clone().unwrap();
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(n @ 1..) = reader.read(&mut buffer) {
                if sender.send(buffer[..n].to_vec()).is_err() {
                    return;
                }
            }
        });
        let mut terminal = Self { keys, screen, bytes, shown: String::new() };
        terminal.resize(columns, rows);
        terminal
    }

    fn resize(&mut self, columns: u16, rows: u16) {
        let size = Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&self.keys, size).unwrap();
        self.shown.clear();
    }

    /// Starts a program that has this terminal, and no other.
    fn run(&self, arguments: &[&str]) -> Child {
        let end = || Stdio::from(self.screen.try_clone().unwrap());
        let mut command = Command::new("setsid");
        command.args(["--ctty", "--wait", env!("CARGO_BIN_EXE_cathforce")]).args(arguments);
        command.env("TERM", "xterm-256color").env_remove("NO_COLOR");
        command.stdin(end()).stdout(end()).stderr(end()).spawn().unwrap()
    }

    /// Reads until the screen has shown what is wanted.
    #[track_caller]
    fn wait_for(&mut self, wanted: impl Fn(&str) -> bool) {
        let until = Instant::now() + PATIENCE;
        while !wanted(&self.shown) {
            let left = until.saturating_duration_since(Instant::now());
            let Ok(bytes) = self.bytes.recv_timeout(left) else {
                panic!("never shown: {}", &self.shown[..self.shown.floor_char_boundary(3000)]);
            };
            self.shown += &String::from_utf8_lossy(&bytes);
        }
    }

    fn settings(&self) -> Termios {
        tcgetattr(&self.screen).unwrap()
    }
}

/// Something was drawn this far to the right: `ESC [ row ; column H`.
fn reaches(shown: &str, column: u16) -> bool {
    let places = shown.split("\x1b[").filter_map(|part| part.split_once('H'));
    let columns = places.filter_map(|(place, _)| place.split_once(';')?.1.parse::<u16>().ok());
    columns.max() >= Some(column)
}

#[test]
fn a_monitor_follows_its_terminal_and_leaves_it_as_it_was() {
    for quit in [&b"q"[..], b"\x1b", b"\x03"] {
        let mut terminal = Terminal::new(80, 24);
        let before = terminal.settings();
        let mut monitor = terminal.run(&["monitor", "--link", "sim"]);
        terminal.wait_for(|shown| shown.contains("ticks") && shown.contains("quits"));
        assert!(!reaches(&terminal.shown, 81));
        terminal.resize(200, 60);
        terminal.wait_for(|shown| reaches(shown, 190));
        // Smaller than anything that it has to show.
        terminal.resize(3, 2);
        terminal.resize(80, 24);
        // The title: what changes is drawn letter by letter.
        terminal.wait_for(|shown| shown.contains("cathforce"));
        // A key that comes with a change of size is seen too.
        terminal.resize(100, 30);
        terminal.keys.write_all(quit).unwrap();
        terminal.wait_for(|shown| shown.contains(LEAVES) && shown.ends_with(SHOWS_CURSOR));
        assert!(monitor.wait().unwrap().success());
        let after = terminal.settings();
        let modes = |t: &Termios| (t.input_modes, t.output_modes, t.control_modes, t.local_modes);
        assert_eq!(modes(&before), modes(&after), "typing is seen again");
    }
}
