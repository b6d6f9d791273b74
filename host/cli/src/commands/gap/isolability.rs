//! `cathforce gap isolability`: what trials can tell, before anything is measured.

use std::ops::ControlFlow;
use std::sync::Mutex;

use cathforce_gap::catheter::planned;
use cathforce_gap::isolability::{
    Isolability, Pair, RESERVE, SEEN, Size, Visibility, expected_simulations, isolability,
};
use cathforce_gap::plant::BROKEN_DOWN;
use cathforce_gap::rounding::significant;
use serde::Serialize;

use super::source::Source;
use crate::args::IsolabilityArguments;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

#[derive(Serialize)]
struct Answer {
    rig: String,
    /// "trials" or "protocol".
    motion: &'static str,
    #[serde(flatten)]
    found: Isolability,
    remarks: Vec<String>,
}

pub fn run(ui: &Ui, arguments: &IsolabilityArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let mut source = Source::open(ui, &arguments.bundle)?;
    let way = &arguments.way;
    let is_way_given = way.from_m.is_some() || way.to_m.is_some();
    let canned = arguments.protocol || is_way_given || source.bundle.trials.is_empty();
    if canned {
        let bundle = &source.bundle;
        let protocol = super::protocol::of(bundle, &arguments.way)?;
        source.bundle = planned(bundle, &protocol)
            .map_err(|e| Failure::input(format!("{}: {e}", bundle.path.display())))?;
    }
    let plant = source.plant()?;
    let progress = ui.progress("playing", expected_simulations(plant.as_ref()), "simulations");
    let progress = Mutex::new(progress);
    let found = isolability(plant.as_ref(), &|done| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(done as u64);
        }
        ControlFlow::Continue(())
    });
    drop(progress);
    let found = found.ok_or_else(|| {
        let message = format!(
            "the nominal model of rig.toml breaks down on this motion\n  fix: {BROKEN_DOWN}"
        );
        Failure::new(Code::Failed, message)
    })?;
    let motion = if canned { "protocol" } else { "trials" };
    let remarks = remarks(&found, plant.remarks());
    let answer = Answer { rig: source.bundle.rig.name.clone(), motion, found, remarks };
    arguments.json_file.write(ui, &answer, answer.text(ui))
}

/// What an answer does not say, or only with a reserve.
fn remarks(found: &Isolability, of_plant: &[String]) -> Vec<String> {
    let failed = found.failed.iter().map(|id| format!("{id} could not be simulated"));
    let known = std::iter::once(RESERVE.to_owned()).chain(of_plant.iter().cloned());
    known.chain(failed).collect()
}

impl Answer {
    fn text(&self, ui: &Ui) -> String {
        let Self { rig, motion, found, remarks } = self;
        let title = format!("{rig}, its {motion}");
        let mut text = format!(
            "{}\nat most {:.0} % of the ordered pairs of effects of typical size are told apart\n\n  \
             {:<28}{:>9}  seen from\n",
            ui.bold(&title),
            100.0 * found.told_apart,
            "effect",
            "distance"
        );
        for Visibility { id, distance, smallest } in &found.effects {
            let seen = match smallest {
                Some(sizes) => sizes.iter().map(size).collect::<Vec<_>>().join(", "),
                None => "not at any size within its bounds".to_owned(),
            };
            text += &format!("  {id:<28}{distance:>9.1}  {seen}\n");
        }
        text += &format!(
            "\n  distance: of one standard deviation of its prior, in standard deviations of the \
             data; seen from {SEEN} on\n"
        );
        let mut near: Vec<&Pair> =
            found.pairs.iter().filter(|pair| pair.distance < SEEN && self.is_seen(pair)).collect();
        near.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        if !near.is_empty() {
            text += "\n  seen, but not told from another\n";
        }
        for Pair { effect, rival, distance } in near {
            text += &format!("  {effect:<28}{distance:>9.1}  {rival}\n");
        }
        for remark in remarks {
            text += &format!("  note: {remark}\n");
        }
        text
    }

    /// Whether the pair's effect is seen at all at its typical size.
    fn is_seen(&self, pair: &Pair) -> bool {
        self.found.effects.iter().any(|own| own.id == pair.effect && own.distance >= SEEN)
    }
}

fn size(Size { name, off, value, unit }: &Size) -> String {
    let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
    let (less, change) = (value < off, significant((value - off).abs(), 2));
    if *off == 0.0 {
        return format!("{name} {}{change}{unit}", if less { "−" } else { "" });
    }
    let off = (1e4 * off).round() / 1e4;
    format!("{name} {off} {} {change}{unit}", if less { "−" } else { "+" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_says_what_is_in_no_distance() {
        let found = Isolability {
            effects: Vec::new(),
            pairs: Vec::new(),
            told_apart: 0.0,
            failed: Vec::new(),
        };
        let remarks = remarks(&found, &["of the plant".to_owned()]);
        let answer = Answer { rig: "rig".to_owned(), motion: "trials", found, remarks };
        let text = answer.text(&Ui::new(false, false));
        assert!(text.contains("note: distances are linearised"), "{text}");
        assert!(text.contains("upper bounds") && text.contains("note: of the plant"), "{text}");
        let json = serde_json::to_value(&answer).expect("plain data");
        assert_eq!(json["remarks"][0], RESERVE);
    }
}
