//! The firmware of ST's Nucleo-H743ZI2, read off its image: what is hot lies in the memory that is always fast,
//! and its control path is the same code as on the emulated board. It is not run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use cathforce_hil_tests::lab::{Code, Symbols};
use cathforce_link::qemu::find_firmware;

/// Names another ELF than the one that the suite builds.
const VARIABLE: &str = "CATHFORCE_NUCLEO_FIRMWARE";
const BUILT: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../target/nucleo-h743/thumbv7em-none-eabihf/firmware/cathforce-firmware"
);
/// The memory that answers in one cycle.
const DTCM: std::ops::Range<u32> = 0x2000_0000..0x2002_0000;
/// Registers that the processor pushes, and alignment.
const PUSHED_BYTES: u32 = 112;
/// As on the emulated board.
const MOST_TICK_STACK_BYTES: u32 = 8192;

fn elf() -> PathBuf {
    let elf = std::env::var_os(VARIABLE).map_or(PathBuf::from(BUILT), PathBuf::from);
    assert!(elf.is_file(), "{} is missing: `cargo xtask firmware` builds it", elf.display());
    elf
}

/// The functions of the shared crates that a tick reaches.
fn control_path(elf: &Path) -> BTreeSet<String> {
    let code = Code::of(elf);
    let reached = code.reachable(code.find("cathforce_firmware::tick"));
    let names = reached.keys().map(|at| code.function(*at).name.clone());
    names.filter(|name| !name.contains("firmware")).collect()
}

#[test]
fn the_control_path_of_both_boards_is_the_same_code() {
    let emulated = find_firmware(None).unwrap_or_else(|error| panic!("{error}"));
    let (emulated, nucleo) = (control_path(&emulated), control_path(&elf()));
    let differing: Vec<_> = emulated.symmetric_difference(&nucleo).collect();
    assert!(differing.is_empty(), "only one board's tick reaches {differing:?}");
    for part in ["ControlLoop::tick", "forward_elimination", "back_substitution"] {
        assert!(nucleo.iter().any(|name| name.contains(part)), "{part}");
    }
    assert!(nucleo.iter().all(|name| !name.contains("core::panicking")), "{nucleo:?}");
}

#[test]
fn the_state_of_the_tick_lies_in_tightly_coupled_memory() {
    let symbols = Symbols::of(&elf());
    for hot in ["device::start::FIRST", "device::start::SECOND", "device::CORE", "_crash_record"] {
        let at = symbols.address(hot);
        assert!(DTCM.contains(&at), "{hot} lies at {at:08x}");
    }
    // The large and slow lie elsewhere.
    for slow in ["image_buffers::FIRST", "image_buffers::SECOND", "_stack_end"] {
        let at = symbols.address(slow);
        assert!(!DTCM.contains(&at), "{slow} lies at {at:08x}");
    }
}

#[test]
fn the_stack_of_its_control_interrupt_is_bounded_by_its_code() {
    let code = Code::of(&elf());
    let (bytes, way) = code.deepest(code.find("cathforce_firmware::tick"));
    let bytes = bytes + PUSHED_BYTES;
    println!(
        "Nucleo-H743ZI2: a tick takes at most {bytes} bytes of stack, through {}",
        way.join(" → ")
    );
    assert!((1000..=MOST_TICK_STACK_BYTES).contains(&bytes), "{bytes} bytes");
}
