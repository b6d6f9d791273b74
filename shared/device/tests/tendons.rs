//! Frames of tendons that drives pull: what they do, what is refused, and the load on the bus.

mod support;

use cathforce_bus::{
    Command, Counter, Displacement, Encoder, Frame, Insertion, Process, Rotation, Sealer, Status,
    Tendons,
};
use cathforce_config::image;
use cathforce_control::{Config, Fault, Mode};
use cathforce_device::ControlLoop;

const START_M: f64 = 0.03;
/// Ticks after which every rotating frame has been sent.
const ROUND: u32 = 15;
const BITS_A_TICK: f64 = 1e6 * 1e-3;

/// A control loop, and the host at the other end of its bus.
struct Bench<'a> {
    config: &'a Config<'a>,
    control_loop: ControlLoop,
    sealer: Sealer,
    tendons_m: [f64; 4],
    /// Frames of tendons are sent.
    speaks: bool,
    /// Bits of all frames, both ways, each as long as it can be.
    bits: u32,
}

impl<'a> Bench<'a> {
    fn armed(config: &'a Config<'a>) -> Self {
        let mut bench = Self {
            config,
            control_loop: ControlLoop::new(),
            sealer: Sealer::default(),
            tendons_m: [0.0; 4],
            speaks: true,
            bits: 0,
        };
        bench.tick(Some(Command::SelfTest));
        while bench.mode() != Mode::Ready {
            bench.tick(None);
        }
        bench.tick(Some(Command::Arm));
        assert_eq!(bench.mode(), Mode::Armed);
        while !bench.control_loop.ticks().is_multiple_of(ROUND) {
            bench.tick(None);
        }
        bench
    }

    fn mode(&self) -> Mode {
        self.control_loop.outputs().unwrap().mode
    }

    fn send(&mut self, process: Process) {
        let frame = self.sealer.seal(process, Status::default());
        self.bits += frame.most_bits();
        self.control_loop.on_frame(&frame);
    }

    fn tick(&mut self, command: Option<Command>) -> Vec<Frame> {
        self.send(Process::Encoder(Encoder {
            insertion: Insertion::from_m(START_M),
            rotation: Rotation::from_rad(0.0),
        }));
        let tendons = self.config.model.description().tendons.len();
        let pairs = if self.speaks { tendons.div_ceil(2) } else { 0 };
        for pair in 0..pairs {
            let displacements =
                [self.tendons_m[2 * pair], self.tendons_m[2 * pair + 1]].map(Displacement::from_m);
            self.send(Process::Tendons(Tendons { pair: pair as u8, displacements }));
        }
        if let Some(command) = command {
            self.send(Process::Command(command));
        }
        let sent: Vec<Frame> =
            self.control_loop.tick(Some(self.config), None).into_iter().flatten().collect();
        self.bits += sent.iter().map(Frame::most_bits).sum::<u32>();
        sent
    }

    fn tip(&self) -> [f32; 3] {
        self.control_loop.state().mechanics().node_position_m(0).unwrap()
    }
}

#[test]
fn a_tendon_that_is_pulled_bends_the_tip_and_is_told_by_its_place() {
    let image = support::image_with_tendons(4);
    let config = image::decode(&image).unwrap();
    // Up is z, and direction × up is −y: the tendons lie at z, −y, −z, y.
    for (tendon, sign, axis) in [(0, 1.0, 2), (1, -1.0, 1), (2, -1.0, 2), (3, 1.0, 1)] {
        let mut bench = Bench::armed(&config);
        let before = bench.tip();
        for _ in 0..400 {
            bench.tendons_m[tendon] += 5e-6;
            bench.tick(None);
        }
        assert_eq!(bench.mode(), Mode::Armed);
        let moved = sign * (bench.tip()[axis] - before[axis]);
        assert!(moved > 1e-3, "tendon {tendon}: {moved} m");
        let model = bench.control_loop.state().mechanics();
        let [at_drive, at_anchor] = model.tendon_tensions_n(tendon).unwrap();
        assert!(at_drive > at_anchor && at_anchor > 0.1, "{at_drive} {at_anchor}");
    }
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let image = support::image_with_tendons(3);
    let config = image::decode(&image).unwrap();
    let run = || {
        let mut bench = Bench::armed(&config);
        let mut sent = Vec::new();
        for tick in 0..300 {
            let at_m = 1e-3 * (0.02 * f64::from(tick)).sin();
            bench.tendons_m = [at_m, -at_m, 0.5 * at_m, 0.0];
            sent.extend(bench.tick(None));
        }
        (sent, bench.control_loop.outputs().unwrap().digest)
    };
    assert_eq!(run(), run());
}

#[test]
fn silent_tendons_ramp_the_output_down() {
    let image = support::image_with_tendons(2);
    let config = image::decode(&image).unwrap();
    let mut bench = Bench::armed(&config);
    bench.speaks = false;
    let timeout = config.settings.encoder_timeout_ticks;
    for _ in 1..timeout {
        bench.tick(None);
        assert_eq!(bench.mode(), Mode::Armed);
    }
    bench.tick(None);
    assert_eq!(bench.mode().fault(), Some(Fault::TendonLost));
}

#[test]
fn a_device_without_tendons_takes_no_notice_of_their_frames() {
    let image = support::image();
    let config = image::decode(&image).unwrap();
    let (mut plain, mut told) = (Bench::armed(&config), Bench::armed(&config));
    for _ in 0..20 {
        let displacements = [Displacement::from_m(1e-3); 2];
        told.send(Process::Tendons(Tendons { pair: 0, displacements }));
        assert_eq!(plain.tick(None), told.tick(None));
    }
    assert_eq!(told.control_loop.counters().get(Counter::Foreign), 0);
}

/// Encoders and everything that a device sends, every frame as long as stuffing can make it.
#[test]
fn the_bus_at_1_mbit_s_is_loaded_as_stated() {
    let load = |tendons: usize| {
        let image = support::image_with_tendons(tendons);
        let config = image::decode(&image).unwrap();
        let mut bench = Bench::armed(&config);
        bench.bits = 0;
        let ticks = 3 * ROUND;
        for _ in 0..ticks {
            bench.tick(None);
        }
        f64::from(bench.bits) / (f64::from(ticks) * BITS_A_TICK)
    };
    let [two, four] = [2, 4].map(load);
    println!("with two tendons {:.1} %, with four {:.1} %", 100.0 * two, 100.0 * four);
    assert!((two - 0.585).abs() < 1e-9, "{two}");
    assert!((four - 0.72).abs() < 1e-9, "{four}");
}
