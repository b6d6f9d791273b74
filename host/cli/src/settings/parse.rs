//! From the text of a settings file to its entries, each with its line.

use std::ops::Range;

use cathforce_config::master::Master;
use toml::de::{DeTable, DeValue};

use super::SCHEMA_VERSION;
use super::band::{self, StatedBand};
use super::entry::{Entry, Setting, problem};
use super::master;
use super::problem::Problem;
use super::table::{Reader, Value};
use crate::output::SETTINGS_KEYS;

/// What a file says. Its names and values need not be right; [`problem`] tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Parsed {
    /// 0 in a file from before versions were counted.
    pub version: u32,
    pub rig: String,
    pub entries: Vec<Entry>,
    pub master: Master,
    pub band: Option<StatedBand>,
}

const FORM: &str =
    "a file has `schema_version = 1`, `rig = \"name\"`, `[set]`, `[master]` and `[band]`";

/// Reads a text. `Err` holds everything that is wrong with it, wrong names and values included.
pub fn parse(text: &str) -> Result<Parsed, Vec<Problem>> {
    let mut reader = Reader::new(text);
    let (table, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let fix = "correct this line; a file has `rig = \"name\"` and, under `[set]`, a line `name = \
                   number` for each setting";
        reader.report(&error.span().unwrap_or_default(), error.message(), fix);
    }
    let table = table.get_ref();
    // What follows from a line that could not be read would only confuse.
    if errors.is_empty() && is_of_this_program(&mut reader, table) {
        let parsed = read(&mut reader, table);
        if reader.has_problems() {
            reader.add(parsed.entries.iter().filter_map(problem));
        } else {
            return Ok(parsed);
        }
    }
    Err(reader.into_problems())
}

/// Whether this is a settings file of a version that this program knows.
fn is_of_this_program(reader: &mut Reader<'_>, table: &DeTable<'_>) -> bool {
    if let Some((key, _)) = table.get_key_value("format") {
        let what = "this is the rig.toml of a bundle, not a settings file";
        let fix = "give the bundle's folder where a bundle is asked for, or make a settings file with \
                   `cathforce config init BUNDLE S.toml`";
        reader.report(&key.span(), what, fix);
        return false;
    }
    let Some(DeValue::Integer(whole)) = table.get("schema_version").map(|value| value.get_ref())
    else {
        return true;
    };
    let version = i64::from_str_radix(whole.as_str(), whole.radix()).unwrap_or(0);
    if version > i64::from(SCHEMA_VERSION) && u32::try_from(version).is_ok() {
        let message = format!(
            "schema_version {version} is newer than {SCHEMA_VERSION}, the newest that this program knows"
        );
        reader.report(&(0..0), message, "use the cathforce that wrote it, or a newer one");
        return false;
    }
    true
}

fn read(reader: &mut Reader<'_>, table: &DeTable<'_>) -> Parsed {
    let mut parsed = Parsed {
        version: 0,
        rig: String::new(),
        entries: Vec::new(),
        master: Master::default(),
        band: None,
    };
    reader.check_keys("", table, &SETTINGS_KEYS, FORM);
    for (key, value) in table {
        match (key.get_ref().as_ref(), value.get_ref()) {
            ("schema_version", DeValue::Integer(whole)) => {
                match u32::from_str_radix(whole.as_str(), whole.radix()) {
                    Ok(version) => parsed.version = version,
                    Err(_) => reader.report(
                        &value.span(),
                        "schema_version must be 1",
                        "write `schema_version = 1`",
                    ),
                }
            }
            ("rig", DeValue::String(name)) => parsed.rig = name.to_string(),
            ("master", DeValue::Table(table)) => parsed.master = master::read(reader, table),
            ("band", DeValue::Table(table)) => {
                parsed.band = band::read(reader, table, &key.span());
            }
            ("set", DeValue::Table(set)) => entries(reader, "", set, &mut parsed.entries),
            (name, found) if SETTINGS_KEYS.contains(&name) => {
                let message = format!("`{name}` must not be a value of type {}", found.type_str());
                reader.report(&key.span(), message, FORM);
            }
            _ => {}
        }
    }
    if parsed.rig.is_empty() && table.get("rig").is_none_or(|rig| rig.get_ref().is_str()) {
        let fix = "write `rig = \"name\"`, with the name in the bundle's rig.toml";
        reader.report(&(0..0), "the rig is missing", fix);
    }
    parsed.entries.sort_by_key(|entry| entry.line);
    parsed
}

/// Entries of a table and of the tables in it, because a dotted key is either.
fn entries(reader: &mut Reader<'_>, prefix: &str, table: &DeTable<'_>, found: &mut Vec<Entry>) {
    for (key, value) in table {
        let name = format!("{prefix}{}", key.get_ref());
        let line = reader.line(&key.span());
        let setting = match value.get_ref() {
            DeValue::Table(inner) if inner.contains_key("value") => {
                diagnosed(reader, &name, inner, &value.span())
            }
            DeValue::Table(inner) => {
                entries(reader, &format!("{name}."), inner, found);
                continue;
            }
            _ => number(reader, &name, value).map(Setting::ByHand),
        };
        found.extend(setting.map(|setting| Entry { name, line, setting }));
    }
}

/// `{ value = number, effect = "id" }`.
fn diagnosed(
    reader: &mut Reader<'_>,
    name: &str,
    table: &DeTable<'_>,
    span: &Range<usize>,
) -> Option<Setting> {
    let effect = table.get("effect").and_then(|effect| effect.get_ref().as_str());
    match (table.get("value"), effect) {
        (Some(value), Some(effect)) if table.len() == 2 => {
            let value = number(reader, name, value)?;
            Some(Setting::Diagnosed { value, effect: effect.into() })
        }
        _ => {
            let message = format!("{name} has other keys than `value` and `effect`");
            reader.report(span, message, "write `{ value = number, effect = \"id\" }`");
            None
        }
    }
}

/// A number in single precision, as the device has it. It is rounded only once, so that a value
/// which was written to the bit reads back to the bit.
fn number(reader: &mut Reader<'_>, name: &str, value: &Value<'_>) -> Option<f32> {
    let number = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(whole) => {
            i64::from_str_radix(whole.as_str(), whole.radix()).ok().map(|n| n as f32)
        }
        _ => None,
    };
    if number.is_none() {
        let message = format!("{name} must be a number, not a {}", value.get_ref().type_str());
        reader.report(&value.span(), message, format!("write `\"{name}\" = number`"));
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(set: &str) -> Vec<Entry> {
        parse(&format!("rig = \"a\"\n[set]\n{set}")).unwrap().entries
    }

    /// The first problem of a text that has one.
    fn first(text: &str) -> Problem {
        parse(text).unwrap_err().remove(0)
    }

    #[test]
    fn a_key_may_be_dotted_quoted_or_in_a_table_of_its_own() {
        let name = "effects.wall.stiffness.factor";
        for set in [
            "effects.wall.stiffness.factor = 0.5",
            "\"effects.wall.stiffness.factor\" = 0.5",
            "[set.effects.wall]\nstiffness.factor = 0.5",
        ] {
            let found = entries(set);
            assert_eq!((found[0].name.as_str(), found[0].setting.value()), (name, 0.5), "{set}");
        }
    }

    #[test]
    fn a_version_is_read_to_the_digit() {
        // The next one to what single precision has.
        let newer = first("schema_version = 16777217").message;
        assert!(newer.contains("schema_version 16777217 is newer"), "{newer}");
        for text in ["schema_version = 4294967297", "schema_version = -1"] {
            let said = parse(text).unwrap_err();
            assert!(said.iter().any(|p| p.message == "schema_version must be 1"), "{said:?}");
        }
    }

    #[test]
    fn a_name_that_is_none_has_its_line_and_its_neighbour() {
        let problem = problem(&entries("\nforce_gian = 2")[0]).unwrap();
        assert_eq!(problem.line, 4);
        assert!(problem.message.contains("force_gian"), "{problem:?}");
        assert!(problem.fix.contains("`force_gain`"), "{problem:?}");
    }

    #[test]
    fn an_effect_that_is_none_has_its_line_and_its_neighbour() {
        let set = |id: &str| {
            let text =
                format!("force_gain = 1\nforce_limit_n = {{ value = 2, effect = \"{id}\" }}");
            problem(&entries(&text)[1])
        };
        assert_eq!(set("wall.stiffness"), None);
        let slip = set("wall.stifness").unwrap();
        assert_eq!(slip.line, 4);
        assert!(slip.message.contains("`wall.stifness`"), "{slip:?}");
        assert!(slip.fix.contains("`wall.stiffness`"), "{slip:?}");
        let nonsense = set("bogus").unwrap();
        assert!(nonsense.fix.contains("`cathforce gap effects`"), "{nonsense:?}");
    }

    #[test]
    fn a_rigs_own_file_is_told_from_settings() {
        let problem = first("\nformat = \"trial-bundle/1\"\n[entry]\nup = 1\n");
        assert_eq!(problem.line, 2);
        assert!(problem.message.contains("rig.toml of a bundle"), "{problem:?}");
        assert!(problem.fix.contains("the bundle's folder"), "{problem:?}");
    }

    #[test]
    fn a_value_out_of_range_has_its_line_and_its_range() {
        let problem = problem(&entries("force_limit_n = 10.5")[0]).unwrap();
        assert!(problem.message.contains("between 0 and 10 N"), "{problem:?}");
        let whole = super::problem(&entries("ramp_time_ticks = 2.5")[0]).unwrap();
        assert!(whole.fix.contains("whole"), "{whole:?}");
    }

    #[test]
    fn what_is_no_file_of_settings_is_refused_with_its_line() {
        for (text, line, word) in [
            ("rig = \"a\"\n[set]\nforce_gain = \"two\"", 3, "must be a number"),
            ("rig = \"a\"\n[set]\nforce_gain = \n", 3, ""),
            ("rig = \"a\"\nset = 3", 2, "`set`"),
            ("rig = \"a\"\nsets = 3", 2, "no key `sets`"),
            ("rig = 3", 1, "`rig`"),
            ("schema_version = 99\nrig = \"a\"", 1, "newer"),
            ("[set]\nforce_gain = 1", 1, "rig is missing"),
            ("rig = \"a\"\n[set]\nx = { value = 1, effects = 2 }", 3, "other keys"),
        ] {
            let problem = first(text);
            assert_eq!(problem.line, line, "{text}: {problem:?}");
            assert!(problem.message.contains(word), "{text}: {problem:?}");
        }
        let problems = parse("rgi = \"a\"").unwrap_err();
        assert!(problems.iter().any(|p| p.fix.contains("`rig`")), "{problems:?}");
    }

    #[test]
    fn everything_that_is_wrong_with_a_file_is_said_at_once() {
        let text = "schema_version = 1\nrgi = \"a\"\n[set]\nforce_gian = 2\nforce_gain = \"x\"\n\
                    force_limit_n = 99\nx = { value = 1 }\n[master]\ncathter = 1\n[band]\nfeed = 1\n";
        let problems = parse(text).unwrap_err();
        let lines = problems.iter().map(|problem| problem.line).collect::<Vec<_>>();
        let mut wanted = vec![1, 2, 4, 5, 6, 7, 9];
        wanted.extend([10; 3]);
        wanted.push(11);
        assert_eq!(lines, wanted, "{problems:#?}");
    }

    #[test]
    fn every_line_that_is_no_toml_is_named() {
        let text = "rig = \"a\"\n[set]\nforce_gain = \ntorque_gain == 2\nforce_limit_n = 1\n";
        let lines = parse(text).unwrap_err().iter().map(|p| p.line).collect::<Vec<_>>();
        assert!(lines.contains(&3) && lines.contains(&4), "{lines:?}");
    }
}
