//! How far the forces may be off, in a settings file: `[band]`.
//!
//! A band is of one model and says nothing of another: the file holds a hash of the one that it is
//! of, and wherever something else is set, none is stated.

use std::fmt::Write as _;

use cathforce_config::{BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow};
use cathforce_mechanics::Description;
use serde::Deserialize;

use super::model::model_sha256;
use super::parse::{Problem, line, line_of};
use crate::ui::Ui;

/// A band, and the model that it is of.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedBand {
    pub band: Band,
    /// [`model_sha256`]; `None` in a file from before it was written: nobody knows then.
    pub model_sha256: Option<String>,
}

impl StatedBand {
    pub fn new(band: Band, of: &Description<f32>) -> Self {
        Self { band, model_sha256: Some(model_sha256(of)) }
    }

    /// The band where it is of this model; else says why the device states none.
    ///
    /// `by_hand`: what was set besides what was diagnosed.
    pub fn for_model(
        &self,
        ui: &Ui,
        description: &Description<f32>,
        by_hand: &[String],
    ) -> Option<Band> {
        let (why, undo) = match &self.model_sha256 {
            Some(hash) if *hash == model_sha256(description) => return Some(self.band),
            Some(_) => {
                let set = match by_hand {
                    [] => "rig.toml or an effect is not what was diagnosed".to_owned(),
                    names => format!("set by hand: {}", names.join(", ")),
                };
                (format!("is of another model ({set})"), "undo that, or ")
            }
            None => {
                ("does not say which model it is of, as an older cathforce wrote it".to_owned(), "")
            }
        };
        ui.warn(format_args!(
            "the settings' band {why}, so the device is told of none\n  fix: {undo}`cathforce gap \
             diagnose` the rig as rig.toml states it and `cathforce gap apply` again, with \
             --band-only where no effect is named"
        ));
        None
    }

    /// The largest half width that it states \[N\]; `None` where it states none.
    pub fn widest_n(&self) -> Option<f64> {
        let rows = self.band.feed.iter().chain(&self.band.withdrawal).flatten();
        let widest = rows.filter(|count| **count != BAND_UNKNOWN).max()?;
        Some(f64::from(*widest) * f64::from(BAND_UNIT_N))
    }
}

/// The part of a file that is read here; the rest is read key by key.
#[derive(Deserialize)]
struct Whole {
    band: Option<Table>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    model_sha256: Option<String>,
    from_m: f32,
    step_m: f32,
    feed: Vec<[f64; 4]>,
    withdrawal: Vec<[f64; 4]>,
}

/// The band of a file, if it states one.
pub fn parse(text: &str) -> Result<Option<StatedBand>, Problem> {
    let fix = || "`cathforce gap apply` writes it; take it out to have none".to_owned();
    let whole = toml::from_str::<Whole>(text).map_err(|error| Problem {
        line: line(text, error.span().map_or(0, |span| span.start)),
        message: error.message().into(),
        fix: fix(),
    })?;
    let Some(table) = whole.band else { return Ok(None) };
    let wrong = |message: String| Problem {
        line: line_of(text, &["band"]),
        message: format!("band: {message}"),
        fix: fix(),
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
    Ok(Some(StatedBand { band, model_sha256: table.model_sha256 }))
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
pub fn text(stated: &StatedBand) -> String {
    let StatedBand { band: Band { from_m, step_m, feed, withdrawal }, model_sha256 } = stated;
    let model = model_sha256.as_ref().map_or(String::new(), |hash| {
        format!(
            "# Of the model with this hash: rig and effects as they were diagnosed. Of another it \
             says nothing.\nmodel_sha256 = {}\n",
            toml::Value::from(hash.as_str())
        )
    });
    let mut text = format!(
        "\n# Half widths of the band in which nine of ten true forces lie, in newtons: on the \
         vessel x, y, z,\n# behind the guide; nan: not known. One row every `step_m` of \
         insertion.\n[band]\n{model}from_m = {from_m:?}\nstep_m = {step_m:?}\n"
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
        _ => format!("{:.4}", f64::from(count) * f64::from(BAND_UNIT_N)),
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
        for model_sha256 in [None, Some("0a".repeat(32))] {
            let stated = StatedBand { band, model_sha256 };
            assert_eq!(parse(&text(&stated)), Ok(Some(stated.clone())));
            assert!(stated.widest_n().is_some_and(|n| (n - 6.5534).abs() < 1e-6));
        }
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
        let text = "rig = \"[band]\"\n[band]\nfrom_m = 0.0\nstep_m = 0.01\nfeed = [[1, 1, 1, 1]]\n\
                    withdrawal = []\n";
        let Err(Problem { line, message, .. }) = parse(text) else { panic!("accepted") };
        assert_eq!((line, message.as_str()), (2, "band: feed has 1 rows, not 24"));
    }
}
