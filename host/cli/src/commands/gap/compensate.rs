//! `cathforce gap compensate`: the inverse of a transmission as a table, or along a desired output.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Numbers;
use cathforce_bundle::bundle::{Axis, Plant as RigPlant, columns};
use cathforce_gap::plant::Plant as _;
use cathforce_gap::report::{Verdict, quantity};
use cathforce_gap::transmission::{Achieved, Compensation, Model, Transmission};
use serde::Serialize;

use super::diagnose::Search;
use super::explanation::Explanation;
use super::source::Source;
use crate::args::CompensateArguments;
use crate::failure::{Code, Failure};
use crate::open::read_text;
use crate::output::{Kind, check_again, check_apart, write_again};
use crate::ui::{Ui, to_json};

/// The model and how well its inverse does.
#[derive(Serialize)]
struct Answer {
    rig: String,
    verdict: Verdict,
    /// Units of output and input.
    output_unit: &'static str,
    input_unit: &'static str,
    /// What the model is made of: that of rig.toml with the named effects.
    model: BTreeMap<&'static str, f64>,
    /// Effects that were named, with their values.
    effects: Vec<(String, BTreeMap<String, f64>)>,
    /// Load for which it holds \[N\] or \[N·m\].
    load: f64,
    /// Outputs that the table reaches.
    range: [f64; 2],
    rows: usize,
    /// Error of the model's output along a test motion, in the unit of the output.
    by_table: Achieved,
    by_memory: Achieved,
    by_gain: Achieved,
    csv: Option<String>,
    notes: Vec<String>,
}

pub fn run(ui: &Ui, arguments: &CompensateArguments) -> Result<(), Failure> {
    let (json, csv) = (&arguments.json_file, arguments.csv.as_deref());
    check_apart(json.out.as_deref().into_iter().chain(csv))?;
    json.check()?;
    let source = Source::open(ui, &arguments.bundle)?;
    let path = &source.bundle.path;
    let refuse =
        |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", path.display()));
    let RigPlant::Transmission(rig) = source.bundle.rig.plant.clone() else {
        return Err(refuse(
            &"rig.toml has no plant = \"transmission\", and only a transmission is inverted\n  fix: a drive's \
              friction is a feed-forward as `cathforce gap diagnose` prints it; settings of a catheter are written by \
              `cathforce gap apply`",
        ));
    };
    let names = heading(rig.input, rig.output, arguments.along.is_some());
    csv.map_or(Ok(()), |file| check_again(file, Kind::Table(&names)))?;
    let desired = arguments.along.as_deref().map(|file| desired(file, rig.output)).transpose()?;
    let transmission = source.transmission()?;
    let explanation = match &arguments.diagnosis {
        Some(file) => {
            let explanation = Explanation::read(file)?;
            explanation.check_source(&source)?;
            explanation
        }
        None => {
            let again = Source::open(ui, &arguments.bundle)?;
            Explanation::of(&Search::default().answer(ui, again, None)?)?
        }
    };
    if !matches!(explanation.verdict, Verdict::Named | Verdict::Partial | Verdict::NoGap) {
        let message = format!(
            "{}: the diagnosis names nothing ({}), so that what is stated in rig.toml is not the \
             transmission, and its inverse would compensate for another one\n  fix: see what `cathforce gap diagnose` \
             says is left",
            path.display(),
            serde_json::to_value(explanation.verdict).unwrap_or_default().as_str().unwrap_or("?")
        );
        return Err(Failure::new(Code::Failed, message));
    }
    let effects = values(&explanation, &transmission);
    let own = Compensation::of(&transmission, &effects, arguments.rows as usize, arguments.load)
        .map_err(|e| refuse(&e))?;
    let rows = match &desired {
        None => table(&own, &names),
        Some((times, outputs)) => along(&own, &names, times, outputs).map_err(|e| refuse(&e))?,
    };
    if let Some(file) = csv {
        write_again(file, Kind::Table(&names), &rows)?;
    }
    let count = rows.lines().count() - 1;
    let answer = Answer {
        rig: source.bundle.rig.name.clone(),
        verdict: explanation.verdict,
        output_unit: rig.output.unit(),
        input_unit: rig.input.unit(),
        model: parameters(&own.model),
        effects: named(&effects, &transmission),
        load: own.load,
        range: own.range(),
        rows: count,
        by_table: own.by_table,
        by_memory: own.by_memory,
        by_gain: own.by_gain,
        csv: csv.map(|file| file.display().to_string()),
        notes: notes(&explanation, &effects),
    };
    // Rows are data, and so is the list; whoever wants both writes the rows into a file.
    if ui.json || csv.is_some() {
        return json.write(ui, &answer, answer.text());
    }
    ui.say(answer.text().trim_end());
    if let Some(file) = &json.out {
        write_again(file, Kind::Json, to_json(&answer)? + "\n")?;
    }
    ui.data(&answer, rows)
}

fn heading(input: Axis, output: Axis, along: bool) -> String {
    let [input, output, _] = columns::of_transmission(input, output);
    match along {
        true => format!("{},{output},{input}", columns::TIME),
        false => {
            let unit = input.trim_start_matches("input_");
            format!("{output},input_rising_{unit},input_falling_{unit}")
        }
    }
}

fn table(own: &Compensation, names: &str) -> String {
    let mut text = format!("{names}\n");
    for row in &own.rows {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{:.9},{:.9},{:.9}", row.output, row.rising, row.falling);
    }
    text
}

fn along(
    own: &Compensation,
    names: &str,
    times: &[f64],
    outputs: &[f64],
) -> Result<String, cathforce_gap::transmission::CompensationError> {
    let mut text = format!("{names}\n");
    for ((t_s, output), input) in times.iter().zip(outputs).zip(own.along(outputs)?) {
        let _ = writeln!(text, "{t_s},{output},{input:.9}");
    }
    Ok(text)
}

/// Times and desired outputs of a file.
fn desired(file: &Path, output: Axis) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    let name = columns::of_transmission(Axis::Linear, output)[1];
    let read = Numbers::read(&read_text(file)?, &[columns::TIME, name]);
    let numbers = read.map_err(|(place, cause)| {
        Failure::input(format!("{}{place}: {cause}\n  fix: {}", file.display(), cause.fix()))
    })?;
    let [times, outputs] = <[Vec<f64>; 2]>::try_from(numbers.columns)
        .map_err(|_| Failure::input(format!("{}: it has no two columns", file.display())))?;
    if outputs.is_empty() {
        let message = format!(
            "{}: it has no rows\n  fix: give desired outputs in columns `{}` and `{name}`",
            file.display(),
            columns::TIME
        );
        return Err(Failure::input(message));
    }
    Ok((times, outputs))
}

/// Values of the named effects, in the order of their parameters.
fn values(explanation: &Explanation, transmission: &Transmission) -> Vec<(String, Vec<f64>)> {
    let of = |own: &super::explanation::Named| {
        let effect = transmission.effects().iter().find(|effect| effect.id == own.id);
        let parameters = effect.map_or(&[][..], |effect| &effect.parameters);
        let values = parameters.iter().map(|p| own.value(p.name).unwrap_or(p.off)).collect();
        (own.id.clone(), values)
    };
    explanation.effects.iter().map(of).collect()
}

fn named(
    effects: &[(String, Vec<f64>)],
    transmission: &Transmission,
) -> Vec<(String, BTreeMap<String, f64>)> {
    let of = |(id, values): &(String, Vec<f64>)| {
        let effect = transmission.effects().iter().find(|effect| effect.id == id);
        let names = effect.map_or(&[][..], |effect| &effect.parameters);
        let with = names.iter().zip(values).map(|(p, value)| (p.name.to_owned(), *value));
        (id.clone(), with.collect())
    };
    effects.iter().map(of).collect()
}

/// The parameters of the model, in the units of input and output.
fn parameters(model: &Model) -> BTreeMap<&'static str, f64> {
    let [height, length, sharpness] = model.bouc_wen;
    let [stops_height, radius] = model.prandtl_ishlinskii;
    let mut all = BTreeMap::from([
        ("gain", model.gain),
        ("offset", model.offset),
        ("curvature", model.curvature),
        ("middle", model.middle),
        ("travel", model.travel),
        ("dead_zone", model.dead_zone),
        ("dead_zone_follows", model.follows),
        ("bouc_wen_height", height),
        ("bouc_wen_length", length),
        ("bouc_wen_sharpness", sharpness),
        ("prandtl_ishlinskii_height", stops_height),
        ("prandtl_ishlinskii_radius", radius),
        ("compliance", model.compliance),
    ]);
    if let Some(own) = &model.sheath {
        all.extend([
            ("sheath_bend_rad", own.bend_rad),
            ("sheath_friction_coefficient", own.friction_coefficient),
            ("sheath_pull_N", own.pull_n),
            ("sheath_return_N_per_m", own.return_n_per_m),
            ("sheath_tendon_N_per_m", own.tendon_n_per_m),
        ]);
    }
    all
}

/// What must be known before it is relied on.
fn notes(explanation: &Explanation, effects: &[(String, Vec<f64>)]) -> Vec<String> {
    let mut notes = Vec::new();
    if explanation.verdict == Verdict::Partial {
        notes.push(
            "the verdict is `partial`: what is left of the gap is not compensated".to_owned(),
        );
    }
    if explanation.verdict == Verdict::NoGap {
        notes.push("no gap was found: this is the inverse of what rig.toml states".to_owned());
    }
    for id in ["transmission.lag", "transmission.latency", "transmission.drift"] {
        if effects.iter().any(|(own, _)| own == id) {
            notes.push(format!("{id} depends on the rate or on the time and is not compensated"));
        }
    }
    notes
}

impl Answer {
    fn text(&self) -> String {
        let error = |own: &Achieved| {
            let [rms, largest] = [own.rms, own.largest].map(|x| quantity(x, self.output_unit));
            format!("{rms} RMS, {largest} at most")
        };
        let mut text = format!("{}: {} rows\n", self.rig, self.rows);
        text += &format!(
            "  outputs from {} to {}\n",
            quantity(self.range[0], self.output_unit),
            quantity(self.range[1], self.output_unit)
        );
        for (id, values) in &self.effects {
            let values: Vec<String> =
                values.iter().map(|(name, value)| format!("{name} {value:.6}")).collect();
            text += &format!("  compensates {id} ({})\n", values.join(", "));
        }
        text += "  error of the model's output along swings of shrinking size:\n";
        text += &format!("    by the gain of rig.toml alone  {}\n", error(&self.by_gain));
        text += &format!("    by this table                  {}\n", error(&self.by_table));
        text += &format!("    by --along                     {}\n", error(&self.by_memory));
        text += &self.notes.iter().map(|note| format!("  note: {note}\n")).collect::<String>();
        if let Some(csv) = &self.csv {
            text += &format!("rows: {csv}\n");
        }
        text
    }
}
