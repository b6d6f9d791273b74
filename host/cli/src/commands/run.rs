//! `cathforce run` and `cathforce simulate`.

use std::path::{Path, PathBuf};

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{CatheterTrial, EncoderReading};
use cathforce_bus::{Displacement, Encoder, Insertion, Rotation, Tendons};
use cathforce_link::{Client, Step};
use cathforce_mechanics::MAX_TENDONS;
use cathforce_recording::sensor::{ForceSensor, SensorAddress, SensorOptions};
use cathforce_recording::{
    Analysis, FEED_BEFORE_SCORE_M, Recording, SensorNoise, Summary, Trial, analyse,
};

#[cfg(not(feature = "dash"))]
use super::web;
use crate::args::{Feel, PlayArguments, RunArguments, SensorArguments};
use crate::difference::difference;
use crate::failure::{Code, Failure};
use crate::image::image;
use crate::log::Watch;
use crate::open::open_bundle;
use crate::open::{read_text, vessel_files};
use crate::output::{Kind, check_again, check_apart, check_recording, write_again};
use crate::run_info::info;
use crate::session::{Pace, Plan, run as run_session};
use crate::ui::{Ui, two_columns};
#[cfg(feature = "dash")]
use crate::web;

/// The device that plays, and a sensor beside it.
#[derive(Clone, Copy)]
pub struct On<'a> {
    /// Address of the link.
    pub link: &'a str,
    pub pace: Pace,
    pub sensor: Option<(&'a SensorAddress, SensorOptions)>,
    /// Sees every frame of the run.
    pub watch: Option<&'a Watch>,
}

impl<'a> On<'a> {
    /// A device alone, in lock step if it can.
    pub const fn device(link: &'a str) -> Self {
        Self { link, pace: Pace::LockStep, sensor: None, watch: None }
    }
}

pub fn run(ui: &Ui, arguments: &RunArguments) -> Result<(), Failure> {
    let SensorArguments { sensor, counts_per_n, axes, tare } = &arguments.sensor;
    let options = SensorOptions {
        counts_per_n: *counts_per_n,
        axes: *axes,
        tare_s: tare.unwrap_or_default(),
    };
    let on = On {
        link: &arguments.link,
        pace: if arguments.free { Pace::Free } else { Pace::LockStep },
        sensor: sensor.as_ref().map(|address| (address, options)),
        watch: None,
    };
    let play =
        |watch: Option<&Watch>| run_and(ui, On { watch, ..on }, &arguments.play, |_, _| Ok(()));
    match arguments.dash {
        None => play(None),
        Some(listen) => {
            // Checked first, because nobody opens a page of a run that cannot begin.
            cathforce_link::check_address(on.link)?;
            web::while_it_runs(ui, listen, on.link, |watch| play(Some(watch)))
        }
    }
}

/// The same; `and` is done with the recording and what follows from it, once they are summed up.
pub fn run_and(
    ui: &Ui,
    on: On<'_>,
    arguments: &PlayArguments,
    and: impl FnOnce(&Recording, &Analysis) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let On { link, pace, sensor, watch } = on;
    // Checked first, because building the image takes a while.
    cathforce_link::check_address(link)?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (number, trial) = pick(&bundle, arguments.trial)?;
    let columns = catheter(trial)?;
    if arguments.feel == Feel::Guidewire && columns.guidewire.is_none() {
        let message = "--feel guidewire: the rig has no guidewire\n  fix: describe it in the table \
                       [guidewire] of rig.toml";
        return Err(Failure::new(Code::Usage, message));
    }
    check_apart(arguments.out.iter().chain(&arguments.summary).map(PathBuf::as_path))?;
    if let Some(out) = &arguments.out {
        check_recording(out, arguments.overwrite)?;
    }
    if let Some(summary) = &arguments.summary {
        check_again(summary, Kind::Json)?;
    }
    let (image, _) = image(ui, &bundle, &arguments.changes)?;

    let folder = temporary_folder()?;
    let out = arguments.out.clone().unwrap_or_else(|| folder.path().join("run.mcap"));
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let sensor = sensor.map(|sensor| start(ui, &client, pace, sensor)).transpose()?;
    let run = TrialRun {
        bundle: &bundle,
        number,
        trial,
        link,
        pace,
        duration_s: arguments.duration,
        feel: arguments.feel,
        overwrite: arguments.overwrite,
        sensor: sensor.as_ref(),
        watch,
    };
    let played = play(ui, &mut client, run, &image, &out);
    // A run that ends before its device is ready leaves no recording.
    if let Some(out) = arguments.out.as_ref().filter(|out| out.is_file()) {
        ui.say(format_args!("recording: {}", out.display()));
    }
    played?;
    finish(ui, &out, arguments, and)
}

/// A trial that a device is to play.
#[derive(Clone, Copy)]
pub struct TrialRun<'a> {
    pub bundle: &'a Bundle,
    pub number: u32,
    pub trial: &'a cathforce_bundle::Trial,
    /// Address of the link, for the recording.
    pub link: &'a str,
    pub pace: Pace,
    /// How much of the trial to play \[s\]; `None` plays all of it.
    pub duration_s: Option<f64>,
    /// The instrument whose load the operator feels.
    pub feel: Feel,
    /// Whether an existing recording is replaced.
    pub overwrite: bool,
    /// Measures the force in place of the trial's.
    pub sensor: Option<&'a ForceSensor>,
    /// Sees every frame.
    pub watch: Option<&'a Watch>,
}

/// Starts a sensor, whose time must be that of the device.
fn start(
    ui: &Ui,
    client: &Client,
    pace: Pace,
    (address, options): (&SensorAddress, SensorOptions),
) -> Result<ForceSensor, Failure> {
    if pace == Pace::LockStep && client.device().can_lock_step {
        let message = "--sensor measures in real time, and this device in lock step computes in its own\n  \
                       fix: add --free";
        return Err(Failure::new(Code::Usage, message));
    }
    if !options.axes.is_rotation() {
        ui.warn("--axes mirrors, which is right only for a sensor that measures the reaction");
    }
    let sensor = ForceSensor::start(address, options)
        .map_err(|e| Failure::new(Code::Link, e.to_string()))?;
    ui.say(format_args!("sensor: {address}, {}", sensor.unit()));
    Ok(sensor)
}

/// Configures a device with an image, plays a trial on it and records the run.
pub fn play(
    ui: &Ui,
    client: &mut Client,
    run: TrialRun<'_>,
    image: &[u8],
    out: &Path,
) -> Result<(), Failure> {
    let TrialRun { bundle, number, trial, link, pace, duration_s, feel, .. } = run;
    let mut measured = recorded(bundle, trial)?;
    let rig_toml = read_text(&bundle.path.join("rig.toml"))?;
    let start_s = measured.rows.first().map_or(0.0, |row| row.t_s);
    measured.rows.iter_mut().for_each(|row| row.t_s -= start_s);
    let vessel = vessel_files(bundle)?;
    let pulled = trial.catheter().map_or(0, |catheter| catheter.tendons_m.len());
    let plan = Plan {
        image,
        pace,
        rig_toml: &rig_toml,
        vessel: &vessel,
        info: info(link, bundle, &format!("{number:03}")),
        trial: &measured,
        step_at: &|t_s| Step {
            encoder: trial.encoder_at(start_s + t_s).map(encoder),
            guidewire: trial.guidewire_at(start_s + t_s).map(encoder),
            guidewire_held: feel == Feel::Guidewire,
            tendons: tendons(pulled, trial.tendons_at(start_s + t_s)),
            ..Step::default()
        },
        duration_s: duration_s.unwrap_or(f64::INFINITY).min(trial.duration_s()),
        out,
        overwrite: run.overwrite,
        sensor: run.sensor,
        watch: run.watch.cloned(),
    };
    run_session(ui, client, plan)
}

/// A catheter's trial in the form of a recording. Times stay as they are.
pub fn recorded(bundle: &Bundle, trial: &cathforce_bundle::Trial) -> Result<Trial, Failure> {
    Ok(Trial {
        noise: SensorNoise::of(&bundle.rig.sensor),
        ..Trial::of(&trial.t_s, catheter(trial)?)
    })
}

/// A temporary folder, which is deleted when it is dropped.
pub fn temporary_folder() -> Result<tempfile::TempDir, Failure> {
    tempfile::tempdir()
        .map_err(|e| Failure::new(Code::Failed, format!("cannot make a temporary folder: {e}")))
}

/// Replays what was recorded, compares it with the sensor, and says what came out.
fn finish(
    ui: &Ui,
    recording: &Path,
    arguments: &PlayArguments,
    and: impl FnOnce(&Recording, &Analysis) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let recording = Recording::open(recording)?;
    ui.say("replaying on the host");
    let analysis = analyse(&recording)?;
    let summary = Summary::of(&recording, &analysis);
    if let Some(path) = &arguments.summary {
        let json = serde_json::to_string_pretty(&summary).map_err(|e| Failure::write(path, e))?;
        write_again(path, Kind::Json, json + "\n")?;
    }
    let title = ui.bold(&format!("{} trial {}", recording.info.rig, recording.info.trial));
    let text = format!("{title}\n{}{}\n", two_columns(&summary.rows()), recording.info.provenance);
    ui.data(&summary, text)?;
    and(&recording, &analysis)?;
    if let Some(replay) = analysis.replay.as_ref().filter(|replay| !replay.identical()) {
        return Err(difference(replay, &recording.info));
    }
    let missed = arguments.max_error.and_then(|percent| match summary.error_share() {
        Some(share) if 100.0 * share <= percent => None,
        Some(share) => Some(format!(
            "the force error is {:.2} % of the measured peak, above the {percent} % of --max-error",
            100.0 * share
        )),
        // An error that was not computed is not within a limit.
        None => Some(format!("no force was compared: {}", not_compared(&recording))),
    });
    missed.map_or(Ok(()), |message| Err(Failure::new(Code::Threshold, message)))
}

/// Why there is no error of the forces, and how to get one.
fn not_compared(recording: &Recording) -> String {
    let mut forces = recording.trial.rows.iter().filter_map(|row| row.force_n).peekable();
    let (why, fix) = if forces.peek().is_none() {
        (
            "the part of the trial that was played has no measured force".into(),
            "play a trial with fx_N, fy_N and fz_N, or omit --max-error".to_owned(),
        )
    } else if forces.all(|force| force == [0.0; 3]) {
        (
            "every measured force is 0".into(),
            "write the sensor's forces into fx_N, fy_N and fz_N, or omit --max-error".to_owned(),
        )
    } else {
        let mm = 1e3 * FEED_BEFORE_SCORE_M;
        (
            format!("no force was measured outside snaps after the first {mm} mm of feed"),
            "play a longer part of the trial, with a larger --duration".to_owned(),
        )
    };
    format!("{why}\n  fix: {fix}")
}

/// The trial with this number, or the first trial.
pub fn pick(
    bundle: &Bundle,
    wanted: Option<u32>,
) -> Result<(u32, &cathforce_bundle::Trial), Failure> {
    let found = match wanted {
        Some(number) => bundle.trial(number),
        None => bundle.trials.first(),
    };
    found.map(|trial| (trial.number, trial)).ok_or_else(|| {
        let there = bundle.trials.iter().map(|t| format!("{:03}", t.number)).collect::<Vec<_>>();
        let path = bundle.path.join("trials");
        let path = path.display();
        Failure::input(match wanted {
            Some(number) if !there.is_empty() => format!(
                "{path}: there is no trial {number:03}\n  fix: give --trial one of {}",
                there.join(", ")
            ),
            _ => format!("{path}: there is no trial to play\n  fix: add trials/000.csv"),
        })
    })
}

fn catheter(trial: &cathforce_bundle::Trial) -> Result<&CatheterTrial, Failure> {
    let missing = "this bundle is of a drive without an instrument, which has no insertion to play\n  \
                   fix: give the bundle of a catheter";
    trial.catheter().ok_or_else(|| Failure::input(missing))
}

/// A drive's position as it crosses the bus.
pub fn encoder(at: EncoderReading) -> Encoder {
    Encoder {
        insertion: Insertion::from_m(at.insertion_m),
        rotation: Rotation::from_rad(at.rotation_rad),
    }
}

/// Displacements of so many tendons as they cross the bus; `None` for pairs that there are not.
pub fn tendons(count: usize, at_m: [f64; MAX_TENDONS]) -> [Option<Tendons>; 2] {
    let at_m = at_m.map(Displacement::from_m);
    std::array::from_fn(|i| {
        let displacements = [at_m[2 * i], at_m[2 * i + 1]];
        (2 * i < count).then_some(Tendons { pair: i as u8, displacements })
    })
}
