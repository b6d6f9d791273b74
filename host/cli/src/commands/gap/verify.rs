//! `cathforce gap verify`: the gap that is left on the device, next to what was predicted.
//!
//! The device plays the trial twice, as rig.toml states the rig and with the settings. Both runs
//! are scored as the diagnosis scores. Device and host compute the same bits, so what separates
//! the achieved from the predicted figure is that the diagnosis' own model is coarser.

use std::path::Path;

use cathforce_config::image;
use cathforce_gap::catheter::{Achieved, Left, Runs, Shrink};
use cathforce_link::Client;
use cathforce_record::{Estimate, Recording, analyse, estimates};
use cathforce_rig::{Bundle, ImageOptions};
use serde::Serialize;

use super::explanation::{Explanation, Figures};
use crate::args::{Feel, VerifyArguments};
use crate::commands::run::{TrialRun, pick, play, temporary_folder};
use crate::failure::{Code, Failure};
use crate::output::check_recording;
use crate::session::Pace;
use crate::ui::{Ui, two_columns};

/// What came out.
#[derive(Serialize)]
struct Verified {
    rig: String,
    trial: u32,
    /// Whether the trial is known not to be one that the settings were fitted to; null when
    /// nothing is known about where they come from.
    fresh: Option<bool>,
    link: String,
    board: String,
    settings: Vec<(String, f32)>,
    #[serde(flatten)]
    achieved: Achieved,
    /// Force RMS over all held-out trials of the diagnosis.
    #[serde(rename = "promised_force_rms_N")]
    promised: Option<Promised>,
    /// Between device and host, both runs.
    differing_bits: u64,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Promised {
    before: f64,
    after: f64,
    floor: f64,
}

impl From<Figures> for Promised {
    fn from(Figures { before, after, floor }: Figures) -> Self {
        Self { before, after, floor }
    }
}

pub fn run(ui: &Ui, arguments: &VerifyArguments) -> Result<(), Failure> {
    let bundle = super::super::open_bundle(ui, &arguments.bundle)?;
    let explanation = arguments.diagnosis.as_deref().map(Explanation::read).transpose()?;
    if let Some(explanation) = &explanation {
        explanation.check_rig(&bundle)?;
    }
    let options = options(&bundle, arguments, explanation.as_ref())?;
    let (number, trial, fresh) = choose(&bundle, arguments, explanation.as_ref())?;
    if let Some(out) = &arguments.out {
        check_recording(out, arguments.overwrite)?;
    }
    let catheter = super::source::catheter(&bundle)?;
    let nominal = ImageOptions { parameters: Vec::new(), band: None, ..options.clone() };
    let (before, _) = super::super::image_with(ui, &bundle, &nominal)?;
    let (after, _) = super::super::image_with(ui, &bundle, &options)?;

    let link = &arguments.link;
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let board = client.device().board.clone();
    let folder = temporary_folder()?;
    let (duration_s, feel) = (arguments.duration, Feel::Catheter);
    let pace = Pace::LockStep;
    let overwrite = false;
    let run = TrialRun { bundle: &bundle, number, trial, link, pace, duration_s, feel, overwrite };
    ui.say("as rig.toml states the rig:");
    let file = folder.path().join("before.mcap");
    let (before, bits) = estimated(ui, &mut client, run, &before, &file)?;
    ui.say("with the settings:");
    let file = arguments.out.clone().unwrap_or_else(|| folder.path().join("after.mcap"));
    let run = TrialRun { overwrite: arguments.overwrite, ..run };
    let (after, more_bits) = estimated(ui, &mut client, run, &after, &file)?;

    let wide: Vec<(String, f64)> =
        options.parameters.iter().map(|(key, value)| (key.clone(), f64::from(*value))).collect();
    let achieved = catheter
        .achieved(number, &wide, Runs { before: &before, after: &after })
        .map_err(|e| Failure::input(format!("{}: {e}", bundle.path.display())))?;
    let promised = explanation.as_ref().and_then(|own| own.gap.force_rms_n).map(Promised::from);
    let verified = Verified {
        rig: bundle.rig.name.clone(),
        trial: number,
        fresh,
        link: link.clone(),
        board,
        settings: options.parameters,
        achieved,
        promised,
        differing_bits: bits + more_bits,
        notes: notes(fresh, number),
    };
    ui.data(&verified, verified.text(ui))?;
    verified.check(arguments.fail_above)
}

/// The settings to verify: those that are given, else those of the diagnosis.
fn options(
    bundle: &Bundle,
    arguments: &VerifyArguments,
    explanation: Option<&Explanation>,
) -> Result<ImageOptions, Failure> {
    let mut options = super::super::options(bundle, &arguments.changes)?;
    if let (true, Some(explanation)) = (options.parameters.is_empty(), explanation) {
        let fitted = explanation.fitted()?;
        options.parameters = fitted.iter().map(|own| (own.key.to_owned(), own.value)).collect();
        options.band = explanation.band()?;
    }
    if options.parameters.is_empty() {
        let message = "no effect is switched on, so there is nothing to verify: give --settings \
                       (from `cathforce gap apply`), --diagnosis or --set";
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(options)
}

/// The trial to play, and whether the diagnosis has not seen it.
fn choose<'a>(
    bundle: &'a Bundle,
    arguments: &VerifyArguments,
    explanation: Option<&Explanation>,
) -> Result<(u32, &'a cathforce_rig::Trial, Option<bool>), Failure> {
    let hash = || {
        let path = std::slice::from_ref(&bundle.path);
        super::hash::of_all(path)
            .map_err(|e| Failure::input(format!("cannot read {}: {e}", bundle.path.display())))
    };
    let same = explanation.map(|own| Ok::<_, Failure>(own.is_of(&hash()?))).transpose()?;
    let fresh = |number: u32| {
        let explanation = explanation?;
        Some(!same? || explanation.held_back(number))
    };
    let unseen = || bundle.trials.iter().map(|t| t.number).find(|&n| fresh(n) == Some(true));
    let (number, trial) = pick(bundle, arguments.trial.or_else(unseen))?;
    Ok((number, trial, fresh(number)))
}

/// What the device estimates while it plays the trial, and in how many bits the host differs.
fn estimated(
    ui: &Ui,
    client: &mut Client,
    run: TrialRun<'_>,
    image: &[u8],
    out: &Path,
) -> Result<(Vec<Estimate>, u64), Failure> {
    play(ui, client, run, image, out)?;
    let recording = Recording::open(out)?;
    let analysis = analyse(&recording)?;
    if let Some(replay) = analysis.replay.as_ref().filter(|replay| !replay.identical()) {
        return Err(crate::commands::replay::difference(replay, &recording.info));
    }
    let config = image::decode(&recording.image).map_err(Failure::input)?;
    let entry_m = config.model.description().entry.position_m.map(f64::from);
    let bits = analysis.replay.as_ref().map_or(0, |replay| replay.differing_bits);
    Ok((estimates(&recording, &analysis.track, entry_m), bits))
}

fn notes(fresh: Option<bool>, trial: u32) -> Vec<String> {
    let mut notes = Vec::new();
    match fresh {
        Some(true) => {}
        Some(false) => notes.push(format!(
            "the settings were fitted to trial {trial:03} among others: it is no fresh data; \
             `cathforce gap diagnose --hold-back {trial}` keeps it out"
        )),
        None => notes.push(
            "without --diagnosis nothing is known about which trials the settings were fitted to"
                .to_owned(),
        ),
    }
    notes.push(
        "device and host compute the same bits; what separates predicted from achieved is the \
         coarser model of the diagnosis (ticks of 4 ms)"
            .to_owned(),
    );
    notes
}

impl Verified {
    fn text(&self, ui: &Ui) -> String {
        let fresh = match self.fresh {
            Some(true) => ", which the diagnosis has not seen",
            _ => "",
        };
        let title = format!("{} trial {:03}{fresh}, on {}", self.rig, self.trial, self.board);
        let mut text = format!("{}\n", ui.bold(&title));
        text += "                   before   predicted    achieved       floor\n";
        let a = &self.achieved;
        let rows = [
            ("force, mN", a.force_rms_n, 1e3),
            ("drive force, mN", a.drive_force_rms_n, 1e3),
            ("tip, mm", a.tip_rms_m, 1e3),
        ];
        for (label, left, scale) in rows {
            if let Some(Left { before, predicted, achieved, floor }) = left {
                text += &format!("{label:<16}");
                for value in [before, predicted, achieved, floor] {
                    text += &format!("{:>9.2}   ", scale * value);
                }
                text = format!("{}\n", text.trim_end());
            }
        }
        let mut rows = Vec::new();
        if let Some(coverage) = &a.coverage {
            let text = super::coverage::text(coverage);
            rows.push(("within the band".to_owned(), text));
        }
        rows.push((
            "gap closed".to_owned(),
            match a.shrink {
                Some(Shrink { predicted, achieved }) => format!(
                    "{:.0} % predicted, {:.0} % achieved, of what is above the floor in all channels",
                    100.0 * predicted,
                    100.0 * achieved
                ),
                None => "there was none above the floor in this trial".to_owned(),
            },
        ));
        if let Some(Promised { before, after, floor }) = self.promised {
            rows.push((
                "promised".to_owned(),
                format!(
                    "force from {:.2} to {:.2} mN, floor {:.2}, over the diagnosis' held-out trials",
                    1e3 * before,
                    1e3 * after,
                    1e3 * floor
                ),
            ));
        }
        rows.push(("device and host".to_owned(), format!("{} bits differ", self.differing_bits)));
        rows.extend(self.notes.iter().map(|note| ("note".to_owned(), note.clone())));
        text + &two_columns(&rows)
    }

    /// Fails with the code of a missed threshold.
    fn check(&self, limit_n: Option<f64>) -> Result<(), Failure> {
        let Some(limit) = limit_n else { return Ok(()) };
        match self.achieved.force_rms_n {
            Some(Left { achieved, .. }) if achieved <= limit => Ok(()),
            Some(Left { achieved, .. }) => Err(Failure::new(
                Code::Threshold,
                format!("the force RMS on the device is {achieved:.4} N, above rms_N={limit}"),
            )),
            None => Err(Failure::new(
                Code::Threshold,
                "no force was measured that could be compared with --fail-above",
            )),
        }
    }
}
