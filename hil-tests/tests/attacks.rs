//! What an attacker on the bus can do, and what limits it (docs/explanation/attacks.md).

use std::time::Duration;

use cathforce_bus::service::{
    self, BLOCK_SIZE, DeviceEndpoint, Hello, HostEndpoint, PROTOCOL_HASH, Refusal, Request,
    Response, Status, crc32,
};
use cathforce_bus::{Command, Counters, Frame, Id, MODE_UNCONFIGURED, Process};
use cathforce_config::{Settings, image};
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::{
    Bench, Chance, Drive, LimitWatch, encoder, image_with, small_image, strong_image,
};
use cathforce_link::{Client, ClientError, Link, LinkError, Sim};

const START: Drive = Drive { insertion_m: 0.03, rotation_rad: 0.0 };

/// An image whose gains are as large as they may be. It is valid, and so it is taken while the device is
/// disarmed; but the device starts over, silent, and what it outputs after arming stays within the limits
/// that are compiled in.
#[test]
fn a_malicious_image_starts_the_device_over_and_exceeds_no_limit() {
    let settings = Settings {
        force_gain: 20.0,
        torque_gain: 20.0,
        force_limit_n: 10.0,
        torque_limit_n_m: 0.1,
        force_slew_n_per_s: 1000.0,
        torque_slew_n_m_per_s: 10.0,
        ..Settings::default()
    };
    let options = cathforce_bundle::ImageOptions { cell_m: 2e-3, settings, ..Default::default() };
    let malicious = image_with(&options);
    let mut bench = Bench::<Sim>::armed(small_image(), START);
    let error = bench.upload(&malicious).expect_err("armed");
    assert!(error.to_string().contains("disarm it first"), "{error}");
    while matches!(bench.tick(&[]).mode(), Some(Mode::Armed | Mode::Ramp { .. })) {}
    bench.upload(&malicious).expect("it is valid, and output is off");
    let first = bench.tick(&[]);
    assert!(first.is_silent() && first.mode() == Some(Mode::Boot), "{first:?}");
    // The host sees another image than its own.
    assert_ne!(bench.report().image_crc32, crc32(small_image()));
    let mut watch = LimitWatch::new(&image::decode(&malicious).expect("valid").settings);
    bench.arm(START).iter().for_each(|tick| watch.check(tick));
    let mut at = START;
    for step in 0..800 {
        at.insertion_m += if step % 400 < 200 { 90e-6 } else { -90e-6 };
        let frame = bench.encoder(at);
        watch.check(&bench.tick(&[frame]));
    }
}

/// Frames of the service, broken ones and uploads that never end, twenty in each tick: the output has the
/// same bits as without them.
#[test]
fn a_flood_of_service_frames_changes_no_bit_of_the_output() {
    let mut flooded = Bench::<Sim>::armed(strong_image(), START);
    let mut spared = Bench::<Sim>::armed(strong_image(), START);
    let mut chance = Chance::new(7);
    let mut uploader = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
    let mut at = START;
    for n in 0..500_u32 {
        at.insertion_m += if n % 200 < 100 { 50e-6 } else { -50e-6 };
        let mut frames = Vec::new();
        for _ in 0..20 {
            let own = uploader.next_frame(0);
            let noise = || Frame::new(Id::ServiceRequest.raw(), &chance.bytes(8)).expect("8 bytes");
            frames.push(own.unwrap_or_else(noise));
        }
        if !uploader.is_sending() {
            let begin = Request::BeginImage { len: 1000 + n, crc32: n };
            let message = service::seal::<_, 64>(n as u8, &begin).expect("it fits");
            uploader.send(&message).expect("it fits");
        }
        frames.push(flooded.encoder(at));
        let sample = spared.encoder(at);
        let (with, without) = (flooded.tick(&frames), spared.tick(&[sample]));
        assert_eq!(with.haptic, without.haptic, "tick {n}");
        assert_eq!(with.contact, without.contact, "tick {n}");
    }
    assert_eq!(flooded.report().digest, spared.report().digest);
}

/// Another sender of ENCODER frames with a counter of its own: both are heard, one of them is always
/// out of turn, and the output ramps to zero.
#[test]
fn a_second_sender_of_encoder_frames_ends_in_a_ramp() {
    let mut bench = Bench::<Sim>::configured(strong_image());
    let mut watch = LimitWatch::new(&image::decode(strong_image()).expect("our own").settings);
    bench.arm(START).iter().for_each(|tick| watch.check(tick));
    let mut thief = bench.clone_sealer();
    // It has fallen behind by some frames, as anyone does who does not hear the counter in time.
    for _ in 0..6 {
        let frame = bench.encoder(START);
        watch.check(&bench.tick(&[frame]));
    }
    let mut ramped = None;
    for n in 0..40 {
        let elsewhere = Drive { insertion_m: START.insertion_m + 1e-4, ..START };
        let stolen = thief.seal(encoder(elsewhere), cathforce_bus::Status::default());
        let own = bench.encoder(START);
        let tick = bench.tick(&[own, stolen]);
        watch.check(&tick);
        if tick.fault() == Some(Fault::BadFrames) && ramped.is_none() {
            ramped = Some(n);
        }
    }
    assert!(ramped.is_some_and(|n| n <= 10), "ramped after {ramped:?} ticks");
    let last = bench.tick(&[]);
    assert!(last.is_silent(), "{last:?}");
}

/// One sender that takes the encoder's place altogether, with the right counter, and says that the drive
/// is somewhere else: the jump is not believed, and the third one ramps.
#[test]
fn an_encoder_that_is_replaced_may_not_jump() {
    let mut bench = Bench::<Sim>::armed(strong_image(), START);
    let elsewhere = Drive { insertion_m: START.insertion_m + 0.05, ..START };
    let ticks = bench.play((0..10).map(|_| vec![encoder(elsewhere)]));
    let fault = ticks.iter().find_map(|tick| tick.fault());
    assert_eq!(fault, Some(Fault::EncoderJump), "{:?}", ticks.last());
}

/// A device whose upload somebody else begins anew after each part.
struct Disturbed {
    endpoint: DeviceEndpoint,
    chunks: u32,
}

impl Link for Disturbed {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let Some(Id::ServiceRequest) = Id::from_raw(frame.id()) else { return Ok(()) };
        let request = self.endpoint.receive(frame, &mut Counters::default());
        let Some((sequence, request)) = request.and_then(|m| service::open(m).ok()) else {
            return Ok(());
        };
        let response = match request {
            Request::Hello => Response::Hello(Hello {
                protocol_hash: PROTOCOL_HASH,
                image_schema_hash: image::schema_hash(),
                firmware: "0.1.0",
                board: "disturbed",
                can_lock_step: true,
                max_image_len: 1 << 20,
                mode: MODE_UNCONFIGURED,
                next_counters: [0; 6],
            }),
            Request::GetStatus => Response::Status(Status::default()),
            Request::ImageChunk { .. } => {
                self.chunks += 1;
                Response::Refused(Refusal::Offset { expected: 0 })
            }
            _ => Response::Done,
        };
        let answer = service::seal::<_, { service::MAX_RESPONSE }>(sequence, &response);
        self.endpoint.send(&answer.expect("it fits")).expect("it fits");
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<Frame>, LinkError> {
        Ok(self.endpoint.next_frame(0))
    }

    fn name(&self) -> &str {
        "disturbed"
    }
}

/// The host does not begin for ever: it gives up, says what it suspects, and the device uses what it had.
#[test]
fn an_upload_that_is_always_begun_anew_is_given_up() {
    let endpoint = DeviceEndpoint::new(Id::ServiceResponse.raw(), BLOCK_SIZE);
    let mut client = Client::connect(Disturbed { endpoint, chunks: 0 }).expect("it answers");
    let error = client.upload_image(&[0; 5000], |_| std::ops::ControlFlow::Continue(()));
    let error = error.expect_err("nothing arrives");
    assert!(matches!(error, ClientError::Refused { .. }), "{error}");
    assert!(error.to_string().contains("does another program upload too"), "{error}");
    assert!(client.link().chunks <= 10, "{} parts", client.link().chunks);
}

/// On the device: an upload that another one has displaced leaves nothing behind, takes no more memory than
/// its one buffer, and neither is used without being whole.
#[test]
fn displaced_uploads_leave_the_image_in_use() {
    let mut bench = Bench::<Sim>::configured(small_image());
    let used = bench.report().image_crc32;
    let mut chance = Chance::new(3);
    for n in 0..50 {
        let mut other = small_image().to_vec();
        other.truncate(100 + chance.below(3000) as usize);
        let error = bench.upload(&other).expect_err("it is cut");
        assert!(matches!(error, ClientError::Refused { .. }), "{n}: {error}");
        assert_eq!(bench.report().image_crc32, used, "{n}");
    }
    bench.upload(small_image()).expect("the buffer is free");
}

/// A stranger may arm a device that could be armed, and disarm one that is armed: COMMAND is believed.
/// What it gets is an output within its limits, and only while the encoder is fresh.
#[test]
fn a_stranger_who_arms_gets_no_more_than_the_limits_and_only_with_an_encoder() {
    let mut bench = Bench::<Sim>::configured(strong_image());
    let mut watch = LimitWatch::new(&image::decode(strong_image()).expect("our own").settings);
    let commands = [Command::SelfTest, Command::Arm, Command::Arm];
    for command in commands {
        let tick = bench.play([vec![Process::Command(command)]]).remove(0);
        assert!(tick.is_silent() && tick.mode() != Some(Mode::Armed), "{tick:?}");
    }
    bench.arm(START).iter().for_each(|tick| watch.check(tick));
    // Without the encoder it is over, whatever is commanded.
    let silent: Vec<_> = (0..40).map(|_| vec![Process::Command(Command::Arm)]).collect();
    let ticks = bench.play(silent);
    ticks.iter().for_each(|tick| watch.check(tick));
    assert!(ticks[30..].iter().all(cathforce_hil_tests::Tick::is_silent), "{:?}", ticks.last());
}
