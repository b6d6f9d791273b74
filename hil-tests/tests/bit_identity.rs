//! P22: a log of the board replays on the host without a differing bit. The same run measures the cost of a
//! tick (P09) and the depth of the stack (P14).

use cathforce_bundle::{ImageOptions, SolverDefaults};
use cathforce_config::image;
use cathforce_hil_tests::{bundle, image_with, record};
use cathforce_link::qemu::Qemu;
use cathforce_recording::{Recording, replay};

/// The deepest of the example's trials: 9.8 s of feed, with rotation.
const TRIAL: u32 = 2;
/// Nodes in the vessel at its end, which is all of them.
const NODES: usize = 64;
/// How much of it is played with two solves \[s\].
const TWO_SOLVES_S: f64 = 2.0;
/// Links that the deepest insertion takes, so that the last one has come in well before.
const LINKS: f64 = 63.5;

/// Largest number of instructions of a tick with one solve (docs/explanation/model.md).
const MOST_INSTRUCTIONS: u32 = 150_000;
/// Least plausible count, so that a counter that stands still fails.
const LEAST_INSTRUCTIONS: u32 = 20_000;

#[test]
fn p22_p09_p14_an_insertion_on_the_board_replays_without_a_differing_bit() {
    let trial = bundle().trial(TRIAL).expect("in the example");
    let deepest_m = trial.catheter().expect("a catheter's").insertion_m.iter();
    let deepest_m = deepest_m.copied().fold(0.0, f64::max);
    let link_length_m = Some(SolverDefaults::default().link_length_over(deepest_m, LINKS));
    let options = ImageOptions { link_length_m, ..Default::default() };
    let image = image_with(&options);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("insertion.mcap");
    let report = record::<Qemu>(bundle(), trial, &image, &file);

    assert!(report.tick >= 10_000, "{} ticks", report.tick);
    assert_eq!(report.load.missed_ticks, 0);
    let worst = report.load.worst_instructions;
    assert!((LEAST_INSTRUCTIONS..=MOST_INSTRUCTIONS).contains(&worst), "{worst} instructions");
    let (used, size) = (report.load.stack_used_bytes, report.load.stack_size_bytes);
    assert!(used > 0 && used * 5 <= size * 3, "{used} of {size} bytes of stack");

    let recording = Recording::open(&file).expect("just written");
    let (replayed, track) = replay(&recording).expect("in lock step");
    assert_eq!(replayed.first_difference, None);
    assert_eq!(replayed.differing_bits, 0);
    assert_eq!((replayed.missing_frames, replayed.extra_frames), (0, 0));
    assert_eq!(replayed.ticks, u64::from(report.tick));
    assert_eq!(replayed.frames_compared, 3 * replayed.ticks);
    // What the bus is too narrow to carry: every output of every tick, nodes included.
    assert_eq!((replayed.digest, replayed.device_digest), (report.digest, Some(report.digest)));
    assert!(replayed.identical());

    let nodes = track.shapes.iter().map(|shape| shape.nodes.len()).max();
    assert_eq!(nodes, Some(NODES));
    println!("{} ticks, worst {worst} instructions, {used} of {size} bytes", report.tick);
}

/// So it does with two solves a tick, which a setting asks for.
#[test]
fn p22_two_solves_a_tick_replay_without_a_differing_bit() {
    let mut short = bundle().trial(TRIAL).expect("in the example").clone();
    short.t_s.retain(|&t_s| t_s < TWO_SOLVES_S);
    let image = |solves| {
        let parameters = vec![("solver.solves".to_owned(), solves)];
        image_with(&ImageOptions { cell_m: 2e-3, parameters, ..ImageOptions::default() })
    };
    let folder = tempfile::tempdir().expect("a folder");
    let digests = [1.0, 2.0].map(|solves| {
        let file = folder.path().join(format!("{solves}.mcap"));
        let report = record::<Qemu>(bundle(), &short, &image(solves), &file);
        let (replayed, _) =
            replay(&Recording::open(&file).expect("written")).expect("in lock step");
        assert!(replayed.identical(), "{} bits differ", replayed.differing_bits);
        assert_eq!(replayed.device_digest, Some(report.digest));
        report.digest
    });
    assert_ne!(digests[0], digests[1]);
}

/// The comparison above would find one bit.
#[test]
fn p22_one_bit_of_one_frame_is_found() {
    let trial = bundle().trial(0).expect("in the example");
    let mut short = trial.clone();
    short.t_s.truncate(50);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("short.mcap");
    let image = cathforce_hil_tests::small_image();
    record::<cathforce_link::Sim>(bundle(), &short, image, &file);
    let mut recording = Recording::open(&file).expect("just written");
    assert!(image::decode(&recording.image).is_ok());
    assert!(replay(&recording).expect("in lock step").0.identical());

    let frames = &mut recording.frames;
    let last = frames.iter_mut().rev().find(|f| f.frame.id() == 0x190).expect("CONTACT");
    let mut data = last.frame.data().to_vec();
    data[0] ^= 1;
    last.frame = cathforce_bus::Frame::new(0x190, &data).expect("as before");
    let (report, _) = replay(&recording).expect("in lock step");
    assert_eq!(report.differing_bits, 1);
    assert!(!report.identical());
}
