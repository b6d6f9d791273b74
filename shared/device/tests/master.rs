//! A lab's own frames in the place of ENCODER and GUIDEWIRE.

mod support;

use cathforce_bus::master::{DriveFrame, Master, Signal};
use cathforce_bus::{
    Command, Counter, Encoder, Frame, Insertion, Process, Rotation, Sealer, Status,
};
use cathforce_config::image;
use cathforce_device::{Sent, Ticker};

const ID: u16 = 0x2C1;
const TICKS: u32 = 400;

/// The catheter's drive as ENCODER has it, at another place of another frame: the same codes.
fn drive() -> DriveFrame {
    let little = |start_bit, signed, scale| Signal {
        start_bit,
        bits: 24,
        big_endian: false,
        signed,
        scale,
        offset: 0.0,
    };
    DriveFrame {
        id: ID,
        insertion: little(4, false, Insertion::UNIT_M),
        rotation: little(36, true, Rotation::UNIT_RAD),
        held: None,
    }
}

/// Plays a feed with a turn; how the position goes to the device is up to `position`.
fn play(master: Master, position: impl Fn(&mut Sealer, Encoder) -> Frame) -> Vec<Sent> {
    let bytes = support::image();
    let config = image::decode(&bytes).unwrap();
    let (mut ticker, mut sealer) = (Ticker::new(), Sealer::default());
    ticker.restart(master);
    let mut sent = Vec::new();
    for tick in 0..TICKS {
        let at = Encoder {
            insertion: Insertion::from_m(0.012 + 1e-5 * f64::from(tick)),
            rotation: Rotation::from_rad(-1e-3 * f64::from(tick)),
        };
        ticker.on_frame(&position(&mut sealer, at));
        for (when, command) in [(0, Command::SelfTest), (300, Command::Arm)] {
            if tick == when {
                ticker.on_frame(&sealer.seal(Process::Command(command), Status::default()));
            }
        }
        sent.push(ticker.tick(Some(&config), None));
    }
    assert_eq!(ticker.counters().get(Counter::Foreign), 0);
    sent
}

#[test]
fn the_same_motion_in_a_labs_own_frames_gives_the_same_bits() {
    let ours =
        play(Master::default(), |sealer, at| sealer.seal(Process::Encoder(at), Status::default()));
    let drive = drive();
    let theirs = play(Master { catheter: Some(drive), guidewire: None }, |_, at| {
        // What else the frame has is none of our business.
        let mut data = [0xA5; 8];
        drive.write(at.insertion.m().into(), at.rotation.rad().into(), false, &mut data);
        Frame::new(ID, &data).unwrap()
    });
    assert_eq!(ours, theirs);
    assert_ne!(ours[0], ours[1], "the ticks differ among themselves");
}

#[test]
fn our_own_frame_is_foreign_where_the_master_has_another_and_a_short_one_is_rejected() {
    let mut ticker = Ticker::new();
    ticker.restart(Master { catheter: Some(drive()), guidewire: None });
    let at = Encoder { insertion: Insertion::from_m(0.01), rotation: Rotation::from_rad(0.0) };
    ticker.on_frame(&Sealer::default().seal(Process::Encoder(at), Status::default()));
    ticker.on_frame(&Frame::new(ID, &[0; 7]).unwrap());
    ticker.on_frame(&Frame::new(ID, &[0; 8]).unwrap());
    for counter in [Counter::Foreign, Counter::WrongLength, Counter::Accepted] {
        assert_eq!(ticker.counters().get(counter), 1, "{counter:?}");
    }
}

/// Two feeds, two rotations and a button in one frame of 8 bytes.
#[test]
fn both_drives_may_share_a_frame() {
    let signal = |start_bit, bits, signed| Signal {
        start_bit,
        bits,
        big_endian: true,
        signed,
        scale: 1e-4,
        offset: 0.0,
    };
    let catheter = DriveFrame {
        id: ID,
        insertion: signal(7, 16, false),
        rotation: signal(23, 16, true),
        held: None,
    };
    let guidewire = DriveFrame {
        id: ID,
        insertion: signal(39, 16, false),
        rotation: signal(55, 15, true),
        held: Some(Signal { scale: 1.0, ..signal(56, 1, false) }),
    };
    let master = Master { catheter: Some(catheter), guidewire: Some(guidewire) };
    assert_eq!(master.validate(), Ok(()));
    let mut data = [0; 8];
    catheter.write(0.5, -1.0, false, &mut data);
    guidewire.write(0.25, 0.75, true, &mut data);
    let frame = Frame::new(ID, &data).unwrap();
    let catheter = catheter.read(&frame).unwrap().unwrap();
    let guidewire = guidewire.read(&frame).unwrap().unwrap();
    assert_eq!((catheter.insertion_m, catheter.rotation_rad, catheter.held), (0.5, -1.0, false));
    assert_eq!((guidewire.insertion_m, guidewire.rotation_rad, guidewire.held), (0.25, 0.75, true));
}
