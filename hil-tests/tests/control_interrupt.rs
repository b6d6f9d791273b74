//! P13 and P14: what the control interrupt of the image can reach, and the stack that it can take, read off
//! its code.

use cathforce_hil_tests::lab::{Code, Symbols};
use cathforce_link::qemu::find_firmware;

/// Parts of names of functions that end in a panic.
const PANICS: [&str; 4] = ["core::panicking", "panic_", "_fail", "rust_begin_unwind"];
/// What the control interrupt calls through a register: the board's pointer to it, and wakers.
const WAKER: &str = "embassy_executor::raw::waker::wake";
/// The tick takes no more than what is painted when it is measured.
const MOST_TICK_STACK_BYTES: u32 = 8192;
/// Registers that the processor pushes, those of the floating point unit included, and alignment.
const PUSHED_BYTES: u32 = 112;

fn code() -> Code {
    Code::of(&find_firmware(None).unwrap_or_else(|error| panic!("{error}")))
}

fn is_panic(name: &str) -> bool {
    PANICS.iter().any(|part| name.contains(part))
}

#[test]
fn p13_no_panic_is_reachable_from_the_control_interrupt() {
    let code = code();
    // The interrupt's handler jumps to the tick through the pointer that `main` gave to the board.
    let handler = code.function(code.find("vectors::timer0"));
    assert_eq!((handler.calls.len(), handler.indirect_calls), (0, 1));
    let tick = code.find("cathforce_firmware::tick");
    let reached = code.reachable(tick);
    for &at in reached.keys() {
        let name = &code.function(at).name;
        assert!(!is_panic(name), "{name} is reached from {}", code.function(reached[&at]).name);
    }
    // All of the model is in reach, or nothing was looked at.
    for part in ["ControlLoop::tick", "forward_elimination", "back_substitution", "joint_moments"] {
        assert!(reached.keys().any(|at| code.function(*at).name.contains(part)), "{part}");
    }
    // Only the tick itself calls through registers, and what it calls so wakes a task.
    let indirect = reached.keys().filter(|at| code.function(**at).indirect_calls > 0);
    let indirect: Vec<_> = indirect.map(|at| code.function(*at).name.as_str()).collect();
    assert_eq!(indirect, ["cathforce_firmware::device::Core::tick"]);
    for at in code.functions().filter(|(_, f)| f.name == WAKER).map(|(at, _)| at) {
        assert!(code.reachable(at).keys().all(|at| !is_panic(&code.function(*at).name)));
    }
    println!(
        "figure P13: {} functions in reach of the control interrupt, none of which panics",
        reached.len()
    );
}

/// The check above finds panics where there are some: the tasks may panic.
#[test]
fn p13_the_check_finds_the_panics_of_the_tasks() {
    let code = code();
    let polls = code.functions().filter(|(_, f)| f.name.contains("TaskStorage"));
    let polls: Vec<u32> = polls.map(|(at, _)| at).collect();
    assert!(!polls.is_empty());
    let panics = |at: &u32| code.reachable(*at).keys().any(|at| is_panic(&code.function(*at).name));
    assert!(polls.iter().any(panics));
}

#[test]
fn p14_the_stack_of_the_control_interrupt_is_bounded_by_its_code() {
    let code = code();
    let (bytes, way) = code.deepest(code.find("cathforce_firmware::tick"));
    // A waker takes at most this much more, wherever it is called.
    let wakers = code.functions().filter(|(_, f)| f.name == WAKER);
    let waker = wakers.map(|(at, _)| code.deepest(at).0).max().unwrap_or(0);
    let bytes = bytes + waker + PUSHED_BYTES;
    println!("figure P14: at most {bytes} bytes by the code, through {}", way.join(" → "));
    assert!((1000..=MOST_TICK_STACK_BYTES).contains(&bytes), "{bytes} bytes");
}

/// Nobody can step over the guard below the stack without touching it.
#[test]
fn p12_no_frame_but_that_of_the_boot_is_larger_than_the_guard() {
    const GUARD_BYTES: u32 = 16_384;
    let code = code();
    let large = code.functions().filter(|(_, f)| f.frame_bytes > GUARD_BYTES);
    let large: Vec<_> = large.map(|(_, f)| f.name.as_str()).collect();
    assert!(
        large.iter().all(|name| name.ends_with("device::place")),
        "larger than the guard: {large:?}"
    );
    let symbols = Symbols::of(&find_firmware(None).unwrap_or_else(|error| panic!("{error}")));
    assert!(symbols.address("_stack_start") - symbols.address("_stack_end") > 4 * GUARD_BYTES);
}
