//! `cathforce run` and `cathforce simulate`.

use std::path::{Path, PathBuf};

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{CatheterTrial, EncoderReading};
use cathforce_bus::{Encoder, Insertion, Rotation};
use cathforce_link::qemu::find_firmware;
use cathforce_link::{Client, Step};
use cathforce_recording::{
    Analysis, FEED_BEFORE_SCORE_M, Recording, RunInfo, SensorNoise, Trial, VESSEL_FILES, analyse,
};
use sha2::{Digest, Sha256};

use super::{image, open_bundle};
use crate::args::{Feel, PlayArguments};
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, check_apart, check_recording, write_again};
use crate::session::{Pace, Plan, run as run_session};
use crate::summary::Summary;
use crate::ui::Ui;

pub fn run(ui: &Ui, link: &str, pace: Pace, arguments: &PlayArguments) -> Result<(), Failure> {
    run_and(ui, link, pace, arguments, |_, _| Ok(()))
}

/// The same; `and` is done with the recording and what follows from it, once they are summed up.
pub fn run_and(
    ui: &Ui,
    link: &str,
    pace: Pace,
    arguments: &PlayArguments,
    and: impl FnOnce(&Recording, &Analysis) -> Result<(), Failure>,
) -> Result<(), Failure> {
    // Building the image takes a while, after which nobody wants to hear of a misprint or of an
    // interface that is down.
    cathforce_link::check_address(link)?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (number, trial) = pick(&bundle, arguments.trial)?;
    let columns = catheter(trial)?;
    if arguments.feel == Feel::Guidewire && columns.guidewire.is_none() {
        let message = "--feel guidewire: the rig has no guidewire; describe it in the table \
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
    let run = TrialRun {
        bundle: &bundle,
        number,
        trial,
        link,
        pace,
        duration_s: arguments.duration,
        feel: arguments.feel,
        overwrite: arguments.overwrite,
    };
    let played = play(ui, &mut client, run, &image, &out);
    // A run that ends before its device is ready records nothing.
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
    /// Plays only so much of it \[s\].
    pub duration_s: Option<f64>,
    /// Whose load the operator feels.
    pub feel: Feel,
    /// Whether a recording that is there is replaced.
    pub overwrite: bool,
}

/// Configures a device with an image, plays a trial on it and records that.
pub fn play(
    ui: &Ui,
    client: &mut Client,
    run: TrialRun<'_>,
    image: &[u8],
    out: &Path,
) -> Result<(), Failure> {
    let TrialRun { bundle, number, trial, link, pace, duration_s, feel, overwrite } = run;
    let mut measured = recorded(bundle, trial)?;
    let rig_toml = read_text(&bundle.path.join("rig.toml"))?;
    let start_s = measured.rows.first().map_or(0.0, |row| row.t_s);
    measured.rows.iter_mut().for_each(|row| row.t_s -= start_s);
    let vessel = vessel_files(bundle)?;
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
            ..Step::default()
        },
        duration_s: duration_s.unwrap_or(f64::INFINITY).min(trial.duration_s()),
        out,
        overwrite,
    };
    run_session(ui, client, plan)
}

/// A catheter's trial as a recording holds it; times stay as they are.
pub fn recorded(bundle: &Bundle, trial: &cathforce_bundle::Trial) -> Result<Trial, Failure> {
    Ok(Trial {
        noise: SensorNoise::of(&bundle.rig.sensor),
        ..Trial::of(&trial.t_s, catheter(trial)?)
    })
}

/// A folder that goes when it is dropped.
pub fn temporary_folder() -> Result<tempfile::TempDir, Failure> {
    tempfile::tempdir().map_err(|e| Failure::new(Code::Failed, format!("no temporary folder: {e}")))
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
    let text = format!("{title}\n{}{}\n", summary.text(), recording.info.provenance);
    ui.data(&summary, text)?;
    and(&recording, &analysis)?;
    if let Some(replay) = analysis.replay.as_ref().filter(|replay| !replay.identical()) {
        return Err(super::replay::difference(replay, &recording.info));
    }
    let missed = arguments.max_error.and_then(|percent| match summary.error_share() {
        Some(share) if 100.0 * share <= percent => None,
        Some(share) => Some(format!(
            "the force error is {:.2} % of the measured peak, above --max-error {percent}",
            100.0 * share
        )),
        // What was not looked at is not within a limit.
        None => Some(format!("no force was compared: {}", not_compared(&recording))),
    });
    missed.map_or(Ok(()), |message| Err(Failure::new(Code::Threshold, message)))
}

/// Why nothing can be said of the forces' error.
fn not_compared(recording: &Recording) -> String {
    let mut forces = recording.trial.rows.iter().filter_map(|row| row.force_n).peekable();
    let (why, fix) = if forces.peek().is_none() {
        (
            "what was played of the trial has no measured force".into(),
            "play a trial with fx_N, fy_N and fz_N, or leave --max-error out".to_owned(),
        )
    } else if forces.all(|force| force == [0.0; 3]) {
        (
            "every measured force is 0".into(),
            "give the sensor's forces in fx_N, fy_N and fz_N, or leave --max-error out".to_owned(),
        )
    } else {
        let mm = 1e3 * FEED_BEFORE_SCORE_M;
        (
            format!("no row with a force is {mm} mm of feed past the beginning and outside snaps"),
            "play a longer part of the trial, with a larger --duration".to_owned(),
        )
    };
    format!("{why}\n  fix: {fix}")
}

/// The trial of this number, or the first one.
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
                "{path}: there is no trial {number:03}, there are: {}\n  fix: give one of them with \
                 --trial",
                there.join(", ")
            ),
            _ => format!("{path}: there are no trials, so nothing to play\n  fix: add trials/000.csv"),
        })
    })
}

fn catheter(trial: &cathforce_bundle::Trial) -> Result<&CatheterTrial, Failure> {
    let missing = "this is a drive without an instrument: it has no insertion to play\n  fix: give \
                   a catheter's bundle";
    trial.catheter().ok_or_else(|| Failure::input(missing))
}

/// The bundle's files that say what the vessel is.
pub fn vessel_files(bundle: &Bundle) -> Result<Vec<(&'static str, Vec<u8>)>, Failure> {
    let there = VESSEL_FILES.into_iter().filter(|name| bundle.path.join(name).is_file());
    there
        .map(|name| {
            let path = bundle.path.join(name);
            let bytes = std::fs::read(&path);
            let bytes = bytes
                .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
            Ok((name, bytes))
        })
        .collect()
}

/// A drive's position as it crosses the bus.
pub fn encoder(at: EncoderReading) -> Encoder {
    Encoder {
        insertion: Insertion::from_m(at.insertion_m),
        rotation: Rotation::from_rad(at.rotation_rad),
    }
}

/// What is known of a run before it begins.
pub fn info(link: &str, bundle: &Bundle, trial: &str) -> RunInfo {
    RunInfo {
        host_version: env!("CARGO_PKG_VERSION").into(),
        link: link.into(),
        rig: bundle.rig.name.clone(),
        trial: trial.into(),
        provenance: provenance(&bundle.path),
        firmware_sha256: firmware_sha256(link),
        noise: SensorNoise::of(&bundle.rig.sensor),
        ..RunInfo::default()
    }
}

/// SHA-256 of the program that runs as the device, where this host starts it; else empty.
fn firmware_sha256(link: &str) -> String {
    let program = match link.split_once(':').map_or(link, |(kind, _)| kind) {
        "sim" => std::env::current_exe().ok(),
        "qemu" => find_firmware(link.split_once(':').map(|(_, elf)| Path::new(elf))).ok(),
        _ => None,
    };
    let bytes = program.and_then(|path| std::fs::read(path).ok());
    bytes.map_or(String::new(), |bytes| format!("{:x}", Sha256::digest(bytes)))
}

/// Longest text about a bundle's origin.
const PROVENANCE_CHARACTERS: usize = 260;

/// What stands in the bundle, or beside it, about its origin: the first sentences of its first
/// paragraph, without markup and without what it says in brackets.
fn provenance(bundle: &Path) -> String {
    let parent = bundle.parent().map(Path::to_path_buf).unwrap_or_default();
    let places: [PathBuf; 4] = [
        bundle.join("PROVENANCE.md"),
        bundle.join("README.md"),
        parent.join("PROVENANCE.md"),
        parent.join("README.md"),
    ];
    let text = places.iter().find_map(|place| std::fs::read_to_string(place).ok());
    let text = text.unwrap_or_default();
    let paragraph = text.split("\n\n").find(|p| !p.trim_start().starts_with('#')).unwrap_or("");
    let mut depth = 0_u32;
    let keep = |c: &char| {
        depth = (depth + u32::from(*c == '(')).saturating_sub(u32::from(*c == ')'));
        depth == 0 && !matches!(c, ')' | '*' | '`')
    };
    let plain = paragraph.chars().filter(keep).collect::<String>();
    let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    let plain = plain.replace(" .", ".").replace(" ,", ",");
    let ends = plain.match_indices(". ").map(|(at, _)| at + 1).chain([plain.len()]);
    let end = ends.take_while(|&end| end <= PROVENANCE_CHARACTERS).last().unwrap_or(0);
    plain[..end].to_owned()
}

pub fn read_text(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn provenance_is_the_first_sentences_beside_the_bundle() {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("rig");
        std::fs::create_dir(&bundle).unwrap();
        assert_eq!(provenance(&bundle), "");
        let text = format!(
            "# Bundles\n\n**Simulated,\nnot measured** (by (f. ex.) us). So. {}.\n\nMore.\n",
            "word ".repeat(PROVENANCE_CHARACTERS / 5)
        );
        std::fs::write(folder.path().join("README.md"), text).unwrap();
        assert_eq!(provenance(&bundle), "Simulated, not measured. So.");
        std::fs::write(bundle.join("PROVENANCE.md"), "Measured here.").unwrap();
        assert_eq!(provenance(&bundle), "Measured here.");
    }
}
