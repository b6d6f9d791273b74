//! The firmware: boards, interrupts, tasks. No mathematics.
//!
//! The tick runs `cathforce_device::ControlLoop` in a timer interrupt of the highest priority. All else
//! runs in tasks below it. See `README.md`.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod bus;
#[cfg(target_os = "none")]
mod device;
#[cfg(target_os = "none")]
mod fault;
#[cfg(target_os = "none")]
mod identity;
#[cfg(target_os = "none")]
mod log;
#[cfg(target_os = "none")]
mod placement;
#[cfg(target_os = "none")]
mod record;
#[cfg(target_os = "none")]
mod requests;
#[cfg(target_os = "none")]
mod saved;
#[cfg(target_os = "none")]
mod service;
#[cfg(target_os = "none")]
mod stack;
#[cfg(target_os = "none")]
mod watch;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use board::Board as _;

    stack::paint();
    let (board, ports) = board::start(tick);
    stack::guard();
    defmt::info!("{=str}, firmware {=str}", board.name(), env!("CARGO_PKG_VERSION"));

    if let Some(crash) = record::read() {
        defmt::warn!("reset by itself {=u32} times, fault {=u8}", crash.resets, crash.fault);
    }
    let spare = device::start(board);
    let tick_frames = bus::start();
    let server = service::prepare(board, spare);
    let options = device::boot_options(board);
    let urgent = board::URGENT_TASKS.start(board::URGENT_IRQ);
    let relaxed = board::RELAXED_TASKS.start(board::RELAXED_IRQ);
    let patient = board::PATIENT_TASKS.start(board::PATIENT_IRQ);
    // Cannot fail: each task is spawned once.
    urgent.spawn(defmt::unwrap!(bus::receive(ports.bus_in)));
    urgent.spawn(defmt::unwrap!(bus::send(ports.bus_out, tick_frames)));
    relaxed.spawn(defmt::unwrap!(log::send(ports.log_out)));
    patient.spawn(defmt::unwrap!(service::serve(server)));

    watch::booted();
    board.run(options);
    loop {
        board.idle();
    }
}

/// The tick, which the board's timer interrupt calls. Its frames go to the bus.
#[cfg(target_os = "none")]
fn tick() {
    // SAFETY: this is the tick's interrupt.
    device::tick(&unsafe { bus::Bus::of_the_tick() });
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "cathforce-firmware runs on a device, not here. `cargo xtask firmware` builds it, \
         `cathforce run --link qemu BUNDLE` boots it on an emulated board."
    );
    std::process::exit(2);
}
