//! `cathforce flash`: the wrong file is refused before anything is touched.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cathforce_hil_tests::program;
use cathforce_link::build_of;
use cathforce_link::qemu::find_firmware;

const BOARD: &str = "nucleo-h743zi2";

/// A folder with a firmware file and programs that stand for those which write flash.
struct Place {
    folder: tempfile::TempDir,
    /// Protocol and schema of this program.
    protocol: String,
    schema: String,
}

impl Place {
    fn new() -> Self {
        let said = Command::new(program()).arg("--version").output().expect("it starts");
        let said = String::from_utf8(said.stdout).expect("text");
        let after = |begin| {
            let line = said.lines().find_map(|line| line.strip_prefix(begin));
            line.unwrap_or_else(|| panic!("no `{begin}` in {said}")).to_owned()
        };
        let folder = tempfile::tempdir().expect("a folder");
        Self { folder, protocol: after("protocol "), schema: after("image schema ") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The firmware of the emulated board, with these words about itself.
    fn firmware(&self, name: &str, board: &str, protocol: &str) -> PathBuf {
        let built = find_firmware(None).expect("the suite builds it");
        let build = build_of(&built).expect("firmware");
        let schema = &self.schema;
        let text = format!(
            "board={board}\nversion=0.0.9\nbuild={build}\nprotocol={protocol}\nimage-schema={schema}\n"
        );
        let (elf, words) = (self.path(name), self.path("identity"));
        fs::write(&words, text).expect("written");
        let section = format!("--add-section=.cathforce={}", words.display());
        let objcopy = Command::new(objcopy()).arg(section).arg(built).arg(&elf).status();
        assert!(objcopy.expect("llvm-tools are installed").success());
        elf
    }

    /// A program that writes down its arguments and ends so.
    fn programmer(&self, name: &str, code: u8) {
        let log = self.path("log");
        let script = format!("#!/bin/sh\necho {name} \"$@\" >> {}\nexit {code}\n", log.display());
        let path = self.path(name);
        fs::write(&path, script).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("ours");
    }

    fn log(&self) -> String {
        fs::read_to_string(self.path("log")).unwrap_or_default()
    }

    fn flash(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(program());
        command.env("PATH", self.folder.path()).env("NO_COLOR", "1").arg("flash").args(arguments);
        command.output().expect("it starts")
    }
}

fn objcopy() -> PathBuf {
    let said = |what: &str| {
        let output = Command::new("rustc").args(["--print", what]).output().expect("rustc");
        String::from_utf8(output.stdout).expect("text").trim().to_owned()
    };
    let rustlib = Path::new(&said("sysroot")).join("lib/rustlib");
    rustlib.join(said("host-tuple")).join("bin/llvm-objcopy")
}

#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
}

#[test]
fn firmware_of_another_board_or_version_is_refused_and_the_right_one_is_loaded() {
    let place = Place::new();
    let text = |path: &Path| path.to_str().expect("text").to_owned();
    place.programmer("probe-rs", 0);

    // Another board, by its name in the file.
    let other = text(&place.firmware("other.elf", "mps2-an500", &place.protocol));
    let output = place.flash(&["--board", BOARD, "--firmware", &other]);
    assert_fails(&output, 3, &["mps2-an500", BOARD, "nothing was loaded", "fix:"]);

    // Another protocol: both are named, and the command that mends it.
    let old = text(&place.firmware("old.elf", BOARD, "0123456789abcdef"));
    let output = place.flash(&["--board", BOARD, "--firmware", &old]);
    let version = env!("CARGO_PKG_VERSION");
    let command = format!("`cathforce flash --board {BOARD}`");
    assert_fails(&output, 3, &["0123456789abcdef", &place.protocol, "0.0.9", version, &command]);

    // Code that is not what the file says.
    let right = text(&place.firmware("right.elf", BOARD, &place.protocol));
    let changed = text(&place.path("changed.elf"));
    let mut bytes = fs::read(&right).expect("an ELF");
    let at = bytes.len() / 2;
    let code = bytes.windows(4).position(|word| word == &bytes[0x1000..0x1004]).unwrap_or(at);
    bytes[code] ^= 1;
    fs::write(&changed, bytes).expect("written");
    let output = place.flash(&["--board", BOARD, "--firmware", &changed]);
    assert_fails(&output, 3, &["it was changed"]);

    // A file that says nothing of itself.
    let built = text(&find_firmware(None).expect("the suite builds it"));
    let output = place.flash(&["--board", BOARD, "--firmware", &built]);
    assert_fails(&output, 3, &["no section .cathforce", "fix:"]);

    // A device that is another board.
    let output = place.flash(&["--board", BOARD, "--firmware", &right, "--link", "sim"]);
    assert_fails(&output, 5, &[BOARD, "nothing was loaded"]);
    assert_eq!(place.log(), "", "nothing was run");

    let output = place.flash(&["--board", BOARD, "--firmware", &right]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let log = place.log();
    let lines: Vec<_> = log.lines().collect();
    assert_eq!(lines[0], format!("probe-rs download --verify --chip STM32H743ZITx {right}"));
    assert_eq!(lines[1..], ["probe-rs reset --chip STM32H743ZITx"]);
}

#[test]
fn the_program_that_is_installed_is_taken_and_its_failure_is_told() {
    let place = Place::new();
    let right = place.firmware("right.elf", BOARD, &place.protocol);
    let right = right.to_str().expect("text");
    let flash =
        |more: &[&str]| place.flash(&[&["--board", BOARD, "--firmware", right], more].concat());

    let output = flash(&[]);
    assert_fails(&output, 1, &["probe-rs, openocd, st-flash", "fix:"]);
    let output = flash(&["--dry-run"]);
    assert!(output.status.success());
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("would be loaded") && said.contains("probe-rs download"), "{said}");

    place.programmer("openocd", 7);
    let output = flash(&[]);
    assert_fails(&output, 1, &["openocd -f board/st_nucleo_h743zi.cfg", "load it again"]);
    assert!(place.log().contains("program {"), "{}", place.log());

    // It reads no ELF, and there is no hex file beside it.
    place.programmer("st-flash", 0);
    let output = flash(&["--programmer", "st-flash"]);
    assert_fails(&output, 3, &["right.hex", "fix:"]);
    fs::write(place.path("right.hex"), ":00000001FF\n").expect("written");
    let output = flash(&["--programmer", "st-flash"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(place.log().contains("st-flash --reset --format ihex write"), "{}", place.log());
}

#[test]
fn an_emulated_board_has_no_flash() {
    let output = Place::new().flash(&["--board", "mps2-an500"]);
    assert_fails(&output, 2, &["--link qemu"]);
}
