//! Reading a tensile test from CSV, strictly.

use std::path::Path;

use csv::StringRecord;

use crate::curve::{Curve, Point, StressMeasure};
use crate::error::{CurveCause, CurveError, LEAST_ROWS};
use crate::names::{Quantity, nearest, quantity};

/// No elastomer stretches further; natural rubber breaks below 10.
const LARGEST_STRETCH: f64 = 16.0;
/// A specimen is clamped within this of its unloaded length.
const FIRST_STRETCH: f64 = 0.5;
/// No bulk polymer bears more \[Pa\]; a drawn nylon thread comes near.
const LARGEST_STRESS_PA: f64 = 1e9;
/// Whole numbers up to this are accepted as forces \[N\].
const LARGEST_WHOLE_FORCE: f64 = 1000.0;
/// Faults of one kind that are listed.
const LISTED: usize = 10;

/// A specimen's unloaded dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Specimen {
    /// Length between the marks or grips that the extension belongs to \[m\].
    pub gauge_m: Option<f64>,
    /// Cross-section \[m²\].
    pub area_m2: Option<f64>,
}

/// What the file does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    pub specimen: Specimen,
    /// Which stress a column `stress_…` holds.
    pub measure: Option<StressMeasure>,
}

type Fault = (usize, CurveCause);

/// The column of a quantity: its place, name and factor to SI.
struct Column {
    index: usize,
    name: String,
    factor: f64,
    offset: f64,
}

/// The two columns of a curve.
struct Columns {
    stretch: Column,
    is_ratio: bool,
    stress: Column,
    is_force: bool,
    measure: StressMeasure,
}

/// Reads a curve. All faults of the heading, or of the rows, are reported at once.
pub fn read_curve(file: &Path, options: &ReadOptions) -> Result<Curve, CurveError> {
    let refused = |faults: Vec<Fault>| CurveError { file: file.to_path_buf(), faults };
    let text = std::fs::read(file).map_err(|error| refused(vec![(0, error.into())]))?;
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
    let broken = |error: csv::Error| {
        let line = error.position().map_or(0, |at| at.line() as usize);
        refused(vec![(line, CurveCause::Csv(error.to_string()))])
    };
    let heading = reader.headers().map_err(broken)?.clone();
    let line = heading.position().map_or(1, |at| at.line() as usize);
    let columns = columns(&heading, options)
        .map_err(|causes| refused(causes.into_iter().map(|cause| (line, cause)).collect()))?;
    let rows: Vec<StringRecord> = reader.records().collect::<Result<_, _>>().map_err(broken)?;
    let (points, lines) = points(&rows, &columns).map_err(refused)?;
    let faults = implausible(&points, &lines, &columns, &rows, line);
    if faults.is_empty() {
        Ok(Curve { measure: columns.measure, points })
    } else {
        Err(refused(faults))
    }
}

/// Finds the two columns of the curve in the heading.
fn columns(heading: &StringRecord, options: &ReadOptions) -> Result<Columns, Vec<CurveCause>> {
    let mut faults = Vec::new();
    let (mut stretch, mut stress) = (None::<(Column, bool)>, None::<(Column, bool, _)>);
    for (index, name) in heading.iter().enumerate() {
        let column = |factor, offset| Column { index, name: name.to_owned(), factor, offset };
        let mut twice = |first: &Column| {
            let (first, second) = (first.name.clone(), name.to_owned());
            faults.push(CurveCause::Twice { first, second });
        };
        let found = match quantity(name) {
            Some(Ok(found)) => found,
            Some(Err(known)) => {
                faults.push(CurveCause::Unit { name: name.to_owned(), known });
                continue;
            }
            None => {
                let nearest = nearest(name);
                faults.push(CurveCause::UnknownColumn { name: name.to_owned(), nearest });
                continue;
            }
        };
        match (found, &stretch, &stress) {
            (Quantity::Ignored, ..) => {}
            (Quantity::Stretch { .. } | Quantity::Extension(_), Some((first, _)), _) => {
                twice(first)
            }
            (Quantity::Force(_) | Quantity::Stress(..), _, Some((first, ..))) => twice(first),
            (Quantity::Stretch { factor, offset }, ..) => {
                stretch = Some((column(factor, offset), true))
            }
            (Quantity::Extension(factor), ..) => stretch = Some((column(factor, 1.0), false)),
            (Quantity::Force(factor), ..) => {
                stress = Some((column(factor, 0.0), true, Some(StressMeasure::Nominal)));
            }
            (Quantity::Stress(factor, measure), ..) => {
                stress = Some((column(factor, 0.0), false, measure));
            }
        }
    }
    let mut missing = |what: &'static str| faults.push(CurveCause::Missing(what));
    let (mut found_stretch, mut found_stress) = (None, None);
    match stretch {
        None => missing("stretch, strain or extension"),
        Some((column, true)) => found_stretch = Some((column, true)),
        Some((mut column, false)) => {
            match options.specimen.gauge_m {
                Some(gauge_m) => column.factor /= gauge_m,
                None => faults.push(CurveCause::Specimen(column.name.clone(), "unloaded length")),
            }
            found_stretch = Some((column, false));
        }
    }
    match stress {
        None => faults.push(CurveCause::Missing("stress or force")),
        Some((mut column, is_force, stated)) => {
            match (is_force, options.specimen.area_m2) {
                (true, Some(area_m2)) => column.factor /= area_m2,
                (true, None) => {
                    faults.push(CurveCause::Specimen(column.name.clone(), "cross-section"));
                }
                (false, _) => {}
            }
            match measure(&column.name, stated, options.measure) {
                Ok(measure) => found_stress = Some((column, is_force, measure)),
                Err(cause) => faults.push(cause),
            }
        }
    }
    match (found_stretch, found_stress) {
        (Some((stretch, is_ratio)), Some((stress, is_force, measure))) if faults.is_empty() => {
            Ok(Columns { stretch, is_ratio, stress, is_force, measure })
        }
        _ => Err(faults),
    }
}

/// Which stress a column holds, by its name and by what the user says.
fn measure(
    name: &str,
    stated: Option<StressMeasure>,
    said: Option<StressMeasure>,
) -> Result<StressMeasure, CurveCause> {
    match (stated, said) {
        (Some(stated), Some(said)) if stated != said => {
            Err(CurveCause::Contradiction(name.to_owned(), stated.name(), said.name()))
        }
        (Some(stated), _) => Ok(stated),
        (None, Some(said)) => Ok(said),
        (None, None) => Err(CurveCause::Unstated(name.to_owned())),
    }
}

/// The rows as points, with their lines.
fn points(
    rows: &[StringRecord],
    columns: &Columns,
) -> Result<(Vec<Point>, Vec<usize>), Vec<Fault>> {
    let mut faults = Vec::new();
    let (mut points, mut lines) = (Vec::new(), Vec::new());
    for row in rows {
        let line = row.position().map_or(0, |at| at.line() as usize);
        let mut cell = |column: &Column| {
            let value = number(row, column).map_err(|cause| faults.push((line, cause))).ok()?;
            Some(value * column.factor + column.offset)
        };
        if let (Some(stretch), Some(stress_pa)) = (cell(&columns.stretch), cell(&columns.stress)) {
            points.push(Point { stretch, stress_pa });
            lines.push(line);
        }
    }
    faults.truncate(LISTED);
    if faults.is_empty() { Ok((points, lines)) } else { Err(faults) }
}

fn number(row: &StringRecord, column: &Column) -> Result<f64, CurveCause> {
    let text = row.get(column.index).unwrap_or_default();
    let name = || column.name.clone();
    if text.is_empty() {
        return Err(CurveCause::Empty(name()));
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(CurveCause::NotFinite { name: name(), text: text.to_owned() }),
        Err(_) => Err(CurveCause::NotANumber { name: name(), text: text.to_owned() }),
    }
}

/// What is wrong with the numbers, though they are numbers.
fn implausible(
    points: &[Point],
    lines: &[usize],
    columns: &Columns,
    rows: &[StringRecord],
    heading: usize,
) -> Vec<Fault> {
    let Some(last) = points.last() else {
        return vec![(heading, CurveCause::TooFewRows { rows: 0 })];
    };
    let line_of = |at: Option<usize>| at.and_then(|at| lines.get(at).copied()).unwrap_or(heading);
    let name = &columns.stretch.name;
    let raw = |stretch: f64| (stretch - columns.stretch.offset) / columns.stretch.factor;
    // A wrong unit makes every other check of the stretch meaningless.
    if let Some(at) = points.iter().position(|point| point.stretch > LARGEST_STRETCH) {
        let largest = points.iter().map(|point| point.stretch).fold(0.0, f64::max);
        let cause = CurveCause::Percent { name: name.clone(), largest: raw(largest) };
        return vec![(lines[at], cause)];
    }
    let first = points[0].stretch;
    if columns.is_ratio && first < FIRST_STRETCH {
        let cause = CurveCause::StrainAsStretch { name: name.clone(), first: raw(first) };
        return vec![(lines[0], cause)];
    }
    let mut faults = order(points, lines);
    faults.extend(strength(points, columns, rows).map(|(at, cause)| (line_of(at), cause)));
    let mut stretches: Vec<f64> = points.iter().map(|point| point.stretch).collect();
    stretches.dedup();
    if stretches.len() < LEAST_ROWS {
        faults.push((
            line_of(Some(points.len() - 1)),
            CurveCause::TooFewRows { rows: stretches.len() },
        ));
    }
    let slope = (last.stress_pa - points[0].stress_pa) / (last.stretch - first);
    if faults.is_empty() && slope <= 0.0 {
        faults.push((line_of(Some(points.len() - 1)), CurveCause::Falling(slope)));
    }
    faults
}

/// Rows whose stretch is impossible or falls.
fn order(points: &[Point], lines: &[usize]) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (at, point) in points.iter().enumerate() {
        if point.stretch <= 0.0 {
            faults.push((lines[at], CurveCause::NotPositive(point.stretch)));
        } else if at > 0 && point.stretch < points[at - 1].stretch {
            let before = points[at - 1].stretch;
            faults.push((lines[at], CurveCause::Unsorted { before, now: point.stretch }));
        }
    }
    faults.truncate(LISTED);
    faults
}

/// A stress that no polymer bears, and forces that are a sensor's counts.
fn strength(
    points: &[Point],
    columns: &Columns,
    rows: &[StringRecord],
) -> Option<(Option<usize>, CurveCause)> {
    let name = &columns.stress.name;
    let (at, most) = points
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.stress_pa.abs().total_cmp(&b.1.stress_pa.abs()))?;
    let stress_mpa = 1e-6 * most.stress_pa.abs();
    if most.stress_pa.abs() > LARGEST_STRESS_PA {
        let cause = match columns.is_force {
            true => CurveCause::Counts { name: name.clone(), stress_mpa },
            false => CurveCause::Unit1000 { stress_mpa },
        };
        return Some((Some(at), cause));
    }
    let is_whole = |row: &StringRecord| {
        row.get(columns.stress.index).is_some_and(|text| text.parse::<i64>().is_ok())
    };
    let largest = most.stress_pa.abs() / columns.stress.factor;
    let is_counts = columns.is_force && largest > LARGEST_WHOLE_FORCE && rows.iter().all(is_whole);
    is_counts.then(|| (Some(at), CurveCause::WholeNumbers(name.clone(), largest)))
}
