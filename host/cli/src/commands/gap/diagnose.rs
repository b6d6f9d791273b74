//! `cathforce gap diagnose`: where the gap lies, which effect causes it, how far it shrinks.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use cathforce_effects::Effect;
use cathforce_gap::plant::Plant;
use cathforce_gap::report::{Diagnosis, Figures, Reproduce};
use cathforce_gap::{diagnose, diagnose_given, expected_simulations, page};
use cathforce_rig::Bundle;

use super::source::Source;
use crate::args::DiagnoseArguments;
use crate::failure::{Code, Failure};
use crate::output::write_again;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    let source = Source::open_all(ui, &arguments.bundle)?;
    let answer = answer(ui, source, &arguments.hold_back, &arguments.effects)?;
    write(ui, &answer, arguments)?;
    if let Some(file) = &arguments.report {
        write_again(file, page(&answer))?;
        ui.say(format_args!("page: {}", file.display()));
    }
    check(&answer, arguments.fail_above)
}

/// Diagnoses a rig's trials without some of its trials; with `effects`, fits those and no others.
pub fn answer(
    ui: &Ui,
    mut source: Source,
    hold_back: &[u32],
    effects: &[&Effect],
) -> Result<Diagnosis, Failure> {
    let bundle_sha256 = source.hash()?;
    hold_trials_back(&mut source.bundle, hold_back)?;
    let plant = source.plant()?;
    let bundle = &source.bundle;
    let given = effects.iter().map(|effect| index(plant.as_ref(), effect));
    let given = given.collect::<Result<Vec<usize>, Failure>>()?;
    ui.say(format_args!("compared: {}", plant.compared()));
    let progress = ui.progress("diagnosing", expected_simulations(plant.as_ref()), "simulations");
    let progress = Mutex::new(progress);
    let tell = |done| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(done as u64);
        }
    };
    let name = &bundle.rig.name;
    let mut answer = match given.as_slice() {
        [] => diagnose(plant.as_ref(), name, &tell),
        given => diagnose_given(plant.as_ref(), name, given, &tell),
    };
    drop(progress);
    answer.remarks.extend(bundle.warnings.iter().map(|warning| warning.to_string()));
    let mut command = "cathforce gap diagnose".to_owned();
    // Writing to a string does not fail.
    for path in &source.paths {
        let _ = write!(command, " {}", path.display());
    }
    for trial in hold_back {
        let _ = write!(command, " --hold-back {trial}");
    }
    for effect in effects {
        let _ = write!(command, " --effect {}", effect.id);
    }
    answer.reproduce = Reproduce {
        command,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        bundle_sha256,
        held_back: hold_back.to_vec(),
    };
    Ok(answer)
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
    bundle.trials.retain(|trial| !hold_back.contains(&trial.number));
    Ok(())
}

/// Where a plant has an effect.
fn index(plant: &dyn Plant, effect: &Effect) -> Result<usize, Failure> {
    plant.effects().iter().position(|own| own.id == effect.id).ok_or_else(|| {
        let own: Vec<&str> = plant.effects().iter().map(|own| own.id).collect();
        let message = format!("this rig cannot have {}; it can have {}", effect.id, own.join(", "));
        Failure::new(Code::Usage, message)
    })
}

fn write(ui: &Ui, answer: &Diagnosis, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    match arguments.json.as_deref() {
        None | Some("-") => ui.data(answer, text(answer))?,
        Some(file) => {
            let file = Path::new(file);
            let json = serde_json::to_string_pretty(answer)
                .map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))?;
            write_again(file, json + "\n")?;
            ui.say(text(answer));
        }
    }
    Ok(())
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
    let mut text = format!("{}\n", answer.sentence());
    let put = &mut text;
    // Writing to a string does not fail.
    let mut line = |l: String| {
        let _ = writeln!(put, "{l}");
    };
    for effect in &answer.effects {
        let kind = if effect.material { "material" } else { "minor" };
        line(format!(
            "  {:<22} closes {:.1} %, confidence {:.2}, {kind}",
            effect.id,
            100.0 * effect.shrink,
            effect.confidence
        ));
        for (name, estimate) in &effect.parameters {
            let ([value, low, high], unit) = (estimate.digits(), estimate.unit);
            line(format!("    {name} = {value} {unit} (90 %: {low} to {high})"));
        }
    }
    for set in &answer.confusable {
        line(format!("  cannot be told apart on this data: {}", set.join(", ")));
    }
    for held_out in &answer.details.held_out {
        line(format!(
            "  trial {:03}, held out: {:.4} N RMS before, {:.4} N after",
            held_out.trial, held_out.before_n, held_out.after_n
        ));
    }
    if let Some(f) = answer.gap.force_rms_n {
        line(format!("  floor: {:.4} N RMS", f.floor));
    }
    if let Some(band) = &answer.band {
        line(format!("  nine of ten forces within: {}", super::coverage::text(&band.coverage)));
    }
    for place in answer.places.iter().take(5) {
        line(format!(
            "  {:.0} % of the gap in {:.0} % of the time: {}, {}, {}{}{}",
            100.0 * place.gap_share,
            100.0 * place.time_share,
            place.channel,
            place.phase,
            place.regime,
            if place.note.is_empty() { "" } else { "; " },
            place.note
        ));
    }
    if let Some(next) = &answer.next_experiment {
        line(format!(
            "  record next: {} ({}), which separates {}",
            next.segment,
            next.what,
            next.separates.join(" from ")
        ));
    }
    for remark in &answer.remarks {
        line(format!("  note: {remark}"));
    }
    text
}
