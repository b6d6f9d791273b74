//! Frames of a guidewire: their contents, the haptic source, and the load on the bus.

mod support;

use cathforce_bus::{
    Accepted, Command, Encoder, Frame, Id, Insertion, Process, Protection, Rotation, Sealer, Status,
};
use cathforce_config::image;
use cathforce_control::{Config, HapticSource, Mode};
use cathforce_device::ControlLoop;

const START_M: f64 = 0.012;
/// Ticks after which every rotating frame has been sent.
const ROUND: u32 = 18;
const BITS_A_TICK: f64 = 1e6 * 1e-3;

/// A control loop, and the host at the other end of its bus.
struct Bench<'a> {
    config: &'a Config<'a>,
    control_loop: ControlLoop,
    sealer: Sealer,
    catheter_m: f64,
    /// `None` where there is none.
    wire_m: Option<f64>,
    held: bool,
    /// Bits of all frames, both ways, each as long as it can be.
    bits: u32,
}

impl<'a> Bench<'a> {
    fn armed(config: &'a Config<'a>) -> Self {
        let wire_m = config.model.description().guidewire.as_ref().map(|_| START_M);
        let (control_loop, sealer) = (ControlLoop::new(), Sealer::default());
        let mut bench = Self {
            config,
            control_loop,
            sealer,
            catheter_m: START_M,
            wire_m,
            held: false,
            bits: 0,
        };
        bench.tick(Some(Command::SelfTest));
        while bench.control_loop.outputs().unwrap().mode != Mode::Ready {
            bench.tick(None);
        }
        bench.tick(Some(Command::Arm));
        assert_eq!(bench.control_loop.outputs().unwrap().mode, Mode::Armed);
        while !bench.control_loop.ticks().is_multiple_of(ROUND) {
            bench.tick(None);
        }
        bench
    }

    fn send(&mut self, process: Process, status: Status) {
        let frame = self.sealer.seal(process, status);
        self.bits += frame.most_bits();
        self.control_loop.on_frame(&frame);
    }

    /// What the device sends in one tick.
    fn tick(&mut self, command: Option<Command>) -> Vec<Accepted> {
        let at = |insertion_m| Encoder {
            insertion: Insertion::from_m(insertion_m),
            rotation: Rotation::from_rad(0.1),
        };
        self.send(Process::Encoder(at(self.catheter_m)), Status::default());
        if let Some(wire_m) = self.wire_m {
            let status = Status { hand: self.held, ..Status::default() };
            self.send(Process::Guidewire(at(wire_m)), status);
        }
        if let Some(command) = command {
            self.send(Process::Command(command), Status::default());
        }
        let sent = self.control_loop.tick(Some(self.config), None);
        sent.into_iter()
            .flatten()
            .map(|frame| {
                self.bits += frame.most_bits();
                accept(&frame)
            })
            .collect()
    }
}

fn accept(frame: &Frame) -> Accepted {
    let id = Id::from_raw(frame.id()).unwrap();
    Protection::default().receive(id, frame, &mut Default::default()).unwrap()
}

#[test]
fn one_tick_in_three_has_a_third_frame_and_the_last_one_says_so() {
    let image = support::image_with_guidewire();
    let config = image::decode(&image).unwrap();
    let mut bench = Bench::armed(&config);
    let mut turns = Vec::new();
    for tick in 0..ROUND {
        let sent = bench.tick(None);
        assert_eq!(sent.len(), if tick % 3 == 0 { 3 } else { 2 }, "tick {tick}");
        assert_eq!([sent[0].process.id(), sent[1].process.id()], [Id::Haptic, Id::Contact]);
        turns.extend(sent.get(2).map(|third| third.process.id()));
        let last: Vec<bool> = sent.iter().map(|frame| frame.status.last).collect();
        assert_eq!(last, (1..=sent.len()).map(|k| k == sent.len()).collect::<Vec<_>>());
    }
    let [tick, drive, moment, Id::Shape(a), Id::Force(b), wire] = turns[..] else {
        panic!("{turns:?}")
    };
    assert_eq!(a, b);
    assert_eq!([tick, drive, moment, wire], [Id::Tick, Id::Drive, Id::Moment, Id::GuidewireDrive]);
}

#[test]
fn the_load_on_the_wire_s_drive_is_sent() {
    let image = support::image_with_guidewire();
    let config = image::decode(&image).unwrap();
    let mut bench = Bench::armed(&config);
    let alone_m = 0.02;
    for _ in 0..1000 {
        bench.wire_m = bench.wire_m.map(|at| at + alone_m / 1000.0);
        bench.tick(None);
    }
    let reached_m = f64::from(bench.control_loop.state().mechanics().insertion_m());
    assert!((reached_m - START_M - alone_m).abs() < 1e-6, "{reached_m} m");
    let sent = loop {
        let sent = bench.tick(None);
        if let Some(Process::GuidewireDrive(drive)) = sent.last().map(|frame| frame.process) {
            break drive;
        }
    };
    let contact = bench.control_loop.outputs().unwrap().contact;
    // The weight of what hangs from the mouth bends both: the whole is shared, not doubled.
    assert!((sent.force.n() - contact.guidewire_force_n).abs() <= 5.1e-5);
    assert!((sent.torque.n_m() - contact.guidewire_torque_n_m).abs() <= 2.6e-7);
    assert!(contact.guidewire_force_n != 0.0 && contact.drive_force_n != 0.0, "{contact:?}");
    assert_eq!((sent.encoder_age_ticks, sent.felt), (0, false));
}

#[test]
fn the_button_says_whose_load_is_felt() {
    let image = support::image_with_guidewire();
    let config = image::decode(&image).unwrap();
    let mut bench = Bench::armed(&config);
    for felt in [HapticSource::Guidewire, HapticSource::Catheter, HapticSource::Guidewire] {
        bench.held = felt == HapticSource::Guidewire;
        let mut said = Vec::new();
        for _ in 0..ROUND {
            for frame in bench.tick(None) {
                if let Process::GuidewireDrive(drive) = frame.process {
                    said.push(drive.felt);
                }
            }
        }
        assert_eq!(said, [bench.held]);
        let outputs = bench.control_loop.outputs().unwrap();
        let contact = &outputs.contact;
        let (force_n, torque_n_m) = match felt {
            HapticSource::Catheter => (contact.drive_force_n, contact.drive_torque_n_m),
            HapticSource::Guidewire => (contact.guidewire_force_n, contact.guidewire_torque_n_m),
        };
        assert_ne!(contact.drive_force_n, contact.guidewire_force_n);
        assert_eq!((outputs.haptic_source, outputs.force_n), (felt, force_n));
        assert_eq!(outputs.torque_n_m, torque_n_m);
    }
}

/// Encoders and everything that a device sends, every frame as long as stuffing can make it.
#[test]
fn the_bus_at_1_mbit_s_is_loaded_below_60_percent() {
    let load = |image: &[u8]| {
        let config = image::decode(image).unwrap();
        let mut bench = Bench::armed(&config);
        bench.bits = 0;
        let ticks = 5 * ROUND;
        for _ in 0..ticks {
            bench.tick(None);
        }
        f64::from(bench.bits) / (f64::from(ticks) * BITS_A_TICK)
    };
    let (alone, with_wire) = (load(&support::image()), load(&support::image_with_guidewire()));
    println!("{:.1} %, with a guidewire {:.1} %", 100.0 * alone, 100.0 * with_wire);
    assert!((alone - 0.54).abs() < 1e-9, "{alone}");
    assert!((with_wire - 0.585).abs() < 1e-9 && with_wire < 0.6, "{with_wire}");
}
