//! From the text of a settings file to its keys, each with its line.

use std::ops::Range;

use cathforce_config::master::Master;
use cathforce_config::{Key, KeyError, keys};
use cathforce_effect_catalogue::Effect;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::band::StatedBand;
use super::{SCHEMA_VERSION, Setting, band, master, slip};

/// A key of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub name: String,
    pub line: usize,
    pub setting: Setting,
}

/// What a file says, whether it means anything or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Parsed {
    /// 0: written before versions were counted.
    pub version: u32,
    pub rig: String,
    pub entries: Vec<Entry>,
    pub master: Master,
    pub band: Option<StatedBand>,
}

/// What is wrong with a file, and what mends it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    pub line: usize,
    pub message: String,
    pub fix: String,
}

/// What a file may say at its top.
const TOP: [&str; 5] = ["schema_version", "rig", "set", "master", "band"];

/// The nearest name to one that is not known, or else `otherwise`.
pub fn misspelt(name: &str, known: &[&str], otherwise: &str) -> String {
    match cathforce_bundle::nearest(name, known) {
        Some(nearest) => format!("write `{nearest}`, if that is meant"),
        None => otherwise.to_owned(),
    }
}

/// Line of a key by the tables that it is in, or of the innermost of them that is there; 1 if none is.
pub fn line_of(text: &str, path: &[&str]) -> usize {
    let mut at = 0..0;
    if let Ok(table) = DeTable::parse(text) {
        let mut inside = Some(table.get_ref());
        for name in path {
            let Some((key, value)) = inside.and_then(|table| table.get_key_value(*name)) else {
                break;
            };
            at = key.span();
            inside = value.get_ref().as_table();
        }
    }
    line(text, at.start)
}

/// Line of a byte.
pub fn line(text: &str, at: usize) -> usize {
    1 + text.get(..at).unwrap_or(text).matches('\n').count()
}

/// Whether a text is a file of settings, right or wrong: it has keys of one, and no others.
pub fn is_settings(text: &str) -> bool {
    DeTable::parse(text).is_ok_and(|table| {
        let keys = table.get_ref().keys();
        let mut known = keys.map(|key| TOP.contains(&key.get_ref().as_ref())).peekable();
        known.peek().is_some() && known.all(|known| known)
    })
}

/// Why an entry cannot be used, if it cannot.
pub fn problem(entry: &Entry) -> Option<Problem> {
    let (name, value) = (entry.name.as_str(), entry.setting.value());
    let problem = |message, fix| Some(Problem { line: entry.line, message, fix });
    let Some(key) = Key::find(name) else {
        let names = keys().map(Key::name).collect::<Vec<_>>();
        let fix = misspelt(name, &names, "`cathforce config` lists the names");
        return problem(format!("there is no setting `{name}`"), fix);
    };
    let [min, max] = key.range();
    let unit = unit(key);
    match key.check(value) {
        Ok(()) => unknown_effect(entry),
        Err(KeyError::NotFinite) => {
            problem(format!("{name} is not a finite number"), range_text(key))
        }
        Err(KeyError::NotWhole) => {
            problem(format!("{name} = {value}: it counts{unit}"), "write a whole number".into())
        }
        Err(KeyError::Range) => {
            let message = format!("{name} must be between {min} and {max}{unit}, not {value}");
            problem(message, slip::out_of_range(key, value).unwrap_or_else(|| range_text(key)))
        }
    }
}

/// Where a value comes from has to be an effect that there is: others read it.
fn unknown_effect(entry: &Entry) -> Option<Problem> {
    let Setting::Diagnosed { effect, .. } = &entry.setting else { return None };
    if Effect::find(effect).is_some() {
        return None;
    }
    let ids = cathforce_effect_catalogue::all().map(|effect| effect.id).collect::<Vec<_>>();
    Some(Problem {
        line: entry.line,
        message: format!("{} is of the effect `{effect}`, which there is not", entry.name),
        fix: misspelt(effect, &ids, "`cathforce gap effects` lists them"),
    })
}

/// A unit after its number, if it has one.
pub fn unit(key: Key) -> String {
    if key.unit() == "1" { String::new() } else { format!(" {}", key.unit()) }
}

fn range_text(key: Key) -> String {
    let [min, max] = key.range();
    format!("write a number from {min} to {max}{}", unit(key))
}

/// Reads a text. Names and values need not be any; what is no file of settings is a problem.
pub fn parse(text: &str) -> Result<Parsed, Problem> {
    let reader = Reader { text };
    let table = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or_default();
        reader.problem(
            &span,
            error.message(),
            "correct this line; a file has `rig = \"name\"` and, under `[set]`, a line `name = \
             number` for each setting",
        )
    })?;
    let mut parsed = Parsed {
        version: 0,
        rig: String::new(),
        entries: Vec::new(),
        master: master::parse(text)?,
        band: band::parse(text)?,
    };
    // Before its keys, none of which is one of settings.
    if let Some((key, _)) = table.get_ref().get_key_value("format") {
        let what = "this is the rig.toml of a bundle, not a file of settings";
        let fix = "give the bundle's folder where a bundle is asked for; a file of settings is another \
                   one, `cathforce config init BUNDLE S.toml` makes it";
        return Err(reader.problem(&key.span(), what, fix));
    }
    for (key, value) in table.get_ref() {
        match (key.get_ref().as_ref(), value.get_ref()) {
            ("schema_version", DeValue::Integer(whole)) => {
                let version = u32::from_str_radix(whole.as_str(), whole.radix());
                parsed.version = version.map_err(|_| {
                    reader.problem(
                        &value.span(),
                        "this is no version",
                        "write `schema_version = 1`",
                    )
                })?;
            }
            ("rig", DeValue::String(name)) => parsed.rig = name.to_string(),
            ("master" | "band", DeValue::Table(_)) => {}
            ("set", DeValue::Table(set)) => reader.entries("", set, &mut parsed.entries)?,
            (name, found) => {
                let form = "a file has `schema_version = 1`, `rig = \"name\"`, `[set]`, `[master]` \
                            and `[band]`";
                let (message, fix) = match TOP.contains(&name) {
                    true => (format!("`{name}` is {}", found.type_str()), form.to_owned()),
                    false => (format!("there is no key `{name}` here"), misspelt(name, &TOP, form)),
                };
                return Err(reader.problem(&key.span(), message, fix));
            }
        }
    }
    if parsed.version > SCHEMA_VERSION {
        let message = format!(
            "schema_version {} is newer than the {SCHEMA_VERSION} that this program knows",
            parsed.version
        );
        return Err(reader.problem(
            &(0..0),
            message,
            "use the cathforce that wrote it, or a newer one",
        ));
    }
    if parsed.rig.is_empty() {
        let fix = "write `rig = \"name\"`, with the name in the bundle's rig.toml";
        return Err(reader.problem(&(0..0), "the rig is missing", fix));
    }
    parsed.entries.sort_by_key(|entry| entry.line);
    Ok(parsed)
}

struct Reader<'a> {
    text: &'a str,
}

impl Reader<'_> {
    /// Entries of a table and of the tables in it: a dotted key is both.
    fn entries(
        &self,
        prefix: &str,
        table: &DeTable<'_>,
        entries: &mut Vec<Entry>,
    ) -> Result<(), Problem> {
        for (key, value) in table {
            let name = format!("{prefix}{}", key.get_ref());
            let line = self.line(&key.span());
            let number = |value| {
                self.number(value).ok_or_else(|| {
                    let message = format!("{name} is {}, not a number", value.get_ref().type_str());
                    self.problem(&value.span(), message, format!("write `\"{name}\" = number`"))
                })
            };
            let setting = match value.get_ref() {
                DeValue::Table(inner) if inner.contains_key("value") => {
                    let effect = inner.get("effect").and_then(|effect| effect.get_ref().as_str());
                    match (inner.get("value"), effect) {
                        (Some(value), Some(effect)) if inner.len() == 2 => {
                            Setting::Diagnosed { value: number(value)?, effect: effect.into() }
                        }
                        _ => {
                            let message =
                                format!("{name} has other keys than `value` and `effect`");
                            let fix = "write `{ value = number, effect = \"id\" }`";
                            return Err(self.problem(&value.span(), message, fix));
                        }
                    }
                }
                DeValue::Table(inner) => {
                    self.entries(&format!("{name}."), inner, entries)?;
                    continue;
                }
                _ => Setting::ByHand(number(value)?),
            };
            entries.push(Entry { name, line, setting });
        }
        Ok(())
    }

    /// A number as the device has it, read once: what is written to the bit comes back so.
    fn number(&self, value: &Spanned<DeValue<'_>>) -> Option<f32> {
        match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(whole) => {
                i64::from_str_radix(whole.as_str(), whole.radix()).ok().map(|n| n as f32)
            }
            _ => None,
        }
    }

    fn line(&self, span: &Range<usize>) -> usize {
        line(self.text, span.start)
    }

    fn problem(
        &self,
        span: &Range<usize>,
        message: impl Into<String>,
        fix: impl Into<String>,
    ) -> Problem {
        Problem { line: self.line(span), message: message.into(), fix: fix.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(set: &str) -> Vec<Entry> {
        parse(&format!("rig = \"a\"\n[set]\n{set}")).unwrap().entries
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
        let newer = parse("schema_version = 16777217").unwrap_err().message;
        assert!(newer.contains("schema_version 16777217 is newer"), "{newer}");
        for text in ["schema_version = 4294967297", "schema_version = -1"] {
            assert_eq!(parse(text).unwrap_err().message, "this is no version", "{text}");
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
        let problem = parse("\nformat = \"trial-bundle/1\"\n[entry]\nup = 1\n").unwrap_err();
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
            ("rig = \"a\"\n[set]\nforce_gain = \"two\"", 3, "not a number"),
            ("rig = \"a\"\n[set]\nforce_gain = \n", 3, ""),
            ("rig = \"a\"\nset = 3", 2, "`set`"),
            ("rig = \"a\"\nsets = 3", 2, "no key `sets`"),
            ("schema_version = 99\nrig = \"a\"", 1, "newer"),
            ("[set]\nforce_gain = 1", 1, "rig is missing"),
            ("rig = \"a\"\n[set]\nx = { value = 1, effects = 2 }", 3, "other keys"),
        ] {
            let problem = parse(text).unwrap_err();
            assert_eq!(problem.line, line, "{text}: {problem:?}");
            assert!(problem.message.contains(word), "{text}: {problem:?}");
        }
        let problem = parse("rgi = \"a\"").unwrap_err();
        assert!(problem.fix.contains("`rig`"), "{problem:?}");
    }
}
