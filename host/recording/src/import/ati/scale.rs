//! Whether the rows of a log are counts or forces, and of which unit.

use super::heading::Heading;
use super::preamble::Preamble;
use super::rows::Rows;
use super::units;

/// Largest force that is taken without a question \[N\]. A phantom does not bear a tenth of it, and the
/// smallest load of a sensor is many more counts.
const LARGEST_N: f64 = 1000.0;
/// Share of a unit that a log in counts exceeds somewhere: the noise of any ATI sensor is larger.
const SMALLEST_OF_COUNTS: f64 = 1e-3;
/// How far a number of the command line may be from that of the log.
const SAME: f64 = 1e-3;

/// What a value of a row is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    /// One of the rows' values \[N\].
    pub(super) newtons: f64,
    /// In words.
    pub(super) text: String,
}

/// The problem, its fix, and whether it is in a row (else it is in the heading).
type Wrong = (String, String);

/// What the log says, and `counts_per_n` where it says nothing. Errors: the two contradict each other,
/// or neither says enough.
pub(super) fn scale(
    said: &Preamble,
    heading: &Heading,
    rows: &Rows<'_>,
    counts_per_n: Option<f64>,
) -> Result<Scale, Wrong> {
    let column = heading.force_unit.as_deref();
    let of_column = column.and_then(units::newtons);
    let of_log = said.force_unit.as_deref().and_then(units::newtons);
    if let (Some(a), Some(b), Some(column), Some(log)) =
        (of_column, of_log, column, &said.force_unit)
        && a != b
    {
        let problem = format!("the columns are in {column}, but the log's `Force Units` are {log}");
        return Err((problem, "correct the one that is wrong".into()));
    }
    let unit = of_column.or(of_log);
    let name = if of_column.is_some() { column } else { said.force_unit.as_deref() };
    let name = name.unwrap_or("N");
    let of_unit = unit.map(|newtons| Scale { newtons, text: format!("the rows are in {name}") });
    let of_counts = said.counts_per_unit.zip(unit).map(|(counts, newtons)| Scale {
        newtons: newtons / counts,
        text: format!("the rows are counts, {counts} of them a {name}"),
    });
    let are_counts = column.is_some_and(units::is_counts)
        || said.force_unit.as_deref().is_some_and(units::is_counts);
    let candidates = match (of_column.is_some(), are_counts) {
        (true, _) => vec![of_unit],
        (_, true) => vec![of_counts],
        _ => vec![of_counts, of_unit],
    };
    let candidates = candidates.into_iter().flatten().collect::<Vec<_>>();
    if let Some(counts_per_n) = counts_per_n {
        return given(&candidates, counts_per_n);
    }
    match &candidates[..] {
        [] if are_counts => {
            let fix = "say how many counts are one newton, from the sensor's calibration: --counts-per-n N";
            Err((
                "the rows are counts, and the log does not say how many are one newton".into(),
                fix.into(),
            ))
        }
        [] if said.counts_per_unit.is_some() => {
            let problem = "the log has counts per unit, but does not say which unit of force";
            Err((problem.into(), "say how many counts are one newton: --counts-per-n N".into()))
        }
        [] => plausible(
            Scale {
                newtons: 1.0,
                text: "the rows are taken as newtons; the log names no unit".into(),
            },
            rows,
        ),
        [only] => plausible(only.clone(), rows),
        [counts, unit, ..] => told_by_rows(counts, unit, rows),
    }
}

/// The scale of the command line, which must be one that the log allows.
fn given(candidates: &[Scale], counts_per_n: f64) -> Result<Scale, Wrong> {
    let agrees = |scale: &&Scale| (scale.newtons * counts_per_n - 1.0).abs() <= SAME;
    match (candidates.iter().find(agrees), candidates.first()) {
        (Some(scale), _) => Ok(scale.clone()),
        (None, None) => {
            let text =
                format!("the rows are counts, {counts_per_n} of them a newton by --counts-per-n");
            Ok(Scale { newtons: 1.0 / counts_per_n, text })
        }
        (None, Some(_)) => {
            let of = candidates.iter().map(|scale| {
                format!("{} (that is {:.6} a newton)", scale.text, 1.0 / scale.newtons)
            });
            let problem = format!(
                "by its own words {}, but --counts-per-n says that {counts_per_n} are one newton",
                of.collect::<Vec<_>>().join(" or ")
            );
            Err((problem, "leave --counts-per-n out, or correct the log's words".into()))
        }
    }
}

/// ATI's program writes counts, which are whole numbers; others divide them first.
fn told_by_rows(counts: &Scale, unit: &Scale, rows: &Rows<'_>) -> Result<Scale, Wrong> {
    let ask = |what: &str| {
        let problem = format!("{what}; the log has both a unit and counts per unit");
        let fix = format!(
            "say which they are: --counts-per-n {} if they are counts, --counts-per-n {} if they are in the unit",
            short(1.0 / counts.newtons),
            short(1.0 / unit.newtons)
        );
        Err((problem, fix))
    };
    if counts.newtons == unit.newtons {
        return Ok(unit.clone());
    }
    match rows.are_whole {
        true if rows.largest > 0.0
            && rows.largest * counts.newtons < SMALLEST_OF_COUNTS * unit.newtons =>
        {
            ask("the rows are whole numbers, but too small for counts")
        }
        true => Ok(counts.clone()),
        false if rows.largest * unit.newtons > LARGEST_N => {
            ask("the rows are no whole numbers like counts, but too large for forces")
        }
        false => Ok(unit.clone()),
    }
}

fn plausible(scale: Scale, rows: &Rows<'_>) -> Result<Scale, Wrong> {
    let largest_n = rows.largest * scale.newtons;
    match largest_n > LARGEST_N {
        true => {
            let problem =
                format!("{}, but the largest is {largest_n:.0} N: are they counts?", scale.text);
            let fix = "say how many of the rows' numbers are one newton: --counts-per-n N";
            Err((problem, fix.into()))
        }
        false => Ok(scale),
    }
}

/// A number with six digits, and no zeros behind them.
fn short(number: f64) -> String {
    let places = (5.0 - number.abs().log10().floor()).max(0.0) as usize;
    let text = format!("{number:.places$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
