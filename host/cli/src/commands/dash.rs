//! `cathforce dash`: a device, a recording or a diagnosis in a browser.

use std::io::{Write as _, stdout};
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::EncoderReading;
use cathforce_dash::{
    Drive, JointNames, Joints, LinkSource, Measurement, NewRecording, Options, Ros2, Source,
    Started, page, serve,
};
use cathforce_link::Step;
use cathforce_recording::{Attachments, Recorder, RunInfo, analyse, is_recording};
use serde_json::json;

use super::run::{encoder, pick, tendons};
use crate::args::{DashArguments, link_address};
use crate::failure::{Code, Failure};
use crate::image::image;
use crate::open::{open_bundle, open_recording, read_bytes, read_text, vessel_files};
use crate::output::{Kind, write_again};
use crate::run_info::info;
use crate::session::{DBC, interrupt_flag, unix_ns};
use crate::settings::master_of;
use crate::ui::Ui;
use crate::web::{fault_pages, options, warn_of_the_network};

/// A measured force is drawn until the next row, if that comes within this time \[s\].
const MEASURED_WITHIN_S: f64 = 0.1;

/// What Foxglove draws of our topics.
const FOXGLOVE_LAYOUT: &str = include_str!("../../../../docs/layouts/foxglove.json");

pub fn run(ui: &Ui, arguments: &DashArguments) -> Result<(), Failure> {
    let source = source(ui, arguments)?;
    if let Some(file) = &arguments.save {
        write_again(file, Kind::Page, page(&source, &fault_pages())?)?;
        ui.say(format_args!("page: {}", file.display()));
        return Ok(());
    }
    if let Some(path) = &arguments.foxglove_layout {
        write_again(path, Kind::Json, FOXGLOVE_LAYOUT)?;
        ui.say(format_args!("wrote the layout for Foxglove: {}", path.display()));
    }
    let foxglove = arguments.foxglove;
    let options = Options { foxglove, ..options(arguments.listen, arguments.hosts.clone()) };
    warn_of_the_network(ui, arguments.listen);
    if foxglove.is_some_and(|listen| !listen.ip().is_loopback()) {
        ui.warn("every computer of the network can read what is served for Foxglove");
    }
    // Until then Ctrl-C ends this program as any other.
    let interrupted = interrupt_flag()?;
    let mut printed = Ok(());
    serve(source, options, interrupted, |started| printed = print(ui, started))?;
    printed
}

/// The address, and for a link the file with the token.
fn print(ui: &Ui, started: &Started) -> Result<(), Failure> {
    let address = format!("http://{}/", started.address);
    let token_file = started.token_file.as_ref().map(|path| path.display().to_string());
    let mut text = format!("{address}\n");
    if let Some(path) = &token_file {
        text += &format!("token: {path}\n");
    }
    let foxglove = started.foxglove.map(|address| format!("ws://{address}"));
    if let Some(address) = &foxglove {
        text += &format!("foxglove: {address}\n");
    }
    let data = json!({ "address": address, "token_file": token_file, "foxglove": foxglove });
    ui.data(&data, text)?;
    // A program that waits for the address reads it from a pipe.
    stdout().flush().map_err(|e| Failure::new(Code::Failed, format!("cannot write to stdout: {e}")))
}

fn source(ui: &Ui, arguments: &DashArguments) -> Result<Source, Failure> {
    let path = Path::new(&arguments.source);
    if !path.exists() {
        return link(ui, arguments);
    }
    let only_link = [
        (arguments.bundle.is_some(), "--bundle"),
        (arguments.watch_only, "--watch-only"),
        (arguments.ros2.is_some(), "--ros2"),
        (arguments.changes.file.is_some(), "--settings"),
        (!arguments.changes.settings.is_empty(), "--set"),
    ];
    if let Some((_, name)) = only_link.into_iter().find(|(given, _)| *given) {
        let message = format!("{name} is for a link, and {} is a file", path.display());
        return Err(Failure::new(Code::Usage, format!("{message}\n  fix: omit {name}")));
    }
    let name = path.display().to_string();
    if is_recording(path) {
        let recording = open_recording(ui, path)?;
        ui.say("replaying on the host");
        let analysis = analyse(&recording)?;
        let (recording, analysis) = (Box::new(recording), Box::new(analysis));
        return Ok(Source::Recording { name, recording, analysis });
    }
    let file = match path.is_dir() {
        true => path.join("diagnosis.json"),
        false => path.to_owned(),
    };
    if path.is_dir() && !file.is_file() {
        return Err(Failure::input(format!(
            "{name}: there is no diagnosis of this bundle yet\n  fix: `cathforce gap diagnose {name} \
             --json {}`, and then this command again",
            file.display()
        )));
    }
    let answer = cathforce_dash::read_diagnosis(&read_bytes(&file)?).map_err(|why| {
        let file = file.display();
        Failure::input(format!(
            "{file}: {why}\n  fix: give the address of a link, a recording (.mcap), or the JSON of \
             `cathforce gap diagnose BUNDLE --json FILE`"
        ))
    })?;
    Ok(Source::Diagnosis { name, answer })
}

fn link(ui: &Ui, arguments: &DashArguments) -> Result<Source, Failure> {
    let address = link_address(&arguments.source).map_err(|why| {
        let source = &arguments.source;
        Failure::new(
            Code::Usage,
            format!("`{source}` is no file, and as the address of a link {why}"),
        )
    })?;
    let drive = arguments.bundle.as_deref().map(|path| drive(ui, arguments, path)).transpose()?;
    let master = master_of(arguments.changes.file.as_deref())?;
    let mut ros2 = arguments.ros2.map(Ros2::join).transpose()?;
    let drive = match (drive, &mut ros2, joints(arguments)) {
        (Some(drive), Some(ros2), Some(names)) => Some(by_joints(drive, ros2.joints(names)?)),
        (drive, _, _) => drive,
    };
    let listeners = ros2.map(|ros2| ros2.listener(master)).transpose()?.into_iter().collect();
    let link = cathforce_link::open(&address)?;
    let watch_only = arguments.watch_only;
    let source = LinkSource { link, master, drive, watch_only, listeners };
    Ok(Source::Link { name: address, source: Box::new(source) })
}

/// The joints of a robot that were asked for.
fn joints(arguments: &DashArguments) -> Option<JointNames> {
    Some(JointNames {
        topic: arguments.ros2_joints.clone()?,
        insertion: arguments.insertion_joint.clone()?,
        rotation: arguments.rotation_joint.clone(),
    })
}

/// The same, moved by the joints of a robot and not by the trial.
fn by_joints(drive: Drive, joints: Joints) -> Drive {
    let reading = move |(insertion_m, rotation_rad)| EncoderReading { insertion_m, rotation_rad };
    Drive {
        step_at: Box::new(move |_| Step {
            encoder: joints.now().map(reading).map(encoder),
            ..Step::default()
        }),
        measured_at: Box::new(|_| None),
        duration_s: f64::INFINITY,
        ..drive
    }
}

/// Makes files for recordings of this rig in the folder for them.
fn new_recording(
    bundle: &Bundle,
    number: u32,
    arguments: &DashArguments,
) -> Result<NewRecording, Failure> {
    let folder = arguments.recordings.clone();
    if !folder.is_dir() {
        let message = format!(
            "--recordings {}: there is no such folder\n  fix: make it, or give another one",
            folder.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let rig_toml = read_text(&bundle.path.join("rig.toml"))?;
    let vessel = vessel_files(bundle)?;
    let known = info(&arguments.source, bundle, &format!("{number:03}"));
    Ok(Box::new(move |image: &[u8]| {
        let started_unix_ns = unix_ns();
        let path = folder.join(format!("dash-{}.mcap", started_unix_ns / 1_000_000));
        let info = RunInfo { started_unix_ns, ..known.clone() };
        let vessel = vessel.iter().map(|(name, bytes)| (*name, &bytes[..])).collect::<Vec<_>>();
        let attachments = Attachments { image, rig_toml: &rig_toml, dbc: DBC, vessel: &vessel };
        let recorder = Recorder::create(&path, &info, attachments);
        recorder.map(|recorder| (path, recorder)).map_err(|error| error.to_string())
    }))
}

/// The trial of a bundle, to be played on the device.
fn drive(ui: &Ui, arguments: &DashArguments, path: &Path) -> Result<Drive, Failure> {
    let bundle = open_bundle(ui, path)?;
    let (number, trial) = pick(&bundle, arguments.trial)?;
    let trial = trial.clone();
    let Some(columns) = trial.catheter().cloned() else {
        let message = format!(
            "{}: this bundle is of a drive without an instrument\n  fix: give the bundle of a catheter",
            path.display()
        );
        return Err(Failure::input(message));
    };
    let (image, _) = image(ui, &bundle, &arguments.changes)?;
    let new_recording = new_recording(&bundle, number, arguments)?;
    let start_s = trial.t_s.first().copied().unwrap_or(0.0);
    let (duration_s, times) = (trial.duration_s(), trial.t_s.clone());
    let pulled = columns.tendons_m.len();
    let measured_at = move |t_s: f64| {
        let at = times.partition_point(|row| *row <= start_s + t_s + 1e-9).checked_sub(1)?;
        let is_near = start_s + t_s - times[at] < MEASURED_WITHIN_S;
        let force = columns.force_n.as_ref().and_then(|column| column[at]);
        let drive = columns.drive_force_n.as_ref().and_then(|column| column[at]);
        let axis = |k: usize| force.map(|force_n| force_n[k] as f32);
        is_near.then(|| Measurement([axis(0), axis(1), axis(2), drive.map(|n| n as f32)]))
    };
    let step_at = move |t_s: f64| Step {
        encoder: trial.encoder_at(start_s + t_s).map(encoder),
        guidewire: trial.guidewire_at(start_s + t_s).map(encoder),
        tendons: tendons(pulled, trial.tendons_at(start_s + t_s)),
        ..Step::default()
    };
    Ok(Drive {
        image,
        lock_step: !arguments.free,
        step_at: Box::new(step_at),
        measured_at: Box::new(measured_at),
        duration_s,
        play: arguments.play,
        new_recording: Some(new_recording),
    })
}
