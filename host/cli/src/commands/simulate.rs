//! `cathforce simulate`: a run on a device in this process, and measurements made of it.

use std::fs;
use std::path::{Path, PathBuf};

use cathforce_blind_test::Noise;
use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::RigSensor;
use cathforce_recording::{
    Analysis, CAMERA_HZ, Recording, VESSEL_FILES, synthetic_trial, write_trial, write_whole,
};

use super::bundle::{check_folder, fill_folder};
use super::run::{On, run_and};
use crate::args::{PlayArguments, SimulateArguments};
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// A device in this process.
const ON_SIM: On<'_> = On::device("sim");
/// The file that says where the trials of a bundle come from.
const README: &str = "README.md";
/// How it begins, in a bundle that was made here.
const MADE: &str = "**Simulated, not measured**";

pub fn run(ui: &Ui, arguments: &SimulateArguments) -> Result<(), Failure> {
    let Some(folder) = &arguments.as_trial else {
        return run_and(ui, ON_SIM, &arguments.play, |_, _| Ok(()));
    };
    let folder = folder.clone().unwrap_or_else(|| beside(&arguments.play.bundle));
    let place = Place::of(&arguments.play.bundle, folder)?;
    run_and(ui, ON_SIM, &arguments.play, |recording, analysis| {
        write(ui, arguments, &place, recording, analysis)
    })
}

/// Where the bundle goes if nobody says: into this folder, under the name of the one it is made of.
fn beside(bundle: &Path) -> PathBuf {
    let whole = bundle.canonicalize().unwrap_or_else(|_| bundle.to_path_buf());
    let mut name = whole.file_name().unwrap_or_default().to_owned();
    name.push("-simulated");
    PathBuf::from(name)
}

/// Where a trial is to be written.
struct Place {
    folder: PathBuf,
    /// Of the trial.
    number: u32,
    is_new: bool,
}

impl Place {
    /// Says before the run that a trial of this bundle cannot be written there.
    fn of(source: &Path, folder: PathBuf) -> Result<Self, Failure> {
        if !folder.join("rig.toml").exists() {
            check_folder(&folder)?;
            return Ok(Self { folder, number: 0, is_new: true });
        }
        let refused = |why: String, fix: &str| {
            let message = format!("{}: {why}\n  fix: {fix}", folder.display());
            Err(Failure::new(Code::Usage, message))
        };
        if source.canonicalize().ok() == folder.canonicalize().ok() {
            return refused(
                "this is the bundle that is simulated: made and measured trials would stand side \
                 by side"
                    .into(),
                "name another folder, which gets the rig and the vessel too",
            );
        }
        for name in std::iter::once("rig.toml").chain(VESSEL_FILES) {
            if fs::read(source.join(name)).ok() != fs::read(folder.join(name)).ok() {
                return refused(
                    format!("its {name} is not that of {}", source.display()),
                    "name a folder that is not there yet, or one that was made of this bundle",
                );
            }
        }
        if !readme(&folder).contains(MADE) {
            return refused(
                "its trials may have been measured: its README.md does not say that they were made"
                    .into(),
                "name a folder that is not there yet",
            );
        }
        let trials = Bundle::open(&folder)?.trials;
        let number = trials.iter().map(|trial| trial.number + 1).max().unwrap_or(0);
        Ok(Self { folder, number, is_new: false })
    }
}

fn readme(folder: &Path) -> String {
    fs::read_to_string(folder.join(README)).unwrap_or_default()
}

fn write(
    ui: &Ui,
    arguments: &SimulateArguments,
    place: &Place,
    recording: &Recording,
    analysis: &Analysis,
) -> Result<(), Failure> {
    let Place { folder, number, is_new } = place;
    let source = Bundle::open(&arguments.play.bundle)?;
    let sensor = source.rig.sensor;
    // Trials of one seed differ in their noise.
    let mut noise = Noise::of_seed(arguments.seed ^ (u64::from(*number) << 32));
    let normal = arguments.noise.then_some(|| noise.normal());
    let trial = synthetic_trial(recording, analysis, &sensor, normal)?;
    let mut csv = Vec::new();
    write_trial(&trial, &mut csv).map_err(|e| Failure::write(folder, e))?;

    let name = format!("trials/{number:03}.csv");
    let line = format!("- `{name}`: {}\n", origin(arguments, recording));
    if *is_new {
        let text = format!(
            "# {}\n\n{MADE}: `cathforce simulate --as-trial` wrote the trials. The rig and the \
             vessel are those of the bundle that was simulated.\n\n{line}",
            source.rig.name
        );
        fill_folder(folder, |new| {
            for file in std::iter::once("rig.toml").chain(VESSEL_FILES) {
                let from = source.path.join(file);
                if from.is_file() {
                    fs::copy(from, new.join(file))?;
                }
            }
            fs::create_dir(new.join("trials"))?;
            fs::write(new.join(&name), &csv)?;
            fs::write(new.join(README), text)
        })?;
    } else {
        let failed = |e| Failure::write(&folder.join(&name), e);
        write_whole(&folder.join(README), |out| {
            std::io::Write::write_all(out, (readme(folder) + &line).as_bytes())
        })
        .map_err(failed)?;
        write_whole(&folder.join(&name), |out| std::io::Write::write_all(out, &csv))
            .map_err(failed)?;
    }
    ui.say(format_args!(
        "trial: {}, {} rows, {}; the tip {CAMERA_HZ} times a second",
        folder.join(&name).display(),
        trial.rows.len(),
        match arguments.noise {
            true => format!("with the noise of seed {}", arguments.seed),
            false => "without noise (--noise adds it)".into(),
        }
    ));
    for column in without_noise(&sensor).into_iter().filter(|_| arguments.noise) {
        ui.warn(format_args!("{column}, so the column is without noise"));
    }
    Ok(())
}

/// What a trial was made of, in a line.
fn origin(arguments: &SimulateArguments, recording: &Recording) -> String {
    let PlayArguments { changes, duration, .. } = &arguments.play;
    let mut parts = vec![format!("trial {} of {}", recording.info.trial, recording.info.rig)];
    parts.extend(duration.map(|s| format!("its first {s} s")));
    parts.extend(changes.file.as_ref().map(|file| format!("settings of {}", file.display())));
    parts.extend(changes.settings.iter().map(|(name, value)| format!("{name} = {value}")));
    parts.extend(changes.tip.map(|tip| format!("tip {}", tip.name)));
    parts.extend(changes.guidewire_tip.map(|tip| format!("guidewire's tip {}", tip.name)));
    parts.push(match arguments.noise {
        true => format!("noise of seed {}", arguments.seed),
        false => "no noise".into(),
    });
    parts.join(", ")
}

/// Columns whose noise the rig does not state.
fn without_noise(sensor: &RigSensor) -> Vec<&'static str> {
    let stated = [
        (sensor.force_noise_sd_n, "rig.toml states no force_noise_sd_N for fx_N, fy_N, fz_N"),
        (sensor.drive_noise_sd_n, "rig.toml states no drive_noise_sd_N for drive_fx_N"),
        (sensor.tip_noise_sd_m, "rig.toml states no tip_noise_sd_m for tip_x_m, tip_y_m, tip_z_m"),
    ];
    stated.into_iter().filter(|(sd, _)| sd.is_none()).map(|(_, column)| column).collect()
}
