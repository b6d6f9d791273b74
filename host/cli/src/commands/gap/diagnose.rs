//! `cathforce gap diagnose`: where the gap lies, which effect causes it, how far it shrinks.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use cathforce_bundle::{Bundle, Trial};
use cathforce_effect_catalogue::Effect;
use cathforce_gap::plant::Plant;
use cathforce_gap::report::{
    Detectable, Diagnosis, Figures, HeldOut, Reproduce, Verdict, quantity,
};
use cathforce_gap::rounding::percent;
use cathforce_gap::{diagnose, diagnose_given, expected_simulations};
use cathforce_pages::diagnosis_page;

use super::hash::own_sha256;
use super::source::Source;
use super::watched::{Onlooker, Watched};
use crate::args::DiagnoseArguments;
#[cfg(not(feature = "dash"))]
use crate::commands::web;
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, check_apart, write_again};
use crate::session::interrupt_flag;
use crate::ui::Ui;
#[cfg(feature = "dash")]
use crate::web;

pub fn run(ui: &Ui, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    // Said now: a diagnosis takes minutes.
    let (json, page_file) = (&arguments.json_file, arguments.report.as_deref());
    check_apart(json.out.as_deref().into_iter().chain(page_file))?;
    json.check()?;
    page_file.map_or(Ok(()), |file| check_again(file, Kind::Page))?;
    let effects = super::names::effects(arguments.effects.iter().map(String::as_str))?;
    let source = Source::open_all(ui, &arguments.bundle)?;
    let diagnose = |onlooker: Option<&dyn Onlooker>| {
        let search = Search { hold_back: &arguments.hold_back, effects: &effects, onlooker };
        let answer = search.answer(ui, source, arguments.budget)?;
        let written = json.write(ui, &answer, text(&answer));
        if let Some(file) = &arguments.report {
            write_again(file, Kind::Page, diagnosis_page(&answer))?;
            ui.say(format_args!("page: {}", file.display()));
        }
        written?;
        check(&answer, arguments.fail_above)
    };
    match arguments.dash {
        None => diagnose(None),
        Some(listen) => {
            let name = arguments.bundle.first().map(|path| path.display().to_string());
            web::while_diagnosing(ui, listen, &name.unwrap_or_default(), |page| {
                diagnose(Some(page))
            })
        }
    }
}

/// What is sought, and who looks on.
#[derive(Clone, Copy, Default)]
pub struct Search<'a> {
    /// Numbers of trials that are left out.
    pub hold_back: &'a [u32],
    /// Fits these effects and no others.
    pub effects: &'a [&'a Effect],
    pub onlooker: Option<&'a dyn Onlooker>,
}

impl Search<'_> {
    /// Diagnoses a rig's trials. `budget`: ends the search with the best answer so far.
    pub fn answer(
        self,
        ui: &Ui,
        mut source: Source,
        budget: Option<Duration>,
    ) -> Result<Diagnosis, Failure> {
        let Self { hold_back, effects, onlooker } = self;
        let (start, interrupted) = (Instant::now(), interrupt_flag()?);
        let reproduce = reproduce(&source, hold_back, effects)?;
        let seen = seen(&source.bundle.trials, hold_back);
        hold_trials_back(&mut source.bundle, hold_back)?;
        let plant = source.plant()?;
        let bundle = &source.bundle;
        let given = indices(plant.as_ref(), effects)?;
        ui.say(format_args!("compared: {}", plant.compared()));
        let expected = expected_simulations(plant.as_ref());
        if let Some(onlooker) = onlooker {
            onlooker.begins(expected, budget);
        }
        let progress = Mutex::new(ui.progress("diagnosing", expected, "simulations"));
        let watched = Watched { progress, start, budget, interrupted, onlooker };
        let name = &bundle.rig.name;
        let mut answer = match given.as_slice() {
            [] => diagnose(plant.as_ref(), name, &watched),
            given => diagnose_given(plant.as_ref(), name, given, &watched),
        };
        drop(watched);
        answer.remarks.extend(bundle.warnings.iter().map(|warning| warning.to_string()));
        answer.remarks.extend(seen);
        answer.reproduce = reproduce;
        onlooker.map_or(Ok(()), |onlooker| onlooker.ends(&answer))?;
        Ok(answer)
    }
}

/// How to get an answer to these files again.
pub fn reproduce(
    source: &Source,
    hold_back: &[u32],
    effects: &[&Effect],
) -> Result<Reproduce, Failure> {
    Ok(Reproduce {
        command: command(&source.paths, hold_back, effects),
        version: format!("{} (SHA-256 {:.16}…)", env!("CARGO_PKG_VERSION"), own_sha256()?),
        bundle_sha256: source.hash()?,
        held_back: hold_back.to_vec(),
    })
}

/// What a shell takes to do the same again.
fn command(paths: &[PathBuf], hold_back: &[u32], effects: &[&Effect]) -> String {
    let words = ["cathforce", "gap", "diagnose"].map(str::to_owned).into_iter();
    let paths = paths.iter().map(|path| path.display().to_string());
    let hold_back = hold_back.iter().flat_map(|n| ["--hold-back".to_owned(), n.to_string()]);
    let effects = effects.iter().flat_map(|effect| ["--effect", effect.id].map(str::to_owned));
    let words: Vec<String> = words.chain(paths).chain(hold_back).chain(effects).collect();
    // No argument of a program holds the one character that cannot be quoted.
    shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "))
}

/// Says of each trial that was held back whether it is a copy of one that was not.
fn seen(trials: &[Trial], hold_back: &[u32]) -> Vec<String> {
    let is_held_back = |trial: &&Trial| hold_back.contains(&trial.number);
    let copied = trials.iter().filter(is_held_back).filter_map(|trial| {
        let mut kept = trials.iter().filter(|own| !is_held_back(own));
        let original = kept.find(|own| own.data == trial.data)?;
        Some(format!(
            "trial {:03}, which is held back, has the same readings as trial {:03} in every row: it is \
             a copy, so the diagnosis has seen it",
            trial.number, original.number
        ))
    });
    copied.collect()
}

pub fn hold_trials_back(bundle: &mut Bundle, hold_back: &[u32]) -> Result<(), Failure> {
    if let Some(absent) = hold_back.iter().find(|&&number| bundle.trial(number).is_none()) {
        let there: Vec<_> = bundle.trials.iter().map(|t| format!("{:03}", t.number)).collect();
        let message = format!(
            "{}: there is no trial {absent:03} to hold back, there are: {}",
            bundle.path.display(),
            there.join(", ")
        );
        return Err(Failure::input(message));
    }
    if !hold_back.is_empty() && bundle.trials.iter().all(|t| hold_back.contains(&t.number)) {
        let message = format!(
            "{}: every trial is held back, so that nothing is left to fit\n  fix: hold fewer \
             trials back; at least two must be left",
            bundle.path.display()
        );
        return Err(Failure::input(message));
    }
    bundle.trials.retain(|trial| !hold_back.contains(&trial.number));
    Ok(())
}

/// Where a plant has these effects. The error names all that it cannot have.
fn indices(plant: &dyn Plant, effects: &[&Effect]) -> Result<Vec<usize>, Failure> {
    let position = |effect: &Effect| plant.effects().iter().position(|own| own.id == effect.id);
    let absent: Vec<&str> = effects
        .iter()
        .filter(|effect| position(effect).is_none())
        .map(|effect| effect.id)
        .collect();
    if !absent.is_empty() {
        let own: Vec<&str> = plant.effects().iter().map(|own| own.id).collect();
        let message =
            format!("this rig cannot have {}; it can have {}", absent.join(" or "), own.join(", "));
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(effects.iter().filter_map(|effect| position(effect)).collect())
}

/// Fails with the code of a missed threshold.
fn check(answer: &Diagnosis, limit_n: Option<f64>) -> Result<(), Failure> {
    match (limit_n, answer.gap.force_rms_n) {
        (Some(limit), Some(Figures { after, .. })) if after > limit => {
            let message =
                format!("the force RMS after diagnosis is {after:.4} N, above rms_N={limit}");
            Err(Failure::new(Code::Threshold, message))
        }
        (Some(_), None) => Err(Failure::new(
            Code::Threshold,
            "there is no force RMS that could be compared with --fail-above; the remarks say why",
        )),
        _ => Ok(()),
    }
}

/// The answer for a terminal.
fn text(answer: &Diagnosis) -> String {
    let lines = [
        vec![answer.sentence()],
        effects(answer),
        unnoticed(answer),
        figures(answer),
        places(answer),
    ];
    let lines = lines.concat();
    let remarks = answer.remarks.iter().map(|remark| format!("  note: {remark}"));
    lines.into_iter().chain(remarks).map(|line| line + "\n").collect()
}

/// The named effects with their parameters, and what they may be mistaken for.
fn effects(answer: &Diagnosis) -> Vec<String> {
    let mut lines = Vec::new();
    for effect in &answer.effects {
        let kind = if effect.material { "material" } else { "minor" };
        let confidence = effect.confidence.map(|c| format!("confidence {c:.2}, "));
        lines.push(format!(
            "  {:<22} closes {}, {}{kind}",
            effect.id,
            percent(effect.shrink),
            confidence.unwrap_or_default()
        ));
        for (name, estimate) in &effect.parameters {
            let ([value, low, high], unit) = (estimate.digits(), estimate.unit_after());
            lines.push(format!("    {name} = {value}{unit} (90 %: {low} to {high})"));
        }
    }
    let sets = answer.confusable.iter();
    lines.extend(sets.map(|set| format!("  this data cannot tell apart: {}", set.join(", "))));
    lines
}

/// Where nothing was found: from which size on each effect would have been seen.
fn unnoticed(answer: &Diagnosis) -> Vec<String> {
    if !matches!(answer.verdict, Verdict::NoGap | Verdict::Inconclusive) {
        return Vec::new();
    }
    let mut lines = Vec::new();
    if !answer.detectable.is_empty() {
        lines.push("  seen with 90 % probability, had it been there, from:".to_owned());
    }
    let line =
        |own: &Detectable| format!("    {:<28} {} = {}", own.id, own.parameter, own.seen_from());
    lines.extend(answer.detectable.iter().map(line));
    lines
}

/// Errors on held-out data, snaps, and the band of the forces.
fn figures(answer: &Diagnosis) -> Vec<String> {
    let mut lines = Vec::new();
    if !answer.gap.rows().is_empty() {
        lines.push(format!("  before, after and floor of {}:", answer.held_out_trials()));
    }
    for (name, Figures { before, after, floor }, unit) in answer.gap.rows() {
        let [before, after, floor] = [before, after, floor].map(|x| quantity(x, unit));
        lines.push(format!("    {name:<42}  {before:>10}  {after:>10}  {floor:>10}"));
    }
    for HeldOut { trial, before_n, after_n } in &answer.details.held_out {
        let [before, after] = [*before_n, *after_n].map(|x| quantity(x, answer.gap.units.force()));
        let name = format!("{} RMS, trial {trial:03}", answer.gap.units.of_force());
        lines.push(format!("    {name:<42}  {before:>10}  {after:>10}"));
    }
    if let Some(snaps) = &answer.gap.snaps {
        lines.push(format!("  {}", snaps.sentence()));
    }
    if let Some(band) = &answer.band {
        let coverage = &band.coverage;
        lines.push(format!(
            "  held-out forces within the 90 % band: {}",
            super::band_text::text(coverage)
        ));
        lines.push(format!("    {}", super::band_text::stated(coverage)));
    }
    lines
}

/// Where the gap lies, what is left of it, and what to record next.
fn places(answer: &Diagnosis) -> Vec<String> {
    let mut lines = Vec::new();
    for place in answer.places.iter().take(5) {
        lines.push(format!(
            "  {:.0} % of the gap in {:.0} % of the time: {}, {}, {}, {}{}{}",
            100.0 * place.gap_share,
            100.0 * place.time_share,
            place.channel,
            place.phase,
            place.regime,
            place.stretch(),
            if place.note.is_empty() { "" } else { "; in all of that phase: " },
            place.note
        ));
    }
    if let Some(left) = &answer.left {
        lines.push(format!("  left: {}", left.words));
    }
    if let Some(next) = &answer.next_experiment {
        lines.push(format!(
            "  record next: {} ({}), which separates {}",
            next.segment,
            next.what,
            next.separates.join(" from ")
        ));
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_gap::report::{Gap, SnapFigures, SnapsOff};

    use super::*;

    #[test]
    fn a_held_back_trial_that_is_a_copy_was_seen() {
        let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
        let mut trials = Bundle::open(Path::new(example)).unwrap().trials;
        trials.push(Trial { number: 90, ..trials[0].clone() });
        let said = seen(&trials, &[90]);
        assert!(matches!(&said[..], [only] if only.starts_with("trial 090, which is held back")));
        // Both are held back, or neither is.
        assert_eq!(seen(&trials, &[0, 90]), seen(&trials, &[]));
        assert_eq!(seen(&trials, &[]), Vec::<String>::new());
    }

    #[test]
    fn the_terminal_tells_every_figure_and_of_which_trials() {
        let figures = |before| Some(Figures { before, after: 0.1 * before, floor: 0.01 * before });
        let before = SnapsOff { found: 0, additional: 2, insertion_m: None, time_s: None };
        let after =
            SnapsOff { found: 3, additional: 0, insertion_m: Some(6e-4), time_s: Some(0.044) };
        let answer = Diagnosis {
            gap: Gap {
                force_rms_n: figures(0.04),
                force_mae_n: figures(0.03),
                force_peak_n: figures(2.0),
                tip_frechet_m: figures(5e-3),
                snaps: Some(SnapFigures { measured: 3, before, after }),
                ..Gap::default()
            },
            held_out: vec![0, 2],
            ..Diagnosis::unanswered("trials")
        };
        let words = text(&answer).split_whitespace().collect::<Vec<_>>().join(" ");
        for line in [
            "before, after and floor of trials 000, 002, each held out in turn:",
            "force RMS 40.0 mN 4.00 mN 0.400 mN",
            "force, mean absolute error 30.0 mN 3.00 mN 0.300 mN",
            "largest force of a trial 2.00 N 200 mN 20.0 mN",
            "path of the tip, discrete Fréchet distance 5.00 mm 0.500 mm 0.050 mm",
            "snaps measured: 3; of these the model has 0 (2 others) before, \
             3 (0.6 mm and 44 ms off on average, 0 others) after",
        ] {
            assert!(words.contains(line), "{line} in {words}");
        }
        assert!(!words.contains("tip RMS") && !words.contains("shape"), "not measured: {words}");
        let nothing = text(&Diagnosis::unanswered("trials"));
        assert!(!nothing.contains("before") && !nothing.contains("left:"), "{nothing}");
    }

    #[test]
    fn the_command_is_what_a_shell_takes_as_it_was_given() {
        let paths = [PathBuf::from("of today/it's.mcap"), PathBuf::from("plain-1.mcap")];
        let said = command(&paths, &[3], &[]);
        let words = shlex::split(&said).expect("closed quotes");
        let given = ["of today/it's.mcap", "plain-1.mcap", "--hold-back", "3"];
        assert_eq!(words, [&["cathforce", "gap", "diagnose"], &given[..]].concat());
        assert!(said.ends_with(" plain-1.mcap --hold-back 3"), "quoted needlessly: {said}");
    }
}
