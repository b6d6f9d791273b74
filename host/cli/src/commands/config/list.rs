//! `cathforce config list`.

use cathforce_config::{Key, keys};
use serde_json::{Value, json};

use crate::args::ConfigListArguments;
use crate::failure::{Code, Failure};
use crate::settings::entry::misspelt;
use crate::settings::units::unit;
use crate::ui::Ui;

/// No setting changes while the output is armed (P17): the device refuses it. A recording therefore
/// has one configuration from its first tick to its last, and replays bit by bit.
const WHILE_ARMED: bool = false;

pub fn run(ui: &Ui, arguments: &ConfigListArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let listed: Vec<Key> = match &arguments.name {
        Some(part) => keys().filter(|key| key.name().contains(part)).collect(),
        None => keys().collect(),
    };
    if let (Some(part), true) = (&arguments.name, listed.is_empty()) {
        let names = keys().map(Key::name).collect::<Vec<_>>();
        let fix = misspelt(part, &names, "`cathforce config list` lists all names");
        let message = format!("no setting has `{part}` in its name\n  fix: {fix}");
        return Err(Failure::new(Code::Usage, message));
    }
    let json = listed.iter().map(|key| json(*key)).collect::<Vec<_>>();
    arguments.json_file.write(ui, &json, text(ui, &listed))
}

fn json(key: Key) -> Value {
    let [min, max] = key.range();
    json!({
        "name": key.name(), "unit": key.unit(), "min": min, "max": max,
        // Null where rig.toml states the value.
        "default": key.default(), "whole": key.is_whole(),
        "while_armed": WHILE_ARMED, "doc": key.doc(),
    })
}

fn text(ui: &Ui, listed: &[Key]) -> String {
    let mut text = String::new();
    let is_of_rig = |key: &&Key| matches!(key, Key::Parameter(_));
    let first_of_rig = listed.iter().find(is_of_rig).map(|key| key.name());
    for key in listed {
        if first_of_rig == Some(key.name()) {
            text +=
                "\nThe rig and its effects (`cathforce gap effects` describes the effects):\n\n";
        }
        let [min, max] = key.range();
        let unit = unit(*key);
        let default = match key.default() {
            Some(default) => format!("{default}{unit}"),
            None => "from rig.toml".to_owned(),
        };
        let name = ui.bold(key.name());
        text += &format!("{name}\n  {default}, from {min} to {max}{unit}\n  {}\n", key.doc());
    }
    text + "\nNo setting changes while the output is armed: disarm, apply, arm again.\n"
}
