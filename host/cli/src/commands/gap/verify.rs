//! `cathforce gap verify`: the gap that is left on the device, next to what was predicted.
//!
//! The device plays the trial twice, as rig.toml states the rig and with the settings. Both runs are
//! scored as the diagnosis scores. Beside them stands the diagnosis' finer model with the same
//! settings, in double precision. It checks the device against the model that the diagnosis used;
//! bit identity is another check, between the device and its replay on this host.

mod outcome;

use std::path::Path;

use cathforce_bundle::{Bundle, ImageOptions};
use cathforce_config::image;
use cathforce_gap::catheter::{Achieved, Left, Runs};
use cathforce_gap::rounding::{from_to, percent, quantity, significant};
use cathforce_link::Client;
use cathforce_mechanics::parameters;
use cathforce_recording::{Estimate, Recording, analyse, estimates};
use serde::Serialize;

use super::apply::stated_band;
use super::explanation::{Explanation, Figures, Fitted};
use crate::args::{Feel, VerifyArguments};
use crate::commands::run::{TrialRun, pick, play, temporary_folder};
use crate::failure::{Code, Failure};
use crate::image::{by_hand, described};
use crate::output::check_recording;
use crate::session::Pace;
use crate::ui::{Ui, two_columns};
use outcome::{Outcome, is_larger};

/// What came out.
#[derive(Serialize)]
struct Verified {
    outcome: Outcome,
    /// The outcome in words.
    sentence: String,
    rig: String,
    trial: u32,
    /// Whether the trial is known not to be one that the settings were fitted to; null when
    /// nothing is known about where they come from.
    fresh: Option<bool>,
    link: String,
    board: String,
    settings: Vec<(String, f32)>,
    /// Where the settings are not what the diagnosis names.
    differences: Vec<Difference>,
    /// Why nothing is concluded from what was measured.
    objections: Vec<String>,
    #[serde(flatten)]
    achieved: Achieved,
    /// Null without a gap above the floor, and with objections.
    shrink: Option<Shrink>,
    /// Force RMS over all held-out trials of the diagnosis.
    #[serde(rename = "promised_force_rms_N")]
    promised: Option<Promised>,
    /// Between device and host, both runs.
    differing_bits: u64,
    notes: Vec<String>,
}

/// Shares of the gap above the floor that the settings close, in all channels.
#[derive(Clone, Copy, Serialize)]
struct Shrink {
    /// By the diagnosis, over its held-out trials; null without one.
    predicted: Option<f64>,
    /// On the device, in this trial.
    achieved: f64,
    /// By the diagnosis' finer model with the same settings, in this trial.
    finer_model: f64,
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

/// A parameter that is set otherwise than the diagnosis says.
#[derive(Serialize)]
struct Difference {
    key: &'static str,
    kind: Kind,
    diagnosed: f32,
    set: f32,
}

#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// Diagnosed, and as rig.toml states it.
    Missing,
    /// Set, and not diagnosed.
    Extra,
    OtherValue,
}

pub fn run(ui: &Ui, arguments: &VerifyArguments) -> Result<(), Failure> {
    let bundle = crate::open::open_bundle(ui, &arguments.bundle)?;
    let explanation = arguments.diagnosis.as_deref().map(Explanation::read).transpose()?;
    if let Some(explanation) = &explanation {
        explanation.check_rig(&bundle)?;
    }
    let options = options(ui, &bundle, arguments, explanation.as_ref())?;
    let (number, trial, fresh) = choose(&bundle, arguments, explanation.as_ref())?;
    if let Some(out) = &arguments.out {
        check_recording(out, arguments.overwrite)?;
    }
    let differences = match &explanation {
        Some(explanation) => differences(&bundle, &options, &explanation.parameters()?)?,
        None => Vec::new(),
    };
    warn_of(ui, &differences);
    let catheter = super::source::catheter(&bundle)?;
    let wide: Vec<(String, f64)> =
        options.parameters.iter().map(|(key, value)| (key.clone(), f64::from(*value))).collect();
    let nothing_of = |e| Failure::input(format!("{}: {e}", bundle.path.display()));
    let objections = catheter.objections(number, &wide).map_err(nothing_of)?;
    for objection in &objections {
        ui.warn(format_args!("{}: trial {number:03}: {objection}", bundle.path.display()));
    }
    let nominal = ImageOptions { parameters: Vec::new(), band: None, ..options.clone() };
    let (before, _) = crate::image::image_with(ui, &bundle, &nominal)?;
    let (after, _) = crate::image::image_with(ui, &bundle, &options)?;

    let played = play_both(ui, arguments, &bundle, (number, trial), [&before, &after])?;

    let runs = Runs { before: &played.before, after: &played.after };
    let achieved = catheter.achieved(number, &wide, runs).map_err(nothing_of)?;
    let predicted = explanation.as_ref().and_then(Explanation::shrink);
    let shrink = achieved.shrink.filter(|_| objections.is_empty());
    let shrink = shrink.map(|own| Shrink {
        predicted,
        achieved: own.achieved,
        finer_model: own.finer_model,
    });
    let outcome = Outcome::of(achieved.energy, predicted, objections.is_empty());
    let promised = explanation.as_ref().and_then(|own| own.gap.force_rms_n).map(Promised::from);
    let verified = Verified {
        outcome,
        sentence: outcome.sentence(achieved.energy, predicted),
        rig: bundle.rig.name.clone(),
        trial: number,
        fresh,
        link: arguments.link.clone(),
        board: played.board,
        settings: options.parameters,
        differences,
        objections,
        notes: notes(fresh, number, &achieved, options.band.is_some()),
        achieved,
        shrink,
        promised,
        differing_bits: played.differing_bits,
    };
    ui.data(&verified, verified.text(ui))?;
    verified.check(arguments.fail_above)
}

/// Warns where the settings are not those that the diagnosis names.
fn warn_of(ui: &Ui, differences: &[Difference]) {
    if !differences.is_empty() {
        let list = differences.iter().map(Difference::text).collect::<Vec<_>>().join("; ");
        ui.warn(format_args!(
            "the settings are not what the diagnosis names: {list}\n  fix: `cathforce gap apply` \
             writes what it names"
        ));
    }
}

/// Both runs of one trial on the device.
struct Played {
    board: String,
    before: Vec<Estimate>,
    after: Vec<Estimate>,
    /// Between the device and its replay on this host, both runs.
    differing_bits: u64,
}

/// Plays a trial as rig.toml states the rig and with the settings. `images`: in this order.
fn play_both(
    ui: &Ui,
    arguments: &VerifyArguments,
    bundle: &Bundle,
    (number, trial): (u32, &cathforce_bundle::Trial),
    images: [&[u8]; 2],
) -> Result<Played, Failure> {
    let link = &arguments.link;
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let board = client.device().board.clone();
    let folder = temporary_folder()?;
    let run = TrialRun {
        bundle,
        number,
        trial,
        link,
        pace: Pace::LockStep,
        duration_s: arguments.duration,
        feel: Feel::Catheter,
        overwrite: false,
        sensor: None,
        watch: None,
    };
    ui.say("as rig.toml states the rig:");
    let file = folder.path().join("before.mcap");
    let (before, bits) = estimated(ui, &mut client, run, images[0], &file)?;
    ui.say("with the settings:");
    let file = arguments.out.clone().unwrap_or_else(|| folder.path().join("after.mcap"));
    let run = TrialRun { overwrite: arguments.overwrite, ..run };
    let (after, more_bits) = estimated(ui, &mut client, run, images[1], &file)?;
    Ok(Played { board, before, after, differing_bits: bits + more_bits })
}

/// The settings to verify: those that are given, else those of the diagnosis.
fn options(
    ui: &Ui,
    bundle: &Bundle,
    arguments: &VerifyArguments,
    explanation: Option<&Explanation>,
) -> Result<ImageOptions, Failure> {
    let mut options = crate::image::options(ui, bundle, &arguments.changes)?;
    if let (true, Some(explanation)) = (options.parameters.is_empty(), explanation) {
        let fitted = explanation.fitted()?;
        options.parameters = fitted.iter().map(|own| (own.key.to_owned(), own.value)).collect();
        if let Some(stated) = stated_band(bundle, explanation, &fitted)? {
            let description = described(bundle, &options)?;
            options.band = stated.for_model(ui, &description, &by_hand(&arguments.changes));
        }
    }
    if options.parameters.is_empty() {
        let message = "no effect is switched on, so there is nothing to verify: give --settings \
                       (from `cathforce gap apply`), --diagnosis or --set";
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(options)
}

/// Where settings are others than the diagnosis names, parameter by parameter.
fn differences(
    bundle: &Bundle,
    options: &ImageOptions,
    fitted: &[Fitted],
) -> Result<Vec<Difference>, Failure> {
    let named = fitted.iter().map(|own| (own.key.to_owned(), own.value)).collect();
    let of =
        |parameters| described(bundle, &ImageOptions { parameters, ..ImageOptions::default() });
    let (nominal, named, set) = (of(Vec::new())?, of(named)?, of(options.parameters.clone())?);
    let difference = |key: &'static str| {
        let nominal = nominal.parameter(key)?;
        let (diagnosed, set) = (named.parameter(key)?, set.parameter(key)?);
        let kind = match () {
            () if set == diagnosed => return None,
            () if set == nominal => Kind::Missing,
            () if diagnosed == nominal => Kind::Extra,
            () => Kind::OtherValue,
        };
        Some(Difference { key, kind, diagnosed, set })
    };
    Ok(parameters().filter_map(|info| difference(info.key)).collect())
}

/// The trial to play, and whether the diagnosis has not seen it.
fn choose<'a>(
    bundle: &'a Bundle,
    arguments: &VerifyArguments,
    explanation: Option<&Explanation>,
) -> Result<(u32, &'a cathforce_bundle::Trial, Option<bool>), Failure> {
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

fn notes(fresh: Option<bool>, trial: u32, achieved: &Achieved, has_band: bool) -> Vec<String> {
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
    for (label, left) in quantities(achieved) {
        if is_larger(left.before.max(left.floor).powi(2), left.achieved.powi(2)) {
            notes.push(format!("the error of the {label} is larger than before"));
        }
    }
    if has_band && achieved.coverage.is_none() {
        notes.push("the device has a band, and none for any force that was compared".to_owned());
    }
    notes
}

/// What was compared.
fn quantities(achieved: &Achieved) -> impl Iterator<Item = (&'static str, Left)> {
    let all = [
        ("force", achieved.force_rms_n),
        ("drive force", achieved.drive_force_rms_n),
        ("tip", achieved.tip_rms_m),
    ];
    all.into_iter().filter_map(|(label, left)| Some((label, left?)))
}

impl Difference {
    fn text(&self) -> String {
        let Self { key, kind, diagnosed, set } = self;
        match kind {
            Kind::Missing => format!("{key} = {diagnosed} is missing"),
            Kind::Extra => format!("{key} = {set} is not among it"),
            Kind::OtherValue => format!("{key} = {set}, diagnosed {diagnosed}"),
        }
    }
}

/// Which program and which precision each column is of.
const MODELS: [(&str, &str); 4] = [
    ("before", "device as rig.toml states the rig (single precision, 1 ms tick)"),
    ("achieved", "device with the settings (single precision, 1 ms tick)"),
    ("floor", "noise floor of this trial"),
    (
        "finer model",
        "finer model of the diagnosis with the settings (double precision, on this host)",
    ),
];

impl Verified {
    fn text(&self, ui: &Ui) -> String {
        let fresh = match self.fresh {
            Some(true) => ", which the diagnosis has not seen",
            _ => "",
        };
        let mut text = format!("{}\n", ui.bold(&self.sentence));
        text += &format!("{} trial {:03}{fresh}, on {}\n", self.rig, self.trial, self.board);
        text += "                   before    achieved       floor  finer model\n";
        for (label, left) in quantities(&self.achieved) {
            let Left { before, achieved, finer_model, floor } = left;
            let unit = if label == "tip" { "mm" } else { "mN" };
            text += &format!("{:<16}", format!("{label}, {unit}"));
            for value in [before, achieved, floor, finer_model] {
                text += &format!("{:>9}   ", significant(1e3 * value, 3));
            }
            text = format!("{}\n", text.trim_end());
        }
        let mut rows: Vec<(String, String)> =
            MODELS.map(|(name, what)| (name.to_owned(), what.to_owned())).to_vec();
        let coverage = self.achieved.coverage.as_ref();
        if let Some(coverage) = coverage.filter(|_| self.objections.is_empty()) {
            rows.push(("within the band".to_owned(), super::band_text::text(coverage)));
            rows.push(("covered by it".to_owned(), super::band_text::stated(coverage)));
        }
        if let Some(Shrink { predicted, achieved, finer_model }) = self.shrink {
            let predicted = predicted.map_or(String::new(), |share| {
                format!("{} predicted by the diagnosis, ", percent(share))
            });
            let share = |share: f64| match share {
                share if share < 0.0 => "none".to_owned(),
                share => percent(share),
            };
            let closed = format!(
                "{predicted}{} achieved on the device, {} by the finer model; shares of the gap above \
                 the floor in all channels",
                share(achieved),
                share(finer_model)
            );
            rows.push(("gap closed".to_owned(), closed));
        }
        if let Some(Promised { before, after, floor }) = self.promised {
            rows.push((
                "promised".to_owned(),
                format!(
                    "force from {}, floor {}, over the held-out trials of the diagnosis",
                    from_to(before, after, "N"),
                    quantity(floor, "N")
                ),
            ));
        }
        rows.push((
            "bit identity".to_owned(),
            format!(
                "{} bits differ between the device and its replay on this host (single precision)",
                self.differing_bits
            ),
        ));
        let difference = |own: &Difference| ("not as diagnosed".to_owned(), own.text());
        rows.extend(self.differences.iter().map(difference));
        rows.extend(self.objections.iter().map(|why| ("no conclusion".to_owned(), why.clone())));
        rows.extend(self.notes.iter().map(|note| ("note".to_owned(), note.clone())));
        text + &two_columns(&rows)
    }

    /// Fails with the code of a missed threshold.
    fn check(&self, limit_n: Option<f64>) -> Result<(), Failure> {
        let Some(limit) = limit_n else { return Ok(()) };
        let missed = |message: String| Err(Failure::new(Code::Threshold, message));
        match (self.objections.first(), self.achieved.force_rms_n) {
            (Some(why), _) => missed(format!("nothing can be compared with --fail-above: {why}")),
            (None, Some(Left { achieved, .. })) if achieved <= limit => Ok(()),
            (None, Some(Left { achieved, .. })) => missed(format!(
                "the force RMS on the device is {achieved:.4} N, above rms_N={limit}"
            )),
            (None, None) => {
                missed("no force was measured that could be compared with --fail-above".to_owned())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cathforce_gap::catheter::Energy;

    use super::*;

    #[test]
    fn every_figure_says_which_program_and_which_precision_it_is_of() {
        let left =
            Left { before: 0.0381, achieved: 0.010_412, finer_model: 0.010_3, floor: 0.0078 };
        let verified = Verified {
            outcome: Outcome::AsPromised,
            sentence: String::new(),
            rig: "rig".to_owned(),
            trial: 3,
            fresh: None,
            link: "sim".to_owned(),
            board: "board".to_owned(),
            settings: Vec::new(),
            differences: Vec::new(),
            objections: Vec::new(),
            achieved: Achieved {
                force_rms_n: Some(left),
                drive_force_rms_n: None,
                tip_rms_m: None,
                energy: Energy { before: 20.0, achieved: 1.7 },
                shrink: None,
                coverage: None,
                samples: 100,
            },
            shrink: Some(Shrink { predicted: Some(0.996), achieved: 0.95, finer_model: 0.96 }),
            promised: None,
            differing_bits: 0,
            notes: Vec::new(),
        };
        let text = verified.text(&Ui::new(false, true));
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "before achieved floor finer model force, mN 38.1 10.4 7.80 10.3",
            "achieved device with the settings (single precision, 1 ms tick)",
            "finer model of the diagnosis with the settings (double precision",
            "99.6 % predicted by the diagnosis, 95 % achieved on the device, 96 % by the finer model",
            "0 bits differ between the device and its replay on this host (single precision)",
        ] {
            assert!(words.contains(part), "{part} in {words}");
        }
        assert!(!text.contains("this host:"), "{text}");
    }
}
