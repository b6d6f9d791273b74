//! A lab's own frames instead of ENCODER and GUIDEWIRE.

mod support;

use cathforce_bus::master::{Collector, Drive, Master, Place, Signal};
use cathforce_bus::{
    Command, Counter, Encoder, Frame, Insertion, Process, Rotation, Sealer, Status,
};
use cathforce_config::image;
use cathforce_control::{Fault, HapticSource, LimitFlags, Mode};
use cathforce_device::{ControlLoop, TickFrames};

const ID: u32 = 0x2C1;
const TICKS: u32 = 400;

/// The catheter's drive with the codes of ENCODER, at other positions in other frames.
fn drive(rotation_id: u32) -> Drive {
    let little = |id, start_bit, signed, scale| Place {
        selector: None,
        id,
        signal: Signal {
            start_bit,
            bits: 24,
            big_endian: false,
            signed,
            float: false,
            scale,
            offset: 0.0,
        },
    };
    Drive {
        insertion: little(ID, 4, false, Insertion::UNIT_M),
        rotation: little(rotation_id, 36, true, Rotation::UNIT_RAD),
        held: None,
    }
}

fn of_catheter(drive: Drive) -> Master {
    Master { catheter: Some(drive), ..Master::default() }
}

/// Plays a feed with a rotation; `position` makes the frames of a position.
fn play(master: Master, position: impl Fn(&mut Sealer, Encoder) -> Vec<Frame>) -> Vec<TickFrames> {
    let bytes = support::image();
    let config = image::decode(&bytes).unwrap();
    let (mut control_loop, mut sealer) = (ControlLoop::new(), Sealer::default());
    control_loop.restart(master);
    let mut sent = Vec::new();
    for tick in 0..TICKS {
        let at = Encoder {
            insertion: Insertion::from_m(0.012 + 1e-5 * f64::from(tick)),
            rotation: Rotation::from_rad(-1e-3 * f64::from(tick)),
        };
        for frame in position(&mut sealer, at) {
            control_loop.on_frame(&frame);
        }
        for (when, command) in [(0, Command::SelfTest), (300, Command::Arm)] {
            if tick == when {
                control_loop.on_frame(&sealer.seal(Process::Command(command), Status::default()));
            }
        }
        sent.push(control_loop.tick(Some(&config), None));
    }
    assert_eq!(control_loop.counters().get(Counter::Foreign), 0);
    sent
}

#[test]
fn the_same_motion_in_a_labs_own_frames_gives_the_same_bits() {
    let ours = play(Master::default(), |sealer, at| {
        vec![sealer.seal(Process::Encoder(at), Status::default())]
    });
    assert_ne!(ours[0], ours[1], "the ticks differ among themselves");
    for rotation_id in [ID, ID + 1] {
        let drive = drive(rotation_id);
        let theirs = play(of_catheter(drive), |_, at| {
            // What else the frames have is none of our business.
            let (mut feed, mut turn) = ([0xA5; 8], [0x5A; 8]);
            drive.insertion.signal.write(at.insertion.m().into(), &mut feed);
            let shared = rotation_id == ID;
            let rotation = if shared { &mut feed } else { &mut turn };
            drive.rotation.signal.write(at.rotation.rad().into(), rotation);
            let frames = [(ID, feed), (rotation_id, turn)];
            let frames = frames.iter().take(if shared { 1 } else { 2 });
            frames.map(|(id, data)| Frame::new(*id, data).unwrap()).collect()
        });
        assert_eq!(ours, theirs);
    }
}

/// The oldest frame determines the age: if the rotation's frame stops, the drive is lost, however often the
/// feed's frame comes.
#[test]
fn p01_one_of_a_drives_frames_that_stops_coming_ramps_down() {
    let bytes = support::image();
    let config = image::decode(&bytes).unwrap();
    let (mut control_loop, mut sealer) = (ControlLoop::new(), Sealer::default());
    control_loop.restart(of_catheter(drive(ID + 1)));
    let mut ages = Vec::new();
    for tick in 0..TICKS + 8 {
        let mut feed = [0; 8];
        drive(ID).insertion.signal.write(0.012, &mut feed);
        control_loop.on_frame(&Frame::new(ID, &feed).unwrap());
        if tick < TICKS {
            control_loop.on_frame(&Frame::new(ID + 1, &[0; 8]).unwrap());
        }
        for (when, command) in [(0, Command::SelfTest), (300, Command::Arm)] {
            if tick == when {
                control_loop.on_frame(&sealer.seal(Process::Command(command), Status::default()));
            }
        }
        control_loop.tick(Some(&config), None);
        let outputs = control_loop.outputs().unwrap();
        assert!(tick != TICKS - 1 || outputs.mode == Mode::Armed);
        if tick >= TICKS {
            ages.push(outputs.encoder_age_ticks);
        }
    }
    assert_eq!(ages[..4], [1, 2, 3, 4]);
    assert_eq!(control_loop.outputs().unwrap().fault, Some(Fault::EncoderLost));
}

/// The load on the drive whose button is held is rendered, and nothing while that is ambiguous.
#[test]
fn buttons_and_grip_say_what_is_felt() {
    let place = |id, start_bit, bits| Place {
        selector: None,
        id,
        signal: Signal {
            start_bit,
            bits,
            big_endian: false,
            float: false,
            signed: false,
            scale: 1e-4,
            offset: 0.0,
        },
    };
    let button = |start_bit| {
        let Place { id, signal, .. } = place(ID + 2, start_bit, 1);
        Some(Place { id, signal: Signal { scale: 1.0, ..signal }, selector: None })
    };
    let drive = |id, start_bit, button| Drive {
        insertion: place(id, start_bit, 16),
        rotation: place(id, start_bit + 16, 16),
        held: button,
    };
    let (catheter, guidewire) = (drive(ID, 0, button(0)), drive(ID, 32, button(1)));
    let master = Master { catheter: Some(catheter), guidewire: Some(guidewire), grip: button(7) };
    assert_eq!((master.validate(), master.frames()), (Ok(()), 2));

    let bytes = support::image_with_guidewire();
    let config = image::decode(&bytes).unwrap();
    let (mut control_loop, mut sealer) = (ControlLoop::new(), Sealer::default());
    control_loop.restart(master);
    let mut tick = |hand: u8, command: Option<Command>| {
        let mut at = [0; 8];
        for place in [catheter.insertion, guidewire.insertion] {
            place.signal.write(0.02, &mut at);
        }
        control_loop.on_frame(&Frame::new(ID, &at).unwrap());
        control_loop.on_frame(&Frame::new(ID + 2, &[hand]).unwrap());
        if let Some(command) = command {
            control_loop.on_frame(&sealer.seal(Process::Command(command), Status::default()));
        }
        control_loop.tick(Some(&config), None);
        *control_loop.outputs().unwrap()
    };
    const GRIP: u8 = 0x80;
    tick(GRIP | 1, Some(Command::SelfTest));
    while tick(GRIP | 1, None).mode != Mode::Ready {}
    assert_eq!(tick(GRIP | 1, Some(Command::Arm)).mode, Mode::Armed);
    for (hand, felt, released) in [
        (GRIP | 1, HapticSource::Catheter, false),
        (GRIP | 2, HapticSource::Guidewire, false),
        (GRIP | 3, HapticSource::Guidewire, true),
        (GRIP, HapticSource::Catheter, true),
        (1, HapticSource::Catheter, true),
        (GRIP | 1, HapticSource::Catheter, false),
    ] {
        let outputs = tick(hand, None);
        assert_eq!((outputs.mode, outputs.haptic_source), (Mode::Armed, felt), "{hand:#x}");
        assert_eq!(outputs.limited.contains(LimitFlags::RELEASED), released, "{hand:#x}");
    }
}

/// The ENCODER frame also tells whether the handle is held.
#[test]
fn an_encoder_frame_says_that_the_handle_is_let_go() {
    let bytes = support::image();
    let config = image::decode(&bytes).unwrap();
    let (mut control_loop, mut sealer) = (ControlLoop::new(), Sealer::default());
    let mut tick = |hand, command: Option<Command>| {
        let at = Encoder { insertion: Insertion::from_m(0.02), rotation: Rotation::from_rad(0.0) };
        let status = Status { hand, ..Status::default() };
        control_loop.on_frame(&sealer.seal(Process::Encoder(at), status));
        if let Some(command) = command {
            control_loop.on_frame(&sealer.seal(Process::Command(command), Status::default()));
        }
        control_loop.tick(Some(&config), None);
        *control_loop.outputs().unwrap()
    };
    tick(false, Some(Command::SelfTest));
    while tick(false, None).mode != Mode::Ready {}
    tick(false, Some(Command::Arm));
    for released in [true, false] {
        assert_eq!(tick(released, None).limited.contains(LimitFlags::RELEASED), released);
    }
}

#[test]
fn our_own_frame_is_foreign_where_the_master_has_another_and_a_short_one_is_rejected() {
    let mut control_loop = ControlLoop::new();
    control_loop.restart(of_catheter(drive(ID)));
    let at = Encoder { insertion: Insertion::from_m(0.01), rotation: Rotation::from_rad(0.0) };
    control_loop.on_frame(&Sealer::default().seal(Process::Encoder(at), Status::default()));
    control_loop.on_frame(&Frame::new(ID, &[0; 7]).unwrap());
    control_loop.on_frame(&Frame::new(ID, &[0; 8]).unwrap());
    for counter in [Counter::Foreign, Counter::WrongLength, Counter::Accepted] {
        assert_eq!(control_loop.counters().get(counter), 1, "{counter:?}");
    }
}

/// Two feeds, two rotations and a button in one frame of 8 bytes.
#[test]
fn both_drives_may_share_a_frame() {
    let place = |start_bit, bits, signed| Place {
        selector: None,
        id: ID,
        signal: Signal {
            start_bit,
            bits,
            big_endian: true,
            signed,
            float: false,
            scale: 1e-4,
            offset: 0.0,
        },
    };
    let button = place(56, 1, false).signal;
    let catheter =
        Drive { insertion: place(7, 16, false), rotation: place(23, 16, true), held: None };
    let guidewire = Drive {
        insertion: place(39, 16, false),
        rotation: place(55, 15, true),
        held: Some(Place { id: ID, signal: Signal { scale: 1.0, ..button }, selector: None }),
    };
    let master = Master { catheter: Some(catheter), guidewire: Some(guidewire), grip: None };
    assert_eq!((master.validate(), master.frames()), (Ok(()), 1));
    let mut data = [0; 8];
    let values = [(catheter.insertion, 0.5), (catheter.rotation, -1.0)].into_iter();
    let values = values.chain([(guidewire.insertion, 0.25), (guidewire.rotation, 0.75)]);
    for (place, value) in values.chain(guidewire.held.map(|held| (held, 1.0))) {
        place.signal.write(value, &mut data);
    }
    let mut collector = Collector::new(master);
    collector.take(&Frame::new(ID, &data).unwrap());
    let (catheter, guidewire) = (collector.catheter().unwrap(), collector.guidewire().unwrap());
    assert_eq!((catheter.insertion_m, catheter.rotation_rad, catheter.held), (0.5, -1.0, None));
    assert_eq!((guidewire.insertion_m, guidewire.rotation_rad), (0.25, 0.75));
    assert_eq!((guidewire.held, guidewire.gripped), (Some(true), true));
}
