//! `cathforce config save --link` against the emulated board: what was saved is there after a reset, and what was
//! only applied is not.

use std::fs;
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use cathforce_hil_tests::lab::Lab;
use cathforce_hil_tests::{EXAMPLE, Rig, program};
use cathforce_link::{Hub, Link};
use serde_json::Value;

/// The board at the end of a TCP link, which lives on between the commands.
struct Board {
    address: String,
    /// Set to press the button; cleared by the board.
    button: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    fn start() -> Self {
        let mut lab = <Lab as Rig>::boot();
        let mut hub = Hub::listen("slcan:listen", "127.0.0.1:0").expect("a free port");
        let address = hub.name().replace("slcan:listen:", "slcan:tcp:");
        let (button, stop) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let (pressed, stopped) = (Arc::clone(&button), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                if pressed.load(Ordering::Relaxed) {
                    lab.reset();
                    pressed.store(false, Ordering::Relaxed);
                }
                while let Some(frame) = hub.receive(Duration::ZERO).expect("the hub is ours") {
                    lab.send(&frame).expect("the board runs");
                }
                if let Some(frame) = lab.receive(Duration::from_millis(1)).expect("it runs") {
                    // Nobody listens between two commands.
                    let _ = hub.send(&frame).and_then(|()| hub.flush());
                }
            }
        });
        Self { address, button, stop, thread: Some(thread) }
    }

    fn reset(&self) {
        self.button.store(true, Ordering::Relaxed);
        while self.button.load(Ordering::Relaxed) {
            let thread = self.thread.as_ref().expect("started");
            assert!(!thread.is_finished(), "the board has failed");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// A command of `cathforce config` to this board.
    fn config(&self, arguments: &[&str]) -> Output {
        config(&[arguments, &["--link", &self.address]].concat())
    }

    fn force_gain(&self) -> Value {
        json(&self.config(&["get", "force_gain"]))["value"].clone()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn config(arguments: &[&str]) -> Output {
    let mut command = Command::new(program());
    command.env("NO_COLOR", "1").arg("config").args(arguments).args(["--json", "--quiet"]);
    command.output().expect("it starts")
}

#[track_caller]
fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[track_caller]
fn assert_fails(output: &Output, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    for word in words {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
}

#[test]
fn p15_config_save_keeps_what_is_in_use_and_apply_alone_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, gain: &str| {
        let path = folder.path().join(name).to_str().expect("text").to_owned();
        json(&config(&["init", EXAMPLE, &path]));
        json(&config(&["set", &path, &format!("force_gain={gain}")]));
        path
    };
    let (saved, applied) = (file("saved.toml", "2.5"), file("applied.toml", "3.5"));
    let board = Board::start();
    let apply = |file: &str| {
        let output = board.config(&["apply", EXAMPLE, file, "--cell", "2"]);
        assert_eq!(json(&output)["verified"], true);
    };

    // There is nothing to save yet.
    assert_fails(&board.config(&["save"]), &["no configuration", "fix:"]);

    // Applied and not saved: gone after a reset.
    apply(&saved);
    assert_eq!(board.force_gain(), 2.5);
    board.reset();
    assert_fails(&board.config(&["get", "force_gain"]), &["no configuration", "fix:"]);

    // Saved: there after a reset.
    apply(&saved);
    let said = json(&board.config(&["save"]));
    assert_eq!(said["saved"], true);
    let crc = said["image_crc32"].as_str().expect("a CRC").to_owned();
    board.reset();
    assert_eq!(board.force_gain(), 2.5);

    // Another one is applied only: the saved one comes back.
    apply(&applied);
    assert_eq!(board.force_gain(), 3.5);
    board.reset();
    assert_eq!(board.force_gain(), 2.5);

    // Saving the same again says so, and changes nothing.
    let mut plain = Command::new(program());
    plain.env("NO_COLOR", "1").args(["config", "save", "--link", &board.address]);
    let output = plain.output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains(&crc) && text.contains("the same was saved before"), "{text}");

    // Nothing else is written on this computer.
    let files = fs::read_dir(folder.path()).expect("ours").count();
    assert_eq!(files, 2);
}
