//! `cathforce gap diagnose`: where the gap lies, which effect causes it, how far it shrinks.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use cathforce_gap::report::{Diagnosis, Estimate, Figures, Reproduce};
use cathforce_gap::{diagnose, expected_simulations, page};

use crate::args::DiagnoseArguments;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    let path = &arguments.bundle;
    let bundle = super::super::open_bundle(ui, path)?;
    let plant = super::plant(&bundle)?;
    ui.say(format_args!("compared: {}", plant.compared()));
    let progress = ui.progress("diagnosing", expected_simulations(plant.as_ref()), "simulations");
    let progress = Mutex::new(progress);
    let mut answer = diagnose(plant.as_ref(), &bundle.rig.name, &|done| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(done as u64);
        }
    });
    drop(progress);
    answer.remarks.extend(bundle.warnings.iter().map(|warning| warning.to_string()));
    answer.reproduce = Reproduce {
        command: format!("cathforce gap diagnose {}", path.display()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        bundle_sha256: super::hash::of_bundle(path)
            .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?,
    };
    write(ui, &answer, arguments)?;
    if let Some(file) = &arguments.report {
        std::fs::write(file, page(&answer)).map_err(|e| Failure::write(file, e))?;
        ui.say(format_args!("page: {}", file.display()));
    }
    check(&answer, arguments.fail_above)
}

fn write(ui: &Ui, answer: &Diagnosis, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    match arguments.json.as_deref() {
        None | Some("-") => ui.data(answer, text(answer))?,
        Some(file) => {
            let file = Path::new(file);
            let json = serde_json::to_string_pretty(answer)
                .map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))?;
            std::fs::write(file, json + "\n").map_err(|e| Failure::write(file, e))?;
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
        for (name, Estimate { value, low, high, unit }) in &effect.parameters {
            line(format!("    {name} = {value:.5} {unit} (90 %: {low:.5} to {high:.5})"));
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
