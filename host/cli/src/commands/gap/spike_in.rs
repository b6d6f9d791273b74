//! `cathforce gap spike-in`: known effects put into the data of trials. Are they found?

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Plant as RigPlant, TrialData};
use cathforce_gap::plant::Effect;
use cathforce_gap::report::{Diagnosis, Estimate, Verdict};
use cathforce_gap::rounding::shortest;
use cathforce_gap::spike::{Changes, Spike, SpikeError, Spiked};
use cathforce_gap::{catheter, diagnose, drive, transmission};
use cathforce_recording::{make_folder, write_drive, write_transmission, write_trial};
use serde::Serialize;

use super::diagnose::hold_trials_back;
use crate::args::SpikeInArguments;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// One bundle with effects in it, and what was named.
#[derive(Serialize)]
struct Row {
    put_in: Vec<Put>,
    changes: Changed,
    /// `None` where the bundle was only written.
    answer: Option<Answer>,
}

/// One parameter that was put in.
#[derive(Serialize)]
struct Put {
    effect: &'static str,
    parameter: &'static str,
    value: f64,
    unit: &'static str,
    /// What was estimated of it; `None` where its effect is not named.
    estimate: Option<Estimate>,
}

/// Root mean square over all rows of a vector; `None` where not measured.
#[derive(Serialize)]
struct Changed {
    #[serde(rename = "force_N")]
    force_n: Option<f64>,
    #[serde(rename = "drive_force_N")]
    drive_force_n: Option<f64>,
    tip_m: Option<f64>,
    shape_m: Option<f64>,
}

#[derive(Serialize)]
struct Answer {
    verdict: Verdict,
    /// The largest first.
    named: Vec<String>,
    /// Effects that cannot be told from what is named.
    alike: Vec<String>,
    shrink: f64,
    /// Whether every effect that was put in is named, or not told apart from what is.
    found: bool,
}

/// A bundle into which effects can be put.
enum Spiking<'a> {
    Catheter(Box<catheter::Spiking<'a>>),
    Drive(Box<drive::Spiking<'a>>),
    Transmission(Box<transmission::Spiking<'a>>),
}

impl<'a> Spiking<'a> {
    fn new(bundle: &'a Bundle) -> Result<Self, Failure> {
        if matches!(bundle.rig.plant, RigPlant::Transmission(_)) {
            let own = transmission::Spiking::new(bundle).map_err(|e| refused(bundle, &e))?;
            Ok(Self::Transmission(Box::new(own)))
        } else if bundle.catheter().is_some() {
            let own = catheter::Spiking::new(bundle).map_err(|e| refused(bundle, &e))?;
            Ok(Self::Catheter(Box::new(own)))
        } else {
            let own = drive::Spiking::new(bundle).map_err(|e| refused(bundle, &e))?;
            Ok(Self::Drive(Box::new(own)))
        }
    }

    fn effects(&self) -> &[Effect] {
        match self {
            Self::Catheter(own) => own.effects(),
            Self::Drive(own) => own.effects(),
            Self::Transmission(own) => own.effects(),
        }
    }

    fn put_in(&self, spikes: &[Spike]) -> Result<Spiked, SpikeError> {
        match self {
            Self::Catheter(own) => own.put_in(spikes),
            Self::Drive(own) => own.put_in(spikes),
            Self::Transmission(own) => own.put_in(spikes),
        }
    }

    fn diagnose(&self, spiked: &Bundle) -> Result<Diagnosis, Failure> {
        match self {
            Self::Catheter(own) => {
                let plant = own.plant(spiked).map_err(|e| refused(spiked, &e))?;
                Ok(diagnose(&plant, &spiked.rig.name, &cathforce_gap::unwatched))
            }
            Self::Drive(own) => own.diagnose(spiked).map_err(|e| refused(spiked, &e)),
            Self::Transmission(own) => own.diagnose(spiked).map_err(|e| refused(spiked, &e)),
        }
    }
}

pub fn run(ui: &Ui, arguments: &SpikeInArguments) -> Result<(), Failure> {
    let mut bundle = crate::open::open_bundle(ui, &arguments.bundle)?;
    if arguments.out.is_some() && arguments.effects.len() != 1 {
        let message = "--out writes one bundle\n  fix: give one --effect; several effects at once \
                       are joined by `+`";
        return Err(Failure::new(Code::Usage, message));
    }
    let asked_for = arguments.effects.iter().flat_map(|spikes| &spikes.0);
    super::names::effects(asked_for.map(|spike| spike.id.as_str()))?;
    hold_trials_back(&mut bundle, &arguments.hold_back)?;
    let spiking = Spiking::new(&bundle)?;
    let each = |effect: &Effect| vec![Spike { id: effect.id.to_owned(), parameters: Vec::new() }];
    let cases: Vec<Vec<Spike>> = match arguments.effects.as_slice() {
        [] => spiking.effects().iter().map(each).collect(),
        given => given.iter().map(|spikes| spikes.0.clone()).collect(),
    };
    // What cannot be put in is said before minutes are spent on the others.
    let spiked = cases.iter().map(|spikes| spiking.put_in(spikes)).collect::<Result<Vec<_>, _>>();
    let spiked = spiked.map_err(|e| Failure::new(Code::Usage, e.to_string()))?;
    let mut rows = Vec::new();
    for (spikes, spiked) in cases.iter().zip(&spiked) {
        let answer = match &arguments.out {
            Some(folder) => {
                write(&spiked.bundle, folder)?;
                None
            }
            None => {
                let answer = spiking.diagnose(&spiked.bundle)?;
                ui.say(format_args!("{}: {}", ids(spikes), answer.sentence()));
                Some(answer)
            }
        };
        rows.push(Row::of(spikes, spiked, answer.as_ref()));
    }
    let lines: String = rows.iter().map(Row::text).collect();
    ui.data(&rows, format!("{HEAD}{lines}"))
}

fn refused(bundle: &Bundle, error: &dyn std::fmt::Display) -> Failure {
    Failure::input(format!("{}: {error}", bundle.path.display()))
}

fn ids(spikes: &[Spike]) -> String {
    spikes.iter().map(|spike| spike.id.as_str()).collect::<Vec<_>>().join(" + ")
}

/// The bundle's own files with other trials; `folder` must not be there yet.
fn write(bundle: &Bundle, folder: &Path) -> Result<(), Failure> {
    let trials = bundle.trials.iter().map(|trial| {
        let mut text = Vec::new();
        let written = match &trial.data {
            TrialData::Catheter(_) => {
                write_trial(&super::super::run::recorded(bundle, trial)?, &mut text)
            }
            TrialData::Drive(data) => write_drive(&trial.t_s, data, &mut text),
            TrialData::Transmission(data) => write_transmission(&trial.t_s, data, &mut text),
        };
        written.map_err(|e| Failure::write(folder, e))?;
        Ok((trial.number, text))
    });
    let trials = trials.collect::<Result<Vec<_>, Failure>>()?;
    let fill = |new: &Path| -> io::Result<()> {
        for file in fs::read_dir(&bundle.path)? {
            let file = file?;
            if file.file_type()?.is_file() {
                fs::copy(file.path(), new.join(file.file_name()))?;
            }
        }
        fs::create_dir(new.join("trials"))?;
        for (number, text) in &trials {
            fs::File::create(new.join(format!("trials/{number:03}.csv")))?.write_all(text)?;
        }
        Ok(())
    };
    make_folder(folder, fill).map_err(|e| Failure::write(folder, e))
}

impl Answer {
    fn of(spikes: &[Spike], answer: &Diagnosis) -> Self {
        let named: Vec<String> = answer.effects.iter().map(|effect| effect.id.clone()).collect();
        let mut alike: Vec<String> = answer.confusable.iter().flatten().cloned().collect();
        alike.retain(|id| !named.contains(id));
        alike.sort_unstable();
        alike.dedup();
        let is_there = |id: &String| {
            let set_of = |set: &Vec<String>| set.contains(id) && named.contains(&set[0]);
            named.contains(id) || answer.confusable.iter().any(set_of)
        };
        // One effect is found where it comes first.
        let found = match (spikes, named.first()) {
            (_, None) => false,
            ([only], Some(first)) => {
                let set_of = |set: &Vec<String>| set.contains(first) && set.contains(&only.id);
                *first == only.id || answer.confusable.iter().any(set_of)
            }
            (several, _) => several.iter().all(|spike| is_there(&spike.id)),
        };
        Self { verdict: answer.verdict, shrink: answer.details.shrink, named, alike, found }
    }
}

const HEAD: &str = "| put in | changes force, drive force, tip, shape by | named | closes | not told \
                    apart | found | within 90 % |\n| --- | --- | --- | --- | --- | --- | --- |\n";

impl Row {
    fn of(spikes: &[Spike], spiked: &Spiked, answer: Option<&Diagnosis>) -> Self {
        let estimate = |id: &str, name: &str| {
            let effect = answer?.effects.iter().find(|effect| effect.id == id)?;
            effect.parameters.get(name).cloned()
        };
        let put = |&(effect, parameter, value, unit): &_| Put {
            effect,
            parameter,
            value,
            unit,
            estimate: estimate(effect, parameter),
        };
        let Changes { force_n, drive_force_n, tip_m, shape_m } = spiked.changes;
        Self {
            put_in: spiked.parameters.iter().map(put).collect(),
            changes: Changed { force_n, drive_force_n, tip_m, shape_m },
            answer: answer.map(|answer| Answer::of(spikes, answer)),
        }
    }

    /// A row of Markdown.
    fn text(&self) -> String {
        let mut put_in = String::new();
        for of_one in self.put_in.chunk_by(|a, b| a.effect == b.effect) {
            let value = |put: &Put| format!("{} {}", put.parameter, shortest(put.value, DIGITS));
            let values: Vec<String> = of_one.iter().map(value).collect();
            let joint = if put_in.is_empty() { "" } else { " + " };
            put_in += &format!("{joint}{} ({})", of_one[0].effect, values.join(", "));
        }
        let scaled = |value: Option<f64>, unit: &str| match value {
            None => "–".to_owned(),
            // Only an axis has such forces.
            Some(value) if value >= 1.0 => format!("{value:.1} {}", &unit[1..]),
            Some(value) => format!("{:.1} {unit}", 1e3 * value),
        };
        let Changed { force_n, drive_force_n, tip_m, shape_m } = self.changes;
        let changes = [
            scaled(force_n, "mN"),
            scaled(drive_force_n, "mN"),
            scaled(tip_m, "mm"),
            scaled(shape_m, "mm"),
        ];
        let answer = self.answer.as_ref().map_or(" – | – | – | – |".to_owned(), Answer::cells);
        let estimates =
            self.put_in.iter().filter_map(|put| Some((put.value, put.estimate.as_ref()?)));
        let within = |(value, own): &(f64, &Estimate)| (own.low..=own.high).contains(value);
        let (all, within) = (estimates.clone().count(), estimates.filter(within).count());
        format!("| {put_in} | {} |{answer} {within} of {all} |\n", changes.join(", "))
    }
}

/// Significant digits of a parameter.
const DIGITS: u8 = 4;
/// Effects that a table's cell lists; of more it says how many.
const MOST_LISTED: usize = 4;

impl Answer {
    fn cells(&self) -> String {
        let named = match (self.verdict, self.named.as_slice()) {
            (Verdict::NoGap, _) => "no gap".to_owned(),
            (Verdict::Unknown, _) => "unknown".to_owned(),
            (Verdict::Inconclusive, _) => "inconclusive".to_owned(),
            (Verdict::Partial, named) => format!("partly {}", named.join(", ")),
            (Verdict::Named, named) => named.join(", "),
        };
        let alike = match self.alike.len() {
            0 => "–".to_owned(),
            1..=MOST_LISTED => self.alike.join(", "),
            many => format!("{many} effects"),
        };
        let found = if self.found { "yes" } else { "no" };
        format!(" {named} | {:.0} % | {alike} | {found} |", 100.0 * self.shrink)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_parameter_is_not_written_as_nothing() {
        let put = |parameter, value| Put {
            effect: "drive.coulomb",
            parameter,
            value,
            unit: "",
            estimate: None,
        };
        let changes =
            Changed { force_n: Some(11.5), drive_force_n: None, tip_m: Some(2e-3), shape_m: None };
        let put_in = vec![put("force_n", 32.0), put("presliding_m", 4.03e-6)];
        let row = Row { put_in, changes, answer: None }.text();
        assert!(
            row.starts_with("| drive.coulomb (force_n 32, presliding_m 0.00000403) |"),
            "{row}"
        );
        assert!(row.contains("| 11.5 N, –, 2.0 mm, – |"), "{row}");
    }
}
