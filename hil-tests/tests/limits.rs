//! P02 and P05 on the wire: for any well-formed, protected frames the output stays within its limits and its
//! slew, and every number that leaves the device is finite.

use cathforce_bus::{Command, Process};
use cathforce_config::{Settings, image};
use cathforce_control::Mode;
use cathforce_device::ControlLoop;
use cathforce_hil_tests::{Bench, Chance, Drive, LimitWatch, Rig, Tick, encoder, strong_image};
use cathforce_link::Sim;
use cathforce_link::qemu::Qemu;

const START: Drive = Drive { insertion_m: 0.03, rotation_rad: 0.0 };

/// First seed whose adversary reaches every limit; with seed 0 the tip is not turned far enough while it is
/// caught.
const PRESSING: u64 = 1;

/// How the adversary moves the drive for a while.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Rest,
    /// As fast as a drive may move, in and out or in both directions of rotation.
    Feed(f64),
    Turn(f64),
    Both(f64, f64),
    /// A reversal in every tick.
    Chatter,
    /// Occasionally one sample at a random position.
    Jumps,
    /// Occasional gaps that are shorter than the time-out.
    Gaps,
    /// A gap that is longer than the time-out.
    Silence,
}

/// A sender that knows the protocol and tries to break the limits.
struct Adversary {
    chance: Chance,
    settings: Settings,
    at: Drive,
    motion: Motion,
    left: u64,
}

impl Adversary {
    fn new(seed: u64, settings: Settings) -> Self {
        Self { chance: Chance::new(seed), settings, at: START, motion: Motion::Rest, left: 0 }
    }

    /// The frames for the next tick; arms the device whenever possible.
    fn next(&mut self, last: &Tick) -> Vec<Process> {
        let mut sent = Vec::new();
        sent.extend(self.sample().map(encoder));
        let useful = match last.mode() {
            Some(Mode::Boot) => Some(Command::SelfTest),
            Some(Mode::Ready) => Some(Command::Arm),
            Some(Mode::Fault { cause }) => Some(Command::ClearFault { token: cause.clear_token() }),
            Some(Mode::Armed) => self.chance.once_in(700).then_some(Command::Disarm),
            _ => None,
        };
        sent.extend(useful.map(Process::Command));
        sent
    }

    fn sample(&mut self) -> Option<Drive> {
        if self.left == 0 {
            self.left = 1 + self.chance.below(120);
            let way = self.chance.pick(&[-1.0, 1.0]);
            self.motion = match self.chance.below(30) {
                0..3 => Motion::Rest,
                3..12 => Motion::Feed(way),
                12..16 => Motion::Turn(way),
                16..20 => Motion::Both(way, self.chance.pick(&[-1.0, 1.0])),
                20..23 => Motion::Chatter,
                23..26 => Motion::Jumps,
                26..29 => Motion::Gaps,
                _ => Motion::Silence,
            };
        }
        self.left -= 1;
        let (feed, turn) = match self.motion {
            Motion::Feed(feed) => (feed, 0.0),
            Motion::Turn(turn) => (0.0, turn),
            Motion::Both(feed, turn) => (feed, turn),
            Motion::Chatter if self.left.is_multiple_of(2) => (1.0, 1.0),
            Motion::Chatter => (-1.0, -1.0),
            _ => (0.0, 0.0),
        };
        // A little less than a drive may move, so that rounding does not make it a jump.
        let s = &self.settings;
        let feed_m = 0.99e-3 * f64::from(s.max_insertion_speed_m_per_s) * feed;
        let turn_rad = 0.99e-3 * f64::from(s.max_rotation_speed_rad_per_s) * turn;
        let at = &mut self.at;
        at.insertion_m = (at.insertion_m + feed_m).clamp(0.0, f64::from(s.max_insertion_m) - 1e-6);
        at.rotation_rad = (at.rotation_rad + turn_rad).clamp(-79.9, 79.9);
        let chance = &mut self.chance;
        match self.motion {
            Motion::Jumps if chance.once_in(12) => Some(Drive {
                insertion_m: chance.between(0.0, 1.7),
                rotation_rad: chance.between(-84.0, 84.0),
            }),
            Motion::Gaps if self.left % 6 < 4 => None,
            Motion::Silence => None,
            _ => Some(self.at),
        }
    }
}

/// Plays an adversary against a rig; `look` sees the rig after every tick.
fn attack<R: Rig>(seed: u64, ticks: usize, look: impl Fn(&Bench<R>)) -> (Vec<Tick>, LimitWatch) {
    let settings = image::decode(strong_image()).expect("our own").settings;
    let mut adversary = Adversary::new(seed, settings);
    let mut watch = LimitWatch::new(&settings);
    let mut bench = Bench::<R>::configured(strong_image());
    let mut seen = bench.play([vec![]]);
    for _ in 0..ticks {
        let frames = adversary.next(&seen[seen.len() - 1]).into_iter();
        let frames: Vec<_> = frames.map(|process| bench.seal(process)).collect();
        let tick = bench.tick(&frames);
        watch.check(&tick);
        look(&bench);
        seen.push(tick);
    }
    (seen, watch)
}

/// Fails unless the attack has reached the limits.
fn assert_pressed(seen: &[Tick], watch: &LimitWatch) {
    let armed = seen.iter().filter(|tick| tick.mode() == Some(Mode::Armed)).count();
    assert!(armed * 10 > seen.len(), "armed in {armed} of {} ticks", seen.len());
    let shares = watch.shares();
    assert!(shares.iter().all(|&share| share > 0.95), "of the limits: {shares:?}");
}

fn assert_finite(ticker: &ControlLoop) {
    let outputs = ticker.outputs().expect("configured");
    let contact = &outputs.contact;
    let model = ticker.state().mechanics();
    let numbers = [
        outputs.force_n,
        outputs.torque_n_m,
        contact.drive_force_n,
        contact.drive_torque_n_m,
        contact.peak_contact_force_n,
    ];
    let vectors = [contact.force_on_vessel_n, contact.moment_on_vessel_n_m].into_iter();
    let nodes = (0..model.nodes())
        .flat_map(|node| [model.node_position_m(node), model.node_force_n(node)])
        .flatten();
    let all = numbers.into_iter().chain(vectors.chain(nodes).flatten());
    assert!(all.into_iter().all(f32::is_finite), "{outputs:?}");
}

#[test]
fn p02_p05_no_protected_frames_exceed_limit_or_slew_or_finite_numbers() {
    for seed in PRESSING..PRESSING + 6 {
        let (seen, watch) = attack::<Sim>(seed, 5000, |bench| assert_finite(bench.ticker()));
        assert_pressed(&seen, &watch);
    }
}

/// The board agrees with the host to the last bit, also under attack (P22).
#[test]
fn p02_p22_the_board_under_attack_keeps_its_limits_and_its_bits() {
    let (on_board, watch) = attack::<Qemu>(PRESSING, 4000, |_| ());
    assert_pressed(&on_board, &watch);
    let (in_process, _) = attack::<Sim>(PRESSING, 4000, |_| ());
    for (tick, (board, host)) in on_board.iter().zip(&in_process).enumerate() {
        assert_eq!(board.frames, host.frames, "tick {tick}");
    }
    assert_eq!(on_board.len(), in_process.len());
}
