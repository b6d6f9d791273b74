//! A recording with something of everything.

use std::path::{Path, PathBuf};

use cathforce_bus::{
    Contact, Encoder, Force, Frame, Haptic, HapticForce, HapticTorque, Insertion, Process,
    Rotation, Sealer, Status,
};
use cathforce_recording::{
    Attachments, BusFrame, Direction, Measured, MeasuredDrive, Recorder, RunInfo, RunResult,
    SensorNoise,
};

pub const TICKS: u64 = 40;

pub fn info() -> RunInfo {
    RunInfo {
        host_version: "0.1.0".into(),
        link: "sim".into(),
        board: "host".into(),
        lock_step: true,
        rig: "tapered".into(),
        trial: "000".into(),
        noise: SensorNoise { force_n: Some(0.01), drive_force_n: Some(0.02), tip_m: None },
        tick_s: 1e-3,
        ..RunInfo::default()
    }
}

pub fn result() -> RunResult {
    RunResult { ticks: TICKS as u32, digest: 0xFEED, ..RunResult::default() }
}

pub fn attachments() -> Attachments<'static> {
    Attachments {
        image: b"CFIM\x01image",
        rig_toml: "format = 1\n",
        dbc: "VERSION \"\"",
        vessel: &[("centreline.csv", b"branch,s_m\n")],
    }
}

pub fn frames() -> Vec<BusFrame> {
    let (mut host, mut device) = (Sealer::default(), Sealer::default());
    let mut frames = Vec::new();
    for tick in 0..TICKS {
        let mut push = |direction, frame: Frame| {
            frames.push(BusFrame { at_ns: tick * 1_000_000, direction, frame });
        };
        let encoder = Process::Encoder(Encoder {
            insertion: Insertion::from_m(0.03 + 1e-5 * tick as f64),
            rotation: Rotation::from_rad(0.0),
        });
        push(Direction::ToDevice, host.seal(encoder, Status::default()));
        let haptic = Haptic { force: HapticForce(1), torque: HapticTorque(2), mode: 4, fault: 0 };
        push(Direction::ToHost, device.seal(Process::Haptic(haptic), Status::default()));
        let contact = Process::Contact(Contact { force: [Force(tick as i16); 3] });
        push(Direction::ToHost, device.seal(contact, Status::default()));
    }
    frames
}

pub fn rows() -> Vec<Measured> {
    (0..10)
        .map(|i| Measured {
            t_s: 0.004 * f64::from(i),
            insertion_m: 0.03 + 4e-5 * f64::from(i),
            rotation_rad: 0.0,
            force_n: Some([0.1, -0.2, 0.3]),
            drive_force_n: None,
            tip_m: (i == 0).then_some([0.03, 0.0, 0.0]),
            guidewire: (i > 4).then_some(MeasuredDrive {
                insertion_m: 0.05,
                rotation_rad: -0.1,
                drive_force_n: (i > 6).then_some(0.2),
            }),
            tendons_m: [Some(1e-3), Some(-2e-4 * f64::from(i)), None, None],
        })
        .collect()
}

pub const SHAPE_M: [[f64; 3]; 2] = [[0.03, 0.0, 1e-3], [0.0, 0.0, 0.0]];

/// A finished recording; the trial begins at 3 ms of bus time.
pub fn record(folder: &Path) -> PathBuf {
    let path = folder.join("run.mcap");
    let mut recorder = Recorder::create(&path, &info(), attachments()).unwrap();
    for frame in frames() {
        recorder.frame(&frame, frame.at_ns + 9).unwrap();
    }
    for row in rows() {
        let shape_m: &[_] = if row.tip_m.is_some() { &SHAPE_M } else { &[] };
        recorder.measured(3_000_000 + (row.t_s * 1e9) as u64, &row, shape_m).unwrap();
    }
    recorder.finish(Some(&result())).unwrap();
    path
}
