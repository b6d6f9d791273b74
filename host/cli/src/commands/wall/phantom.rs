//! `cathforce wall phantom`: the static test of Pescio et al. 2025 on finite elements.

use std::fmt::Write as _;

use cathforce_wall::phantom::{ASSUMED, FORCES_N, MEASURED_MM, Phantom, table_3};
use cathforce_wall::{Patch, Pressed};
use serde_json::{Value, json};

use super::load::{describe, law_json, mesh_json, meshed, patch_json, press_all};
use crate::args::WallPhantomArguments;
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &WallPhantomArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let rows = table_3(arguments.elements.poisson).map_err(|error| Failure::input(&error))?;
    let phantom = Phantom::default();
    let mesh = meshed(ui, &phantom, arguments.thickness_mm, &arguments.elements)?.mesh;
    let (near, direction) = phantom.pressed();
    let patch = Patch::round(&mesh, &near, Some(direction), arguments.patch_mm);
    let patch = patch.map_err(Failure::input)?;
    let (laws, published): (Vec<_>, Vec<_>) =
        rows.into_iter().map(|row| (row.material.into(), row.simulated_mm)).unzip();
    let results = press_all(ui, &mesh, &laws, &patch, &FORCES_N)?;
    let rows = || results.iter().zip(&published);
    let json = json!({
        "mesh": mesh_json(&mesh),
        "patch": patch_json(&patch),
        "thickness_mm": arguments.thickness_mm,
        "poissons_ratio": arguments.elements.poisson,
        "assumed": ASSUMED,
        "measured_mm": MEASURED_MM,
        "rows": rows().map(|((name, pressed), published)| {
            let mut row = law_json(name, pressed);
            row["published_mm"] = json!(published);
            row
        }).collect::<Vec<Value>>(),
    });
    let mut text = describe(&mesh, &patch);
    text += &format!(
        "wall {} mm thick, Poisson's ratio {}\nassumed: {ASSUMED}\n\n{:<14} {:>8} {:>10} {:>13} {:>9} {:>12}\n",
        arguments.thickness_mm,
        arguments.elements.poisson,
        "law",
        "force N",
        "measured",
        "published mm",
        "ours mm",
        "ours/publ."
    );
    for ((name, pressed), published) in rows() {
        lines(&mut text, name, pressed, published);
    }
    arguments.json_file.write(ui, &json, text)
}

fn lines(text: &mut String, name: &str, pressed: &[Pressed], published: &[f64; 3]) {
    for (index, force_n) in FORCES_N.into_iter().enumerate() {
        let ours = pressed.iter().find(|pressed| pressed.force_n == force_n);
        let [ours, ratio] = match ours {
            Some(ours) => [
                format!("{:.2}", ours.displacement_mm),
                format!("{:.2}", ours.displacement_mm / published[index]),
            ],
            None => ["none".into(), String::new()],
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:<14} {force_n:>8.2} {:>10.2} {:>13.2} {ours:>9} {ratio:>12}",
            if index == 0 { name } else { "" },
            MEASURED_MM[index],
            published[index],
        );
    }
}
