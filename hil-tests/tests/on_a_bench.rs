//! The promises that can be shown on a board that runs free.
//!
//! `CATHFORCE_RIG=bench` runs them on a real board (docs/how-to/bring-up-a-board.md). Without it, most of them run on
//! the device's code behind a TCP link, so that their own code and the rig's are executed. That shows nothing about
//! a board, and docs/promises.md does not count it.

use cathforce_bundle::ImageOptions;
use cathforce_bus::service::{SavedState, crc32};
use cathforce_bus::{Command, Counter, Frame};
use cathforce_config::{Settings, image};
use cathforce_control::Mode;
use cathforce_hil_tests::lab::Lab;
use cathforce_hil_tests::places::{PLACES, Place};
use cathforce_hil_tests::real_board::{RIG, RealBoard, VirtualBoard, Wiring};
use cathforce_hil_tests::{Drive, Free, LimitWatch, Rig, Tick, encoder, image_with, small_image};

const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };
/// Feed in a tick \[m\]: 20 mm/s.
const FEED_M: f64 = 20e-6;
/// Longest that a link may take for a test to say anything about milliseconds \[ticks\].
const SLOWEST_LINK: usize = 4;
/// Frames of 8 bytes on a bus of 1 Mbit/s in a tick, at 111 bits each, beside those of host and device.
const FREE_PLACES: u32 = 1000 / 111 - 4;

fn strong_settings() -> Settings {
    let gain = 20.0;
    Settings {
        force_gain: gain,
        torque_gain: gain,
        force_limit_n: 1.0,
        torque_limit_n_m: 4e-3,
        ..Settings::default()
    }
}

/// An image with a strong output, on a grid that fits into a real board.
fn strong() -> Vec<u8> {
    let settings = strong_settings();
    image_with(&ImageOptions { cell_m: 2e-3, settings, ..ImageOptions::default() })
}

fn asked() -> Option<Wiring> {
    Wiring::from_environment().unwrap_or_else(|why| panic!("{why}"))
}

/// Runs a test on the real board that was asked for, or on the device's code behind a TCP link.
fn on_the_rig(test: impl Fn(RealBoard)) {
    if asked().is_some() {
        return test(RealBoard::boot());
    }
    let board = VirtualBoard::start();
    test(RealBoard::start(board.wiring()).unwrap_or_else(|why| panic!("{why}")));
    assert!(board.probed().starts_with("reset --chip SIM\n"), "{}", board.probed());
}

fn force_n(ticks: &[Tick]) -> f32 {
    ticks.last().map_or(0.0, |tick| tick.haptic.force.n().abs())
}

/// Clears the fault that the device is left with, so that a real board ends as it began.
fn check_fault_and_clear<R: Rig>(free: &mut Free<R>) {
    let ticks = free.hear(1);
    let fault = ticks.last().and_then(Tick::fault).expect("a fault is latched");
    free.command(Command::ClearFault { token: fault.clear_token() });
    let ticks = free.hear(20);
    assert_eq!(ticks.last().and_then(Tick::mode), Some(Mode::Boot));
}

#[test]
fn p01_output_ends_when_samples_stop() {
    on_the_rig(|rig| {
        let mut free = Free::configured(rig, &strong());
        let (_, delay) = free.arm(START);
        assert!(delay <= SLOWEST_LINK, "the link takes {delay} ms, which hides what is measured");
        free.plan().feed_m = FEED_M;
        // The tip touches after some travel; the output has to be there to be lost.
        let mut ticks = free.hear(1);
        for _ in 0..100 {
            ticks = free.hear(50);
            if force_n(&ticks) > 0.05 {
                break;
            }
        }
        assert!(force_n(&ticks) > 0.05, "{} N are no output to lose", force_n(&ticks));
        free.plan().at = None;
        let lost = free.hear(60);
        let zero = lost.iter().rposition(|tick| !tick.is_silent()).map_or(0, |last| last + 1);
        let told = lost.iter().position(|tick| tick.fault().is_some()).expect("a fault");
        let follows = lost.iter().take_while(|tick| tick.mode() == Some(Mode::Armed)).count();
        assert_eq!(free.lost(), 0, "frames of the device were lost: nothing is shown");
        // One tick takes the last sample, after what the link takes.
        let begin = delay + 1;
        println!(
            "on {}: armed for {follows}, zero after {zero}, told after {told} ticks; the link takes {delay}",
            free.client_mut().device().board
        );
        assert!(follows < 5 + begin && zero < 25 + begin && told < 35 + begin);
        check_fault_and_clear(&mut free);
    });
}

#[test]
fn p02_the_output_keeps_its_limits() {
    on_the_rig(|rig| {
        let image = strong();
        let mut free = Free::configured(rig, &image);
        let mut watch = LimitWatch::new(&image::decode(&image).expect("our own").settings);
        let (ticks, _) = free.arm(START);
        ticks.iter().for_each(|tick| watch.check(tick));
        for feed_m in [FEED_M, -FEED_M, FEED_M] {
            free.plan().feed_m = feed_m;
            free.hear(400).iter().for_each(|tick| watch.check(tick));
        }
        assert_eq!(free.lost(), 0, "frames of the device were lost: nothing is shown");
        assert!(watch.shares()[0] > 0.0, "there was no output to limit");
    });
}

#[test]
fn p04_four_bad_frames_ramp_down() {
    on_the_rig(|rig| {
        let mut free = Free::configured(rig, small_image());
        free.arm(START);
        let before = free.report().counters.get(Counter::Corrupt);
        let bad = |free: &mut Free<RealBoard>| {
            let good = free.seal(encoder(START));
            let mut data = good.data().to_vec();
            data[0] ^= 1;
            Frame::new(good.id(), &data).expect("as long as before")
        };
        let one = bad(&mut free);
        free.send([one]);
        assert_eq!(free.hear(40).last().and_then(Tick::mode), Some(Mode::Armed));
        assert_eq!(free.report().counters.get(Counter::Corrupt), before + 1);
        let many = [(); 4].map(|()| bad(&mut free));
        free.send(many);
        free.hear(60);
        assert_eq!(free.report().counters.get(Counter::Corrupt), before + 5);
        check_fault_and_clear(&mut free);
    });
}

#[test]
fn p07_three_jumps_ramp_down() {
    on_the_rig(|rig| {
        let mut free = Free::configured(rig, small_image());
        free.arm(START);
        free.plan().at = Some(Drive { insertion_m: START.insertion_m + 0.02, ..START });
        free.hear(60);
        check_fault_and_clear(&mut free);
    });
}

#[test]
fn p16_a_damaged_image_is_refused() {
    on_the_rig(|rig| {
        let mut free = Free::configured(rig, small_image());
        let mut damaged = strong();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 0x10;
        let error = free.upload(&damaged).expect_err("damaged");
        assert!(error.to_string().contains("check does not fit"), "{error}");
        assert_eq!(free.report().image_crc32, crc32(small_image()));
    });
}

#[test]
fn p17_an_armed_device_takes_no_image() {
    on_the_rig(|rig| {
        // Made before: a device that is armed does not wait for a host that computes.
        let other = strong();
        let mut free = Free::configured(rig, small_image());
        free.arm(START);
        let error = free.upload(&other).expect_err("armed");
        assert!(error.to_string().contains("disarm it first"), "{error}");
        let report = free.report();
        assert_eq!(report.image_crc32, crc32(small_image()));
        assert_eq!(Mode::from_codes(report.mode, report.fault), Some(Mode::Armed));
    });
}

#[test]
fn p18_nothing_is_output_before_arming() {
    on_the_rig(|rig| {
        let mut free = Free::configured(rig, &strong());
        let is_quiet = |ticks: &[Tick]| {
            ticks.iter().all(|tick| tick.is_silent() && tick.mode() != Some(Mode::Armed))
        };
        free.plan().at = Some(START);
        free.command(Command::Arm);
        assert!(is_quiet(&free.hear(20)), "armed without a self-test");
        free.plan().at = None;
        free.command(Command::SelfTest);
        free.command(Command::Arm);
        assert!(is_quiet(&free.hear(20)), "armed without samples");
        let (ticks, _) = free.arm(START);
        let first = ticks.iter().position(|tick| tick.mode() == Some(Mode::Armed));
        assert!(is_quiet(&ticks[..first.expect("it is armed in the end")]));
    });
}

/// What is saved on a real board is another image afterwards.
#[test]
fn p15_what_was_saved_is_there_after_a_reset() {
    fn saves<R: Rig>(rig: R) {
        let image = strong();
        let mut free = Free::configured(rig, &image);
        free.client_mut().save_image().expect("nothing is armed");
        free.upload(small_image()).expect("nothing is armed");
        let mut free = free.again();
        assert_eq!(free.report().image_crc32, crc32(&image), "applied is not saved");
        let saved = free.client_mut().saved().expect("an answer").expect("a flash");
        assert_eq!((saved.state, saved.image_crc32), (SavedState::Good, crc32(&image)));
    }
    match asked() {
        Some(_) => saves(RealBoard::boot()),
        None => saves(<Lab as Rig>::boot()),
    }
}

/// The device's code behind a TCP link measures no time: only a board shows this.
#[test]
#[ignore = "needs a real board: CATHFORCE_RIG=bench, and --ignored"]
fn p09_p10_p14_p20_a_full_bus_delays_no_tick() {
    assert!(asked().is_some(), "NOT RUN: it measures a real board; set {RIG}=bench");
    let mut free = Free::configured(RealBoard::boot(), small_image());
    free.arm(START);
    free.client_mut().reset_counters().expect("an answer");
    let before = free.sent_foreign();
    free.plan().foreign = FREE_PLACES;
    free.hear(10_000);
    let report = free.report();
    let load = report.load;
    assert_eq!(Mode::from_codes(report.mode, report.fault), Some(Mode::Armed));
    assert_eq!(load.missed_ticks, 0, "{load:?}");
    assert_eq!(load.overruns, 0, "{load:?}");
    assert!((1..=2000).contains(&load.latest_start_ns), "{load:?}");
    // Half of a millisecond at 400 MHz.
    assert!((1..=200_000).contains(&load.worst_cycles), "{load:?}");
    let (used, size) = (load.stack_used_bytes, load.stack_size_bytes);
    assert!(used > 0 && 10 * u64::from(used) <= 6 * u64::from(size), "{load:?}");
    let foreign = report.counters.get(Counter::Foreign);
    println!("{load:?}; {} foreign frames sent, {foreign} seen", free.sent_foreign() - before);
    assert!(foreign > 0, "the bus was not full: nothing is shown");
}

/// Every test of the table is here, and no other test carries a promise's number.
#[test]
fn the_table_of_places_names_these_tests() {
    for (id, place) in PLACES {
        match place {
            Place::Bench { .. } => {}
            Place::EmulatorOnly(why) => println!("{id} NOT RUN: it cannot run on a bench: {why}"),
            Place::NoBoard(why) => println!("{id} NOT RUN: it needs no board: {why}"),
        }
    }
    let source = include_str!("on_a_bench.rs");
    let functions = source.lines().filter_map(|line| line.strip_prefix("fn p")?.split('(').next());
    let mut here: Vec<_> = functions.map(|rest| format!("p{rest}")).collect();
    let bench = PLACES.iter().filter_map(|(id, place)| match place {
        Place::Bench { test, .. } => Some((id, *test)),
        _ => None,
    });
    let mut named: Vec<_> = bench
        .map(|(id, test)| {
            assert!(test.contains(&id.to_lowercase()), "{test} does not bear {id}");
            test.to_owned()
        })
        .collect();
    named.sort_unstable();
    named.dedup();
    here.sort_unstable();
    assert_eq!(here, named);
}
