//! Bad input is refused whole and changes nothing: images over the bus (P16), bundles and
//! links at the command.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

use cathforce_bus::service::crc32;
use cathforce_bus::slcan::{self, Decoder, Line};
use cathforce_bus::{Command as BusCommand, Process};
use cathforce_control::Mode;
use cathforce_hil_tests::{Bench, Drive, EXAMPLE, Rig, encoder, program, small_image};
use cathforce_link::qemu::Qemu;
use cathforce_link::{ClientError, Link, Sim};
use cathforce_recording::Recording;

const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };

/// Invalid images, each with a part of the expected message.
fn wrong_images() -> Vec<(Vec<u8>, &'static str)> {
    let good = small_image();
    let with = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut image = good.to_vec();
        change(&mut image);
        image
    };
    // The CRC is corrected, so that only the meaning is wrong.
    let meant = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut image = with(change);
        let crc = crc32(&image[22..]);
        image[18..22].copy_from_slice(&crc.to_le_bytes());
        image
    };
    let middle = good.len() / 2;
    vec![
        (with(&|image| image.clear()), "shorter than its header"),
        (with(&|image| image.truncate(10)), "shorter than its header"),
        (with(&|image| image.truncate(middle)), "not as long as it says"),
        (with(&|image| image.push(0)), "not as long as it says"),
        (with(&|image| image[0] ^= 0x20), "CFIM"),
        (with(&|image| image[4] ^= 1), "format version"),
        (with(&|image| image[6] ^= 1), "another version of this firmware"),
        (with(&|image| image[middle] ^= 0x10), "check does not fit"),
        // The outer radius, the first number of the head, is NaN.
        (meant(&|image| image[22..26].copy_from_slice(&f32::NAN.to_le_bytes())), "outer_radius_m"),
        (meant(&|image| image[22..26].copy_from_slice(&(-1.0f32).to_le_bytes())), "outer_radius_m"),
    ]
}

/// The drive at rest for so many ticks, with a command in the first one.
fn steps(ticks: usize, command: BusCommand) -> Vec<Vec<Process>> {
    let mut steps = vec![vec![encoder(START)]; ticks];
    steps[0].push(Process::Command(command));
    steps
}

/// A device that refuses images behaves like one that never received them.
fn refuses_and_goes_on<R: Rig>() {
    let mut tried = Bench::<R>::armed(small_image(), START);
    let mut spared = Bench::<Sim>::armed(small_image(), START);
    let same = |tried: &mut Bench<R>, spared: &mut Bench<Sim>, at: Drive| {
        let frame = [tried.encoder(at), spared.encoder(at)];
        assert_eq!(tried.tick(&frame[..1]).frames, spared.tick(&frame[1..]).frames);
    };
    let error = tried.upload(small_image()).expect_err("armed");
    assert!(error.to_string().contains("disarm it first"), "{error}");
    same(&mut tried, &mut spared, START);
    let disarmed = steps(40, BusCommand::Disarm);
    assert_eq!(tried.play(disarmed.clone()), spared.play(disarmed));
    for (n, (image, why)) in wrong_images().into_iter().enumerate() {
        let before = tried.report();
        let error = tried.upload(&image).expect_err(why);
        assert!(matches!(error, ClientError::Refused { .. }), "{error}");
        assert!(error.to_string().contains(why), "`{why}` in: {error}");
        let after = tried.report();
        let seen = |r: &cathforce_bus::service::Status| (r.tick, r.digest, r.mode, r.fault);
        assert_eq!(seen(&after), seen(&before), "{why}");
        let insertion_m = START.insertion_m + 1e-5 * n as f64;
        same(&mut tried, &mut spared, Drive { insertion_m, ..START });
    }
    // The image in use is the old one, to the last bit, and can be armed.
    let armed = steps(200, BusCommand::Arm);
    let (ours, theirs) = (tried.play(armed.clone()), spared.play(armed));
    assert_eq!(ours, theirs);
    assert_eq!(ours[199].mode(), Some(Mode::Armed));
}

#[test]
fn p16_p17_a_wrong_image_is_refused_and_the_old_one_stays_on_the_board() {
    refuses_and_goes_on::<Qemu>();
}

#[test]
fn p16_p17_a_wrong_image_is_refused_and_the_old_one_stays_in_process() {
    refuses_and_goes_on::<Sim>();
}

fn cathforce(arguments: &[&str]) -> Output {
    let mut command = Command::new(program());
    command.env("NO_COLOR", "1").args(arguments).output().expect("the program starts")
}

#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
}

/// The example with one file changed.
fn broken_bundle(folder: &Path, file: &str, change: impl FnOnce(Vec<u8>) -> Vec<u8>) {
    fs::create_dir_all(folder.join("trials")).expect("a folder");
    for name in ["rig.toml", "vessel.stl", "centreline.csv", "trials/000.csv"] {
        let bytes = fs::read(Path::new(EXAMPLE).join(name)).expect("the example");
        fs::write(folder.join(name), bytes).expect("written");
    }
    let bytes = fs::read(folder.join(file)).expect("copied");
    fs::write(folder.join(file), change(bytes)).expect("written");
}

#[test]
fn a_malformed_bundle_is_exit_code_3_before_the_device_is_touched() {
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    type Change = Box<dyn Fn(Vec<u8>) -> Vec<u8>>;
    let cases: Vec<(&str, Change, &[&str])> = vec![
        (
            "vessel.stl",
            Box::new(|mut stl| {
                stl.truncate(stl.len() - 30);
                stl
            }),
            &["vessel.stl", "byte", "fix:"],
        ),
        (
            "rig.toml",
            Box::new(move |toml| text(toml).replace("= 1.65e-3", "= -1").into_bytes()),
            &["rig.toml:6", "outer_diameter_m", "fix:"],
        ),
        (
            "trials/000.csv",
            Box::new(move |csv| text(csv).replacen("0.028000", "far", 1).into_bytes()),
            &["000.csv:2", "insertion_m", "fix:"],
        ),
    ];
    for (file, change, words) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        broken_bundle(folder.path(), file, change);
        let bundle = folder.path().to_str().expect("text");
        let out = folder.path().join("run.mcap");
        // There is no such board: a command that opens the link before it reads the bundle would end with 4.
        let link = "qemu:/no/such.elf";
        let output =
            cathforce(&["run", "--link", link, bundle, "--out", out.to_str().expect("text")]);
        assert_fails(&output, 3, words);
        assert!(!out.exists(), "nothing half done");
    }
}

#[test]
fn a_link_that_cannot_be_opened_is_exit_code_4_with_what_to_do() {
    let output = cathforce(&["run", "--link", "qemu:/no/such.elf", EXAMPLE]);
    assert_fails(&output, 4, &["/no/such.elf", "cargo xtask firmware"]);
    let output = cathforce(&["info", "--link", "slcan:/dev/ttyNOPE7"]);
    assert_fails(&output, 4, &["/dev/ttyNOPE7", "Check"]);
}

/// A device behind an SLCAN server that hangs up, or falls silent, after so many frames.
fn dying_device(frames: usize, hangs_up: bool) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("slcan:tcp:{}", listener.local_addr().expect("bound"));
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a client");
        stream.set_read_timeout(Some(Duration::from_millis(20))).expect("a time-out");
        let (mut sim, mut decoder, mut buffer) = (Sim::new(), Decoder::default(), [0; 4096]);
        let mut left = frames;
        loop {
            let read = match stream.read(&mut buffer) {
                Ok(0) => return,
                Ok(n) => n,
                Err(_) => 0,
            };
            for line in buffer[..read].iter().filter_map(|&byte| decoder.push(byte)) {
                if let Line::Frame(frame) = line {
                    left = left.saturating_sub(1);
                    if left > 0 {
                        sim.send(&frame).expect("in process");
                    } else if hangs_up {
                        return;
                    }
                }
            }
            while let Some(frame) = sim.receive(Duration::ZERO).expect("in process") {
                if stream.write_all(&slcan::encode(&frame)).is_err() {
                    return;
                }
            }
        }
    });
    address
}

/// Frames after which the example is being played: its image takes 70 000.
const WHILE_PLAYING: usize = 75_000;

#[test]
fn a_link_that_is_lost_while_playing_is_exit_code_4_and_the_recording_is_readable() {
    for (hangs_up, word) in [(true, "lost"), (false, "nothing heard")] {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("run.mcap");
        let link = dying_device(WHILE_PLAYING, hangs_up);
        let arguments = ["run", "--link", &link, EXAMPLE, "--out", out.to_str().expect("text")];
        assert_fails(&cathforce(&arguments), 4, &[&link, word, "Check"]);
        let recording = Recording::open(&out).expect("finished");
        assert!(recording.frames.len() > 1000, "{}", recording.frames.len());
        assert_eq!(recording.result, None);
    }
}
