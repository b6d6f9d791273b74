//! P11 and P12: a hang, a panic, a fault of the processor and a stack overflow switch the outputs off, leave
//! a record that outlives the reset, and reset the device. Each fault is put in by the debugger.

use cathforce_bus::{Command, Process};
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::lab::{HANG, Lab, Patch, UNDEFINED};
use cathforce_hil_tests::{Bench, Drive, encoder, small_image};
use cathforce_link::{Client, CrashRecord};

/// A short insertion, so that settling ends soon.
const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };
/// Longer than any reset may take, and shorter than the ramp that begins without encoders: what switches
/// the outputs off is the reset.
const GRANTED_TICKS: u16 = 22;
/// Promise P11.
const MOST_MS: f64 = 20.0;
/// The tasks, by the paths of their functions, and their names in a record.
const TASKS: [(&str, &str); 4] = [
    ("bus::receive", "receive"),
    ("bus::send", "send"),
    ("log::send", "log"),
    ("service::serve", "service"),
];

/// What was seen of a crash.
struct Seen {
    /// From the fault to the reset \[ms\].
    after_ms: f64,
    record: CrashRecord,
    bench: Bench<Lab>,
}

/// Arms a board, lets ticks run, puts a fault in at the begin of one, and waits until the board has reset
/// itself. What `put_in` has overwritten in the code, it gives back.
fn crash(put_in: impl FnOnce(&mut Lab) -> Option<Patch>) -> Seen {
    let mut bench = Bench::<Lab>::armed(small_image(), START);
    bench.grant_ticks(GRANTED_TICKS);
    let lab = bench.link_mut();
    lab.run_to(lab.symbols.address("device::Core::tick"));
    assert!(lab.outputs_are_on(), "an armed board's outputs are on");
    let began_ms = lab.time_ms();
    let patch = put_in(lab);
    let after_ms = reset(lab) - began_ms;
    if let Some(patch) = patch {
        lab.mend(&patch);
    }
    lab.debugger.go_on();
    let mut bench = bench.again();
    let record = bench.client_mut().crash().expect("an answer").expect("a record");
    println!("{after_ms:.2} ms, {record:?}");
    Seen { after_ms, record, bench }
}

/// Runs the board until it resets itself with the outputs off, and through the reset. Returns the time of it
/// \[ms\].
fn reset(lab: &mut Lab) -> f64 {
    lab.run_to(lab.symbols.address("cathforce_reset"));
    let at_ms = lab.time_ms();
    assert!(!lab.outputs_are_on(), "the outputs are on at the reset");
    lab.run_to(lab.symbols.address("Reset"));
    at_ms
}

/// Hangs a function; the outputs must go off, and the board reset itself, in time.
fn hang(what: &str, find: impl FnOnce(&mut Lab) -> u32, expected: &str) {
    let Seen { after_ms, record, .. } = crash(|lab| {
        let at = find(lab);
        Some(lab.patch(at, HANG))
    });
    println!("figure P11: {what} hangs: reset after {after_ms:.1} ms");
    assert!(after_ms <= MOST_MS, "{what}: {after_ms} ms");
    assert_eq!((record.fault, record.resets), (Some(Fault::Hang), 1), "{what}");
    assert_eq!(record.text.split(", ").next(), Some(expected), "{what}: {record:?}");
}

#[test]
fn p11_each_task_that_hangs_resets_the_board() {
    for (task, name) in TASKS {
        hang(task, |lab| lab.poll_of(task), name);
    }
}

#[test]
fn p11_a_tick_and_an_interrupt_that_hang_reset_the_board() {
    hang("the tick", |lab| lab.symbols.address("device::Core::tick"), "tick");
    // Nobody below the interrupt runs any more.
    hang("an interrupt", |lab| lab.symbols.address("vectors::urgent"), "receive");
}

/// In lock step no byte is received while ticks run, so this board runs free, with its outputs off.
#[test]
fn p11_the_interrupt_of_the_bus_that_hangs_resets_a_board_that_runs_free() {
    let mut lab = Lab::start(true);
    let interrupt = lab.symbols.address("vectors::uart0_receive");
    // The boot has a watchdog of its own, which waits longer.
    lab.run_to(lab.symbols.address("device::Core::tick"));
    lab.send_bytes(b"\r");
    lab.run_to(interrupt);
    let began_ms = lab.time_ms();
    let patch = lab.patch(interrupt, HANG);
    let after_ms = reset(&mut lab) - began_ms;
    lab.mend(&patch);
    lab.debugger.go_on();
    assert!(after_ms <= MOST_MS, "{after_ms} ms");
    let mut client = Client::connect(lab).expect("the board is back");
    let record = client.crash().expect("an answer").expect("a record");
    println!("{after_ms:.2} ms, {record:?}");
    assert_eq!((record.fault, record.program_counter), (Some(Fault::Hang), interrupt));
}

/// The record is there until the next crash, and its fault holds the device until it is cleared by name.
fn assert_locked_until_cleared(seen: &mut Seen, fault: Fault) {
    assert_eq!((seen.record.fault, seen.record.resets), (Some(fault), 1));
    let bench = &mut seen.bench;
    bench.upload(small_image()).expect("nothing is armed");
    let mode = |bench: &mut Bench<Lab>, command| {
        let ticks = bench.play([vec![encoder(START), Process::Command(command)]]);
        ticks[0].mode()
    };
    let latched = Some(Mode::Fault { cause: fault });
    assert_eq!(mode(bench, Command::SelfTest), latched);
    assert_eq!(mode(bench, Command::Arm), latched);
    let token = Fault::Overrun.clear_token();
    assert_eq!(mode(bench, Command::ClearFault { token }), latched, "another fault's token");
    let token = fault.clear_token();
    assert_eq!(mode(bench, Command::ClearFault { token }), Some(Mode::Boot));
    // It does not come back with the next configuration.
    bench.upload(small_image()).expect("nothing is armed");
    assert_eq!(mode(bench, Command::SelfTest), Some(Mode::Idle));
    assert_eq!(bench.client_mut().crash().expect("an answer").as_ref(), Some(&seen.record));
}

#[test]
fn p12_a_panic_leaves_its_message_and_holds_the_device_until_it_is_cleared() {
    let mut bench = Bench::<Lab>::armed(small_image(), START);
    let lab = bench.link_mut();
    let began_ms = lab.time_ms();
    // No tick is granted, so that nobody has the core. A line that is no frame is counted, and the task that
    // counts it finds that the core is not there.
    let core = lab.symbols.address("device::CORE");
    lab.debugger.write(core, &[0; 4]);
    lab.send_bytes(b"?\r");
    let after_ms = reset(lab) - began_ms;
    lab.debugger.go_on();
    let mut bench = bench.again();
    let record = bench.client_mut().crash().expect("an answer").expect("a record");
    let mut seen = Seen { after_ms, record, bench };
    assert_locked_until_cleared(&mut seen, Fault::Panic);
    let text = &seen.record.text;
    assert!(text.starts_with("firmware/src/device.rs:") && text.contains("corrupt"), "{text}");
}

#[test]
fn p12_an_undefined_instruction_leaves_where_it_was() {
    let mut at = 0;
    let mut seen = crash(|lab| {
        at = lab.poll_of("bus::send");
        Some(lab.patch(at, UNDEFINED))
    });
    assert_locked_until_cleared(&mut seen, Fault::HardFault);
    assert_eq!(seen.record.program_counter, at);
    /// UNDEFINSTR of the Configurable Fault Status Register.
    const UNDEFINED_INSTRUCTION: u32 = 1 << 16;
    assert_eq!(seen.record.status, UNDEFINED_INSTRUCTION);
}

#[test]
fn p12_a_stack_overflow_is_told_from_other_faults() {
    let mut seen = crash(|lab| {
        // As deep as if a recursion had left 64 bytes above the guard of 16 KiB.
        let end = lab.symbols.address("_stack_end");
        lab.debugger.set_stack_pointer(end + 16384 + 64);
        None
    });
    assert_locked_until_cleared(&mut seen, Fault::StackOverflow);
}

#[test]
fn p12_there_is_no_record_after_switching_on() {
    let mut bench = Bench::<Lab>::booted();
    assert_eq!(bench.client_mut().crash().expect("an answer"), None);
    // Memory that holds a record by chance, but for one bit.
    let lab = bench.link_mut();
    let place = lab.symbols.address("_crash_record");
    lab.debugger.write(place, &0xCFC0_1D01u32.to_le_bytes());
    lab.debugger.go_on();
    assert_eq!(bench.client_mut().crash().expect("an answer"), None);
}
