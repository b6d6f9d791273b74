//! P01: no fresh valid encoder sample for 5 ms → RAMP, zero by 25 ms, and the fault on the
//! bus within 10 ms more.

use cathforce_bus::{Command, Frame, Process};
use cathforce_config::image;
use cathforce_control::{Config, Mode};
use cathforce_device::ControlLoop;
use cathforce_hil_tests::{Bench, Drive, LimitWatch, Rig, Tick, encoder, strong_image};
use cathforce_link::Sim;
use cathforce_link::qemu::Qemu;

const START: Drive = Drive { insertion_m: 0.05, rotation_rad: 0.0 };
/// Feed in a tick \[m\]: 20 mm/s.
const FEED_M: f64 = 20e-6;

/// Ticks since the last sample after which the output no longer follows the model.
const TIMEOUT: usize = 5;
/// Ticks since the last sample after which the output is zero.
const ZERO: usize = 25;
/// Ticks since the last sample after which the fault is on the bus.
const TOLD: usize = 35;

/// `lost`: the ticks after the last sample. `watch` has seen all ticks before them.
fn check(phase: usize, mut watch: LimitWatch, lost: &[Tick]) {
    assert!(lost.len() >= TOLD);
    for (ticks, tick) in (1..).zip(lost) {
        watch.check(tick);
        let mode = tick.mode();
        let follows = mode == Some(Mode::Armed);
        assert!(!follows || ticks < TIMEOUT, "phase {phase}, {ticks} ms: {tick:?}");
        assert!(tick.is_silent() || ticks < ZERO, "phase {phase}, {ticks} ms: {tick:?}");
        let told = matches!(mode, Some(Mode::Fault { .. }));
        assert!(told || ticks < TOLD, "phase {phase}, {ticks} ms: {tick:?}");
    }
}

fn feed<R: Rig>(bench: &mut Bench<R>, at: &mut Drive, ticks: usize) -> Vec<Tick> {
    let steps = (0..ticks).map(|_| {
        at.insertion_m += FEED_M;
        vec![encoder(*at)]
    });
    bench.play(steps)
}

/// An armed device with a haptic output, which the ramp then has to remove.
fn pushing<R: Rig>(at: &mut Drive) -> (Bench<R>, LimitWatch) {
    let mut bench = Bench::configured(strong_image());
    let watch = push(&mut bench, at);
    (bench, watch)
}

fn push<R: Rig>(bench: &mut Bench<R>, at: &mut Drive) -> LimitWatch {
    let mut watch = LimitWatch::new(&image::decode(strong_image()).expect("our own").settings);
    let mut ticks = bench.arm(*at);
    ticks.extend(feed(bench, at, 60));
    ticks.iter().for_each(|tick| watch.check(tick));
    let force_n = ticks.last().map_or(0.0, |tick| tick.haptic.force.n().abs());
    assert!(force_n > 0.05, "{force_n} N are no output to lose");
    watch
}

#[test]
fn p01_output_ends_when_frames_stop_at_a_spread_of_phases_on_the_board() {
    let (mut at, mut phase) = (START, 0);
    let (mut bench, mut watch) = pushing::<Qemu>(&mut at);
    for more in [0, 1, 7, 340] {
        for tick in feed(&mut bench, &mut at, more) {
            watch.check(&tick);
        }
        phase += more;
        let lost = bench.play(std::iter::repeat_n(vec![], TOLD));
        check(phase, watch, &lost);
        let token = lost.last().and_then(Tick::fault).expect("a fault").clear_token();
        let clear = Process::Command(Command::ClearFault { token });
        bench.play([vec![encoder(at), clear]]);
        watch = push(&mut bench, &mut at);
    }
}

/// What a broken drive sends instead of samples.
enum Broken {
    Nothing,
    /// The last frame over and over.
    Repeats(Frame),
    /// Frames with a wrong CRC.
    Corrupt(Frame),
    /// Protected samples from where no drive can be.
    OutOfRange(Vec<Frame>),
}

impl Broken {
    fn run(&self, mut ticker: ControlLoop, config: &Config<'_>) -> Vec<Tick> {
        let tick = |n: usize| {
            let frame = match self {
                Self::Nothing => None,
                Self::Repeats(frame) | Self::Corrupt(frame) => Some(frame),
                Self::OutOfRange(frames) => frames.get(n),
            };
            if let Some(frame) = frame {
                ticker.on_frame(frame);
            }
            Tick::decode(ticker.tick(Some(config), None))
        };
        (0..TOLD).map(tick).collect()
    }
}

#[test]
fn p01_output_ends_when_frames_stop_or_break_at_each_of_1000_phases() {
    let config = image::decode(strong_image()).expect("our own");
    let mut at = START;
    let (mut bench, mut watch) = pushing::<Sim>(&mut at);
    for phase in 0..1000 {
        at.insertion_m += FEED_M;
        let last = bench.encoder(at);
        let tick = bench.tick(&[last]);
        watch.check(&tick);
        assert_eq!(tick.mode(), Some(Mode::Armed));
        let kinds = [Broken::Nothing, broken(phase, last, &mut bench.clone_sealer(), at)];
        for kind in kinds {
            let lost = kind.run(bench.ticker().clone(), &config);
            check(phase, watch.clone(), &lost);
        }
    }
}

fn broken(phase: usize, last: Frame, sealer: &mut cathforce_bus::Sealer, at: Drive) -> Broken {
    match phase % 3 {
        0 => Broken::Repeats(last),
        1 => {
            let mut data = last.data().to_vec();
            data[phase % 8] ^= 1 << (phase / 8 % 8);
            Broken::Corrupt(Frame::new(last.id(), &data).expect("as long as before"))
        }
        _ => {
            let far = encoder(Drive { insertion_m: 1.5, ..at });
            Broken::OutOfRange((0..TOLD).map(|_| sealer.seal(far, Default::default())).collect())
        }
    }
}
