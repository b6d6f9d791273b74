//! `cathforce gap ablation`: is each named effect found again, once it is missing in a model that has
//! the others?

use cathforce_gap::plant::Plant;
use cathforce_gap::report::{Diagnosis, NamedEffect, Verdict};
use cathforce_gap::{Altered, diagnose};
use serde::Serialize;

use super::source::Source;
use crate::args::AblationArguments;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// What was named when one effect was missing.
#[derive(Serialize)]
struct Row {
    missing: String,
    verdict: Verdict,
    /// The largest first.
    named: Vec<String>,
    shrink: f64,
    /// Whether the missing effect comes first, or is not told apart from what does.
    found: bool,
}

pub fn run(ui: &Ui, arguments: &AblationArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let source = Source::open(ui, &arguments.bundle)?;
    let plant = source.plant()?;
    let name = source.bundle.rig.name.as_str();
    let whole = diagnose(plant.as_ref(), name, &cathforce_gap::unwatched);
    ui.say(format_args!("{}", whole.sentence()));
    if whole.effects.is_empty() {
        let message = format!(
            "{}: no effect is named, so none can be taken out\n  fix: see `cathforce gap diagnose`",
            arguments.bundle.display()
        );
        return Err(Failure::new(Code::Failed, message));
    }
    let rows: Vec<Row> = whole
        .effects
        .iter()
        .map(|missing| {
            let row = Row::of(plant.as_ref(), name, &whole, missing);
            ui.say(format_args!("without {}: {}", row.missing, row.named.join(", ")));
            row
        })
        .collect();
    let lines: String = rows.iter().map(Row::text).collect();
    let head = "| missing | named | closes | found |\n| --- | --- | --- | --- |\n";
    arguments.json_file.write(ui, &rows, format!("{head}{lines}"))
}

impl Row {
    fn of(plant: &dyn Plant, name: &str, whole: &Diagnosis, missing: &NamedEffect) -> Self {
        let kept = whole.values(plant);
        let kept: Vec<(&str, &[f64])> = kept
            .iter()
            .filter(|(id, _)| *id != missing.id)
            .map(|(id, values)| (id.as_str(), values.as_slice()))
            .collect();
        let answer = diagnose(&Altered::assuming(plant, &kept), name, &cathforce_gap::unwatched);
        let named: Vec<String> = answer.effects.iter().map(|effect| effect.id.clone()).collect();
        let found = named.first().is_some_and(|first| {
            let alike = |set: &Vec<String>| set.first() == Some(first) && set.contains(&missing.id);
            *first == missing.id || answer.confusable.iter().any(alike)
        });
        let shrink = answer.details.shrink;
        Self { missing: missing.id.clone(), verdict: answer.verdict, named, shrink, found }
    }

    fn text(&self) -> String {
        let named = match self.named.as_slice() {
            [] => "–".to_owned(),
            named => named.join(", "),
        };
        let found = if self.found { "yes" } else { "no" };
        format!("| {} | {named} | {:.0} % | {found} |\n", self.missing, 100.0 * self.shrink)
    }
}
