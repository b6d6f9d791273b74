//! `cathforce config init`, `set`, `diff` and `validate`: settings files.

use std::path::Path;

use cathforce_config::{Key, keys};
use cathforce_link::Client;
use serde_json::json;
use toml_edit::{DocumentMut, Item, Table, value};

use super::values::{Values, changes, defaults, head_on, values};
use crate::args::{
    ConfigDiffArguments, ConfigInitArguments, ConfigSetArguments, ConfigValidateArguments,
};
use crate::failure::{Code, Failure};
use crate::image::check_model;
use crate::open::open_bundle;
use crate::settings::entry::{check, problem};
use crate::settings::units::{self, unit};
use crate::settings::{SCHEMA_VERSION, SettingsFile, Staged, parse_file, refused};
use crate::ui::Ui;

pub fn init(ui: &Ui, arguments: &ConfigInitArguments) -> Result<(), Failure> {
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let path = &arguments.file;
    if path.exists() {
        let message = format!(
            "{} exists already and was not changed\n  fix: give another name, or change values in it \
             with `cathforce config set`",
            path.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let staged = Staged::new(path, &template(&bundle.rig.name))?;
    staged.commit()?;
    let shown = path.display().to_string();
    ui.data(&json!({ "path": shown }), format_args!("{shown}\n"))
}

/// A file that holds every setting as a comment, and so changes nothing.
fn template(rig: &str) -> String {
    let mut text = format!(
        "# Settings of cathforce for one rig. Remove the `#` before a line to set its value; the \
         values\n# here are the defaults. `cathforce config apply` sends the file to a device, and \
         `--settings`\n# uses it for a run. No setting changes while the output is armed.\nschema_version = {SCHEMA_VERSION}\nrig = {}\n\n[set]\n",
        toml::Value::from(rig)
    );
    for key in keys() {
        let [min, max] = key.range();
        let default = key.default().map_or("…".to_owned(), |value| format!("{value:?}"));
        text += &format!(
            "\n# {} From {min} to {max}{}.\n# \"{}\" = {default}\n",
            key.doc(),
            unit(key),
            key.name()
        );
    }
    text
}

pub fn set(ui: &Ui, arguments: &ConfigSetArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    // A file that is wrong already is refused with its lines.
    let old = SettingsFile::read(path)?;
    let wrong = |(name, value): &(String, f32)| check(name, *value).err();
    let wrong = arguments.values.iter().filter_map(wrong);
    let wrong = wrong.map(|(message, fix)| format!("{message}\n  fix: {fix}")).collect::<Vec<_>>();
    if !wrong.is_empty() {
        return Err(Failure::new(Code::Usage, wrong.join("\n")));
    }
    let text = std::fs::read_to_string(path).map_err(Failure::input)?;
    let text = edited(&text, &arguments.values).map_err(Failure::input)?;
    let staged = Staged::new(path, &text)?;
    staged.commit()?;
    let new = SettingsFile::read(path)?;
    let changed = changes(&of_file(&old), &of_file(&new));
    for (name, value) in &arguments.values {
        warn_of_slip(ui, name, *value);
    }
    let lines = changed.iter().map(|change| change.text() + "\n").collect::<String>();
    ui.data(&changed, if lines.is_empty() { "nothing changed\n".to_owned() } else { lines })
}

/// The text with these values; comments and everything else stay.
fn edited(text: &str, values: &[(String, f32)]) -> Result<String, toml_edit::TomlError> {
    let mut document = text.parse::<DocumentMut>()?;
    let set = document.entry("set").or_insert(Item::Table(Table::new()));
    for (name, number) in values {
        if let Some(table) = set.as_table_like_mut() {
            // A dotted key or a table of its own would be a second value of the same name.
            remove_dotted(table, name);
            // The shortest decimal that reads back to the same bits.
            let number = number.to_string().parse::<f64>().unwrap_or(f64::from(*number));
            match table.get_mut(name) {
                Some(old) => {
                    let decor = old.as_value().map(|old| old.decor().clone());
                    let mut new = toml_edit::Value::from(number);
                    *new.decor_mut() = decor.unwrap_or_default();
                    *old = Item::Value(new);
                }
                None => {
                    table.insert(name, value(number));
                }
            }
        }
    }
    Ok(document.to_string())
}

fn remove_dotted(table: &mut dyn toml_edit::TableLike, name: &str) {
    if let Some((first, rest)) = name.split_once('.')
        && let Some(inner) = table.get_mut(first).and_then(Item::as_table_like_mut)
    {
        inner.remove(rest);
        remove_dotted(inner, rest);
    }
}

fn of_file(file: &SettingsFile) -> Values {
    let value = |key: Key| Some((key.name(), file.set.get(key.name())?.value()));
    keys().filter_map(value).collect()
}

pub fn diff(ui: &Ui, arguments: &ConfigDiffArguments) -> Result<(), Failure> {
    let first = source(&arguments.first)?;
    let second = match &arguments.second {
        Some(second) => source(second)?,
        // Only the names of the first: it says nothing about the others.
        None => defaults().into_iter().filter(|(name, _)| first.contains_key(name)).collect(),
    };
    let (old, new) = if arguments.second.is_some() { (first, second) } else { (second, first) };
    let changed = changes(&old, &new);
    let lines = changed.iter().map(|change| change.text() + "\n").collect::<String>();
    ui.data(&changed, if lines.is_empty() { "no difference\n".to_owned() } else { lines })
}

/// The values of a file if there is one of that name, else of the device behind that link.
fn source(text: &str) -> Result<Values, Failure> {
    let path = Path::new(text);
    if path.exists() || path.extension().is_some_and(|extension| extension == "toml") {
        return Ok(of_file(&SettingsFile::read(path)?));
    }
    if cathforce_link::check_address(text).is_err() && !text.contains(':') {
        let message = format!(
            "{text} is neither a file nor a link\n  fix: check the path, or give a link such as {}",
            cathforce_link::ADDRESSES.join(", ")
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let mut client = Client::connect(cathforce_link::open(text)?)?;
    Ok(head_on(&mut client)?.as_ref().map(values).unwrap_or_default())
}

pub fn validate(ui: &Ui, arguments: &ConfigValidateArguments) -> Result<(), Failure> {
    let path = &arguments.path;
    let shown = path.display().to_string();
    if path.is_dir() {
        let bundle = open_bundle(ui, path)?;
        check_model(&bundle)?;
        let warnings = bundle.warnings.len();
        let json = json!({ "path": shown, "rig": bundle.rig.name, "warnings": warnings });
        return ui.data(&json, format_args!("{shown}: valid, {warnings} warnings\n"));
    }
    let parsed = parse_file(path)?;
    let problems = parsed.entries.iter().filter_map(problem).collect::<Vec<_>>();
    if !problems.is_empty() {
        return Err(refused(path, &problems));
    }
    let mut warnings = 0;
    for entry in &parsed.entries {
        let slip =
            Key::find(&entry.name).and_then(|key| units::in_range(key, entry.setting.value()));
        if let Some(slip) = slip {
            warnings += 1;
            ui.warn(format_args!("{shown}:{}: {slip}", entry.line));
        }
    }
    let settings = parsed.entries.len();
    let json = json!({
        "path": shown, "rig": parsed.rig, "schema_version": parsed.version,
        "settings": settings, "warnings": warnings,
    });
    ui.data(&json, format_args!("{shown}: valid, {settings} settings, {warnings} warnings\n"))
}

/// Warns where a value may be in the wrong unit.
pub fn warn_of_slip(ui: &Ui, name: &str, value: f32) {
    if let Some(slip) = Key::find(name).and_then(|key| units::in_range(key, value)) {
        ui.warn(slip);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_sets_nothing_and_names_everything() {
        let text = template("a \"rig\"");
        let parsed = crate::settings::parse::parse(&text).unwrap();
        assert_eq!((parsed.version, parsed.rig.as_str()), (SCHEMA_VERSION, "a \"rig\""));
        assert_eq!(parsed.entries, []);
        for key in keys() {
            assert!(text.contains(&format!("\n# \"{}\" = ", key.name())), "{}", key.name());
        }
    }

    #[test]
    fn a_change_keeps_comments_and_leaves_one_value_however_it_was_written() {
        let text =
            "rig = \"a\"\n[set]\n# why\nforce_gain = 2 # so\nwall.friction_coefficient = 0.3\n";
        let values =
            [("wall.friction_coefficient".to_owned(), 0.1), ("force_gain".to_owned(), 3.0)];
        let text = edited(text, &values).unwrap();
        assert!(text.contains("# why\nforce_gain = 3.0 # so"), "{text}");
        let parsed = crate::settings::parse::parse(&text).unwrap();
        let found = parsed.entries.iter().map(|e| (e.name.as_str(), e.setting.value()));
        let mut found = found.collect::<Vec<_>>();
        found.sort_by(|a, b| a.0.cmp(b.0));
        assert_eq!(found, [("force_gain", 3.0), ("wall.friction_coefficient", 0.1)]);
    }
}
