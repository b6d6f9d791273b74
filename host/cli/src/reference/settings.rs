//! docs/reference/settings.md.

use std::fmt::Write as _;

use cathforce_config::{Key, keys};

use super::{cell, check, notice};
use crate::settings::SCHEMA_VERSION;
use crate::settings::units::unit;

#[test]
fn the_page_of_settings_is_up_to_date() {
    let introduction = include_str!("settings.md");
    let mut page = format!(
        "# Settings\n\n{}\n{introduction}\nNames and layout have the version {SCHEMA_VERSION} \
         (`schema_version`).\n",
        notice("the declarations of the settings")
    );
    let is_setting = |key: &Key| matches!(key, Key::Setting(_));
    page += "\n## Settings of the operator\n";
    page += &table(keys().filter(is_setting));
    page += "\n## Parameters of the rig and its effects\n";
    page += &table(keys().filter(|key| !is_setting(key)));
    check("settings.md", &page);
}

fn table(keys: impl Iterator<Item = Key>) -> String {
    let mut text = "\n| name | default | range | meaning |\n| --- | --- | --- | --- |\n".to_owned();
    for key in keys {
        let [min, max] = key.range();
        let default = key.default().map_or("rig.toml".to_owned(), |value| value.to_string());
        let _ = writeln!(
            text,
            "| `{}` | {default} | {min} to {max}{} | {} |",
            key.name(),
            unit(key),
            cell(key.doc())
        );
    }
    text
}
