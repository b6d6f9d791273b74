//! How far the forces may be off, in a settings file: `[band]`.

use std::fmt::Write as _;

use cathforce_config::{BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow};
use serde::Deserialize;

use super::parse::Problem;

/// The part of a file that is read here; the rest is read key by key.
#[derive(Deserialize)]
struct Whole {
    band: Option<Table>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    from_m: f32,
    step_m: f32,
    feed: Vec<[f64; 4]>,
    withdrawal: Vec<[f64; 4]>,
}

/// The band of a file, if it states one.
pub fn parse(text: &str) -> Result<Option<Band>, Problem> {
    let line = |at: usize| 1 + text.get(..at).unwrap_or(text).matches('\n').count();
    let fix = || "`cathforce gap apply` writes it; take it out to have none".to_owned();
    let whole = toml::from_str::<Whole>(text).map_err(|error| Problem {
        line: line(error.span().map_or(0, |span| span.start)),
        message: error.message().into(),
        fix: fix(),
    })?;
    let Some(table) = whole.band else { return Ok(None) };
    let wrong = |message: String| {
        let line = line(text.find("[band]").unwrap_or(0));
        Problem { line, message: format!("band: {message}"), fix: fix() }
    };
    let rows = |name: &str, rows: &[[f64; 4]]| -> Result<[BandRow; BAND_ROWS], Problem> {
        let counts: Vec<BandRow> = rows.iter().map(|row| row.map(count)).collect();
        counts
            .try_into()
            .map_err(|_| wrong(format!("{name} has {} rows, not {BAND_ROWS}", rows.len())))
    };
    let (feed, withdrawal) = (rows("feed", &table.feed)?, rows("withdrawal", &table.withdrawal)?);
    let band = Band { from_m: table.from_m, step_m: table.step_m, feed, withdrawal };
    band.validate().map_err(|name| wrong(format!("{name} is not finite or out of range")))?;
    Ok(Some(band))
}

/// What a device has for a half width \[N\]: the next larger one. What is not a number is not
/// known.
pub fn count(half_width_n: f64) -> u16 {
    if half_width_n.is_nan() {
        return BAND_UNKNOWN;
    }
    // A thousandth of a count is rounding.
    let counts = (half_width_n / f64::from(BAND_UNIT_N) - 1e-3).ceil();
    (counts.max(0.0) as u16).min(BAND_UNKNOWN - 1)
}

/// As it is written in a file.
pub fn text(band: &Band) -> String {
    let Band { from_m, step_m, feed, withdrawal } = band;
    let mut text = format!(
        "\n# Half widths of the band in which nine of ten true forces lie, in newtons: on the \
         vessel x, y, z,\n# behind the guide; nan: not known. One row every `step_m` of \
         insertion.\n[band]\nfrom_m = {from_m:?}\nstep_m = {step_m:?}\n"
    );
    for (name, rows) in [("feed", feed), ("withdrawal", withdrawal)] {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{name} = [");
        for row in rows {
            let [x, y, z, drive] = row.map(number);
            let _ = writeln!(text, "  [{x}, {y}, {z}, {drive}],");
        }
        let _ = writeln!(text, "]");
    }
    text
}

fn number(count: u16) -> String {
    match count {
        BAND_UNKNOWN => "nan".to_owned(),
        _ => format!("{:.4}", f64::from(count) * 1e-4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_reads_back_to_the_count() {
        let mut feed = [[12, 65534, 0, BAND_UNKNOWN]; BAND_ROWS];
        for (row, widths) in feed.iter_mut().enumerate() {
            widths[0] = 977 * row as u16;
        }
        let band = Band { from_m: 0.031, step_m: 3.7e-3, feed, withdrawal: feed };
        assert_eq!(parse(&text(&band)), Ok(Some(band)));
        assert_eq!(parse("rig = \"a\""), Ok(None));
    }

    #[test]
    fn widths_are_never_made_narrower() {
        for (width_n, counts) in [(0.0, 0), (1e-4, 1), (1.01e-4, 2), (99.0, 65534)] {
            assert_eq!(count(width_n), counts, "{width_n}");
        }
        assert_eq!(count(f64::NAN), BAND_UNKNOWN);
    }

    #[test]
    fn a_band_with_other_rows_is_refused_with_its_line() {
        let text = "rig = \"a\"\n[band]\nfrom_m = 0.0\nstep_m = 0.01\nfeed = [[1, 1, 1, 1]]\n\
                    withdrawal = []\n";
        let Err(Problem { line, message, .. }) = parse(text) else { panic!("accepted") };
        assert_eq!((line, message.as_str()), (2, "band: feed has 1 rows, not 24"));
    }
}
