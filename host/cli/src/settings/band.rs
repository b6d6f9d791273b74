//! The uncertainty of the forces in a settings file: `[band]`.
//!
//! A band belongs to one model and says nothing about another. The file therefore holds a hash of
//! its model; a device that is configured with any other model is told of no band.

use std::fmt::Write as _;
use std::ops::Range;

use cathforce_config::{BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow};
use cathforce_mechanics::Description;
use toml::de::DeTable;

use super::model::model_sha256;
use super::table::Reader;
use crate::ui::Ui;

/// A band and its model.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedBand {
    pub band: Band,
    /// [`model_sha256`]; `None` in a file of an older version, whose model is unknown.
    pub model_sha256: Option<String>,
}

impl StatedBand {
    pub fn new(band: Band, of: &Description<f32>) -> Self {
        Self { band, model_sha256: Some(model_sha256(of)) }
    }

    /// The band if it belongs to this model. Otherwise warns that the device states none, and why.
    ///
    /// `by_hand`: names of the settings that were changed after the diagnosis.
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
                    [] => "rig.toml or an effect differs from what was diagnosed".to_owned(),
                    names => format!("set by hand: {}", names.join(", ")),
                };
                (format!("belongs to another model ({set})"), "undo that, or ")
            }
            None => ("does not say to which model it belongs".to_owned(), ""),
        };
        ui.warn(format_args!(
            "the settings' band {why}, so the device states none\n  fix: {undo}run `cathforce gap \
             diagnose` on the rig as rig.toml states it and `cathforce gap apply` again, with \
             --band-only where no effect is named"
        ));
        None
    }

    /// The largest half width that is stated \[N\]; `None` where none is.
    pub fn widest_n(&self) -> Option<f64> {
        let rows = self.band.feed.iter().chain(&self.band.withdrawal).flatten();
        let widest = rows.filter(|count| **count != BAND_UNKNOWN).max()?;
        Some(f64::from(*widest) * f64::from(BAND_UNIT_N))
    }
}

const FIX: &str = "`cathforce gap apply` writes this table; delete it to state no band";
const KEYS: [&str; 5] = ["model_sha256", "from_m", "step_m", "feed", "withdrawal"];

/// The band of a file, from the table `[band]` that begins at `span`; `None` where it is wrong.
pub fn read(
    reader: &mut Reader<'_>,
    table: &DeTable<'_>,
    span: &Range<usize>,
) -> Option<StatedBand> {
    reader.check_keys("band", table, &KEYS, FIX);
    let model_sha256 = table.get("model_sha256");
    let model_sha256 =
        model_sha256.and_then(|hash| reader.word("band.model_sha256", hash, &[], FIX));
    let mut number = |name: &str| {
        let value = reader.required("band", table, name, span, FIX)?;
        reader.number(&format!("band.{name}"), value, FIX).map(|number| number as f32)
    };
    let (from_m, step_m) = (number("from_m"), number("step_m"));
    let (feed, withdrawal) =
        (rows(reader, table, "feed", span), rows(reader, table, "withdrawal", span));
    let band = Band { from_m: from_m?, step_m: step_m?, feed: feed?, withdrawal: withdrawal? };
    if let Err(name) = band.validate() {
        reader.report(span, format!("band.{name} is not finite or out of range"), FIX);
    }
    Some(StatedBand { band, model_sha256: model_sha256.map(str::to_owned) })
}

/// The rows of one direction of motion: x, y, z and behind the guide \[N\].
fn rows(
    reader: &mut Reader<'_>,
    table: &DeTable<'_>,
    name: &str,
    span: &Range<usize>,
) -> Option<[BandRow; BAND_ROWS]> {
    let value = reader.required("band", table, name, span, FIX)?;
    let form = format!("band.{name} must be {BAND_ROWS} rows of four numbers");
    let Some(rows) = value.get_ref().as_array() else {
        reader.report(&value.span(), form, FIX);
        return None;
    };
    let mut counts = Vec::new();
    for row in rows {
        let numbers = row.get_ref().as_array().map(|row| {
            let numbers = row.iter().map(|value| reader.number(&form, value, FIX));
            numbers.collect::<Option<Vec<f64>>>()
        });
        match numbers {
            Some(numbers) => counts.push(<[f64; 4]>::try_from(numbers?).ok()?.map(count)),
            None => {
                reader.report(&row.span(), form, FIX);
                return None;
            }
        }
    }
    let found = counts.len();
    let rows = counts.try_into().ok();
    if rows.is_none() {
        let message = format!("band.{name} has {found} rows, not {BAND_ROWS}");
        reader.report(&value.span(), message, FIX);
    }
    rows
}

/// The device's count for a half width \[N\], rounded up; NaN means that the width is not known.
pub fn count(half_width_n: f64) -> u16 {
    if half_width_n.is_nan() {
        return BAND_UNKNOWN;
    }
    // A thousandth of a count is a rounding error of the text, not a wider band.
    let counts = (half_width_n / f64::from(BAND_UNIT_N) - 1e-3).ceil();
    (counts.max(0.0) as u16).min(BAND_UNKNOWN - 1)
}

/// The band as it is written in a file.
pub fn text(stated: &StatedBand) -> String {
    let StatedBand { band: Band { from_m, step_m, feed, withdrawal }, model_sha256 } = stated;
    let model = model_sha256.as_ref().map_or(String::new(), |hash| {
        format!(
            "# The band holds for the model with this hash only: rig and effects as they were \
             diagnosed.\nmodel_sha256 = {}\n",
            toml::Value::from(hash.as_str())
        )
    });
    let mut text = format!(
        "\n# Half widths in newtons of the band that holds nine of ten true forces: on the vessel x, \
         y, z,\n# and behind the guide; nan means not known. One row every `step_m` of \
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
    use crate::settings::problem::Problem;

    fn parse(text: &str) -> Result<Option<StatedBand>, Vec<Problem>> {
        let table = DeTable::parse(text).unwrap();
        let mut reader = Reader::new(text);
        let band = table
            .get_ref()
            .get_key_value("band")
            .and_then(|(key, value)| read(&mut reader, value.get_ref().as_table()?, &key.span()));
        let problems = reader.into_problems();
        if problems.is_empty() { Ok(band) } else { Err(problems) }
    }

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
    fn a_band_with_other_rows_is_refused_with_both_lines() {
        let text = "rig = \"[band]\"\n[band]\nfrom_m = 0.0\nstep_m = 0.01\nfeed = [[1, 1, 1, 1]]\n\
                    withdrawal = []\n";
        let problems = parse(text).unwrap_err();
        let said = problems.iter().map(|p| (p.line, p.message.as_str())).collect::<Vec<_>>();
        let both = [(5, "band.feed has 1 rows, not 24"), (6, "band.withdrawal has 0 rows, not 24")];
        assert_eq!(said, both);
    }
}
