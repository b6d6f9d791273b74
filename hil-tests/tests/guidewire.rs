//! A guidewire leads a catheter round a bend, each fed and rotated by its own profile: on the
//! board, bit by bit the same on the host (P22), within its time (P09) and its limits (P02).

use cathforce_bundle::{ImageOptions, SolverDefaults, device_image};
use cathforce_config::Settings;
use cathforce_control::TICK_S;
use cathforce_hil_tests::{guidewire_bundle, record};
use cathforce_link::qemu::Qemu;
use cathforce_recording::{Recording, TickEstimate, replay};

/// Half of the instructions of a tick of 1 ms at 480 MHz and one cycle each.
const MOST_INSTRUCTIONS: u32 = 240_000;
/// Least plausible count, so that a counter that stands still fails.
const LEAST_INSTRUCTIONS: u32 = 20_000;
/// Links that the deepest insertion needs; all of them are in use for a while.
const LINKS: f64 = 63.5;
/// The bend of the example ends here, in the frame of the entry \[m\].
const BEND_ENDS_M: [f32; 2] = [0.055, 0.025];
/// Large enough for the limits to act.
const GAIN: f32 = 20.0;

#[test]
fn p22_p09_p02_a_wire_and_its_catheter_round_a_bend_on_the_board() {
    let bundle = guidewire_bundle();
    let trial = bundle.trial(0).expect("in the example");
    let deepest_m = bundle.largest_insertion_m().expect("a catheter's trial");
    let settings = Settings { force_gain: GAIN, torque_gain: GAIN, ..Settings::default() };
    let link_length_m = Some(SolverDefaults::default().link_length_over(deepest_m, LINKS));
    let options = ImageOptions { link_length_m, settings, ..ImageOptions::default() };
    let (image, _) = device_image(bundle, &options).unwrap_or_else(|error| panic!("{error}"));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("guidewire.mcap");
    let report = record::<Qemu>(bundle, trial, &image, &file);

    assert!(report.tick >= 6000, "{} ticks", report.tick);
    assert_eq!(report.load.missed_ticks, 0);
    let worst = report.load.worst_instructions;
    assert!((LEAST_INSTRUCTIONS..=MOST_INSTRUCTIONS).contains(&worst), "{worst} instructions");

    let recording = Recording::open(&file).expect("just written");
    let (replayed, track) = replay(&recording).expect("in lock step");
    assert_eq!(replayed.first_difference, None);
    assert_eq!(replayed.differing_bits, 0);
    assert_eq!((replayed.digest, replayed.device_digest), (report.digest, Some(report.digest)));
    assert!(replayed.identical());
    let nodes = track.shapes.iter().map(|shape| shape.nodes.len()).max();
    assert_eq!(nodes, Some(64));

    assert_limits(&track.ticks, &settings);
    assert_each_is_felt(&track.ticks);
    assert_path(&track.ticks);
    let [catheter_n, wire_n] = peaks_n(&track.ticks);
    assert!(catheter_n > 0.01 && wire_n > 0.01, "{catheter_n} {wire_n} N");
    println!(
        "{} ticks, worst {worst} instructions; at most {:.1} mN on the catheter's drive, {:.1} mN \
         on the wire's",
        report.tick,
        1e3 * catheter_n,
        1e3 * wire_n
    );
}

/// P02: limits hold for either load and during the change.
fn assert_limits(ticks: &[TickEstimate], settings: &Settings) {
    let slew_n = settings.force_slew_n_per_s * TICK_S;
    let slew_n_m = settings.torque_slew_n_m_per_s * TICK_S;
    for pair in ticks.windows(2) {
        let [before, now] = pair else { continue };
        let force_n = now.haptic_force_n - before.haptic_force_n;
        let torque_n_m = now.haptic_torque_n_m - before.haptic_torque_n_m;
        assert!(force_n.abs() <= slew_n && torque_n_m.abs() <= slew_n_m, "{before:?} {now:?}");
        assert!(now.haptic_force_n.abs() <= settings.force_limit_n, "{now:?}");
        assert!(now.haptic_torque_n_m.abs() <= settings.torque_limit_n_m, "{now:?}");
    }
    assert!(ticks.iter().any(|tick| tick.limited), "no limit acted");
}

/// Without limiting, the output is the gain times the load of the instrument that is held.
fn assert_each_is_felt(ticks: &[TickEstimate]) {
    let mut seen = [0; 2];
    for tick in ticks.iter().filter(|tick| tick.mode == 4 && !tick.limited) {
        let wire = tick.guidewire.expect("fed from the first tick on");
        let felt = wire.felt.expect("a replay knows");
        let load_n = if felt { wire.drive_force_n } else { tick.drive_force_n };
        assert_eq!(Some(tick.haptic_force_n), load_n.map(|load_n| GAIN * load_n));
        seen[usize::from(felt)] += 1;
    }
    assert!(seen.iter().all(|&ticks| ticks > 500), "{seen:?} ticks");
}

/// The tip comes out of the bend, and in the end the wire is back in its catheter.
fn assert_path(ticks: &[TickEstimate]) {
    let tips = ticks.iter().filter_map(|tick| tick.tip_from_entry_m);
    let [x_m, y_m, _] = tips.max_by(|a, b| a[1].total_cmp(&b[1])).expect("inside");
    assert!((x_m - BEND_ENDS_M[0]).abs() < 4e-3 && y_m > BEND_ENDS_M[1] + 5e-3, "{x_m} {y_m} m");
    let last = ticks.last().expect("played");
    let (catheter_m, wire) = (last.insertion_m.expect("fed"), last.guidewire.expect("fed"));
    assert!(wire.insertion_m < catheter_m - 0.02, "{last:?}");
    let ahead = |tick: &TickEstimate| {
        tick.guidewire.zip(tick.insertion_m).is_some_and(|(wire, m)| wire.insertion_m > m + 0.02)
    };
    assert!(ticks.iter().any(ahead), "the wire led");
}

/// The largest load on either drive.
fn peaks_n(ticks: &[TickEstimate]) -> [f32; 2] {
    let peak = |load: fn(&TickEstimate) -> Option<f32>| {
        ticks.iter().filter_map(load).fold(0.0, |most: f32, x| most.max(x.abs()))
    };
    [peak(|tick| tick.drive_force_n), peak(|tick| tick.guidewire?.drive_force_n)]
}
